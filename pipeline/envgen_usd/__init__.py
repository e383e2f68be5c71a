"""From an OpenDRIVE road to a labelled 3D environment in OpenUSD, with camera images and labels."""


def __getattr__(name: str) -> str:
    """`__version__`, looked up when it is asked for, so that a command does not wait for it."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version  # noqa: PLC0415

    return version("envgen-usd")
