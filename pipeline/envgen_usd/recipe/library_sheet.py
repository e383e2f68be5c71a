"""A contact sheet of a library: a stage of its variants or materials, drawn cell by cell."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from envgen_usd.assets.asset_catalogue import scan_library
from envgen_usd.assets.preview_stage import write_asset_stage, write_material_stage
from envgen_usd.output_files import check_output_file
from envgen_usd.render.frames.contact_sheet import draw_contact_sheet
from envgen_usd.step_clock import Progress


def write_sheet(
    library: Path | None,
    names: Sequence[str],
    out: Path,
    *,
    materials: bool = False,
    progress: Progress = lambda _step, _done, _total: None,
) -> int:
    """Draws the variants of assets, or materials; returns the number of pictures.

    Args:
        library: Folder of the library; `None` for the shipped library.
        names: Assets or kinds of assets, or materials; none for all.
        out: PNG file.
        materials: Draw materials instead of assets.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: A name is unknown, `out` is no PNG file or cannot be written, or OpenGL is
            missing.
    """
    check_output_file(out, ".png")
    catalogue, _ = scan_library(library)
    write = write_material_stage if materials else write_asset_stage
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder) / "sheet.usda"
        exhibits = write(catalogue, names, stage)
        shown = [(exhibit.name, exhibit.box, exhibit.front) for exhibit in exhibits]
        draw_contact_sheet(stage, shown, out, progress)
    return len(shown)
