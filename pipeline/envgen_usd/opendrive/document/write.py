"""Writes the repaired file: the original XML with all reported repairs."""

from pathlib import Path

from lxml import etree

from envgen_usd.opendrive.document.xml_document import Document, restore_namespace
from envgen_usd.whole_files import write_whole


def write_document(document: Document, path: Path) -> None:
    """Writes a document as UTF-8, atomically.

    Reading the written file yields the same network and no further issue with an action.

    Args:
        document: Document of `reader.read`.
        path: Output file; its folder has to exist.

    Raises:
        EnvgenError: The file cannot be written.
    """
    root = restore_namespace(document)
    text = etree.tostring(root.getroottree(), encoding="UTF-8", xml_declaration=True)
    write_whole(path, text + b"\n")
