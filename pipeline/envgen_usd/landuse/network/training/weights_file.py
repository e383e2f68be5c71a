"""Weights and training states on disk."""

import dataclasses
import json
import sys
import textwrap
import zipfile
from pathlib import Path
from typing import Any

import msgspec
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.model.generator import Generator, PlainUNet, make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.tasks.known_tasks import inputs_of
from envgen_usd.landuse.network.tasks.network_task import Target
from envgen_usd.landuse.network.training.trainer import TrainState
from envgen_usd.whole_files import whole_file

LARGEST_WEIGHT = 1e6
"""Largest absolute value of a usable weight; a larger bound lets activations overflow.

Trained weights stay below 1000.
"""

_REASON = 240
"""Largest number of characters of a reason; torch lists all tensors of another size."""


def write_weights(network: Generator | PlainUNet, path: Path) -> None:
    """Writes weights with their layer sizes, as safetensors."""
    sizes = json.dumps(dataclasses.asdict(network.config))
    weights = {name: value.contiguous() for name, value in network.state_dict().items()}
    with whole_file(path, SafetensorError) as part:
        save_file(weights, part, metadata={"network": sizes})


def read_network(path: Path, target: Target | None = None) -> Generator | PlainUNet:
    """Reads a network for inference.

    Args:
        path: File of `write_weights`.
        target: Required target; `None` accepts any target.

    Raises:
        EnvgenError: The file does not exist, is not a network of that target and version, or holds
            a weight that is not finite or beyond `LARGEST_WEIGHT`.
    """
    try:
        config = _read_config(path)
        with safe_open(path, framework="pt") as file:
            weights = {name: file.get_tensor(name).float() for name in file.keys()}  # noqa: SIM118
        # The file's tensors become the network's, so stated sizes alone request no memory.
        with torch.device("meta"):
            network = make_generator(config)
        network.load_state_dict(weights, assign=True)
    except Exception as error:
        raise _unreadable(path, error) from error
    if target not in (None, config.target):
        raise EnvgenError(f"{path}: holds a network for {config.target}, not {target}")
    if (config.fields, config.condition) != inputs_of(config.target):
        raise EnvgenError(
            f"{path}: holds a network of another version, which is given other figures of its "
            "surroundings; train it again with envgen-usd landuse train, or name other weights"
        )
    for name, values in weights.items():
        _check_values(values, f"{path}: tensor {name}")
    return network.eval().requires_grad_(False)


def _check_values(values: torch.Tensor, where: str) -> None:
    """Raises an error for a value of a tensor that spoils the network's whole output."""
    unusable = values[~(values.abs() <= LARGEST_WEIGHT)]
    if len(unusable):
        raise EnvgenError(
            f"{where} holds {unusable[0]:g}; weights are numbers up to {LARGEST_WEIGHT:g}, "
            "so train the network again, or name other weights"
        )


def read_target(path: Path) -> Target:
    """Reads the target of a network file.

    Raises:
        EnvgenError: The file does not exist, or is not a network.
    """
    try:
        return _read_config(path).target
    except Exception as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> EnvgenError:
    """The error of a file that is no network, with the start of a long reason on a single line."""
    reason = textwrap.shorten(str(error), _REASON)
    return EnvgenError(f"{path}: cannot be read as a network: {reason}")


def _read_config(path: Path) -> NetworkConfig:
    with safe_open(path, framework="pt") as file:
        return msgspec.json.decode((file.metadata() or {})["network"], type=NetworkConfig)


def write_state(state: TrainState, path: Path) -> None:
    """Writes the state of a training run whole or not at all; equal states give equal bytes."""
    values = {f.name: getattr(state, f.name) for f in dataclasses.fields(state)}
    with whole_file(path, RuntimeError) as part:
        torch.save(_without_identity(values), part)


def _without_identity(value: Any) -> Any:  # noqa: ANN401 - any part of a state
    """A copy in which equal texts are one object and no container is used twice.

    Pickle writes an object that it has seen as a reference, so the bytes of a resumed run would
    tell which of its texts came from a file.
    """
    if isinstance(value, str):
        return sys.intern(value)
    if isinstance(value, dict):
        return {_without_identity(key): _without_identity(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(map(_without_identity, value))
    return value


def read_state(path: Path) -> TrainState:
    """Reads a file of `write_state`.

    Raises:
        EnvgenError: The file is damaged; all its checksums are compared.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            damaged = archive.testzip()
        if damaged is None:
            return TrainState(**torch.load(path, map_location="cpu", weights_only=True))
        reason = f"{damaged} has another checksum"
    except Exception as error:  # zipfile, pickle and torch raise many kinds
        reason = textwrap.shorten(str(error), _REASON)
    raise EnvgenError(f"{path}: the state of the training is damaged: {reason}")
