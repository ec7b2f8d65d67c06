"""What a reversal buys without a force sensor: it tells the friction of the tendon from the rigidity of the robot.

Pulling alone shows rigidity over what friction leaves of the tension; letting the cable out again shows their product.
Run ``python examples/probe.py`` after ``pip install '.[agents]'``; it writes runs/probe.png.
"""

from dataclasses import dataclass
from pathlib import Path

import gymnasium
import matplotlib.pyplot as plt
import numpy as np
import tyro

from agents import RobotEstimator, search

BACK = slice(8, 13)  # steps of the reversal, before contact
GAIN = 1.3  # action per EI/L² of force error


@dataclass(frozen=True)
class Args:
    """Compare episodes that reverse the cable once before contact with episodes that do not."""

    env_id: str = "CCR/PushObstacle-v1"
    """Environment."""
    episodes: int = 200
    """Episodes of each kind, in the same scenes."""
    out: Path = Path("runs/probe.png")
    """Figure to write."""


def play(args: Args, *, probing: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return errors of the estimated loss and of the force over its set-point, ``(steps, episodes)`` each."""
    envs = gymnasium.make_vec(args.env_id, args.episodes, sensing="sensorless", obs_mode="dict", split="test")
    settings = envs.unwrapped.settings
    estimator = RobotEstimator(settings, args.episodes)
    observation, _ = envs.reset(seed=1_000_000)
    loss = envs.unwrapped.privileged_state.tendon_loss
    losses, forces = [], []
    for step in range(64):
        known, touching = estimator.update(observation), observation["contact"].any(axis=1)
        goal = settings.force_span * np.linalg.norm(observation["desired_force"], axis=1)
        speed = np.where(touching, np.clip(GAIN * (goal - known.force), -1, 1), 1.0)
        if probing and BACK.start <= step < BACK.stop:
            speed = np.where(touching, speed, -1.0)
        observation, _, _, _, info = envs.step((speed[:, None] * search(observation)).astype(np.float32))
        losses.append(np.abs(known.loss - loss))
        desired = np.linalg.norm(np.atleast_2d(info["desired_force"].T).T, axis=-1)
        forces.append(np.abs(np.linalg.norm(info["force_true"], axis=1) / desired - 1))
    return np.array(losses), np.array(forces)


def main(args: Args) -> dict[str, dict[str, float]]:
    """Draw the medians of both errors over the steps; print and return those of the last sixteen."""
    found = {}
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    for probing, label in ((False, "no reversal"), (True, "one reversal")):
        losses, forces = play(args, probing=probing)
        for axes, errors in ((left, losses), (right, forces)):
            low, middle, high = np.percentile(errors, [25, 50, 75], axis=1)
            axes.plot(middle, label=label)
            axes.fill_between(range(len(middle)), low, high, alpha=0.2)
        early = float(np.median(losses[BACK.start]))
        loss, force = (float(np.median(errors[-16:])) for errors in (losses, forces))
        found[label] = {"early_loss": early, "loss": loss, "force": force}
        print(f"{label}: loss ±{loss:.3f}, force ±{100 * force:.1f} % at the end")
    left.axvspan(BACK.start, BACK.stop, color="0.9", zorder=0)
    left.set(xlabel="step", ylabel="error of the estimated loss", ylim=(0, None))
    right.set(xlabel="step", ylabel="error of the force / set-point", ylim=(0, 1))
    right.legend()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(args.out, dpi=120)
    print(f"Written: {args.out}")
    return found


if __name__ == "__main__":
    main(tyro.cli(Args))
