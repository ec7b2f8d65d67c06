"""Your own task in ten lines: say which scene and set-point an episode has; the rest follows from the robot."""

from dataclasses import dataclass

import gymnasium
import numpy as np

from ccr_gym import Assignment, ContactEnv, ContactVectorEnv, Scales, Task
from solver import Capsule, Robot, Scene

ENV_ID = "Mine/PushTube-v1"


@dataclass(frozen=True)
class PushTube(Task[Robot]):
    """A tube that leans across the robot's way, to be pressed with a desired force."""

    def sample(self, robot: Robot, generator: np.random.Generator) -> Assignment:
        """Return a tube and a set-point, as multiples of the robot's length L and of EI/L²."""
        length, unit = Scales.of(robot).length_mm, Scales.of(robot).force_n
        x, y, lean, force = generator.uniform((0.3, 0.5, -0.5, 0.4), (0.4, 0.8, 0.5, 1.5))
        center, half = np.array([x, y]) * length, 0.1 * length * np.array([np.sin(lean), np.cos(lean)])
        tube = Capsule(start=tuple(center - half), end=tuple(center + half), radius=0.06 * length)
        return Assignment(Scene([tube]), force * unit)


gymnasium.register(
    ENV_ID,
    entry_point=lambda **settings: ContactEnv(PushTube(), **settings),
    vector_entry_point=lambda **settings: ContactVectorEnv(PushTube(), **settings),
    max_episode_steps=PushTube.steps,
)


def main() -> None:
    """Play an episode with a proportional controller, then step many environments at once."""
    env = gymnasium.make(ENV_ID)
    _, info = env.reset(seed=0)
    for step in range(PushTube.steps):
        force = np.linalg.norm(info["force_true"])
        action = np.clip(1 - force / info["desired_force"], -1, 1)
        *_, info = env.step(np.array([action], np.float32))
        if step % 8 == 7:
            print(f"step {step + 1:2d}: {np.linalg.norm(info['force_true']):.3f} N of {info['desired_force']:.3f} N")
    envs = gymnasium.make_vec(ENV_ID, 64, vectorization_mode="vector_entry_point", robot="guidewire")
    envs.reset(seed=0)
    _, rewards, *_ = envs.step(envs.action_space.sample())
    print(f"64 guidewires, mean reward {rewards.mean():.3f}")


if __name__ == "__main__":
    main()
