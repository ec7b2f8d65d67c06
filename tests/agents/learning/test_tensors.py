"""Files of tensors and JSON: what is read is what was written, or an error."""

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from agents.learning.pretrained import trained
from agents.learning.tensors import METADATA_KEY, read_tensors, write_tensors

VALUES = {"progress": {"steps": 1024, "seconds": 47.25}, "counters": {"updates": 4}}


def same(found, tensors):
    read, values = found
    return values == VALUES and read.keys() == tensors.keys() and all(torch.equal(read[k], tensors[k]) for k in tensors)


def test_a_single_flipped_bit_is_seen(tmp_path):
    random = np.random.default_rng(0)
    tensors = {name: torch.tensor(random.normal(size=size)).float() for name, size in (("a", 40), ("b", (8, 9)))}
    path = tmp_path / "file.safetensors"
    write_tensors(path, tensors, VALUES)
    assert same(read_tensors(path), tensors)
    content = path.read_bytes()
    for position in range(len(content)):
        damaged = bytearray(content)
        damaged[position] ^= 1 << random.integers(8)
        path.write_bytes(bytes(damaged))
        try:
            found = read_tensors(path)
        except Exception:
            continue
        assert same(found, tensors), position  # white space of the header


def test_a_file_without_a_checksum_is_refused(tmp_path):
    save_file({"a": torch.zeros(3)}, tmp_path / "file", {METADATA_KEY: "{}"})
    with pytest.raises(ValueError, match="it has no checksum, as those of earlier versions"):
        read_tensors(tmp_path / "file")


def test_shipped_policies_are_as_they_were_written():
    paths = [path for learner in ("PPO", "Distilled") for path in trained(learner, "CCR/PushObstacle-v1")]
    assert len(paths) == 2
    for path in paths:
        read_tensors(path)
