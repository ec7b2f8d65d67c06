"""Files of tensors and JSON, which hold no code (safetensors)."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors import safe_open
from safetensors.torch import save

from agents.files import replacing

TEXT = "ccr-gym"  # key of the JSON in the header of a file


def write_tensors(path: Path, tensors: Mapping[str, torch.Tensor], values: dict[str, Any]) -> None:
    """Write tensors and what JSON can hold, all of it or nothing.

    Raises:
        UserError: If the file cannot be written.
    """
    plain = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    content = save(plain, {TEXT: json.dumps(values)})
    with replacing(path) as partial:
        partial.write_bytes(content)


def read_tensors(path: Path) -> tuple[dict[str, torch.Tensor], dict[str, Any]]:
    """What :func:`write_tensors` wrote.

    Raises:
        Exception: Any, if the file is something else: its reader says whose fault that is.
    """
    with safe_open(path, "pt") as file:
        values = json.loads(file.metadata()[TEXT])
        return {name: file.get_tensor(name) for name in file.keys()}, values  # noqa: SIM118 - no mapping
