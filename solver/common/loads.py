"""Dead loads of a rod: gravity as weights of its nodes, and forces and moments on its disks."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from solver.common.rod import AnyRod


class NodeLoad(NamedTuple):
    """A dead load on a disk; numbers, or expressions where the length of a segment is one.

    Attributes:
        node: Node of the disk.
        place_mm: Point of the disk where the force acts, from the backbone [mm].
        force: Force [N].
        moment: Moment, in the plane [N·mm].
    """

    node: int
    place_mm: tuple[float, float]
    force: tuple[Any, ...]
    moment: float = 0.0


def node_loads(robot: AnyRod, segment_mm: Any) -> Iterator[NodeLoad]:
    """Yield the weight of each node, half of that of each segment beside it, then the loads on disks."""
    if any(robot.weight_per_length):
        for node in range(1, robot.segments + 1):
            carried = segment_mm * (1.0 if node < robot.segments else 0.5)
            yield NodeLoad(node, (0.0, 0.0), tuple(weight * carried for weight in robot.weight_per_length))
    for load in robot.loads:
        yield NodeLoad(load.node, load.place_mm, load.force, load.moment)


def load_work(
    robot: AnyRod,
    segment_mm: Any,
    point: Callable[[int, tuple[float, float]], Any],
    turn: Callable[[int], Any] = lambda node: 0.0,
) -> Any:
    """Return the work of the loads from the base to a shape: minus their potential [N·mm].

    Args:
        robot: The robot.
        segment_mm: Length of a segment, a number or an expression [mm].
        point: Where a point of the disk of a node is [mm].
        turn: Angle of the disk of a node, counter-clockwise, in the plane [rad].
    """
    work = 0.0
    for load in node_loads(robot, segment_mm):
        at = point(load.node, load.place_mm)
        work += sum(component * at[k] for k, component in enumerate(load.force))
        if load.moment:
            work += load.moment * turn(load.node)
    return work
