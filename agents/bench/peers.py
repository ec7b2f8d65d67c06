"""Other tools on the same robot: CasADi's SQP method on the node problem, and MuJoCo on a chain of hinges.

The SQP method solves the same problem to the same solution. MuJoCo simulates a robot with inertia and soft contacts
until it is at rest; its tendon slides, so it is compared with the rod model. Its hinges replace our arcs: even in exact
equilibrium with a rigid contact, the force differs by some percent at 18 segments, most where it is small. MuJoCo's
parameters were tuned on the path measured here, in its favour.

MuJoCo is optional: ``pip install mujoco``.
"""

import importlib
import importlib.util
import math
import time
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from agents.bench.kernel import PUSHED, timed_step
from agents.files import JsonObject
from solver import Circle, Equilibrium, ReferenceSolver, Robot, Scene, Solver

PULLS = tuple(float(cable) for cable in np.arange(0.25, 8.01, 0.25))  # [mm]
FIRST_PULL = 1.0  # the node problem is compared from here on, as it is degenerate without a pull [mm]
BEAD_MM = 1.0  # radius of the spheres that touch; the obstacle is smaller by this
SUBSTEPS, CHECK, CAP = 50, 5, 1000  # of a fixed pull; between checks for rest; at most
REST = 1e-3  # largest hinge speed of a robot at rest [rad/s]
SQP_OPTIONS: dict[str, object] = {
    "qpsol": "qrqp",
    "qpsol_options": {"print_iter": False, "print_header": False, "print_info": False, "error_on_fail": False},
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
    "print_time": False,
    "error_on_fail": False,
    "record_time": True,
    "expand": True,
    "max_iter": 100,
    "tol_pr": 1e-9,
    "tol_du": 1e-8,
}


class SqpSolver(ReferenceSolver):
    """The reference solver with CasADi's ``sqpmethod`` and exact Hessians instead of IPOPT."""

    _plugin, _options = "sqpmethod", SQP_OPTIONS


def sqp_times(pulls: tuple[float, ...] = PULLS, obstacle: Circle = PUSHED) -> JsonObject:
    """Solve each pull beyond 1 mm by the SQP method, started as the reference solver starts its own.

    Returns:
        For each converged step ``step_ms`` with the initial guess, ``solve_ms`` of the method alone, ``iterations`` and
        ``touching``; ``failures``, the number of other steps; and ``difference_mm``, the largest distance of a node
        from ours.
    """
    robot = Robot.prototype(model="paper", max_tension=math.inf)
    solver, rival = Solver(robot, Scene([obstacle])), SqpSolver(robot, Scene([obstacle]))
    now, failures, difference = _pulled(solver, FIRST_PULL), 0, 0.0
    present, rows = rival._start(now), []
    for cable in (pull for pull in pulls if pull > FIRST_PULL):
        now, begin = solver.step(now, cable), time.perf_counter_ns()
        point = rival._solve(present, cable, now.length_mm)
        elapsed = (time.perf_counter_ns() - begin) / 1e6
        if point is None:
            failures, present = failures + 1, rival._start(now)
            continue
        apart = (point.unknowns - now.node_solution()[0]).reshape(-1, 2)
        difference, present = max(difference, float(np.hypot(*apart.T).max())), point
        rows.append(
            (elapsed, 1e3 * rival._nlp_solver.stats()["t_wall_total"], point.iterations, bool(now.contact.any()))
        )
    names = ("step_ms", "solve_ms", "iterations", "touching")
    columns = {name: [row[i] for row in rows] for i, name in enumerate(names)}
    return {**columns, "failures": failures, "difference_mm": difference}


def _pulled(solver: Solver, cable_mm: float) -> Equilibrium:
    now = solver.rest()
    for part in np.linspace(0, 1, 5)[1:]:
        now = solver.step(now, float(part * cable_mm))
    return now


class Contact(NamedTuple):
    """Softness of a contact in MuJoCo's parameters."""

    solref: str  # time constant [s], damping ratio
    solimp: str  # impedance at the surface and within, width between [m], midpoint, power


CONTACTS = {
    "default": Contact("0.02 1", "0.9 0.95 0.001 0.5 2"),
    "tuned": Contact("0.011 1.1", "0.99 0.999 0.00004 0.5 2"),
    "stiff": Contact("0.011 1", "0.9999 0.9999 0.00001 0.5 2"),
}


@dataclass(frozen=True, slots=True)
class Tuning:
    """Parameters that a quasi-static robot does not have, chosen so that the chain comes to rest in few substeps.

    Attributes:
        timestep: Duration of a substep [s].
        mass: Mass of the robot [kg].
        armature: Inertia added to every hinge [kg·m²].
        damping: Damping of every hinge [N·m·s/rad].
        gain: Gain of the tendon's length [N/m].
        gain_damping: Gain of its rate [N·s/m].
    """

    timestep: float = 0.0055
    mass: float = 0.007
    armature: float = 7e-5
    damping: float = 0.027
    gain: float = 1.1e6
    gain_damping: float = 1.3e4


def chain_xml(robot: Robot, obstacle: Circle | None, contact: Contact, tuning: Tuning) -> str:
    """Return MuJoCo's description of the robot [m, kg, s, rad]: rigid disks, a hinge in the middle of every segment.

    Beads at the backbone and cable points touch the obstacle, without friction, and nothing else.
    """
    n, half, offset = robot.segments, robot.segment_mm / 2e3, robot.offset_mm / 1e3
    mass, inertia = tuning.mass / n, tuning.mass / n * offset**2 / 4
    stiffness = robot.rigidity / robot.segment_mm / 1e3
    bodies = "".join(
        f'<body pos="0 {half if k == 1 else 2 * half} 0">'
        f'<joint axis="0 0 1" stiffness="{stiffness}" damping="{tuning.damping}" armature="{tuning.armature}"/>'
        f'<inertial pos="0 {half} 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>'
        f'<site name="node{k}" pos="0 {half} 0"/><site name="cable{k}" pos="{offset} {half} 0"/>'
        f'<geom pos="0 {half} 0"/><geom pos="{offset} {half} 0"/>'
        for k in range(1, n + 1)
    )
    ball = ""
    if obstacle is not None:
        (x, y), radius = obstacle.center, obstacle.radius - BEAD_MM
        ball = f'<geom pos="{x / 1e3} {y / 1e3} 0" size="{radius / 1e3}" contype="0" conaffinity="1"/>'
    return f"""<mujoco>
      <option timestep="{tuning.timestep}" integrator="implicitfast" gravity="0 0 0"/>
      <default><geom size="{BEAD_MM / 1e3}" condim="1" contype="1" conaffinity="0"
        solref="{contact.solref}" solimp="{contact.solimp}"/></default>
      <worldbody>{ball}<site name="cable0" pos="{offset} 0 0"/>{bodies}{"</body>" * n}</worldbody>
      <tendon><spatial name="cable">{"".join(f'<site site="cable{k}"/>' for k in range(n + 1))}</spatial></tendon>
      <actuator><position tendon="cable" kp="{tuning.gain}" kv="{tuning.gain_damping}"/></actuator>
    </mujoco>"""


class MujocoChain:
    """A robot in MuJoCo that starts straight and at rest.

    Args:
        robot: The robot; its cable slides, whatever its model.
        obstacle: A circle, or ``None``.
        contact: Softness of the contact.
        tuning: Parameters of the simulation.

    Raises:
        ModuleNotFoundError: If MuJoCo is not installed.
    """

    def __init__(
        self, robot: Robot, obstacle: Circle | None, contact: Contact = CONTACTS["tuned"], tuning: Tuning = Tuning()
    ) -> None:
        try:
            self._mujoco = importlib.import_module("mujoco")
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError("this comparison needs MuJoCo: pip install mujoco") from error
        self._robot = robot
        self._model = self._mujoco.MjModel.from_xml_string(chain_xml(robot, obstacle, contact, tuning))
        self._data = self._mujoco.MjData(self._model)

    def pull(self, cable_mm: float, substeps: int = SUBSTEPS) -> int:
        """Command a cable displacement [mm] and simulate; return the number of substeps."""
        self._data.ctrl[0] = (self._robot.length_mm - cable_mm) / 1e3
        self._mujoco.mj_step(self._model, self._data, substeps)
        return substeps

    def settle(self, cable_mm: float) -> int:
        """Command a cable displacement [mm] and simulate until the robot rests; return the substeps, at most CAP."""
        substeps = self.pull(cable_mm, CHECK)
        while not np.abs(self._data.qvel).max() < REST and substeps < CAP:
            substeps += self.pull(cable_mm, CHECK)
        return substeps

    @property
    def tip(self) -> np.ndarray:
        """Backbone point of the last node, ``(2,)`` [mm]."""
        return np.array(self._data.site(f"node{self._robot.segments}").xpos[:2]) * 1e3

    @property
    def force(self) -> float:
        """Magnitude of the contact force [N]."""
        total, wrench = np.zeros(3), np.zeros(6)
        for i, touch in enumerate(self._data.contact):
            self._mujoco.mj_contactForce(self._model, self._data, i, wrench)
            total += touch.frame.reshape(3, 3).T @ wrench[:3]
        return float(np.linalg.norm(total))


def rod() -> Robot:
    """Return the rod model of the prototype without a tension limit."""
    return replace(Robot.prototype(model="paper", max_tension=math.inf), model="rod")


def free_tip_error(cable_mm: float = 8.0) -> float:
    """Return the distance of the tip of MuJoCo's chain from ours without contact [mm]."""
    robot = rod()
    chain = MujocoChain(robot, None)
    for cable in np.linspace(0, cable_mm, 33)[1:]:
        chain.settle(float(cable))
    return float(np.linalg.norm(chain.tip - _pulled(Solver(robot, Scene()), cable_mm).nodes[-1, :2]))


def our_path(repeats: int = 21) -> JsonObject:
    """Return ``steps_per_s`` of our solver on the path of pulls, and its ``forces``, the reference for MuJoCo [N]."""
    solver, forces = Solver(rod(), Scene([PUSHED])), list[float]()
    runs = []
    for _ in range(repeats):
        now, times, forces = solver.rest(), [], []
        for cable in PULLS:
            step = timed_step(solver, now, cable)
            now = step.end
            times.append(step.microseconds / 1e6)
            forces.append(float(np.linalg.norm(now.forces)))
        runs.append(times)
    return {"steps_per_s": _rate(runs), "forces": forces}


def mujoco_path(contact: Contact, settle: bool, forces: list[float], repeats: int = 7) -> JsonObject:
    """Measure MuJoCo on the path of pulls, with a fixed number of substeps each or until it rests.

    Args:
        contact: Softness of the contact.
        settle: Whether to simulate until the robot rests.
        forces: Our force at every pull [N].
        repeats: Number of runs; the median duration of every step counts.

    Returns:
        ``steps_per_s``; ``substeps_median`` and ``substeps_max``; ``unsettled`` pulls that never came to rest;
        ``error_median`` and ``error_p95`` of the force relative to ours, where ours is not zero; ``mismatches``, the
        pulls at which only one of the two touches.
    """
    runs, found, substeps = [], np.empty(0), np.empty(0)
    for _ in range(repeats):
        chain = MujocoChain(rod(), PUSHED, contact)
        rows = [_timed(chain, cable, settle) for cable in PULLS]
        times, substeps, found = np.array(rows).T
        runs.append(times.tolist())
    ours = np.array(forces)
    touching = ours > 0
    errors = np.abs(found[touching] / ours[touching] - 1)
    return {
        "steps_per_s": _rate(runs),
        "substeps_median": float(np.median(substeps)),
        "substeps_max": int(substeps.max()),
        "unsettled": int((substeps >= CAP).sum()),
        "error_median": float(np.median(errors)),
        "error_p95": float(np.percentile(errors, 95)),
        "mismatches": int(((found > 0) != touching).sum()),
    }


def _timed(chain: MujocoChain, cable: float, settle: bool) -> tuple[float, int, float]:
    begin = time.perf_counter()
    substeps = chain.settle(cable) if settle else chain.pull(cable)
    return time.perf_counter() - begin, substeps, chain.force


def _rate(runs: list[list[float]]) -> float:
    """Return the steps per second of a path, from the durations of its steps in several runs [s]."""
    return float(1 / np.median(runs, axis=0).mean())


def measure() -> JsonObject:
    """Return speed and deviation of the other tools; MuJoCo only if it is installed."""
    sqp = sqp_times()
    touching = np.array(sqp["touching"])
    found: JsonObject = {
        "sqpmethod": {
            "solve_ms": float(np.median(np.array(sqp["solve_ms"])[touching])),
            "step_ms": float(np.median(np.array(sqp["step_ms"])[touching])),
            "failures": sqp["failures"],
            "difference_mm": sqp["difference_mm"],
        }
    }
    if importlib.util.find_spec("mujoco") is None:
        return found
    ours = our_path()
    found["ours_steps_per_s"], found["mujoco_free_tip_mm"] = ours["steps_per_s"], free_tip_error()
    for name, contact in CONTACTS.items():
        for mode, settle in (("fixed", False), ("at rest", True)):
            found[f"mujoco {name}, {mode}"] = mujoco_path(contact, settle, ours["forces"])
    return found
