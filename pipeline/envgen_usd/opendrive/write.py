"""The mended file: the original XML with everything mended that was reported as mended."""

from pathlib import Path

from lxml import etree

from envgen_usd.opendrive.document import Document, restore_namespace


def write_document(document: Document, path: Path) -> None:
    """Writes a document as UTF-8, at once or not at all.

    Reading the written file gives the same network and no issue with an action again.

    Args:
        document: What `reader.read` returned.
        path: File to write; its folder has to exist.
    """
    root = restore_namespace(document)
    text = etree.tostring(root.getroottree(), encoding="UTF-8", xml_declaration=True)
    partial = path.with_name(f".{path.name}.partial")
    partial.write_bytes(text + b"\n")
    partial.replace(path)
