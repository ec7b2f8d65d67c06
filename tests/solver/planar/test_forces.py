"""Forces against the virtual work they stand for, and against the paper's Table 1."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import Capsule, Circle, Ellipse, Equilibrium, HalfPlane, Polygon, Robot, Scene, Solver
from solver.common.robot import MODELS
from solver.planar.forces import VirtualWork, force_true, onset_tension
from solver.planar.formulation import node_derivatives, robot_inequality_count
from solver.planar.free import fitted_slopes, tip_slopes
from solver.planar.layout import layout

SCENES = [
    Scene([Circle(center=(44, 104), radius=15)]),
    Scene([Circle(center=(33, 89), radius=12.5), Circle(center=(59, 140), radius=15)]),
    Scene([HalfPlane(point=(31, 127), normal=(-1, 0), nodes=(14,))]),
    Scene(
        [
            Circle(center=(33, 89), radius=12.5, spring=0.3),
            Ellipse(center=(59, 140), radii=(16, 12), spring=((2, 0.5), (0.5, 1))),
            Capsule(start=(70, 60), end=(80, 70), radius=10.5),
            Polygon(corners=((70, 100), (80, 100), (75, 110)), radius=8),
        ]
    ),
]
EVERY_SCENE = pytest.mark.parametrize("scene", SCENES)
EVERY_MODEL = pytest.mark.parametrize("model", MODELS)


def pulled(scene: Scene, cable_mm: float, step: float = 0.25, model: str = "paper"):
    solver = Solver(replace(Robot.prototype(model="paper", max_tension=math.inf), model=model), scene)
    now = solver.rest()
    while now.cable_mm < cable_mm - 1e-9:
        now = solver.step(now, min(now.cable_mm + step, cable_mm))
    return solver, now


@EVERY_SCENE
def test_force_is_stiffness_times_multiplier(scene):
    _, equilibrium = pulled(scene, 9.0)
    for force, multipliers in zip(force_true(equilibrium), equilibrium.multipliers, strict=True):
        assert np.linalg.norm(force) <= equilibrium.energy_scale * multipliers.sum() * (1 + 1e-12)
    assert np.linalg.norm(force_true(equilibrium).sum(axis=0)) > 0


@EVERY_MODEL
@EVERY_SCENE
def test_work_of_tension_and_contact_is_the_change_of_energy(model, scene):
    """B(∂J/∂q·q' + ∂J/∂l) = T + Σ F_j·x_j' for any admissible direction (q', 1), in node coordinates."""
    _, equilibrium = pulled(scene, 9.0, model=model)
    robot, n = equilibrium.robot, equilibrium.robot.segments
    unknowns, parameters, _, _ = equilibrium.node_solution()
    slope, _, equality_slopes, _, gaps = (
        v.full() for v in node_derivatives(robot, scene.laws, scene.mounted)(unknowns, parameters)
    )
    # Admissible: backbone and disks keep their lengths; the cable shortens, by 1/n in each segment or as a whole.
    shortening = np.zeros(3 * n)
    if model == "rod":
        equality_slopes, gaps, shortening = (
            np.vstack([equality_slopes, gaps[:1]]),
            gaps[robot_inequality_count(robot) :],
            np.r_[shortening, 1.0],
        )
    else:
        shortening[n : 2 * n] = -1.0 / n
    null = np.linalg.svd(equality_slopes)[2][len(equality_slopes) :]
    generator = np.random.default_rng(0)
    for _ in range(10):
        direction = (
            np.linalg.lstsq(equality_slopes, shortening, rcond=None)[0] + generator.normal(size=len(null)) @ null
        )
        work = equilibrium.energy_scale * float(equilibrium.multipliers[:, :, 1:].ravel() @ (gaps @ direction))
        change = equilibrium.energy_scale * float(slope.ravel() @ direction)
        assert change == pytest.approx(equilibrium.tension + work, abs=1e-8)


@EVERY_MODEL
@EVERY_SCENE
def test_tension_is_the_slope_of_the_energy_along_the_branch(model, scene):
    solver, equilibrium = pulled(scene, 9.1, model=model)
    ahead, behind = (solver.step(equilibrium, equilibrium.cable_mm + h) for h in (1e-4, -1e-4))
    slope = (ahead.energy - behind.energy) / 2e-4
    assert slope == pytest.approx(equilibrium.tension, rel=1e-6)


@EVERY_MODEL
@EVERY_SCENE
def test_kernel_reads_forces_slopes_and_onset(model, scene):
    """As they follow from the multipliers, the closed form of the free robot, and the way there."""
    robot = replace(Robot.prototype(model="paper"), model=model, length_range_mm=(150, 200))
    solver = Solver(robot, scene)
    now = solver.rest()
    for pulled_to, length in [(2.0, 180), (4.0, 181), (6.0, 182), (9.0, 180), (5.0, 179), (1.0, 180)]:
        before, now = now, solver.step(now, pulled_to, length)
        forces = np.zeros((len(scene), 2))
        for j, line, position in np.argwhere(now.contact):
            normal = scene.obstacles[j].normal_at(now.points[line, position] - now.displacements[j])
            forces[j] += now.energy_scale * now.multipliers[j, line, position] * normal
        assert now.forces == pytest.approx(forces, abs=1e-12)
        places = layout(robot, len(scene))
        assert places.force(now.block) == pytest.approx(forces.sum(axis=0), abs=1e-12)
        assert places.clearance(now.block)[0] == now.gaps.min()
        assert np.array_equal(places.flags(now.block), now.contact.any(axis=0).ravel())
        assert now.tip_slopes == pytest.approx(tip_slopes(robot.at(length), now.cable_mm), rel=1e-10)
        assert now.onset_tension == pytest.approx(onset_tension(before, now), rel=1e-5)


def test_onset_does_not_depend_on_the_increment():
    onsets = [pulled(SCENES[2], 6.0, step)[1].onset_tension for step in (0.05, 0.25, 0.5)]
    assert onsets == pytest.approx([onsets[0]] * 3, rel=1e-6)


def test_onset_is_forgotten_when_contact_ends():
    solver, equilibrium = pulled(SCENES[0], 7.0)
    assert equilibrium.onset_tension > 0
    released = solver.step(equilibrium, 2.0)
    assert released.onset_tension == 0
    assert not VirtualWork().estimate(released).any()
    assert not force_true(released).any()


def test_estimate_on_a_wall_is_equation_11():
    _, equilibrium = pulled(SCENES[2], 7.0)
    x, y, turn = tip_slopes(equilibrium.robot, equilibrium.cable_mm)
    load = equilibrium.tension - equilibrium.onset_tension
    for friction in (0.0, 0.4):
        horizontal = equilibrium.robot.offset_mm * load * turn / (friction * y + x)
        force = VirtualWork(friction).estimate(equilibrium)[0]
        assert force == pytest.approx([horizontal, friction * horizontal])
    assert horizontal < 0  # the wall pushes the robot back


@EVERY_SCENE
def test_estimate_knows_nothing_of_the_material(scene):
    _, equilibrium = pulled(scene, 8.0)
    stiffer = replace(equilibrium.robot, rigidity=3 * equilibrium.robot.rigidity)
    springs = (None if o.spring is None else 3 * o.spring_matrix for o in scene)
    scaled = Scene(replace(o, spring=k) for o, k in zip(scene, springs, strict=True))
    block = equilibrium.block.copy()
    places = layout(stiffer, len(scene))
    for scaling in (places.tensions, places.onset, places.forces, places.force):
        scaling(block)[:] *= 3
    same = Equilibrium(stiffer, scaled, block, equilibrium.status, 0)
    estimate = VirtualWork().estimate(equilibrium)
    assert estimate.any()
    assert VirtualWork().estimate(same) == pytest.approx(3 * estimate, rel=1e-12)
    assert max(same.residuals()) < 1e-8


def test_estimate_with_straight_line_slopes():
    _, equilibrium = pulled(SCENES[2], 7.0)
    fitted = VirtualWork(0.4, fit_range_mm=(0.0, 8.0))
    x, y, turn = fitted_slopes(equilibrium.robot, 0.0, 8.0)
    horizontal = equilibrium.robot.offset_mm * (equilibrium.tension - equilibrium.onset_tension) * turn / (0.4 * y + x)
    assert fitted.estimate(equilibrium)[0] == pytest.approx([horizontal, 0.4 * horizontal])
    narrow = VirtualWork(0.4, fit_range_mm=(6.999, 7.001)).estimate(equilibrium)
    assert narrow == pytest.approx(VirtualWork(0.4).estimate(equilibrium), rel=1e-6)


def test_estimate_shares_one_load_among_several_contacts():
    """The work of all estimated forces on the free tip is that of the load, and each follows its multipliers."""
    _, equilibrium = pulled(SCENES[1], 5.0, step=0.05)
    forces, energy = VirtualWork().estimate(equilibrium), force_true(equilibrium)
    assert np.all(np.linalg.norm(forces, axis=1) > 0)
    slopes = tip_slopes(equilibrium.robot, equilibrium.cable_mm)
    load = equilibrium.tension - equilibrium.onset_tension
    assert (forces @ slopes[:2]).sum() == pytest.approx(equilibrium.robot.offset_mm * load * slopes[2])
    ratio = forces[energy != 0] / energy[energy != 0]
    assert ratio == pytest.approx(ratio[0], rel=1e-9)


def test_table_1_theoretical_column_from_one_calibration_point():
    """Paper, Table 1: μ from d = 31 mm, 250 g → 17.8 g, then the theoretical column within its rounding."""
    robot = Robot.prototype(model="paper")
    slopes = tip_slopes(robot, 3.5)
    estimator = VirtualWork.calibrated(17.8, 250.0, slopes, robot.offset_mm)
    x, y, turn = slopes
    column = [-robot.offset_mm * load * turn / (estimator.friction * y + x) for load in range(50, 351, 50)]
    assert column == pytest.approx([3.5, 7.1, 10.7, 14.2, 17.8, 21.3, 24.9], abs=0.1)
    with pytest.raises(ValueError, match="positive"):
        VirtualWork.calibrated(0.0, 250.0, slopes, robot.offset_mm)
