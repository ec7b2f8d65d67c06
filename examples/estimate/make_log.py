"""Write the log of a robot whose truth is known, by the realistic environment, for ``ccr-gym estimate``.

The robot pulls its cable, lets it out once to tell friction from rigidity, pulls until it touches the obstacle, then
holds and changes its force. Run ``python examples/estimate/make_log.py`` after ``pip install '.[agents]'``.
"""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from ccr_gym import PushObstacleEnv
from solver import Circle

FREE, BACK, IN = 20, 12, 34  # rows of pulling, of letting out, and of pulling into the obstacle
SCENE = [Circle(center=(49.0, 112.0), radius=14.0)]
DT_S = 0.1


@dataclass(frozen=True)
class Args:
    """Write log.csv, truth.csv, robot.json and scene.json."""

    out: Path = Path(__file__).parent
    """Folder."""
    seed: int = 3
    """Seed of the robot's hidden imperfections."""
    rows: int = 160
    """Rows of the log."""


def drive(rows: int) -> np.ndarray:
    """Return the actions of all rows."""
    swing = 0.4 * np.sin(np.arange(rows) * 2 * np.pi / 40)
    plan = [np.full(FREE, 0.5), np.full(BACK, -0.5), np.full(IN, 0.5), np.zeros(10), swing]
    return np.concatenate(plan)[:rows]


def play(seed: int, rows: int) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """Return the rows of the log, and those of the truth."""
    env = PushObstacleEnv(sensing="sensorless", obs_mode="dict")
    settings, scales = env.settings, env.settings.scales
    env.reset(seed=seed, options={"scene": SCENE, "desired_force": scales.force_n})
    log, truth = [], []
    for row, action in enumerate(drive(rows)):
        observation, *_, info = env.step(np.array([action]))
        hidden, time = env.privileged_state, {"time_s": round(DT_S * row, 6)}
        tension = settings.tension_span * scales.tension_n * float(observation["tension"][0])
        tip = settings.reach_mm * observation["nodes"][-3:-1].astype(float)
        measured = {"cable_mm": hidden.motor_mm[0], "tension_n": tension, "tip_x_mm": tip[0], "tip_y_mm": tip[1]}
        log.append(time | {name: round(float(value), 4) for name, value in measured.items()})
        known = {"rigidity_ratio": hidden.rigidity_ratio, "tendon_loss": hidden.tendon_loss}
        known |= {"half_backlash_mm": hidden.half_backlash_mm[0], "latency_rows": hidden.latency}
        forces = {"force_n": np.linalg.norm(info["force_true"]), "cable_mm": hidden.actuated_mm[0]}
        truth.append(time | {name: round(float(value), 6) for name, value in (forces | known).items()})
    return log, truth


def write(path: Path, rows: list[dict[str, float]]) -> None:
    """Write rows to a CSV file."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def main(args: Args) -> None:
    """Write the four files."""
    log, truth = play(args.seed, args.rows)
    write(args.out / "log.csv", log)
    write(args.out / "truth.csv", truth)
    obstacles = [{"shape": "Circle", "center": list(circle.center), "radius": circle.radius} for circle in SCENE]
    (args.out / "robot.json").write_text(json.dumps({"preset": "prototype"}) + "\n")
    (args.out / "scene.json").write_text(json.dumps(obstacles) + "\n")


if __name__ == "__main__":
    main(tyro.cli(Args))
