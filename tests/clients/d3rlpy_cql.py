"""d3rlpy reads the data sets that Minari wrote; its Gymnasium is too old for the environments themselves."""

import d3rlpy
import minari
import numpy as np
from d3rlpy.algos import CQLConfig
from d3rlpy.dataset import MDPDataset

DATA = ("ccr/push-obstacle/random-v0", "ccr/spatial-push/random-v0")

for dataset_id in DATA:
    episodes = list(minari.load_dataset(dataset_id).iterate_episodes())
    columns = {
        "observations": np.concatenate([episode.observations[:-1] for episode in episodes]),
        "actions": np.concatenate([episode.actions for episode in episodes]),
        "rewards": np.concatenate([episode.rewards for episode in episodes]),
        "terminals": np.concatenate([episode.terminations for episode in episodes]),
        "timeouts": np.concatenate([episode.truncations for episode in episodes]),
    }
    learner = CQLConfig(batch_size=32).create(device="cpu:0")
    learner.fit(MDPDataset(**columns), n_steps=50, n_steps_per_epoch=50, show_progress=False, save_interval=100)
print(f"d3rlpy {d3rlpy.__version__}: CQL on {', '.join(DATA)}")
