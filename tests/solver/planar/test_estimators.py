"""Estimators of the contact force: against the identity they rest on, beam theory, and random scenes with noise."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import Circle, Ellipse, HalfPlane, Polygon, Robot, Scene, Solver, VirtualWork, free_motion
from solver.common.robot import MODELS
from solver.planar.contact_force import contact_estimate, shape_estimate
from solver.planar.estimators import (
    LEAST_SLOPE,
    SPREAD,
    Motion,
    RigidityFit,
    force_factor,
    point_forces,
    shape_motion,
)
from solver.planar.forces import force_true
from solver.planar.free import clearance, free_nodes, free_tension, tip_slopes

EVERY_MODEL = pytest.mark.parametrize("model", MODELS)
SCENES = [
    Scene([Circle(center=(44, 104), radius=15)]),
    Scene([Circle(center=(33, 89), radius=12.5), Circle(center=(59, 140), radius=15)]),
    Scene([HalfPlane(point=(31, 127), normal=(-1, 0), nodes=(14,))]),
    Scene(
        [
            Circle(center=(33, 89), radius=12.5, spring=0.3),
            Ellipse(center=(59, 140), radii=(16, 12), spring=((2, 0.5), (0.5, 1))),
            Polygon(corners=((70, 100), (80, 100), (75, 110)), radius=8),
        ]
    ),
]


def pulled(robot, scene, cable_mm, step=0.25):
    solver = Solver(robot, scene)
    now = solver.rest()
    while now.cable_mm < cable_mm - 1e-9:
        now = solver.step(now, min(now.cable_mm + step, cable_mm))
    return now


@EVERY_MODEL
@pytest.mark.parametrize("cable", [0.0, 1e-6, 3.0, 12.0])
def test_free_motion_is_that_of_the_closed_form(model, cable):
    robot = Robot.prototype(model=model, length_range_mm=(150, 200)).at(160.0)
    motion = free_motion(robot, cable, 160.0)
    assert motion.nodes == pytest.approx(free_nodes(robot, cable), abs=1e-11)
    assert motion.tensions == pytest.approx([free_tension(robot, cable)], rel=1e-11)
    slopes = [tip_slopes(robot, cable, node) for node in range(robot.segments + 1)]
    assert motion.slopes == pytest.approx(np.array(slopes)[None], abs=1e-8)


@EVERY_MODEL
def test_motion_from_a_bent_shape_is_one_the_robot_can_make(model):
    """A step along it keeps every length of the segments and shortens the cable by as much."""
    state = pulled(Robot.prototype(model=model), SCENES[0], 9.0)
    robot, length = state.robot, state.length_mm
    motion = shape_motion(robot, state.nodes, state.cable_mm, length)

    def lengths(nodes):
        """Chords relative to the arc's or the backbone's, and the cable in each segment."""
        cable = nodes[:, :2] + robot.offset_mm * np.stack([np.cos(nodes[:, 2]), np.sin(nodes[:, 2])], axis=1)
        chords, holes = (np.hypot(*np.diff(points, axis=0).T) for points in (nodes[:, :2], cable))
        arcs = np.sinc(np.diff(nodes[:, 2]) / (2 * np.pi)) if model == "rod" else 1.0
        return chords / arcs, holes

    step = 1e-4
    (chords, cable), (chords_before, cable_before) = (
        lengths(state.nodes + s * motion.slopes[0]) for s in (step, -step)
    )
    assert chords == pytest.approx(chords_before, abs=1e-9)
    taken = (cable_before - cable) / (2 * step)
    assert taken.sum() == pytest.approx(1, abs=1e-6)
    if model == "paper":
        assert taken == pytest.approx(1 / robot.segments, abs=1e-6)


@EVERY_MODEL
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("between", [0, 2])
def test_identity_gives_the_force_at_the_true_shape(model, scene, between):
    state = pulled(Robot.prototype(model=model, max_tension=math.inf, between=between), scene, 9.0)
    assert state.contact.any()
    assert shape_estimate(state, state.nodes, state.tension) == pytest.approx(force_true(state), abs=1e-8)
    assert point_forces(state).sum(axis=(1, 2)) == pytest.approx(force_true(state), abs=1e-12)


def test_unknown_rigidity_scales_tension_and_force_alike():
    state = pulled(Robot.prototype(model="rod"), SCENES[1], 9.0)
    stiff = shape_estimate(state, state.nodes, 2.5 * state.tension, rigidity_ratio=2.5)
    assert stiff == pytest.approx(2.5 * force_true(state), abs=1e-8)


@pytest.mark.parametrize("node", [6, 9, 14, 18])
def test_contact_is_exact_at_small_deflection(node):
    """A wall that the straight robot grazes: F = T·3a/2s by beam theory. The paper's is 4s/3L of it."""
    robot = Robot.prototype(model="rod", touch=("backbone",))
    state = pulled(robot, Scene([HalfPlane(point=(1e-4, 0.0), normal=(-1.0, 0.0), nodes=(node,))]), 0.1, 0.05)
    force = force_true(state)[0, 0]
    arc = node * robot.segment_mm
    assert contact_estimate(state, state.tension)[0, 0] == pytest.approx(force, rel=2e-3)
    assert -contact_estimate(state, state.tension)[0, 0] == pytest.approx(
        1.5 * robot.offset_mm / arc * state.tension, rel=5 / node**2
    )
    assert VirtualWork().estimate(state)[0, 0] / force == pytest.approx(4 * arc / (3 * robot.length_mm), rel=0.01)


def test_several_obstacles_share_by_the_multipliers():
    state = pulled(Robot.prototype(model="rod"), SCENES[1], 5.03)
    assert state.contact.any(axis=(1, 2)).all()
    estimate, force = contact_estimate(state, state.tension), force_true(state)
    assert estimate / force == pytest.approx(np.full((2, 2), estimate[0, 0] / force[0, 0]), rel=1e-9)
    assert estimate == pytest.approx(force, rel=0.1)


def test_nothing_touches_nothing_is_felt():
    state = pulled(Robot.prototype(model="rod"), SCENES[0], 3.0)
    assert not contact_estimate(state, state.tension + 1).any()
    assert not shape_estimate(state, state.nodes, state.tension + 1).any()


def test_obstacles_only_push():
    state = pulled(Robot.prototype(model="rod"), SCENES[0], 7.0)
    assert not contact_estimate(state, 0.0).any()


def test_contact_that_a_pull_hardly_presses_on_has_a_floor():
    """Next to the base the motion vanishes, and tension noise would count for infinitely much."""
    robot = Robot.prototype(model="rod")
    state = pulled(robot, Scene([HalfPlane(point=(8.02, 0.0), normal=(-1.0, 0.0), nodes=(1,))]), 5.0)
    assert state.contact.any()
    felt, truth = (np.abs(force).max() for force in (contact_estimate(state, state.tension + 0.02), force_true(state)))
    assert felt < truth + 0.02 / (LEAST_SLOPE * robot.length_mm / robot.offset_mm)


def test_two_cables_by_least_squares():
    """Both tensions are short of one unknown: c g = T − k T_bend, as numpy solves it."""
    generator = np.random.default_rng(0)
    robot = Robot.prototype(model="rod")
    count, cables = 5, 2
    motion = Motion(
        np.broadcast_to(free_nodes(robot, 5.0), (count, 19, 3)),
        generator.normal(size=(count, cables, 19, 3)),
        generator.uniform(1, 3, (count, cables)),
    )
    forces = generator.normal(size=(count, 1, 2, 19, 2))
    tensions, ratio = generator.uniform(3, 6, (count, cables)), generator.uniform(0.5, 2, count)
    factors = force_factor(robot, motion, forces, tensions, ratio)
    disks = np.stack([-np.sin(motion.nodes[..., 2]), np.cos(motion.nodes[..., 2])], axis=-1)
    for k in range(count):
        on_backbone = motion.slopes[k, :, :, :2]
        on_cable = on_backbone + robot.offset_mm * motion.slopes[k, :, :, 2:] * disks[k]
        works = -np.array(
            [
                np.sum(forces[k, 0, 0] * on_backbone[cable]) + np.sum(forces[k, 0, 1] * on_cable[cable])
                for cable in range(cables)
            ]
        )
        (expected,), *_ = np.linalg.lstsq(works[:, None], tensions[k] - ratio[k] * motion.tensions[k], rcond=None)
        least = LEAST_SLOPE * robot.length_mm / robot.offset_mm * np.linalg.norm(forces[k], axis=-1).sum()
        assert factors[k] == pytest.approx(max(0.0, expected) * min(1.0, works @ works / least**2))


def test_a_batch_is_its_robots_one_by_one():
    robot = Robot.prototype(model="rod", length_range_mm=(150, 200))
    states = [pulled(robot, SCENES[0], cable) for cable in (3.0, 6.0, 9.0)]
    cables, lengths = np.array([s.cable_mm for s in states]), np.array([s.length_mm for s in states])
    forces, tensions = np.array([point_forces(s) for s in states]), np.array([[s.tension] for s in states])
    factors = force_factor(robot, free_motion(robot, cables, lengths), forces, tensions, np.ones(3))
    for state, factor in zip(states, factors, strict=True):
        assert factor * state.forces == pytest.approx(contact_estimate(state, state.tension), abs=1e-15)


def test_twice_the_size_has_the_same_bits():
    small = pulled(Robot.prototype(model="rod"), SCENES[0], 8.0)
    large_robot = Robot.prototype(model="rod", length_mm=360.0, offset_mm=16.0, rigidity=20_000.0)
    large = pulled(large_robot, Scene([Circle(center=(88, 208), radius=30)]), 16.0, 0.5)
    assert np.array_equal(contact_estimate(small, small.tension), contact_estimate(large, large.tension))


def test_rigidity_is_ridge_regression():
    generator = np.random.default_rng(0)
    free = generator.uniform(0.1, 2, (12, 4, 1))
    tensions = 1.7 * free + generator.normal(0, 0.02, free.shape)
    touching = generator.random((12, 4)) < 0.3
    fit = RigidityFit.prior(4)
    assert np.array_equal(fit.ratio, np.ones(4))
    for row in range(12):
        fit = fit.updated(tensions[row], free[row], touching[row], tension_noise_n=0.02)
    for robot in range(4):
        rows = ~touching[:, robot]
        design = np.append(free[rows, robot, 0] / 0.02, 1 / SPREAD)
        wanted = np.append(tensions[rows, robot, 0] / 0.02, 1 / SPREAD)
        assert fit.ratio[robot] == pytest.approx(np.linalg.lstsq(design[:, None], wanted, rcond=None)[0][0])


def test_rigidity_stays_while_anything_touches():
    before = RigidityFit.prior(2)
    after = before.updated(np.array([[2.0], [2.0]]), np.array([[1.0], [1.0]]), np.array([True, False]), 0.02)
    assert after.ratio[0] == 1
    assert after.ratio[1] == pytest.approx(2, abs=1e-3)


def errors_on_random_scenes(scenes):
    """True force [N] and relative errors of (contact, shape, paper) of a rod that is pulled into random circles.

    Rigidity 0.3 to 3 times its nominal value, noise of 20 mN on the tension and of 0.5° on every disk's angle.
    """
    generator, robot, errors = np.random.default_rng(0), Robot.prototype(model="rod"), []
    noise = 0.02
    for _ in range(scenes):
        low, high = (35, 75, 10), (75, 150, 16)
        circles = generator.uniform(low, high, (generator.integers(1, 4), 3))
        scene = Scene(Circle(center=(x, y), radius=r) for x, y, r in circles)
        if clearance(robot, scene, 0.0) < 1:
            continue
        rigidity, fit, onset = math.exp(generator.uniform(math.log(0.3), math.log(3))), RigidityFit.prior(), None
        solver = Solver(robot, scene)
        state = solver.rest()
        for cable in np.arange(0.25, 12, 0.25):
            state = solver.step(state, float(cable))
            tension = rigidity * state.tension + generator.normal(0, noise)
            nodes = state.nodes.copy()
            nodes[1:, 2] += generator.normal(0, math.radians(0.5), robot.segments)
            free = free_motion(robot, state.cable_mm, state.length_mm).tensions
            fit = fit.updated(np.array([tension]), free, state.contact.any(), noise)
            force = rigidity * np.linalg.norm(state.forces)
            if force > 0.02:
                onset = rigidity * state.onset_tension + generator.normal(0, noise) if onset is None else onset
                k = float(fit.ratio)
                estimates = (
                    contact_estimate(state, tension, k),
                    shape_estimate(state, nodes, tension, k),
                    VirtualWork().estimate(state) * (tension - onset) / (state.tension - state.onset_tension),
                )
                errors.append([force, *(np.linalg.norm(estimate) / force - 1 for estimate in estimates)])
    return np.array(errors)


def test_median_errors_with_unknown_rigidity_and_noise():
    """Design values: contact 4 %, shape 1.7 %, the paper's 10 %; the targets of the tasks are 20 to 150 mN."""
    force, *errors = np.abs(errors_on_random_scenes(80)).T
    assert len(force) > 1500
    contact, shape, paper = np.median(errors, axis=1)
    assert contact < 0.055
    assert shape < 0.017
    assert 0.08 < paper < 0.12
    target = (force > 0.02) & (force < 0.15)
    assert target.sum() > 300
    assert np.median(errors[0][target]) < 0.045


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda state: contact_estimate(None, 1.0), TypeError, "nominal"),
        (lambda state: contact_estimate(state, math.nan), ValueError, "tension is nan; it must be finite"),
        (lambda state: contact_estimate(state, 1.0, 0.0), ValueError, "rigidity_ratio is 0.0; it must be positive"),
        (lambda state: shape_estimate(state, state.nodes[1:], 1.0), ValueError, r"nodes .*\(19, 3\)"),
        (lambda state: RigidityFit.prior().updated(np.ones(1), np.ones(1), False, 0.0), ValueError, "tension_noise_n"),
    ],
)
def test_mistakes_are_named(call, error, words):
    state = pulled(replace(Robot.prototype(model="paper"), model="rod"), SCENES[0], 6.0)
    with pytest.raises(error, match=words):
        call(state)
