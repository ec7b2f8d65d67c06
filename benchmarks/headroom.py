"""How much there is to win with realistic sensing: the force error of a tuned PI controller beside that of a bound.

``python benchmarks/headroom.py`` searches the gains on training scenes and prints a row for every id: error of the
controller that knows what is hidden, of the best PI controller, and its gains.
"""

from itertools import product

import numpy as np

from agents.evaluate import run_episodes
from agents.policy import ForceController, NewtonController, Policy
from ccr_gym import ENV_IDS

SEARCH = 24  # steps in which contact is found, which do not count
EPISODES = 16
PROPORTIONAL, INTEGRAL = (0.0, 1.0, 3.0, 6.0, 10.0), (4.0, 8.0, 16.0, 32.0)


def error(policy: Policy, env_id: str, episodes: int) -> tuple[float, float]:
    """Median and mean over training scenes of the root mean square force error after the search [mN]."""
    played = run_episodes(policy, env_id, 0, episodes, sensing="realistic", split="train")
    errors = [1e3 * float(np.sqrt(np.mean(episode.lacking[SEARCH:] ** 2))) for episode in played]
    return float(np.median(errors)), float(np.mean(errors))


def main() -> None:
    """Search and print."""
    print("| id | bound, median (mean) [mN] | PI, median (mean) [mN] | proportional, integral |")
    print("| --- | --- | --- | --- |")
    for env_id in ENV_IDS:
        bound = error(NewtonController(), env_id, 4 if "Spatial" in env_id else EPISODES)
        gains = list(product(PROPORTIONAL, INTEGRAL))
        found = min((error(ForceController(*pair), env_id, EPISODES), pair) for pair in gains)
        (median, mean), (proportional, integral) = found
        row = f"{bound[0]:.2f} ({bound[1]:.2f}) | {median:.2f} ({mean:.2f}) | {proportional:g}, {integral:g}"
        print(f"| `{env_id}` | {row} |", flush=True)


if __name__ == "__main__":
    main()
