"""Files of tensors and JSON (safetensors), which hold no code."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save

from agents.files import JsonObject, replacing

METADATA_KEY, DIGEST_KEY = "ccr-gym", "sha256"  # of the JSON in the header of a file, and of its checksum
Tensors = dict[str, torch.Tensor]


def write_tensors(path: Path, tensors: Mapping[str, torch.Tensor], values: JsonObject) -> None:
    """Write tensors and JSON values, either completely or not at all.

    Raises:
        UserError: If the file cannot be written.
    """
    contiguous = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    metadata = {METADATA_KEY: json.dumps(values)}
    content = save(contiguous, metadata | {DIGEST_KEY: _digest(contiguous, metadata[METADATA_KEY])})
    with replacing(path) as partial:
        partial.write_bytes(content)


def read_tensors(path: Path) -> tuple[Tensors, JsonObject]:
    """Return the tensors and values of a file of :func:`write_tensors`.

    Raises:
        Exception: Of any kind, if the file holds anything else, or is not as it was written; callers turn it into an
            error that names the file.
    """
    with safe_open(path, "pt") as file:
        metadata = file.metadata()
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - no mapping
    if DIGEST_KEY not in metadata:
        raise ValueError("it has no checksum, as those of earlier versions")
    if metadata[DIGEST_KEY] != _digest(tensors, metadata[METADATA_KEY]):
        raise ValueError("its checksum differs")
    values: JsonObject = json.loads(metadata[METADATA_KEY])
    return tensors, values


def _digest(tensors: Tensors, text: str) -> str:
    """Return the checksum of tensors and JSON, that of a file that holds nothing else."""
    return hashlib.sha256(save(tensors, {METADATA_KEY: text})).hexdigest()
