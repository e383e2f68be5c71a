"""Networks by name: the default one, those of torchvision and segmentation_models_pytorch."""

import importlib
from contextlib import suppress
from pathlib import Path
from types import ModuleType

import torch
from torch import nn
from torch.nn import functional

from envgen_usd.errors import EnvgenError
from envgen_usd.study.first_weights import load_first_weights
from envgen_usd.study.small_network import SmallNetwork
from envgen_usd.study.study_classes import CLASSES

_SUPPRESSION = "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor"
"""Signature of torchvision's operators, which it looks for when it is imported."""
_KNOWN = "small, yolov8n, torchvision:NAME, smp:NAME:ENCODER"


def make_network(name: str, weights: str = "") -> nn.Module:
    """A network from pictures, B x 3 x H x W, to logits of the seven classes, B x 7 x H x W.

    Args:
        name: ``small``; ``torchvision:NAME``, e.g. lraspp_mobilenet_v3_large; or
            ``smp:NAME:ENCODER``, e.g. Unet:resnet18.
        weights: File with a state of the network, as its library names the tensors; empty:
            random first weights.

    Raises:
        EnvgenError: The name is unknown, its library is missing, or the file does not fit.
    """
    family, _, rest = name.partition(":")
    if family == "small" and not rest:
        network: nn.Module = SmallNetwork(len(CLASSES))
    elif family == "torchvision" and rest:
        network = _of_torchvision(rest)
    elif family == "smp" and rest:
        network = _of_smp(rest)
    else:
        raise EnvgenError(f"--network {name}: unknown; known: {_KNOWN}")
    if weights:
        load_first_weights(network, Path(weights))
    return _WithoutDict(network) if family == "torchvision" else network


class _WithoutDict(nn.Module):
    """torchvision's segmentation networks answer with a dictionary."""

    def __init__(self, network: nn.Module) -> None:
        super().__init__()
        self.network = network

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        logits: torch.Tensor = self.network(pictures)["out"]
        return functional.interpolate(logits, pictures.shape[2:], mode="bilinear")


def _of_torchvision(name: str) -> nn.Module:
    models = _library("torchvision.models.segmentation", "torchvision")
    make = getattr(models, name, None)
    if not callable(make):
        raise EnvgenError(f"--network torchvision:{name}: torchvision.models.segmentation lacks it")
    network: nn.Module = make(weights=None, weights_backbone=None, num_classes=len(CLASSES))
    return network


def _of_smp(name: str) -> nn.Module:
    models = _library("segmentation_models_pytorch", "segmentation-models-pytorch")
    kind, _, encoder = name.partition(":")
    make = getattr(models, kind, None)
    if not callable(make):
        raise EnvgenError(f"--network smp:{name}: segmentation_models_pytorch has no {kind}")
    try:
        network: nn.Module = make(
            encoder_name=encoder or "resnet18", encoder_weights=None, classes=len(CLASSES)
        )
    except KeyError as error:
        raise EnvgenError(f"--network smp:{name}: no encoder {encoder}") from error
    return network


def _library(module: str, package: str) -> ModuleType:
    define_operators()
    try:
        return importlib.import_module(module)
    except (ImportError, RuntimeError) as error:
        raise EnvgenError(
            f"--network: {package} cannot be imported ({error}); install envgen-usd[study]"
        ) from error


def define_operators() -> None:
    """Names operators that torchvision expects of its compiled part, where that does not fit torch.

    Segmentation networks never call them; without the names its import fails, and so does that of
    segmentation_models_pytorch, which uses it.
    """
    for name in ("nms", "qnms"):
        with suppress(RuntimeError):  # already there
            torch.library.define(f"torchvision::{name}", _SUPPRESSION)
