"""Opens rasters without the network, and lists the files of a raster."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rasterio
from rasterio.errors import NotGeoreferencedWarning, RasterioError

from envgen_usd.errors import EnvgenError, one_line

WITHOUT_NETWORK = {
    "CPL_VSIL_CURL_ALLOWED_EXTENSIONS": "none",
    "GDAL_HTTP_PROXY": "http://127.0.0.1:0",
    "GDAL_HTTPS_PROXY": "http://127.0.0.1:0",
}
"""Settings of GDAL for files of others: a small XML file may else fetch what it names.

No connection can be made to a proxy at port 0.
"""


@contextmanager
def unplaced_accepted() -> Iterator[None]:
    """Lets rasterio open rasters without a place in silence; readers say what they assume."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        yield


def raster_files(path: Path) -> tuple[Path, ...]:
    """Returns a raster's file and the files it refers to: VRT sources, masks, statistics.

    Raises:
        EnvgenError: The file cannot be read as a raster.
    """
    try:
        with unplaced_accepted(), rasterio.Env(**WITHOUT_NETWORK), rasterio.open(path) as raster:
            others = [Path(name) for name in raster.files]
    except RasterioError as error:
        raise EnvgenError(f"{path}: cannot be read as a raster: {one_line(error)}") from error
    present = sorted({other.resolve() for other in others if other.is_file()} - {path.resolve()})
    return (path, *present)
