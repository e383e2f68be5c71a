"""Reads files by resolved USD paths, also inside packages (``a.usdz[b.png]``)."""

from pxr import Ar

from envgen_usd.errors import EnvgenError


def read_resolved(path: str) -> bytes:
    """Content of an asset.

    Raises:
        EnvgenError: The file cannot be opened.
    """
    resolver = Ar.GetResolver()
    asset = resolver.OpenAsset(Ar.ResolvedPath(path))  # type: ignore[attr-defined] # not in types-usd
    if not asset:
        raise EnvgenError(f"{path}: cannot be opened")
    return bytes(asset.GetBuffer() or b"")  # OpenUSD has no buffer of an empty file
