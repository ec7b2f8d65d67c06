"""Forces against the virtual work they stand for, and against the paper's Table 1."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver import Capsule, Circle, Ellipse, Equilibrium, HalfPlane, Polygon, Robot, Scene, Solver
from solver.forces import Onset, VirtualWork, force_true
from solver.formulation import node_derivatives
from solver.free import fitted_slopes, tip_slopes
from solver.robot import CABLES

SCENES = [
    Scene([Circle(center=(44, 104), radius=15)]),
    Scene([Circle(center=(33, 89), radius=12.5), Circle(center=(59, 140), radius=15)]),
    Scene([HalfPlane(point=(31, 127), normal=(-1, 0), nodes=(14,))]),
    Scene(
        [
            Circle(center=(33, 89), radius=12.5, stiffness=0.3),
            Ellipse(center=(59, 140), radii=(16, 12), stiffness=((2, 0.5), (0.5, 1))),
            Capsule(start=(70, 60), end=(80, 70), radius=8),
            Polygon(corners=((70, 100), (80, 100), (75, 110)), radius=4),
        ]
    ),
]
EVERY_SCENE = pytest.mark.parametrize("scene", SCENES)
EVERY_CABLE = pytest.mark.parametrize("cable", CABLES)


def pulled(scene: Scene, cable_mm: float, step: float = 0.25, cable: str = "uniform"):
    solver = Solver(replace(Robot.prototype(max_tension=math.inf), cable=cable), scene)
    before, now, onset = solver.rest(), solver.rest(), Onset()
    while now.cable_mm < cable_mm - 1e-9:
        before, now = now, solver.step(now, min(now.cable_mm + step, cable_mm))
        onset = onset.after(before, now)
    return solver, now, onset


@EVERY_SCENE
def test_force_is_stiffness_times_multiplier(scene):
    _, equilibrium, _ = pulled(scene, 9.0)
    for force, multipliers in zip(force_true(equilibrium), equilibrium.multipliers, strict=True):
        assert np.linalg.norm(force) <= equilibrium.stiffness * multipliers.sum() * (1 + 1e-12)
    assert np.linalg.norm(force_true(equilibrium).sum(axis=0)) > 0


@EVERY_CABLE
@EVERY_SCENE
def test_work_of_tension_and_contact_is_the_change_of_energy(cable, scene):
    """B(∂J/∂q·q' + ∂J/∂l) = T + Σ F_j·x_j' for any admissible direction (q', 1), in node coordinates."""
    _, equilibrium, _ = pulled(scene, 9.0, cable=cable)
    robot, n = equilibrium.robot, equilibrium.robot.segments
    unknowns, parameters, _, _ = equilibrium.node_solution()
    slope, _, held, _, gaps = (
        v.full() for v in node_derivatives(robot, scene.laws, scene.mounted)(unknowns, parameters)
    )
    # Admissible: backbone and disks keep their lengths; the cable shortens, by 1/n in each segment or as a whole.
    shortening = np.zeros(3 * n)
    if cable == "sliding":
        held, gaps, shortening = np.vstack([held, gaps[:1]]), gaps[1:], np.r_[shortening, 1.0]
    else:
        shortening[n : 2 * n] = -1.0 / n
    null = np.linalg.svd(held)[2][len(held) :]
    generator = np.random.default_rng(0)
    for _ in range(10):
        direction = np.linalg.lstsq(held, shortening, rcond=None)[0] + generator.normal(size=len(null)) @ null
        work = equilibrium.stiffness * float(equilibrium.multipliers[:, :, 1:].ravel() @ (gaps @ direction))
        change = equilibrium.stiffness * float(slope.ravel() @ direction)
        assert change == pytest.approx(equilibrium.tension + work, abs=1e-8)


@EVERY_CABLE
@EVERY_SCENE
def test_tension_is_the_slope_of_the_energy_along_the_branch(cable, scene):
    solver, equilibrium, _ = pulled(scene, 9.1, cable=cable)
    ahead, behind = (solver.step(equilibrium, equilibrium.cable_mm + h) for h in (1e-4, -1e-4))
    slope = (ahead.energy - behind.energy) / 2e-4
    assert slope == pytest.approx(equilibrium.tension, rel=1e-6)


def test_onset_does_not_depend_on_the_increment():
    onsets = [pulled(SCENES[2], 6.0, step)[2].tension for step in (0.05, 0.25, 0.5)]
    assert onsets == pytest.approx([onsets[0]] * 3, rel=1e-6)


def test_onset_is_forgotten_when_contact_ends():
    solver, equilibrium, onset = pulled(SCENES[0], 7.0)
    assert onset.tension is not None
    released = solver.step(equilibrium, 2.0)
    assert onset.after(equilibrium, released) == Onset()
    assert not VirtualWork().estimate(released, Onset()).any()
    assert not force_true(released).any()


def test_estimate_on_a_wall_is_equation_11():
    _, equilibrium, onset = pulled(SCENES[2], 7.0)
    x, y, turn = tip_slopes(equilibrium.robot, equilibrium.cable_mm)
    load = equilibrium.tension - onset.tension
    for friction in (0.0, 0.4):
        horizontal = equilibrium.robot.offset_mm * load * turn / (friction * y + x)
        force = VirtualWork(friction).estimate(equilibrium, onset)[0]
        assert force == pytest.approx([horizontal, friction * horizontal])
    assert horizontal < 0  # the wall pushes the robot back


@EVERY_SCENE
def test_estimate_knows_nothing_of_the_material(scene):
    _, equilibrium, onset = pulled(scene, 8.0)
    stiffer = replace(equilibrium.robot, rigidity=3 * equilibrium.robot.rigidity)
    springs = (None if o.stiffness is None else 3 * o.stiffness_matrix for o in scene)
    scaled = Scene(replace(o, stiffness=k) for o, k in zip(scene, springs, strict=True))
    block = equilibrium.block.copy()
    block[2] *= 3
    same = Equilibrium(stiffer, scaled, block, equilibrium.status, 0)
    estimate = VirtualWork().estimate(equilibrium, onset)
    assert estimate.any()
    assert VirtualWork().estimate(same, Onset(3 * onset.tension)) == pytest.approx(3 * estimate, rel=1e-12)
    assert max(same.residuals()) < 1e-8


def test_estimate_with_straight_line_slopes():
    _, equilibrium, onset = pulled(SCENES[2], 7.0)
    fitted = VirtualWork(0.4, fit_range_mm=(0.0, 8.0))
    x, y, turn = fitted_slopes(equilibrium.robot, 0.0, 8.0)
    horizontal = equilibrium.robot.offset_mm * (equilibrium.tension - onset.tension) * turn / (0.4 * y + x)
    assert fitted.estimate(equilibrium, onset)[0] == pytest.approx([horizontal, 0.4 * horizontal])
    narrow = VirtualWork(0.4, fit_range_mm=(6.999, 7.001)).estimate(equilibrium, onset)
    assert narrow == pytest.approx(VirtualWork(0.4).estimate(equilibrium, onset), rel=1e-6)


def test_estimate_shares_one_load_among_several_contacts():
    """The work of all estimated forces on the free tip is that of the load, and each follows its multipliers."""
    _, equilibrium, onset = pulled(SCENES[1], 5.0, step=0.05)
    forces, energy = VirtualWork().estimate(equilibrium, onset), force_true(equilibrium)
    assert np.all(np.linalg.norm(forces, axis=1) > 0)
    slopes = tip_slopes(equilibrium.robot, equilibrium.cable_mm)
    load = equilibrium.tension - onset.tension
    assert (forces @ slopes[:2]).sum() == pytest.approx(equilibrium.robot.offset_mm * load * slopes[2])
    ratio = forces[energy != 0] / energy[energy != 0]
    assert ratio == pytest.approx(ratio[0], rel=1e-9)


def test_table_1_theoretical_column_from_one_calibration_point():
    """Paper, Table 1: μ from d = 31 mm, 250 g → 17.8 g, then the theoretical column within its rounding."""
    robot = Robot.prototype()
    slopes = tip_slopes(robot, 3.5)
    estimator = VirtualWork.calibrated(17.8, 250.0, slopes, robot.offset_mm)
    x, y, turn = slopes
    column = [-robot.offset_mm * load * turn / (estimator.friction * y + x) for load in range(50, 351, 50)]
    assert column == pytest.approx([3.5, 7.1, 10.7, 14.2, 17.8, 21.3, 24.9], abs=0.1)
    with pytest.raises(ValueError, match="positive"):
        VirtualWork.calibrated(0.0, 250.0, slopes, robot.offset_mm)
