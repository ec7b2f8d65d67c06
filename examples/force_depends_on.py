"""What a contact force depends on: a table of sensitivities, from the solver's derivatives and by solving again.

Run ``python examples/force_depends_on.py`` after ``pip install .``; it prints a table in Markdown.
"""

from dataclasses import dataclass, replace

import numpy as np

from solver import Circle, Robot, Scene, Solver, contact_estimate, sensitivity

ROBOT, CIRCLE = Robot.prototype(), Circle(center=(49.0, 112.0), radius=14.0)
CABLE_MM, STEPS = 8.0, 80
STEP = 1e-4  # of a parameter, over its size, for central differences


@dataclass(frozen=True)
class Setup:
    """A robot that presses on a circle, and what its motor reads."""

    robot: Robot = ROBOT
    circle: Circle = CIRCLE
    cable_mm: float = CABLE_MM

    def solve(self):
        """Return the equilibrium after the cable was pulled in small steps."""
        solver = Solver(self.robot, Scene([self.circle]))
        equilibrium = solver.rest()
        for cable in np.linspace(0, self.cable_mm, STEPS + 1)[1:]:
            equilibrium = solver.step(equilibrium, float(cable))
        return equilibrium


def shifted(setup: Setup, name: str, amount: float) -> Setup:
    """Return the setup with one parameter changed: by an amount [mm], or where it is a size of the robot by a share."""
    robot, circle = setup.robot, setup.circle
    x, y = circle.center
    match name:
        case "EI":
            return replace(setup, robot=replace(robot, rigidity=robot.rigidity * (1 + amount)))
        case "a":
            return replace(setup, robot=replace(robot, offset_mm=robot.offset_mm * (1 + amount)))
        case "L":
            return replace(setup, robot=replace(robot, length_mm=robot.length_mm * (1 + amount)))
        case "x":
            return replace(setup, circle=replace(circle, center=(x + amount, y)))
        case "y":
            return replace(setup, circle=replace(circle, center=(x, y + amount)))
        case "radius":
            return replace(setup, circle=replace(circle, radius=circle.radius + amount))
    return replace(setup, cable_mm=setup.cable_mm + amount)


def force(setup: Setup) -> float:
    """Return the contact force that the model has at the cable's displacement [N]."""
    return float(np.linalg.norm(setup.solve().forces[0]))


def estimate(setup: Setup, tension: float) -> float:
    """Return the contact force that a measured tension tells by virtual work [N]."""
    return float(np.linalg.norm(contact_estimate(setup.solve(), tension)[0]))


def derivatives(setup: Setup) -> dict[str, float]:
    """Return relative changes of the force per unit of each parameter, from the solver's own sensitivities.

    Of the sizes of the robot they are per relative change. That of the offset follows from the others: a robot and a
    scene that are s times as large, with an s² times as large rigidity, have the same forces.
    """
    equilibrium, robot = setup.solve(), setup.robot
    change, rows = sensitivity(equilibrium), type(sensitivity(equilibrium)).rows(robot)
    size = np.linalg.norm(equilibrium.forces[0])
    relative = change.forces[:, 0] @ equilibrium.forces[0] / size**2
    x, y, _, radius = relative[rows.obstacle(0)]
    cable, length = relative[0], relative[rows.length] * robot.length_mm
    moved = setup.circle.center[0] * x + setup.circle.center[1] * y + setup.circle.radius * radius
    offset = -(2 + length + cable * setup.cable_mm + moved)
    return {"EI": 1.0, "a": offset, "L": length, "x": x, "y": y, "radius": radius, "cable": cable}


def differences(setup: Setup) -> dict[str, tuple[float, float]]:
    """Return the same by solving again, of the force at the cable's displacement and of the one from its tension."""
    tension, reference = setup.solve().tension, (force(setup), estimate(setup, setup.solve().tension))
    found = {}
    for name in derivatives(setup):
        step = STEP if name in ("EI", "a", "L") else 10 * STEP
        ends = [shifted(setup, name, way * step) for way in (1, -1)]
        values = np.array([(force(end), estimate(end, tension)) for end in ends])
        found[name] = tuple(((values[0] - values[1]) / (2 * step) / reference).tolist())
    return found


UNITS = {
    "EI": ("EI, 1 % more", 0.01),
    "a": ("offset a of the cable, 1 % more", 0.01),
    "L": ("length L, 1 % more", 0.01),
    "x": ("obstacle 1 mm further away (x)", 1.0),
    "y": ("obstacle 1 mm further along (y)", 1.0),
    "radius": ("its radius 1 mm larger", 1.0),
    "cable": ("cable 0.1 mm further in (play, encoder)", 0.1),
}


def tension_rows(setup: Setup) -> list[str]:
    """Return rows of the table for what only the measured tension has: loss and zero."""
    tension = setup.solve().tension
    reference = estimate(setup, tension)
    changes = {"tension read 1 % too high (loss η known to 0.01)": 0.01 * tension, "zero of the tension 10 mN": 0.01}
    return [
        f"| {name} | 0 | 0 | {100 * (estimate(setup, tension + more) / reference - 1):+.1f} % |"
        for name, more in changes.items()
    ]


def table(setup: Setup) -> str:
    """Return the table in Markdown."""
    own, again = derivatives(setup), differences(setup)
    head = "| change | F at the displacement, derivative | solved again | F from the tension, solved again |"
    rows = [
        f"| {title} | {100 * unit * own[name]:+.1f} % | {100 * unit * again[name][0]:+.1f} % "
        f"| {100 * unit * again[name][1]:+.1f} % |"
        for name, (title, unit) in UNITS.items()
    ]
    finer = replace(setup, robot=replace(setup.robot, segments=2 * setup.robot.segments))
    tension = setup.solve().tension
    more = [100 * (force(finer) / force(setup) - 1), 100 * (estimate(finer, tension) / estimate(setup, tension) - 1)]
    rows.append(
        f"| n = {setup.robot.segments} → {finer.robot.segments} segments | | {more[0]:+.1f} % | {more[1]:+.1f} % |"
    )
    return "\n".join([head, "| --- | --- | --- | --- |", *rows, *tension_rows(setup)])


if __name__ == "__main__":
    example = Setup()
    print(f"F = {force(example):.4f} N, tension {example.solve().tension:.3f} N\n")
    print(table(example))
