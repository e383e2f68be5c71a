"""Makes `schemas/generatedSchema.usda` and `plugInfo.json` from `schemas/schema.usda`.

    python tools/make_schemas.py [FOLDER]

The generator of OpenUSD leaves placeholders for paths in `plugInfo.json`, with which a codeless
schema loads without definitions. Here they become the folder itself. Needs jinja2.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

SCHEMAS = Path(__file__).parents[1] / "schemas"
PLACES = {
    "@PLUG_INFO_ROOT@": ".",
    "@PLUG_INFO_LIBRARY_PATH@": "",
    "@PLUG_INFO_RESOURCE_PATH@": ".",
}


def main() -> None:
    """Writes both files into a folder, by default `schemas`."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else SCHEMAS
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pxr.Usd.usdGenSchema", SCHEMAS / "schema.usda", folder]
        subprocess.run(command, check=True, capture_output=True)
        (out / "generatedSchema.usda").write_text(
            (Path(folder) / "generatedSchema.usda").read_text()
        )
        text = (Path(folder) / "plugInfo.json").read_text()
    for placeholder, place in PLACES.items():
        text = text.replace(placeholder, place)
    (out / "plugInfo.json").write_text(text)


if __name__ == "__main__":
    main()
