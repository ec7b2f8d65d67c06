"""Checks of every step of a walk."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from soak.cores import CoreCheck
from soak.ends import holes_meet, is_wedged
from soak.shapes import distance
from soak.walks import Numbers, command_of, step
from solver import Robot, Status

FAR = 0.5  # of the shortest edge: a step that moves a point farther is checked between its accepted shapes
CERTIFY_EVERY = 1000
MOST_FACTORIZATIONS = 5000
WORK = 4500  # factorisations: a step that was given up on after more has spent its budget, as its trace would tell
MOST_REPEATED = 30  # cases of an episode whose commands are repeated, which takes long
SAME_PLACE = 1e-4  # of the offset and the robot's length: steps given up on there
SAME_WAY = 0.1  # distance of unit vectors to their commands: and in this direction are one case
MOST_BLOCKED = 3  # blocked steps of an episode that are retried in other ways
DEEPEST = 1e-12  # of the robot's length
INSIDE = 1e-11  # of the robot's length, by the distances in numpy, which round differently
BAND = 1e-6  # of the tension limit
OPTIMAL = 1e-8
PRETENSION = 0.00625 * 1.001  # of the offset: a cable displaced less is practically slack
REPEATED = ("far", "pinched", "wedged", "unexplained")  # reasons that repeats show
REPEATS = 300  # of a command that was given up on, each of which must move a cable or the base
STILL = 1e-9  # by more than this of the offset, or of the length
PINCHED = 100  # of EI/L²: a contact force far beyond what bends the robot
STALLED_AGAIN = 3  # stalled steps of an episode that are repeated
MOVED_ON = 1e-4  # of the offset: a repeated command that stalled must not lead farther
WITHIN_BAND = 1e-3  # the same, where the tension rises on the way, within its band
BUCKLED = 0.9  # of the tension 12 EI/l0² of all cables, at which segments in line buckle one by one
UNPULLED = 10  # contact force over the tension: beyond what the cables can cause
CERTIFIED = 1e-7  # in natural units: stationarity · L, gaps / L, complementarity, sign · L


class Finding(NamedTuple):
    """Something that must not happen, at a step of an episode."""

    kind: str
    step: int
    value: float


def check(solver, taken, tally, offset=0):
    """Return all findings of a walk, and add its measurements to the tally."""
    numbers = Numbers.of(taken.states)
    findings = [
        *_rest(solver, taken),
        *_states(solver, numbers, tally),
        *_optimality(solver, taken, tally, offset),
        *_stalled(solver, taken),
        *_gave_up(solver, taken, tally),
        *_blocked(solver, taken, tally),
        *_cores(solver, taken, numbers, tally),
    ]
    tally.findings.update(finding.kind for finding in findings)
    return findings


def _rest(solver, taken):
    """Check that the robot came to rest under all of its loads, some of which cables may have to yield to."""
    rest = taken.states[0]
    worst = float(np.max(solver.optimality(rest)))
    kept = rest.status <= Status.STALLED and worst <= OPTIMAL
    return [] if kept else [Finding(f"at rest {rest.status.name}", 0, worst)]


def _states(solver, numbers, tally):
    """Check numbers, gaps, edges, tensions and work of every state."""
    robot, work = solver.robot, numbers.work
    length = robot.longest_mm
    finite = (np.isfinite(numbers.blocks) | np.isposinf(numbers.blocks)).all(axis=1)
    least = numbers.gaps.min(axis=(1, 2, 3), initial=math.inf) / length
    inside = _least_distance(solver, numbers) / length
    edges = np.linalg.norm(np.diff(numbers.points, axis=2), axis=-1).max(axis=2) - robot.edges_mm
    longer = edges.max(axis=1) / length  # than the longest that there can be, which holds up to the gap of its disks
    tension = numbers.tensions.max(axis=1) / robot.max_tension
    tally.contact += int(numbers.touching[1:].sum())
    tally.least_gap = min(tally.least_gap, least.min(initial=math.inf))
    tally.least_distance = min(tally.least_distance, inside.min(initial=math.inf))
    tally.most_tension = max(tally.most_tension, tension.max())
    tally.most_factorizations = max(tally.most_factorizations, int(work.max()))
    return [
        *_first("not finite", ~finite, least),
        *_first("gap", least < -DEEPEST, least),
        *_first("penetration", inside < -INSIDE, inside),
        *_first("edge", longer > DEEPEST, longer),
        *_first("tension", tension > 1 + BAND, tension),
        *_first("factorizations", work > MOST_FACTORIZATIONS, work),
    ]


def _first(kind, wrong, values):
    """Return the first wrong step only, as later ones may be its consequence."""
    return [Finding(kind, max(int(k) - 1, 0), float(values[k])) for k in np.flatnonzero(wrong)[:1]]


def _least_distance(solver, numbers):
    """Return the least signed distance to the obstacles that all points can touch, ``(T+1,)`` [mm]."""
    distances = [
        distance(obstacle, numbers.points - numbers.displacements[:, None, None, j]).min(axis=(1, 2))
        for j, obstacle in enumerate(solver.scene)
        if obstacle.nodes is None
    ]
    return np.min(distances, axis=0) if distances else np.full(len(numbers.blocks), math.inf)


def _optimality(solver, taken, tally, offset):
    """Check the kernel's residuals of every state, and the node-coordinate certificate of events and some others.

    That knows neither cables through holes that meet nor obstacles on springs that the clamped base holds up.
    """
    findings, certified = [], 0
    for k, (before, state) in enumerate(pairwise(taken.states)):
        worst = float(np.max(solver.optimality(state))) / _strain(state)
        tally.worst_optimality = max(tally.worst_optimality, worst)
        if not worst <= OPTIMAL:
            findings.append(Finding("optimality", k, worst))
        event = state.status != Status.CONVERGED and not np.array_equal(before.block, state.block)
        tally.events += event
        wanted = (event and certified < tally.certificates_each) or (offset + k) % CERTIFY_EVERY == 0
        if wanted and not _holes_meet(state) and not state.contact[:, :, 0].any():
            certified += 1
            tally.certified += 1
            worst = certificate(state) / _strain(state)
            tally.worst_certificate = max(tally.worst_certificate, worst)
            if not worst <= CERTIFIED:
                findings.append(Finding("certificate", k, worst))
    return findings


def _strain(state):
    """Return by how much forces exceed those that bend the robot, and their roundoff with them, at least 1.

    These are tensions that no motor limits, and contact forces beyond PINCHED EI/L².
    """
    robot = state.robot
    bending = robot.rigidity / robot.longest_mm**2
    strain = max(1.0, float(_largest_contact_force(state)) / (PINCHED * bending))
    if np.isfinite(robot.max_tension):
        return strain
    return max(strain, float(np.max(state.tensions)) * robot.offset_mm / (bending * robot.longest_mm))


def _largest_contact_force(state):
    """Return the largest force of an obstacle on a single point [N]."""
    return state.energy_scale * state.multipliers.max(initial=0.0)


def _holes_meet(state):
    robot = state.robot
    return robot.model == "rod" and not isinstance(robot, Robot) and holes_meet(state)


def certificate(state):
    """Return the worst residual of the node-coordinate problem in natural units."""
    length, residuals = state.robot.length_mm, state.residuals()
    return max(
        residuals.stationarity * length,
        residuals.lengths / length,
        residuals.gaps / length,
        residuals.complementarity,
        residuals.sign * length,
    )


def _stalled(solver, taken):
    """Check that stalled steps lead no farther when their command is repeated."""
    stalled = np.flatnonzero([state.status == Status.STALLED for state in taken.states[1:]])
    for k in stalled[:: max(1, len(stalled) // STALLED_AGAIN)].tolist():
        state = taken.states[k + 1]
        again = step(solver, state, taken.commands[k])
        moved, rises = _distance(again, command_of(state)), np.max(again.tensions) > np.max(state.tensions)
        if moved > (WITHIN_BAND if rises else MOVED_ON):
            return [Finding("stalled, but goes on", k, float(moved))]
    return []


def _gave_up(solver, taken, tally):
    """Check that every step given up on has an explanation."""
    cases, unexplained = [], []
    for k in np.flatnonzero([state.status == Status.GAVE_UP for state in taken.states[1:]]).tolist():
        case = _case(taken, k)
        reason = next((why for known, why in cases if _is_same(known, case)), None)
        if reason is None:
            spent = sum(why in REPEATED for _, why in cases) >= MOST_REPEATED
            reason = _reason(solver, taken, k, repeats=0 if spent else REPEATS)
            cases.append((case, reason))
        tally.reasons[reason] += 1
        if reason == "unexplained":
            unexplained.append(Finding("gave up", k, taken.states[k + 1].factorizations))
    return unexplained[:1]


def _case(taken, k):
    """Return where a step was given up on, in natural units, and the direction to its command."""
    state, robot = taken.states[k + 1], taken.states[k + 1].robot
    scale = np.array([*(robot.offset_mm for _ in robot.cables), robot.length_mm])
    place = np.append(command_of(state) / scale, state.nodes / robot.length_mm)
    way = (taken.commands[k] - command_of(state)) / scale
    return place, way / np.linalg.norm(way)


def _is_same(case, other):
    return np.abs(case[0] - other[0]).max() <= SAME_PLACE and np.linalg.norm(case[1] - other[1]) <= SAME_WAY


def _reason(solver, taken, k, repeats=REPEATS):
    """Return why a step was given up on, "not looked at" where that takes repeats and there are to be none.

    At once or after repeats, ``folded``: the branch ends where a segment of the paper's models folds over; ``slack``:
    without pretension the shape of the paper's model is undetermined; ``crossing``: the pulled cable of a pair changes
    in contact, where the shape of the paper's model jumps. ``far``: the command exceeds the work of one step; each
    repeat moves on, until one ends with another status. ``pinched``: no repeat moves on any more, and obstacles
    squeeze the robot, with contact forces that no cable causes by pulling: the command feeds or draws it, or a cable of
    the paper's models pushes it, into a place that is too narrow, and these models set no limit to that. ``wedged``: no
    repeat moves on any more, and by the slopes of the closed gaps alone no motion does. ``holes meet``: two holes
    of a taut cable do, where its length has no slope. ``buckled``: cables, which no limit stops before, pull
    against each other so much that segments bend to and fro, from pattern to pattern in many small snaps, or that no
    shape is stable.
    """
    state, command, robot = taken.states[k + 1], taken.commands[k], solver.robot
    reason = "work" if state.factorizations > WORK else _trace(solver, taken.states[k], command).reason
    if reason == "folded":
        return reason
    if _holes_meet(state):
        return "holes meet"
    if near_zero := _near_zero(state, command):
        return near_zero
    softest = min(robot.segment_rigidity or [robot.rigidity]) if robot.model == "rod" else robot.rigidity
    buckling = 12 * softest * (robot.segments / state.length_mm) ** 2
    if robot.model == "rod" and state.tensions.sum() > BUCKLED * buckling:
        return "buckled"
    if repeats == 0:
        return "not looked at"
    state = _repeated(solver, state, command, repeats)
    if state.status != Status.GAVE_UP:
        return "far"
    if _trace(solver, state, command).reason == "folded":
        return "folded"
    if near_zero := _near_zero(state, command):
        return near_zero
    if _is_pinched(state, command):
        return "pinched"
    return "wedged" if is_wedged(state, command) else "unexplained"


def _near_zero(state, command):
    """Return what is wrong with a cable of the paper's models that is next to slack, an empty string where none is."""
    robot, pulled = state.robot, command_of(state)[:-1]
    near = np.abs(pulled) <= PRETENSION * robot.offset_mm
    if robot.model != "paper":
        return ""
    if isinstance(robot, Robot):
        return "slack" if near[0] else ""
    return "crossing" if np.any((pulled * command[:-1] <= 0) & near) else ""


def _repeated(solver, state, command, repeats):
    """Return where a command leads that is repeated as long as it moves any cable: one may let out for another."""
    for _ in range(repeats):
        before, state = state, step(solver, state, command)
        if state.status != Status.GAVE_UP or _distance(state, command_of(before)) <= STILL:
            break
    return state


def _distance(state, command):
    robot = state.robot
    scale = np.array([*(robot.offset_mm for _ in command[:-1]), robot.length_mm])
    return np.max(np.abs(command_of(state) - command) / scale)


def _is_pinched(state, command):
    """Return whether contact forces that the pull of the cables cannot cause squeeze a robot."""
    force = np.linalg.norm(state.forces, axis=-1).max(initial=0)
    pull, fed = np.max(state.tensions), state.length_mm != command[-1]
    bending = state.robot.rigidity / state.length_mm**2
    return (fed or pull < 0) and force > PINCHED * bending and force > UNPULLED * pull


def _blocked(solver, taken, tally):
    """Report blocked steps that another way passes, or that no limit to what presses explains.

    No motor limits the base: where closed gaps alone keep the robot from being fed or drawn, it is blocked. A repeated
    step comes closer to where they balance.
    """
    blocked = np.flatnonzero([state.status == Status.BLOCKED for state in taken.states[1:]])
    tally.blocked += len(blocked)
    findings = []
    if np.isinf(solver.robot.max_tension):  # to first order only: bent another way, the robot may get past
        return findings
    for k in blocked[:MOST_BLOCKED].tolist():
        after, command = taken.states[k + 1], taken.commands[k]
        ends = [state for state in (after, step(solver, after, command)) if state.status == Status.BLOCKED]
        wedged = any(is_wedged(state, command) for state in ends)
        passed = _other_ways(solver, taken, k, wedged)
        tally.blocked_unconfirmed += passed
        if passed or command[-1] == after.length_mm or not wedged:
            kind = "blocked, but reached another way" if passed else "blocked"
            findings.append(Finding(kind, k, after.factorizations))
    return findings


def _other_ways(solver, taken, k, wedged):
    """Return whether a blocked command, or its tension limit, is reached in small steps or in another way.

    That from rest may go round the other side of what keeps a robot where closed gaps balance each other.
    """
    before, command = taken.states[k], taken.commands[k]
    start = command_of(before)
    small = np.linspace(start, command, 41)[1:]
    corner = [np.array([command[0], *start[1:]]), command]
    straight = np.linspace(command_of(solver.rest()), command, 81)[1:]
    if _passes(solver, before, small) or _passes(solver, before, corner):
        return True
    return not wedged and _passes(solver, solver.rest(), straight)


def _passes(solver, state, commands):
    for command in commands:
        state = step(solver, state, command)
    return state.status < Status.BLOCKED


def _cores(solver, taken, numbers, tally):
    """Check for swept cores from state to state where all moves are small, else between accepted shapes."""
    core, states = CoreCheck(solver.robot, solver.scene), taken.states
    if not core.obstacles:
        return []
    points, moved = numbers.points, numbers.displacements
    motion = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=(1, 2))
    motion = np.maximum(motion, np.linalg.norm(np.diff(moved, axis=0), axis=-1).max(axis=1, initial=0))
    snapped = np.array([state.status == Status.SNAPPED for state in states[1:]], bool)
    swept = core.swept(points, moved)
    suspect = snapped | (motion > FAR * min(solver.robot.edges_mm)) | swept.any(axis=1)
    tally.traced += int(suspect.sum())
    findings = []
    for steps in _chunks(np.flatnonzero(suspect)):
        findings += [Finding("core swept", k, j) for k, j in _traced(solver, core, taken, steps)]
    tally.cores_swept += len(findings)
    return findings


def _chunks(steps, size=16):
    return [steps[k : k + size] for k in range(0, len(steps), size)]


def _traced(solver, core, taken, steps):
    """Return (step, obstacle) of the cores that some steps swept."""
    ways = [accepted(solver, taken.states[k], taken.commands[k]) for k in steps]
    points, moved = (np.concatenate(parts) for parts in zip(*ways, strict=True))
    owner = np.repeat(steps, [len(way[0]) for way in ways])
    swept = core.swept(points, moved, linked=owner[1:] == owner[:-1])
    return sorted({(int(owner[k]), int(j)) for k, j in np.argwhere(swept)})


def accepted(solver, state, command):
    """Return points and obstacle displacements of all shapes accepted on the way of a step, first and last included."""
    trace = _trace(solver, state, command)
    return trace.points, trace.displacements


def _trace(solver, state, command):
    if isinstance(solver.robot, Robot):
        return solver.trace(state, command[:-1], float(command[-1]))
    return solver.trace(state, command[:-1])
