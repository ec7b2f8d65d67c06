"""The rod's problem in node coordinates: certificate of the kernel's states, and IPOPT on the same branches."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import null_space
from truth import robots
from truth.recorded import RECORDED, approach, pulls_along, read_states

from solver import (
    Cable,
    Capsule,
    Circle,
    Custom,
    Ellipse,
    Family,
    HalfPlane,
    Load,
    Polygon,
    ReferenceSolver,
    Robot,
    Scene,
    Solver,
    Status,
    spatial,
)
from solver.planar.formulation import kkt_derivatives as planar_kkt
from solver.planar.formulation import node_problem as planar_problem
from solver.planar.formulation import robot_inequality_count
from solver.spatial.formulation import kkt_derivatives as spatial_kkt
from solver.spatial.formulation import node_problem as spatial_problem
from solver.spatial.rod_formulation import rod_inequality_count

CERTIFIED = 1e-9  # in natural units
PAIR = (Cable(), Cable(angle=math.pi))
SECTIONS = (*PAIR, Cable(end=9, offset_mm=6.0))
THIRDS = tuple(2 * math.pi / 3 * k for k in range(3))
PLANAR = Robot.prototype(
    model="rod",
    cables=SECTIONS,
    between=1,
    segment_rigidity=(6000.0,) * 9 + (3500.0,) * 9,
    precurvature=0.01,
    weight_per_length=(1e-4, -2e-4),
    loads=(Load(node=18, force=(0.02, 0.03), moment=1.5, at=(8.0, math.pi)), Load(node=7, force=(0.0, -0.02))),
)
SPATIAL = spatial.SpatialRobot.prototype(
    model="rod",
    cables=(*(Cable(angle=angle) for angle in THIRDS), *(Cable(angle=angle + 0.4, end=9) for angle in THIRDS)),
    precurvature=(0.01, -0.005, 0.008),
    weight_per_length=(1e-4, 1e-4, -2e-4),
    loads=(Load(node=18, force=(0.02, -0.01, 0.03), at=(8.0, 1.0)),),
)
OVAL = Family.trace(lambda point, sizes: (point[0] / sizes[0]) ** 4 + (point[1] / sizes[1]) ** 2 - 1, sizes=2)
SPRING = ((0.4, 0.1), (0.1, 0.2))
SOFT = ((0.4, 0.1, 0.0), (0.1, 0.2, 0.05), (0.0, 0.05, 0.3))
PLANAR_SHAPES = [
    Circle(center=(44, 104), radius=15),
    Circle(center=(44, 104), radius=15, spring=SPRING),
    Ellipse(center=(44, 104), radii=(15, 9), axis=(1, 2), spring=1.0),
    Capsule(start=(40, 100), end=(52, 112), radius=8),
    Polygon(corners=((36, 98), (52, 98), (52, 110), (40, 112)), radius=4),
    HalfPlane(point=(31, 127), normal=(-1, 0.2), nodes=(14,), spring=SPRING),
    Custom(family=OVAL, sizes=(16, 11), center=(44, 104), axis=(1, 2), reach=20),
    Custom(family=OVAL, sizes=(16, 11), center=(44, 104), axis=(1, 2), reach=20, spring=SPRING),
]
SPATIAL_SHAPES = [
    spatial.Sphere(center=(40, 18, 104), radius=15, spring=SOFT),
    spatial.Capsule(start=(38, 30, 100), end=(44, 0, 108), radius=12),
    spatial.Cylinder(start=(30, 35, 100), end=(48, -5, 108), radius=12, edge=3, spring=0.5),
    spatial.Box(center=(40, 18, 104), sizes=(26, 30, 28), edge=6, axis=(1, 0.3, 0.2)),
    spatial.HalfSpace(point=(31, 12, 127), normal=(-1, -0.3, 0.2), nodes=(14,)),
]
PULLED = {Robot: (9.0, -12.0, 2.5), spatial.SpatialRobot: (7.5, 0.0, -11.0, 1.0, -4.0, -6.0)}


def kernel_of(robot, scene):
    return (Solver if isinstance(robot, Robot) else spatial.SpatialSolver)(robot, scene)


def reference_of(robot, scene):
    return (ReferenceSolver if isinstance(robot, Robot) else spatial.SpatialReferenceSolver)(robot, scene)


def solvers(robot, scene):
    """Kernel and reference solver of a robot, which takes seconds to build."""
    return kernel_of(robot, scene), reference_of(robot, scene)


def certificate(equilibrium):
    """The residuals of the node-coordinate problem in natural units."""
    length, residuals = equilibrium.length_mm, equilibrium.residuals()
    return max(np.array(residuals) * [length, 1 / length, 1 / length, 1.0, length])


def least_curvature(equilibrium):
    """The least eigenvalue of the Lagrangian's Hessian on the motions that the active constraints leave, times a²."""
    robot, scene = equilibrium.robot, equilibrium.scene
    kkt = (planar_kkt if isinstance(robot, Robot) else spatial_kkt)(robot, scene.laws, scene.mounted)
    unknowns, parameters, tensions, multipliers = equilibrium.node_solution()
    slopes = kkt(unknowns, parameters, tensions, multipliers)[0].full()
    hessian, equalities, inequalities = np.split(slopes, np.cumsum([unknowns.size, tensions.size]))
    motions = null_space(np.vstack([equalities, inequalities[multipliers > 0]]))
    return robot.offset_mm**2 * np.linalg.eigvalsh(motions.T @ hessian @ motions)[0]


def pull(solver, steps=30, share=1.0):
    """Yield the states of a straight pull from rest to the displacements of the robot's kind."""
    equilibrium = solver.rest()
    start, end = equilibrium.cables_mm, share * np.array(PULLED[type(solver.robot)])
    for part in np.linspace(0, 1, steps + 1)[1:]:
        equilibrium = solver.step(equilibrium, (1 - part) * start + part * end)
        yield equilibrium


def assert_same(ours, theirs):
    """Compare two states of a robot in natural units."""
    robot = ours.robot
    assert theirs.nodes == pytest.approx(ours.nodes, rel=0, abs=1e-8 * robot.length_mm)
    unit = robot.rigidity / robot.length_mm
    assert theirs.tensions == pytest.approx(ours.tensions, rel=0, abs=1e-7 * unit / robot.offset_mm)
    assert theirs.forces == pytest.approx(ours.forces, rel=0, abs=1e-7 * unit / robot.length_mm)
    assert theirs.displacements == pytest.approx(ours.displacements, rel=0, abs=1e-7 * robot.length_mm)
    assert theirs.objective == pytest.approx(ours.objective, rel=1e-7, abs=1e-9)
    assert theirs.energy == pytest.approx(ours.energy, rel=1e-7, abs=1e-9 * unit)
    assert theirs.slacks_mm == pytest.approx(ours.slacks_mm, rel=0, abs=1e-8 * robot.length_mm)


@pytest.mark.parametrize("name", RECORDED)
def test_recorded_states_are_certified(name):
    spec = robots.require(RECORDED[name]["spec"])
    for state, equilibrium in read_states(RECORDED[name]):
        assert certificate(equilibrium) <= CERTIFIED
        assert equilibrium.slacks_mm == pytest.approx(np.array(state["slack_mm"]), abs=1e-8 * sum(spec["segment_mm"]))


ONE_OF_EACH_FAMILY = pytest.mark.parametrize(
    "name", ["a04", "b02", "c02", "d02", "e04", "f00", "g02", "h02", "i00", "j00", "k00"]
)


@ONE_OF_EACH_FAMILY
def test_recorded_states_are_minima(name):
    """No motion that keeps the taut cables and the contacts lowers the energy."""
    robots.require(RECORDED[name]["spec"])
    for _, equilibrium in read_states(RECORDED[name]):
        assert least_curvature(equilibrium) > 1e-6


@ONE_OF_EACH_FAMILY
def test_reference_follows_the_recorded_paths(name):
    """One path of each family from rest, in steps that the reference solver divides by itself."""
    spec = robots.require(RECORDED[name]["spec"])
    kernel, reference = solvers((solver := robots.make_solver(spec)).robot, solver.scene)
    here, there = kernel.rest(), reference.rest()
    assert there.nodes == pytest.approx(here.nodes, abs=1e-8 * kernel.robot.length_mm)
    _, pulls = pulls_along(spec, 40)
    for k, target in enumerate([*approach(spec), *pulls]):
        here = kernel.step(here, robots.command(spec, target))
        assert here.status is Status.CONVERGED
        if k % 10 == 9:
            there = reference.step(there, robots.command(spec, target))
            assert there.status is Status.CONVERGED
            assert_same(here, there)
            assert certificate(there) <= CERTIFIED


AMONG_SHAPES = [*((PLANAR, shape) for shape in PLANAR_SHAPES), *((SPATIAL, shape) for shape in SPATIAL_SHAPES)]


def label(value):
    return value.kind + ("" if value.spring is None else " on a spring") if hasattr(value, "kind") else ""


@pytest.mark.parametrize(("robot", "obstacle"), AMONG_SHAPES, ids=label)
def test_several_cables_and_loads_among_shapes(robot, obstacle):
    *states, last = pull(kernel_of(robot, Scene([obstacle])))
    assert last.contact.any()
    assert all(certificate(state) <= CERTIFIED for state in states[::5])
    assert certificate(last) <= CERTIFIED


@pytest.mark.parametrize(
    ("robot", "obstacle"),
    [
        pytest.param(
            robot, shape, marks=[] if label(shape) in ("circle on a spring", "custom", "box") else pytest.mark.long
        )
        for robot, shape in AMONG_SHAPES
    ],
    ids=label,
)
def test_the_reference_solver_among_shapes(robot, obstacle):
    kernel, reference = solvers(robot, Scene([obstacle]))
    *_, before, last = pull(kernel)
    assert last.contact.any()
    assert_same(last, reference.step(before, last.cables_mm))


@pytest.mark.parametrize("robot", [PLANAR, SPATIAL], ids=["plane", "space"])
def test_rest_and_free_pull(robot):
    kernel, reference = solvers(robot, Scene())
    assert_same(kernel.rest(), reference.rest())
    (ours,), (theirs,) = (pull(solver, 1, 0.3) for solver in (kernel, reference))
    assert_same(ours, theirs)


@pytest.mark.parametrize("robot", [PLANAR, SPATIAL], ids=["plane", "space"])
def test_energy_grows_by_the_work_of_the_cables(robot):
    """Its slope in a displacement is the tension, loads and springs included."""
    obstacle = PLANAR_SHAPES[1] if robot is PLANAR else SPATIAL_SHAPES[0]
    kernel = kernel_of(robot, Scene([obstacle]))
    *_, here = pull(kernel)
    for k, change in enumerate(1e-4 * np.eye(len(robot.cables))):
        ahead, behind = (kernel.step(here, here.cables_mm + by) for by in (change, -change))
        assert (ahead.energy - behind.energy) / 2e-4 == pytest.approx(here.tensions[k], rel=1e-6, abs=1e-6)


def test_energy_of_loads():
    """A straight robot that carries its weight and a force at its tip, by hand."""
    robot = Robot.prototype(
        model="rod", weight_per_length=(0.0, -1e-4), loads=(Load(node=18, force=(0.0, 0.02)),), rigidity=1e7
    )
    rest = Solver(robot, Scene()).rest()
    assert rest.objective == pytest.approx(0, abs=1e-20)
    assert rest.energy == pytest.approx(1e-4 * 180**2 / 2 - 0.02 * 180)


def test_a_robot_that_its_loads_press_against_a_wall_is_at_rest():
    """It lies on the wall to roundoff on either side."""
    for weight in np.linspace(3e-4, 1e-3, 8):
        robot = Robot.prototype(model="rod", weight_per_length=(weight, -weight))
        scene = Scene([HalfPlane(point=(10.5, 150), normal=(-1, 0))])
        for solver in solvers(robot, scene):
            rest = solver.rest()
            assert rest.contact.any()
            assert certificate(rest) <= CERTIFIED


@pytest.mark.parametrize("robot", [PLANAR, SPATIAL], ids=["plane", "space"])
def test_reference_stalls_at_the_limit(robot):
    """All cables stop where the first one reaches it."""
    limited = replace(robot, max_tension=2.0)
    (stalled,) = pull(reference_of(limited, Scene()), 1)
    assert stalled.status is Status.STALLED
    assert stalled.tensions.max() == pytest.approx(2.0, rel=1e-5)
    assert certificate(stalled) <= CERTIFIED


@pytest.mark.parametrize("robot", [replace(PLANAR, length_range_mm=(120, 180)), PLANAR], ids=["insertion", "fixed"])
def test_insertion(robot):
    kernel, reference = solvers(robot, Scene([Circle(center=(44, 104), radius=15)]))
    *_, here = pull(kernel)
    shortest, _ = robot.lengths_mm
    ours, theirs = (solver.step(here, here.cables_mm, max(170.0, shortest)) for solver in (kernel, reference))
    assert_same(ours, theirs)


@pytest.mark.parametrize("robot", [PLANAR, SPATIAL], ids=["plane", "space"])
def test_order_of_the_inequalities(robot):
    """Slacks of the cables, gaps between disks, then gaps to obstacles."""
    is_plane = robot is PLANAR
    scene = Scene([PLANAR_SHAPES[0] if is_plane else SPATIAL_SHAPES[1]])
    problem = (planar_problem if is_plane else spatial_problem)(robot, scene.laws, scene.mounted)
    count, cables = (robot_inequality_count if is_plane else rod_inequality_count)(robot), len(robot.cables)
    values = ca.Function("values", [problem.unknowns, problem.parameters], [problem.inequalities, problem.objective])
    *_, equilibrium = pull(kernel_of(robot, scene))
    unknowns, parameters, _, multipliers = equilibrium.node_solution()
    inequalities, objective = (value.full().ravel() for value in values(unknowns, parameters))
    assert count == cables + (2 if is_plane else 1) * robot.segments
    assert inequalities[:cables] == pytest.approx(equilibrium.slacks_mm, abs=1e-10)
    assert inequalities[cables:count].min() > 0
    assert inequalities[count:] == pytest.approx(equilibrium.gaps[:, :, 1:].ravel(), abs=1e-9)
    assert multipliers[:cables] * equilibrium.energy_scale == pytest.approx(equilibrium.tensions)
    assert objective.item() * equilibrium.energy_scale == pytest.approx(equilibrium.energy)
    assert equilibrium.pulled.shape == (cables, robot.segments + 1, 2 if is_plane else 3)


def test_disks_of_a_rod_in_space_that_meet():
    """Their multipliers are certified, and those of the reference solver."""
    robot = spatial.SpatialRobot.prototype(
        model="rod", disk_radius_mm=20.0, disk_thickness_mm=4.0, max_cable_mm=60.0, max_tension=60.0
    )
    kernel, reference = solvers(robot, Scene([spatial.Sphere(center=(40, 18, 70), radius=15)]))
    here = kernel.rest()
    for part in np.linspace(0, 1, 101)[1:]:
        before, here = here, kernel.step(here, (40.0 * part, 20.0 * part))
        if here.disk_multipliers.any() and here.status is Status.CONVERGED:
            break
    assert here.status is Status.CONVERGED
    assert certificate(here) <= CERTIFIED
    again = reference.step(before, here.cables_mm)
    assert_same(here, again)
    assert again.disk_multipliers == pytest.approx(here.disk_multipliers, rel=1e-6, abs=1e-8)


def test_derivatives_in_space_are_smooth_where_nothing_is_bent():
    robot = replace(SPATIAL, precurvature=(0.0, 0.0, 0.0), weight_per_length=(0.0, 0.0, 0.0), loads=())
    problem = spatial_problem(robot, (), ())
    lagrangian = problem.objective + ca.sum1(problem.equalities) + ca.sum1(problem.inequalities)
    hessian = ca.Function(
        "hessian", [problem.unknowns, problem.parameters], [ca.hessian(lagrangian, problem.unknowns)[0]]
    )
    rest = spatial.SpatialSolver(robot, Scene()).rest()
    assert np.isfinite(hessian(*rest.node_solution()[:2]).full()).all()
