"""The paper's claims about shapes and contacts (sections 2, 3 and 5)."""

import math

import numpy as np

from agents.paper import eq_5, published
from agents.paper.model import ROBOT, path, pull, pull_in_space
from agents.paper.verdict import Claim, Verdict, judged
from solver import Equilibrium, Scene

CLOSED_MM = 1e-6  # gap of a point that touches
PULL_MM = 8.0  # cable displacement that Fig. 4's scenes are pulled to


def claims() -> list[Claim]:
    """Return the claims about shapes and contacts, judged."""
    return [
        _errors_of_poses(),
        _perpendicular_disks(),
        _uniqueness(),
        _peaks_of_multipliers(),
        _contacts_by_multipliers(),
        _plane_of_two_cables(),
        _energy_of_two_cables(),
    ]


def _errors_of_poses() -> Claim:
    return Claim(
        "The pose is predicted within 0.75 % of the length (1.35 mm), within 0.58 % among obstacles (Fig. 3b, 4).",
        "abstract, sections 2.1, 3.1, 5, 6",
        Verdict.UNTESTABLE,
        "the measured poses are photographs: neither their points nor their cable displacements are printed. One "
        "root mean square of one photograph is later called a maximum",
    )


def _perpendicular_disks() -> Claim:
    state = pull(published.FIG_4A, PULL_MM)
    tilt = math.degrees(np.abs(state.shear).max())
    return Claim(
        "The disk is always perpendicular to the backbone.",
        "section 2",
        judged(tilt < 1),
        f"eq. 5 does not ask for it: at the obstacle of Fig. 4a, pulled by {PULL_MM:.0f} mm, segments shear against "
        f"their disks by up to {tilt:.1f}°, a kink that one can see. The rod keeps its disks perpendicular",
    )


def _uniqueness() -> Claim:
    free = pull(Scene(), 5.0)
    moved, difference, violation = fold(free, ROBOT.segments // 2)
    return Claim(
        "With these constraints, we can uniquely identify the profile of the actuated robot.",
        "section 2, eq. 4",
        judged(violation > CLOSED_MM or difference > 1e-9),
        f"fold one segment of the free robot back on itself: the tip moves by {moved:.1f} mm, the objective by "
        f"{difference:.0e} rad², and eq. 4 is still met to {violation:.0e} mm. The profile is that of the branch that "
        "small increments follow, not of the global optimum",
    )


def fold(state: Equilibrium, segment: int) -> tuple[float, float, float]:
    """Fold a segment of a free robot back on itself, so that its disks turn as far the other way.

    Returns:
        How far the tip moves [mm], by how much the objective changes [rad²], and the violation of eq. 4 [mm].
    """
    problem, points = eq_5.problem_of(state, state.cable_mm), eq_5.node_points(state)
    (low, high), (angle, turned) = state.nodes[segment : segment + 2, :2] @ [1, 1j], state.nodes[segment:, 2][:2]
    # The disks' bisector turns by the segment's angle, all beyond the segment by twice of it.
    back = angle - turned
    places = points @ [1, 1j]  # (2, n), the plane as complex numbers
    places[:, segment:] = low - (high - low) * np.exp(1j * back) + (places[:, segment:] - high) * np.exp(2j * back)
    folded = np.stack([places.real, places.imag], axis=-1)
    before, after = (placed.ravel() / eq_5.UNIT_MM for placed in (points, folded))
    return (
        float(np.linalg.norm(folded[0, -1] - points[0, -1])),
        abs(eq_5.objective(after, problem) - eq_5.objective(before, problem)),
        float(np.abs(eq_5.equalities(after, problem)).max() * eq_5.UNIT_MM),
    )


def _peaks_of_multipliers() -> Claim:
    wanted = np.arange(ROBOT.segments + 1) == np.array(published.FIG_5_NODES)[:, None]  # one node on each obstacle
    pushed = {state.cable_mm: state.contact[:, 1] for state in path(published.FIG_4B, PULL_MM)}
    both = {cable: nodes for cable, nodes in pushed.items() if nodes.any(axis=1).all()}
    alike = sum(np.array_equal(nodes, wanted) for nodes in both.values())
    return Claim(
        "The multipliers of the cable points peak at nodes 11 and 17, one on each obstacle (Fig. 5).",
        "section 3.1",
        judged(0 < alike == len(both)),
        f"the cable displacement of Fig. 4b is not printed, and none is chosen here: of {len(both)} equilibria that "
        f"touch both obstacles, from {min(both):.2f} to {max(both):.2f} mm, {alike} do so at nodes 11 and 17 alone. "
        "Pulled farther, the robot leaves the first obstacle",
    )


def _contacts_by_multipliers() -> Claim:
    states = [*path(published.FIG_4A, PULL_MM), *path(published.FIG_4B, PULL_MM)]
    touching = sum(int(state.contact.sum()) for state in states)
    unlike = sum(int(np.sum(state.contact != (np.abs(state.gaps) < CLOSED_MM))) for state in states)
    return Claim(
        "Points in contact have multipliers that are not zero, which identify them without prior knowledge.",
        "sections 3, 3.1, 6",
        judged(unlike == 0),
        f"of {touching} contacts on the way to {PULL_MM:.0f} mm in Fig. 4a and 4b, {unlike} differ between positive "
        "multipliers and closed gaps. The shape and place of the obstacle are prior knowledge all the same",
    )


def _plane_of_two_cables() -> Claim:
    equilibrium = pull_in_space((5.0, 5.0))
    across = equilibrium.points[0] @ [math.sqrt(0.5), -math.sqrt(0.5), 0.0]
    return Claim(
        "Two cables pulled at once bend the robot in a plane between those of each alone (Fig. 11).",
        "section 5",
        judged(bool(np.ptp(across) < 1e-9)),
        f"pulled by 5 mm each, the backbone stays within {np.ptp(across):.0e} mm of the plane at 45°; "
        f"eq. 13 is met to {equilibrium.residuals()[0]:.0e} rad²/mm",
    )


def _energy_of_two_cables() -> Claim:
    spread = {angle: bending_costs(math.radians(angle)) for angle in (90, 60)}
    return Claim(
        "Minimising the slope angles of both cables is equivalent to minimising the total strain energy.",
        "section 5, eq. 13",
        judged(all(np.ptp(costs) < 1e-6 for costs in spread.values())),
        "it is for bending by cables 90° apart, whose cost of a small angle is the same in all directions to "
        f"{np.ptp(spread[90]):.0e}. For 60° it runs from {spread[60].min():.2f} to {spread[60].max():.2f}; the paper "
        f"says only that the cables do not oppose each other. Twist costs {twist_cost():.2f} times as much as bending, "
        "which is GJ = 2 EI; a round solid rod has about 0.77 EI",
    )


def bending_costs(apart: float) -> np.ndarray:
    """Return eq. 13's cost of bending over the angle squared, in all directions, for cables an angle apart."""
    directions = np.linspace(0, math.pi, 181)
    return np.array([_cost((math.cos(t), math.sin(t), 0.0), apart) for t in directions])


def twist_cost() -> float:
    """Return eq. 13's cost of twist over the angle squared."""
    return _cost((0.0, 0.0, 1.0), math.pi / 2)


def _cost(axis: tuple[float, float, float], apart: float, angle: float = 1e-3) -> float:
    """Return the squared angles by which a small turn moves the directions of both cables, over its square."""
    cables = np.array([[1.0, 0.0, 0.0], [math.cos(apart), math.sin(apart), 0.0]])
    across = np.cross(axis, cables)
    turned = cables + math.sin(angle) * across + (1 - math.cos(angle)) * np.cross(axis, across)
    sines = np.linalg.norm(np.cross(cables, turned), axis=1)
    return float(np.sum(np.arctan2(sines, np.sum(cables * turned, axis=1)) ** 2) / angle**2)
