"""Weights and training states on disk."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import torch
from safetensors import safe_open
from safetensors.torch import save_file

from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.config import NetworkConfig, Target
from envgen_usd.landuse.network.generator import Generator, PlainUNet, make_generator
from envgen_usd.landuse.network.trainer import TrainState


def write_weights(network: Generator | PlainUNet, path: Path) -> None:
    """Writes weights with the sizes that they belong to, as safetensors."""
    sizes = json.dumps(dataclasses.asdict(network.config))
    weights = {name: value.contiguous() for name, value in network.state_dict().items()}
    part = path.with_suffix(".part")
    save_file(weights, part, metadata={"network": sizes})
    part.replace(path)


def read_network(path: Path, target: Target | None = None) -> Generator | PlainUNet:
    """Reads a network that is ready to be used.

    Args:
        path: What `write_weights` wrote.
        target: What it has to make; none: it may make anything.

    Raises:
        EnvgenError: The file is not there, or holds something else.
    """
    try:
        config = _read_config(path)
        with safe_open(path, framework="pt") as file:
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        network = make_generator(config)
        network.load_state_dict(weights)
    except Exception as error:
        raise EnvgenError(f"{path}: cannot be read as a network: {error}") from error
    if target not in (None, config.target):
        raise EnvgenError(f"{path}: holds a network for {config.target}, not {target}")
    return network.eval().requires_grad_(False)


def read_target(path: Path) -> Target:
    """Reads what the network of a file makes.

    Raises:
        EnvgenError: The file is not there, or holds something else.
    """
    try:
        return _read_config(path).target
    except Exception as error:
        raise EnvgenError(f"{path}: cannot be read as a network: {error}") from error


def _read_config(path: Path) -> NetworkConfig:
    with safe_open(path, framework="pt") as file:
        sizes: dict[str, Any] = json.loads((file.metadata() or {})["network"])
    fields: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in sizes.items()
    }
    return NetworkConfig(**fields)


def write_state(state: TrainState, path: Path) -> None:
    """Writes what a training run goes on from; an interruption leaves the last state whole."""
    part = path.with_suffix(".part")
    torch.save({f.name: getattr(state, f.name) for f in dataclasses.fields(state)}, part)
    part.replace(path)


def read_state(path: Path) -> TrainState:
    """Reads what `write_state` wrote."""
    return TrainState(**torch.load(path, map_location="cpu", weights_only=True))
