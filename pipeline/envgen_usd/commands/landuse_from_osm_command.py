"""The command `landuse from-osm`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.terminal_output import print_issues, shell_command
from envgen_usd.output_files import check_output_folder
from envgen_usd.whole_files import make_folder


def from_osm(
    extract: Annotated[Path, typer.Argument(help="OpenStreetMap extract, .osm or .pbf.")],
    *,
    out: Annotated[Path, typer.Option(help="Output folder; each 200 m chunk becomes a GeoTIFF.")],
) -> None:
    """Converts an OpenStreetMap extract to class rasters with road masks, for training."""
    from envgen_usd.landuse.landuse_geotiff import write_landuse_map
    from envgen_usd.landuse.osm_landuse import rasterise_osm, read_osm

    check_output_folder(out)
    read = read_osm(extract)
    make_folder(out)
    count = 0
    for landuse in rasterise_osm(read):
        write_landuse_map(landuse, out / f"{landuse.chunk.name}.tif", read.crs)
        count += 1
    print_issues(read.issues)
    print(f"rasters: {count} in {out}")
    words = ("landuse", "train", "--data", out, "--out", "FOLDER")
    print(f"next:    {shell_command(*words)}")
