"""Slopes of sampled states, against the dense optimality conditions and against differences of the kernel's steps."""

from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from soak.scenes import MODELS, SPATIAL, make_solver, sample_setting
from soak.walks import sample_increments, walk
from solver import Robot, Scene, Status
from solver.planar import sensitivity as planar
from solver.planar.solve import kernel_scene as planar_scene
from solver.spatial import sensitivity as spatial
from solver.spatial.solve import kernel_scene as spatial_scene

KINDS = ("circles", "shapes", "springs", "channel"), ("spheres", "shapes", "springs", "channel")
STEPS, STATES = 160, 48  # of a walk, and taken of it
PULLED = 0.1  # least displacement over the offset that determines the shear of the paper's model
BRINK = 100.0  # largest slope of a node in the command, beyond which a robot is about to snap or locked by its cables
STEP_SIZES = 4  # of a difference, each a quarter of the last
UNSURE = 1e-7  # estimated error of a difference, over the largest slope, from which on it proves nothing
ROUNDOFF = 1e-12  # slope that is none: of a robot whose cables are all slack
PARTS = ("nodes", "turns", "multipliers", "tensions", "forces", "displacements")


@dataclass
class Survey:
    """What came of comparing slopes.

    Attributes:
        dense: Largest error of each state against the dense conditions, over the largest slope of its kind.
        differences: The same of each row that was compared with differences.
        left_out: Numbers of states and rows that were not compared, by reason.
        worst: Descriptions of the rows with the largest errors.
    """

    dense: list = field(default_factory=list)
    differences: list = field(default_factory=list)
    left_out: Counter = field(default_factory=Counter)
    worst: list = field(default_factory=list)

    def note(self, error, *what):
        """Keep what has one of the largest errors."""
        self.worst = sorted([*self.worst, (error, *what)], key=lambda entry: -entry[0])[:8]


def survey(model, count, seed=0):
    """Return the comparison of a number of states of a family, half of them in contact where there are so many."""
    found, walks = Survey(), 0
    while len(found.dense) < count:
        generator = np.random.default_rng([seed, MODELS.index(model), walks])
        walks += 1
        setting = sample_setting(generator, model, kinds=KINDS[model in SPATIAL], scales=(1.0,))
        states = walk(setting.solver, sample_increments(generator, setting.solver, setting.scale, STEPS)).states
        touching = [state for state in states if state.contact.any()]
        chosen = _some(generator, states, STATES // 2) + _some(generator, touching, STATES // 2)
        for k, state in enumerate(chosen[: count - len(found.dense)]):
            _compare(found, generator, state, (model, seed, walks - 1, k))
    return found


def _some(generator, states, count):
    return [states[k] for k in generator.choice(len(states), min(count, len(states)), replace=False)]


def _compare(found, generator, state, name):
    robot = state.robot
    if state.status == Status.GAVE_UP or state.contact[:, :, 0].any():
        found.left_out["gave up, or a contact of the base"] += 1
        return
    if robot.model == "paper" and np.abs(state.cables_mm).max() <= PULLED * robot.offset_mm:
        found.left_out["paper's model all but slack"] += 1
        return
    in_plane = isinstance(robot, Robot)
    parts = (planar._kernel_slopes if in_plane else spatial._kernel_slopes)(state)
    if parts is None:
        found.left_out["singular, or locked by its cables"] += 1
        return
    names = [name for name in PARTS if name != "turns" or not in_plane]
    slopes = dict(zip(names, parts, strict=True))
    if np.abs(slopes["nodes"][: len(robot.cables) + 1]).max() > BRINK:
        found.left_out["about to snap"] += 1
        return
    exact = (planar.dense_sensitivity if in_plane else spatial.dense_spatial_sensitivity)(state)
    errors = {part: _error(slopes[part], getattr(exact, part)) for part in names}
    found.dense.append(max(errors.values()))
    found.note(found.dense[-1], "dense", *name, max(errors, key=errors.get))
    for row, ways in _rows(generator, state):
        differences = _differentiate(state, ways)
        if isinstance(differences, str):
            found.left_out[differences] += 1
            continue
        if any(_over(unsure, slopes[part], row) > UNSURE for part, (_, unsure) in differences.items()):
            found.left_out["kinked or too curved for differences"] += 1
            continue
        errors = {part: _over(slopes[part][row] - differences[part][0], slopes[part], row) for part in names}
        found.differences.append(max(errors.values()))
        found.note(found.differences[-1], "difference", *name, row, max(errors, key=errors.get))


def _error(slopes, exact):
    largest = np.abs(exact).max(initial=0)
    return np.abs(slopes - exact).max(initial=0) / (largest if largest > ROUNDOFF else 1)


def _over(errors, slopes, row):
    """Return the largest error of a row, over its largest slope, or over a hundredth of the largest in any row."""
    largest = max(np.abs(slopes[row]).max(initial=0), np.abs(slopes).max(initial=0) / 100)
    return np.abs(errors).max(initial=0) / (largest if largest > ROUNDOFF else 1)


# Differences.


def _rows(generator, state):
    """Yield a cable, the length, and a motion of an obstacle that presses, if one does: row, and how it is changed."""
    robot, count = state.robot, len(state.robot.cables)
    cable = int(generator.integers(count))
    yield cable, (0.005 * robot.offset_mm, lambda by: (by * np.eye(count + 1)[cable], state.scene))
    yield count, (5e-4 * robot.length_mm, lambda by: (by * np.eye(count + 1)[-1], state.scene))
    pressing = np.flatnonzero(state.contact.any(axis=(1, 2)))
    if pressing.size:
        j = int(generator.choice(pressing))
        in_plane = isinstance(robot, Robot)
        motions = planar.MOTIONS if in_plane else spatial.MOTIONS
        ways = _motions(state.scene.obstacles[j])
        motion = int(generator.choice(sorted(ways)))
        size, change = ways[motion]

        def moved(by):
            return np.zeros(count + 1), Scene(change(o, by) if k == j else o for k, o in enumerate(state.scene))

        yield count + 1 + motions * j + motion, (size, moved)


def _motions(obstacle):
    """Return how an obstacle can be changed: by motion, a size, and the change."""
    space, extent = obstacle.space, obstacle.extent
    ways = {k: (0.05, lambda o, by, k=k: o.shifted(by * np.eye(space)[k])) for k in range(space)}
    names = {name for name in ("start", "end", "corners") if hasattr(obstacle, name)}
    for k in range(1 if space == 2 else 3):
        if names:
            ways[space + k] = (0.05 / extent.radius, lambda o, by, k=k: _turned(o, k, by))
    if obstacle.kind in ("circle", "capsule", "sphere", "spatial_capsule"):
        last = (planar.MOTIONS if space == 2 else spatial.MOTIONS) - 1
        ways[last] = (0.05, lambda o, by: replace(o, radius=o.radius + by))
    return ways


def _turned(obstacle, axis, by):
    """Return an obstacle that is given by its points, turned about its centre."""
    center = np.array(obstacle.extent.center)
    cosine, sine = np.cos(by), np.sin(by)
    if obstacle.space == 2:
        matrix = np.array([[cosine, -sine], [sine, cosine]])
    else:
        one, other = (axis + 1) % 3, (axis + 2) % 3
        matrix = np.eye(3)
        matrix[one, one] = matrix[other, other] = cosine
        matrix[one, other], matrix[other, one] = -sine, sine
    points = {
        name: np.array(getattr(obstacle, name)) for name in ("start", "end", "corners") if hasattr(obstacle, name)
    }
    moved = {name: center + (value - center) @ matrix.T for name, value in points.items()}
    as_tuples = {name: tuple(map(tuple, value)) if value.ndim == 2 else tuple(value) for name, value in moved.items()}
    return replace(obstacle, **as_tuples)


def _differentiate(state, ways):
    """Return differences extrapolated to none, by part, or why there are none.

    Steps that are too large, where the active set changes, are left out; two in a row are needed.
    """
    size, change = ways
    stronger = replace(
        state.robot, max_tension=10 * state.robot.max_tension
    )  # motors at their limit hold a little more
    kernel, rows, reason = make_solver(stronger, state.scene)._kernel, [], ""
    compiled = planar_scene if isinstance(state.robot, Robot) else spatial_scene
    here = compiled(state.robot, state.scene)
    for k in range(STEP_SIZES):
        step = size / 4**k
        near = []
        for sign in (1, -1):
            command, scene = change(sign * step)
            there = here if scene is state.scene else compiled(state.robot, scene)
            near.append(_solve(kernel, state, command, here, there))
        if isinstance(near[0], str) or isinstance(near[1], str):
            rows, reason = [], next(one for one in near if isinstance(one, str))
            continue
        row = [{part: (near[0][part] - near[1][part]) / (2 * step) for part in near[0]}]
        for order, before in enumerate(rows[-1] if rows else [], start=1):
            weight = 16.0**order
            row.append({part: (weight * row[-1][part] - before[part]) / (weight - 1) for part in before})
        rows.append(row)
    if len(rows) < 2:
        return reason
    return {part: _best([[entry[part] for entry in row] for row in rows]) for part in rows[0][0]}


def _best(rows):
    """Return the entry of a table of extrapolations that is closest to its neighbours, and how far it is from them."""
    best, least = rows[-1][0], np.inf
    for before, row in pairwise(rows):
        for order in range(1, min(len(row), len(before) + 1)):
            neighbours = row[order - 1], before[order - 1]
            error = max(np.abs(row[order] - one).max(initial=0) for one in neighbours)
            if error < least:
                best, least = row[order], error
    return best, least


def _solve(kernel, state, command, here, there):
    """Return the equilibrium near a state with another command and obstacles, by part, or why there is none.

    It is approached once more from a little farther on, so that the last steps of Newton's method take it well below
    the tolerance of a single step.
    """
    still = [0.0] * len(here)
    bounds = still if there is here else [1.0] * len(here)
    wanted = np.array([*state.cables_mm, state.length_mm]) + command
    beside = wanted.copy()
    beside[0] += 1e-3 * state.robot.offset_mm
    block = state.block
    for origins, motions, goal in ((here, bounds, wanted), (there, still, beside), (there, still, wanted)):
        reached = np.empty_like(block)
        status, *_ = kernel.move(block, goal.tolist(), origins, there, motions, reached)
        if status != Status.CONVERGED:
            return "a step beside it did not converge"
        block = reached
    if not _alike(state, block):
        return "active set changes beside it"
    return _outputs(state, block)


def _alike(state, block):
    layout = state._layout
    same = np.array_equal(layout.multipliers(block) > 0, layout.multipliers(state.block) > 0)
    same = same and np.array_equal(layout.tensions(block) > 0, layout.tensions(state.block) > 0)
    return same and np.array_equal(
        np.sign(layout.disk_multipliers(block)), np.sign(layout.disk_multipliers(state.block))
    )


def _outputs(state, block):
    layout = state._layout
    names = ("nodes", "multipliers", "tensions", "forces", "displacements")
    out = {name: getattr(layout, name)(block).copy() for name in names}
    if not isinstance(state.robot, Robot):
        turned = layout.frames(block) @ np.swapaxes(layout.frames(state.block), 1, 2)
        skew = (turned - np.swapaxes(turned, 1, 2)) / 2
        sine = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
        size = np.linalg.norm(sine, axis=1, keepdims=True)
        out["turns"] = sine * np.where(size > 0, np.arcsin(size) / np.maximum(size, 1e-300), 1)
    return out
