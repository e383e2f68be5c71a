"""First weights of a network, from the file that ``--weights`` names."""

import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import torch
from torch import nn

from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_file

_OPTION = "--weights"
_REMEDY = "name a file of first weights, or leave --weights out"


def check_weights_file(path: Path) -> None:
    """Checks that a file can hold weights, for a library that reads it by itself.

    Raises:
        EnvgenError: There is no such file, or it is no archive of torch.
    """
    check_input_file(path, _REMEDY, _OPTION)
    if not zipfile.is_zipfile(path):
        raise _no_weights(path, "a checkpoint that torch.save wrote")


def load_first_weights(network: nn.Module, path: Path) -> None:
    """Gives a network the weights of a file.

    Args:
        network: Its weights are replaced.
        path: A ``state_dict`` as ``torch.save`` writes it, or safetensors.

    Raises:
        EnvgenError: There is no such file, it holds no weights, those of another network, or a
            value that is not finite.
    """
    check_input_file(path, _REMEDY, _OPTION)
    state = _read_state(path)
    wanted: dict[str, torch.Tensor] = network.state_dict()
    fault = next(_differences(state, wanted), None)
    if fault:
        raise EnvgenError(
            f"{_OPTION} {path}: holds weights of another network: {fault}; name weights of the"
            " network of --network"
        )
    for name, values in state.items():
        if not values.isfinite().all():
            raise EnvgenError(
                f"{_OPTION} {path}: tensor {name} holds values that are not finite; name other"
                " weights"
            )
    network.load_state_dict(state)


def _read_state(path: Path) -> Mapping[str, torch.Tensor]:
    expected = "a state_dict that torch.save or safetensors wrote"
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # pickle, zipfile, safetensors and torch raise many kinds
        raise _no_weights(path, expected) from error
    if not isinstance(state, Mapping) or not all(
        isinstance(name, str) and isinstance(values, torch.Tensor) for name, values in state.items()
    ):
        raise _no_weights(path, expected)
    return state


def _no_weights(path: Path, expected: str) -> EnvgenError:
    return EnvgenError(f"{_OPTION} {path}: is no file of weights, or damaged; name {expected}")


def _differences(
    state: Mapping[str, torch.Tensor], wanted: Mapping[str, torch.Tensor]
) -> Iterator[str]:
    """Why a state does not fit a network, in words; none if it fits."""
    for name, values in wanted.items():
        if name not in state:
            yield f"it lacks the tensor {name}"
        elif state[name].shape != values.shape:
            yield f"tensor {name} is {_size(state[name])}, not {_size(values)}"
    for name in state:
        if name not in wanted:
            yield f"it holds the tensor {name}, which the network lacks"


def _size(values: torch.Tensor) -> str:
    return " x ".join(map(str, values.shape)) or "a number"
