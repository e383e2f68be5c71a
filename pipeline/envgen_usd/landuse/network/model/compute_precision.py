"""Selects the fastest compute precision of a device."""

import torch


def computes_in_half(device: torch.device) -> bool:
    """True if a device multiplies bfloat16 faster than single precision."""
    if device.type == "cuda":
        return True
    return bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())
