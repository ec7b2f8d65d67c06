"""Plan with copies of the environment: the best of random pulls, tried on forks, then the first step for real."""

import gymnasium
import numpy as np

import ccr_gym  # noqa: F401 - registers the ids

CANDIDATES, AHEAD, STEPS = 32, 4, 40


def main() -> None:
    """Play an episode and print the forces."""
    env = gymnasium.make("CCR/PushObstacle-v1").unwrapped
    forks = gymnasium.make_vec("CCR/PushObstacle-v1", CANDIDATES, vectorization_mode="vector_entry_point")
    generator = np.random.default_rng(0)
    _, info = env.reset(seed=1)
    forks.reset(seed=1)  # the first of them is the same episode
    for step in range(STEPS):
        forks.fork([0] * CANDIDATES)
        state, returns = forks.get_state(), np.zeros(CANDIDATES)
        plans = generator.uniform(-1, 1, (CANDIDATES, 1)) * np.ones((AHEAD, 1, 1))
        for actions in plans:
            returns += forks.step(actions)[1]
        best = plans[0, int(np.argmax(returns))]
        forks.set_state(state)
        forks.step(np.tile(best, (CANDIDATES, 1)))
        *_, info = env.step(best)
        force = np.linalg.norm(info["force_true"])
        print(f"{step:2d}  action {best[0]:+.2f}  force {force:.4f} N of {info['desired_force']:.4f}")


if __name__ == "__main__":
    main()
