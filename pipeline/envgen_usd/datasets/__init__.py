"""Data sets: their index of frames, sheets, report; `Frames` for training."""

from typing import Any

__all__ = ["Frames"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - a class
    """Imports `Frames` at its first use, since it needs torch."""
    if name != "Frames":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from envgen_usd.datasets.torch_frames import Frames  # noqa: PLC0415

    return Frames
