"""Files of tensors and JSON (safetensors), which hold no code."""

import json
from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save

from agents.files import JsonObject, replacing

METADATA_KEY = "ccr-gym"  # of the JSON in the header of a file
Tensors = dict[str, torch.Tensor]


def write_tensors(path: Path, tensors: Mapping[str, torch.Tensor], values: JsonObject) -> None:
    """Write tensors and JSON values, either completely or not at all.

    Raises:
        UserError: If the file cannot be written.
    """
    contiguous = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    content = save(contiguous, {METADATA_KEY: json.dumps(values)})
    with replacing(path) as partial:
        partial.write_bytes(content)


def read_tensors(path: Path) -> tuple[Tensors, JsonObject]:
    """Return the tensors and values of a file of :func:`write_tensors`.

    Raises:
        Exception: Of any kind, if the file holds anything else; callers turn it into an error that names the file.
    """
    with safe_open(path, "pt") as file:
        values: JsonObject = json.loads(file.metadata()[METADATA_KEY])
        return {name: file.get_tensor(name) for name in file.keys()}, values  # noqa: SIM118 - no mapping
