"""Episodes: a random walk in a sampled setting, and everything that is checked of it."""

import math
from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from solver import Robot, Status
from soak.cores import CoreCheck, line_points
from soak.report import Tally
from soak.scenes import MODELS, make_solver, sample_setting
from soak.shapes import distance

BLOCKED, GAVE_UP = Status(3), Status(4)
STEPS = 250
FAR = 0.5  # of the spacing: a step that moves a point farther is looked at from one accepted shape to the next
CERTIFY_EVERY = 1000
MOST_FACTORISATIONS = 5000
DEEPEST = 1e-12  # of the robot's length
INSIDE = 1e-11  # the same by the distances in numpy, which round differently
BAND = 1e-6  # of the tension limit
OPTIMAL = 1e-8
CERTIFIED = 1e-7  # in natural units: stationarity · L, gaps / L, complementarity, sign · L


class Walk(NamedTuple):
    """What was commanded, and what came of it."""

    states: list
    commands: np.ndarray  # (T, cables + 1) [mm], the length last


class Finding(NamedTuple):
    """Something that must not happen, at a step of an episode."""

    kind: str
    step: int
    value: float


class Episode(NamedTuple):
    """An episode, all of which follows from these."""

    model: str
    seed: int
    index: int
    steps: int = STEPS


def setting_of(episode):
    """Its setting, and the generator that its commands come from."""
    generator = np.random.default_rng([episode.seed, MODELS.index(episode.model), episode.index])
    return sample_setting(generator, episode.model), generator


def walk(solver, increments):
    """Move by increments ``(T, cables + 1)`` of what the robot has reached, kept in range."""
    states, commands = [solver.rest()], []
    for increment in increments:
        commands.append(_in_range(solver.robot, command_of(states[-1]) + increment))
        states.append(step(solver, states[-1], commands[-1]))
    return Walk(states, np.array(commands).reshape(-1, increments.shape[1]))


def replay(solver, commands):
    """Follow commands ``(T, cables + 1)`` from rest."""
    states = [solver.rest()]
    for command in commands:
        states.append(step(solver, states[-1], command))
    return Walk(states, np.asarray(commands))


def step(solver, state, command):
    """One step to a command (cables, length)."""
    if isinstance(solver.robot, Robot):
        return solver.step(state, float(command[0]), float(command[1]))
    return solver.step(state, command[:2])


def command_of(state):
    """Where a state's cables and base are, ``(cables + 1,)`` [mm]."""
    cables = [state.cable_mm] if isinstance(state.robot, Robot) else state.cables_mm
    return np.array([*cables, state.length_mm])


def _in_range(robot, command):
    high = robot.cable_limit_mm
    low, lengths = (0.0, robot.lengths_mm) if isinstance(robot, Robot) else (-high, 2 * (robot.length_mm,))
    return np.array([*np.clip(command[:-1], low, high), np.clip(command[-1], *lengths)])


def sample_increments(generator, solver, scale, steps):
    """Increments of cables and length, some manners of moving one after the other, ``(steps, cables + 1)`` [mm]."""
    rows, calm = [], generator.random() < 0.6
    while len(rows) < steps:
        count, sizes = int(generator.integers(3, 31)), _sizes(generator, calm)
        direction = _direction(generator, solver)
        insertion = _insertion(generator) if getattr(solver.robot, "length_range_mm", None) else lambda: 0.0
        rows += [[*(sizes() * direction), insertion()] for _ in range(count)]
    return scale * np.array(rows[:steps])


def _sizes(generator, calm):
    """A manner of moving the cables, in a calm episode only by little [mm]."""
    pull = generator.uniform(0.05, 1.0)
    manners = [
        lambda: generator.normal(0.05, 0.3),
        lambda: pull,
        lambda: pull * generator.uniform(0, 2),
        lambda: -pull,
        lambda: 0.1 * generator.choice([-1, 1]),
        lambda: generator.choice([-1e-3, 0.0, 1e-3]),
        lambda: generator.choice([-0.7, 1.0]) * generator.uniform(5, 11),
    ]
    weights = np.array([3, 5, 3, 3, 1, 1, 0 if calm else 5])
    return manners[generator.choice(len(manners), p=weights / weights.sum())]


def _direction(generator, solver):
    """Of the cables; in space mostly towards an obstacle."""
    if isinstance(solver.robot, Robot):
        return np.ones(1)
    if generator.random() < 0.3 or not len(solver.scene):
        towards = generator.normal(size=2)
    else:
        towards = np.array(solver.scene.obstacles[generator.integers(len(solver.scene))].extent.center[:2])
    return towards / np.linalg.norm(towards)


def _insertion(generator):
    way = generator.uniform(-2, 3)
    return [lambda: 0.0, lambda: way, lambda: generator.uniform(-3, 3), lambda: generator.uniform(-40, 40)][
        generator.choice(4, p=[0.4, 0.3, 0.2, 0.1])
    ]


def play(episode):
    """Play an episode; its tally, and the cases to reproduce what was found."""
    setting, generator = setting_of(episode)
    solver = setting.solver
    taken = walk(solver, sample_increments(generator, solver, setting.scale, episode.steps))
    tally = Tally.of(episode.model, setting, taken)
    found = check(solver, taken, tally, episode.index * episode.steps)
    return tally, [_case(episode, setting, taken, finding) for finding in found]


def _case(episode, setting, taken, finding):
    solver = setting.solver
    return {
        "kind": finding.kind,
        "value": finding.value,
        "step": finding.step,
        "episode": list(episode),
        "scene_kind": setting.kind,
        "robot": repr(solver.robot),
        "scene": [repr(obstacle) for obstacle in solver.scene],
        "commands": taken.commands[: finding.step + 1].tolist(),
    }


def check(solver, taken, tally, offset=0):
    """Everything that must not happen and did; what was measured is added to the tally."""
    findings = _states(solver, taken, tally) + _optimality(solver, taken, tally, offset)
    return findings + _blocked(solver, taken, tally) + _cores(solver, taken, tally)


def _states(solver, taken, tally):
    """Numbers, gaps, tensions, verdicts and work of every state."""
    states, robot = taken.states, solver.robot
    length = robot.length_mm
    finite = np.array([np.isfinite(state.block[~np.isposinf(state.block)]).all() for state in states])
    least = np.array([state.gaps.min(initial=math.inf) for state in states]) / length
    inside = _least_distance(solver, states) / length
    tension = np.array([np.max(_tensions(state)) for state in states]) / robot.max_tension
    work = np.array([getattr(state, "factorisations", state.iterations) for state in states])
    gave_up = np.array([state.status == GAVE_UP for state in states])
    tally.least_gap = min(tally.least_gap, least.min(initial=math.inf))
    tally.least_distance = min(tally.least_distance, inside.min(initial=math.inf))
    tally.most_tension = max(tally.most_tension, tension.max())
    tally.most_factorisations = max(tally.most_factorisations, int(work.max()))
    return [
        *_first("not finite", ~finite, least),
        *_first("gap", least < -DEEPEST, least),
        *_first("penetration", inside < -INSIDE, inside),
        *_first("tension", tension > 1 + BAND, tension),
        *_first("factorisations", work > MOST_FACTORISATIONS, work),
        *_first("gave up", gave_up, work),
    ]


def _tensions(state):
    return state.tension if isinstance(state.robot, Robot) else state.tensions


def _first(kind, wrong, values):
    """The first step at which something is wrong; what follows may follow from it."""
    return [Finding(kind, max(int(k) - 1, 0), float(values[k])) for k in np.flatnonzero(wrong)[:1]]


def _points(states):
    robot = states[0].robot
    frames = None if isinstance(robot, Robot) else np.stack([state.frames for state in states])
    return line_points(robot, np.stack([state.nodes for state in states]), frames)


def _displacements(states):
    return np.stack([state.displacements for state in states])


def _least_distance(solver, states):
    """Least signed distance of the points that can touch to the obstacles that all can, ``(T+1,)`` [mm]."""
    points, moved = _points(states), _displacements(states)
    distances = [
        distance(obstacle, points - moved[:, None, None, j]).min(axis=(1, 2))
        for j, obstacle in enumerate(solver.scene)
        if obstacle.nodes is None
    ]
    return np.min(distances, axis=0) if distances else np.full(len(states), math.inf)


def _optimality(solver, taken, tally, offset):
    """The kernel's own measure of every state, and the node-coordinate certificate of events and now and then."""
    findings, certified = [], 0
    for k, (before, state) in enumerate(pairwise(taken.states)):
        if hasattr(solver, "optimality"):
            worst = float(np.max(solver.optimality(state)))
            tally.worst_optimality = max(tally.worst_optimality, worst)
            if not worst <= OPTIMAL:
                findings.append(Finding("optimality", k, worst))
        event = state.status != Status.CONVERGED and not np.array_equal(before.block, state.block)
        tally.events += event
        if (event and certified < tally.certificates_each) or (offset + k) % CERTIFY_EVERY == 0:
            certified += 1
            tally.certified += 1
            worst = certificate(state)
            tally.worst_certificate = max(tally.worst_certificate, worst)
            if not worst <= CERTIFIED:
                findings.append(Finding("certificate", k, worst))
    return findings


def certificate(state):
    """Worst residual of the node-coordinate problem in natural units."""
    length, residuals = state.robot.length_mm, state.residuals()
    return max(
        residuals.stationarity * length,
        residuals.lengths / length,
        residuals.gaps / length,
        residuals.complementarity,
        residuals.sign * length,
    )


def _blocked(solver, taken, tally):
    """Blocked steps, and whether another way gets on from there."""
    findings = []
    for k, state in enumerate(taken.states[1:]):
        if state.status != BLOCKED or (k and taken.states[k].status == BLOCKED):
            continue
        tally.blocked += 1
        passed = _other_ways(solver, taken, k)
        tally.blocked_unconfirmed += passed
        findings.append(Finding("blocked, but not another way" if passed else "blocked", k, state.iterations))
    return findings


def _other_ways(solver, taken, k):
    """Whether a command that was blocked is reached, or its tension limit is, in small steps or by another way."""
    before, command = taken.states[k], taken.commands[k]
    start = command_of(before)
    small = np.linspace(start, command, 41)[1:]
    corner = np.array([command[0], *start[1:]])
    straight = np.linspace(command_of(solver.rest()), command, 81)[1:]
    return _passes(solver, before, small) or _passes(solver, before, [corner, command]) or _passes(
        solver, solver.rest(), straight
    )


def _passes(solver, state, commands):
    for command in commands:
        state = step(solver, state, command)
    return state.status != BLOCKED and state.status != GAVE_UP


def _cores(solver, taken, tally):
    """Cores swept from state to state where all moves are small, else from one accepted shape to the next."""
    core, states = CoreCheck(solver.scene), taken.states
    if not core.obstacles:
        return []
    points, moved = _points(states), _displacements(states)
    motion = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=(1, 2))
    motion = np.maximum(motion, np.linalg.norm(np.diff(moved, axis=0), axis=-1).max(axis=1, initial=0))
    snapped = np.array([state.status == Status.SNAPPED for state in states[1:]])
    swept = core.swept(points, moved)
    looked = snapped | (motion > FAR * solver.robot.spacing_mm) | swept.any(axis=1)
    tally.traced += int(looked.sum())
    findings = []
    for steps in _chunks(np.flatnonzero(looked)):
        findings += [Finding("core swept", k, j) for k, j in _traced(solver, core, taken, steps)]
    tally.cores_swept += len(findings)
    return findings


def _chunks(steps, size=16):
    return [steps[k : k + size] for k in range(0, len(steps), size)]


def _traced(solver, core, taken, steps):
    """(step, obstacle) of cores that some steps swept."""
    ways = [accepted(solver, taken.states[k], taken.commands[k]) for k in steps]
    points, moved = (np.concatenate(parts) for parts in zip(*ways, strict=True))
    owner = np.repeat(steps, [len(way[0]) for way in ways])
    swept = core.swept(points, moved, linked=owner[1:] == owner[:-1])
    return sorted({(int(owner[k]), int(j)) for k, j in np.argwhere(swept)})


def accepted(solver, state, command):
    """Points and displacements of obstacles of all shapes accepted on the way of a step, the first and last included.

    A trace tells the nodes only: in space the lines off the backbone are not looked at in between, and neither are
    obstacles on springs.
    """
    target = float(command[0]) if isinstance(solver.robot, Robot) else command[:2]
    length = (float(command[1]),) if isinstance(solver.robot, Robot) else ()
    nodes = solver.trace(state, target, *length)
    moved = np.zeros((len(nodes), *state.displacements.shape))
    moved[:, list(solver.scene.mounted)] = math.nan
    return line_points(solver.robot, nodes), moved


def find(robot, scene, commands):
    """Kinds of what a case shows, at its last step or before."""
    solver = make_solver(robot, scene)
    return Counter(finding.kind for finding in check(solver, replay(solver, np.array(commands)), Tally()))
