"""Six scenes that both models are put into by the same pull: what each says about shape and contact force."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from agents.paper import published
from agents.paper.model import STEP_MM
from solver import Capsule, Equilibrium, Robot, Scene, Solver
from solver.spatial import Cylinder, SpatialEquilibrium, SpatialRobot, SpatialSolver, Sphere

MODELS = ("paper", "rod")
AnyEquilibrium = Equilibrium | SpatialEquilibrium


@dataclass(frozen=True, slots=True)
class Case:
    """A scene, and how far the cables are pulled in it.

    Attributes:
        name: Name of its picture.
        title: What it is.
        scene: The obstacles.
        pulls_mm: Cable displacements [mm].
        seen: What a reader sees, in words; numbers by the names of :class:`Reading`, as ``{paper.turn:.0f}``.
    """

    name: str
    title: str
    scene: Scene
    pulls_mm: tuple[float, ...]
    seen: str


@dataclass(frozen=True, slots=True)
class Reading:
    """What is read off an equilibrium.

    Attributes:
        forces: Contact force of each obstacle on the robot [N].
        force: Sum of their magnitudes [N].
        tension: Tension of the first cable [N].
        turn: Sharpest turn of the backbone at a node [°].
        node: Node where it is, counted from 0.
        tilt: Largest angle of a disk out of the plane across the backbone [°].
    """

    forces: tuple[float, ...]
    force: float
    tension: float
    turn: float
    node: int
    tilt: float


CASES = (
    Case(
        "circle",
        "Circle of Fig. 4a",
        published.FIG_4A,
        (8.0,),
        "The paper's robot kinks by {paper.turn:.0f}° at node {paper.node}, where it touches; everywhere else it bends "
        "as evenly as the free robot, and the disks next to the kink stand up to {paper.tilt:.0f}° askew. The rod "
        "bends as a beam does under a load from the side: evenly from the contact to the tip, by {rod.turn:.1f}° a "
        "node, and less and less towards the base. Its disks stay perpendicular, and it pushes {ratio:.0f} times as "
        "hard.",
    ),
    Case(
        "pair",
        "Pair of Fig. 4b",
        published.FIG_4B,
        (5.0,),
        "Both robots rest on both circles, at the same nodes (10 and 16, the peaks of Fig. 5), and their shapes can "
        "hardly be told apart. Their forces can: the paper's are {paper.forces[0]:.4f} and {paper.forces[1]:.4f} N, "
        "the rod's {rod.forces[0]:.3f} and {rod.forces[1]:.3f} N, {ratio:.0f} times as large in sum.",
    ),
    Case(
        "load_cell",
        "Load cell at 26 mm",
        published.load_cell(26.0),
        (8.0,),
        "One disk rests on the plate, and it alone can touch (eq. 12, Fig. 8 and 9). The paper's robot folds over "
        "there by {paper.turn:.0f}°. The rod is nearly straight next to its base, where the plate takes up the moment "
        "of the cable, and bends above. The cable says so too: {paper.tension:.1f} N against {rod.tension:.1f} N for "
        "the same 8 mm. The force of the rod, {rod.force:.2f} N, is {ratio:.0f} times the paper's. At equal cable load "
        "[Table 1](model.md) measured three quarters of the rod's force, and four times the paper's.",
    ),
    Case(
        "channel",
        "Channel",
        Scene(
            [
                Capsule(start=(25.0, 40.0), end=(25.0, 120.0), radius=10.0),
                Capsule(start=(-15.0, 40.0), end=(-15.0, 120.0), radius=10.0),
            ]
        ),
        (8.0,),
        "The paper's robot leaves the channel round a corner of {paper.turn:.0f}°, its disks up to {paper.tilt:.0f}° "
        "askew, and leans on the left wall as well, where it kinks back. The rod curves out of the channel and touches "
        "the right wall alone, with {ratio:.0f} times the force of both contacts of the paper's robot.",
    ),
    Case(
        "sphere",
        "Sphere beside the plane of bending",
        Scene([Sphere(center=(40.0, 6.0, 104.0), radius=15.0)]),
        (7.0, 0.0),
        "The sphere stands 6 mm beside the plane that the first cable bends the robot in, and turns both robots to −y. "
        "The paper's (eq. 13) kinks at node {paper.node}, by {paper.turn:.1f}°; the rod bends by {rod.turn:.1f}° at "
        "most. Its force is {ratio:.0f} times as large, within 1 % of an independent Kirchhoff rod's (0.142 N).",
    ),
    Case(
        "cylinder",
        "Cylinder across",
        Scene([Cylinder(start=(30.0, -40.0, 70.0), end=(60.0, 60.0, 150.0), radius=10.0, edge=2.0)]),
        (8.0, 0.0),
        "The cylinder slants across the way of the robot. Both models touch it with the same two nodes; the paper's "
        "robot turns by up to {paper.turn:.1f}° there and by half as much everywhere else, the rod by {rod.turn:.1f}° "
        "at most, and the rod pushes {ratio:.0f} times as hard.",
    ),
)


def states(case: Case) -> dict[str, AnyEquilibrium]:
    """Return the equilibrium of the prototype in a scene, in both models."""
    return {model: _pulled(case, model) for model in MODELS}


def _pulled(case: Case, model: str) -> AnyEquilibrium:
    """Return the equilibrium after pulling the cables from rest in small steps."""
    steps = round(max(case.pulls_mm) / STEP_MM)
    if len(case.pulls_mm) == 1:
        solver = Solver(Robot.prototype(model=model, max_tension=math.inf), case.scene)
        state = solver.rest()
        for k in range(1, steps + 1):
            state = solver.step(state, case.pulls_mm[0] * k / steps)
        return state
    in_space = SpatialSolver(SpatialRobot.prototype(model=model, max_tension=math.inf), case.scene)
    bent = in_space.rest()
    for k in range(1, steps + 1):
        bent = in_space.step(bent, np.array(case.pulls_mm) * k / steps)
    return bent


def read(state: AnyEquilibrium) -> Reading:
    """Return what is read off an equilibrium."""
    forces = np.linalg.norm(state.forces, axis=1)
    chords, axes = directions(state)
    turns = _angles(chords[1:], chords[:-1])
    tilts = _angles(_unit(chords[1:] + chords[:-1]), axes[1:-1])
    return Reading(
        forces=tuple(forces.tolist()),
        force=float(forces.sum()),
        tension=float(state.tensions[0]),
        turn=float(turns.max()),
        node=int(turns.argmax()) + 1,
        tilt=float(tilts.max()),
    )


def directions(state: AnyEquilibrium) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions of the segments, ``(n, d)``, and of the disks' axes, ``(n + 1, d)``."""
    if isinstance(state, SpatialEquilibrium):
        return _unit(np.diff(state.nodes, axis=0)), state.frames[:, :, 2]
    angles = state.nodes[:, 2]
    return _unit(np.diff(state.nodes[:, :2], axis=0)), np.column_stack([-np.sin(angles), np.cos(angles)])


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _angles(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the angles between directions, row by row [°]."""
    return np.asarray(np.degrees(np.arccos(np.clip(np.sum(first * second, axis=1), -1.0, 1.0))))


def page(readings: Mapping[str, Mapping[str, Reading]]) -> str:
    """Return the page of all scenes, each with its picture and what a reader sees, for :func:`read` of each model."""
    ratios = [_ratio(reading) for reading in readings.values()]
    lines = [
        "# Two models, six scenes",
        "",
        'The same robot, obstacles and cable displacements, in `model="paper"` and in `model="rod"`: the prototype '
        f"(180 mm, 18 segments, EI 5000 N·mm²), pulled from rest in steps of {STEP_MM} mm. Red arrows are "
        "the forces of the robot on the obstacles, with their numbers in newton. They are to scale, one scale for both "
        "robots of a picture and another in the next, so that the paper's are hardly longer than the dot at the "
        "contact; grey bars are disks. "
        "[model.md](model.md) says what the models are; `ccr-gym reproduce` draws the pictures and writes this page.",
        "",
        "Look at two things. Where the robot touches, the paper's model has a kink with disks askew, which no robot "
        "with disks fixed to a backbone shows; the rod has none. And for the same cable displacement the rod pushes "
        f"{min(ratios):.0f} to {max(ratios):.0f} times as hard.",
        "",
        "| scene | forces, paper [N] | rod [N] | ratio | sharpest turn, paper | rod | disks askew, paper | rod |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
        *(_row(case, readings[case.name]) for case in CASES),
        "",
        "Forces are those of each obstacle, the ratio is that of their sums. The sharpest turn is the backbone's at a "
        "node, a disk is askew by its angle out of the plane across the backbone.",
    ]
    for case in CASES:
        lines += ["", f"## {case.title}", "", f"![{case.title}](two_models/{case.name}.png)", ""]
        lines.append(_words(case, readings[case.name]))
    return "\n".join(lines) + "\n"


def _row(case: Case, reading: Mapping[str, Reading]) -> str:
    paper, rod = reading["paper"], reading["rod"]
    forces = [", ".join(f"{force:.2g}" for force in one.forces) for one in (paper, rod)]
    angles = [f"{value:.1f}°" for value in (paper.turn, rod.turn, paper.tilt, rod.tilt)]
    return "| " + " | ".join([case.title, *forces, f"{_ratio(reading):.0f}", *angles]) + " |"


def _words(case: Case, reading: Mapping[str, Reading]) -> str:
    """Return what a reader sees in a picture."""
    pulls = " and ".join(f"{pull:g}" for pull in case.pulls_mm)
    pulled = f"Cable pulled by {pulls} mm." if len(case.pulls_mm) == 1 else f"Cables pulled by {pulls} mm."
    seen = case.seen.format(paper=reading["paper"], rod=reading["rod"], ratio=_ratio(reading))
    return f"{pulled} {seen}"


def _ratio(reading: Mapping[str, Reading]) -> float:
    """Return the rod's force over the paper's."""
    return reading["rod"].force / reading["paper"].force
