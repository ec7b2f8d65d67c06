import json

import pytest
from replay import RECORDED, checksums, machine

RECORDING = json.loads(RECORDED.read_text())


@pytest.mark.skipif(RECORDING["machine"] != machine(), reason="the recorded bits are another machine's")
def test_20_000_steps_give_the_recorded_bits():
    assert checksums() == RECORDING["checksums"]
