"""From an OpenDRIVE road to a labelled 3D environment in OpenUSD, with camera images and labels."""

from importlib.metadata import version

__version__ = version("envgen-usd")
