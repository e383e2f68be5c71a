"""Data sets: their index of frames, sheets, report; `Frames` and `read_scans` for training."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from envgen_usd.datasets.scan_set import read_scans
    from envgen_usd.datasets.torch_frames import Frames

_HOMES = {"Frames": "torch_frames", "read_scans": "scan_set"}
"""Public name to its module."""
__all__ = ["Frames", "read_scans"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - names of any type
    """Imports a name at its first use, since `Frames` needs torch."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
