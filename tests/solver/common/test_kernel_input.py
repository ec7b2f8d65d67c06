"""Numbers that the kernel and the checks of robots must share."""

from solver import _kernel
from solver.common.rod import MAX_CABLES


def test_robots_have_as_many_cables_as_the_kernel_takes():
    assert _kernel.MAX_CABLES == MAX_CABLES
