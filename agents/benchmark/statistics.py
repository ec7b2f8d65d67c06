"""Statistics over episodes: interquartile means with bootstrap intervals, tail means, performance profiles."""

import numpy as np
from scipy import stats

RESAMPLES = 2000
TAIL = 0.1  # share of the worst episodes in the tail mean
QUARTER = 0.25


def iqm(samples: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the interquartile mean: the mean of the middle half of the samples."""
    return np.asarray(stats.trim_mean(samples, QUARTER, axis=axis))


def iqm_interval(samples: np.ndarray, seed: int = 0) -> tuple[float, float]:
    """Return the 95 % interval of the interquartile mean of all samples, from a percentile bootstrap.

    As all training seeds play the same scenes, seeds (rows) and scenes (columns) are resampled independently.

    Args:
        samples: Samples of every training seed and scene, ``(seeds, scenes)``.
        seed: Seed of the resampling.
    """

    def resampled_iqm(rows: np.ndarray, columns: np.ndarray, axis: int) -> np.ndarray:
        crossed = samples[rows[..., :, None], columns[..., None, :]]
        return iqm(crossed.reshape(*crossed.shape[:-2], -1), axis)

    found = stats.bootstrap(
        [np.arange(max(count, 2)) % count for count in samples.shape],  # SciPy needs at least two of each
        resampled_iqm,
        n_resamples=RESAMPLES,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(seed),
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def cvar(samples: np.ndarray) -> float:
    """Return the mean of the largest tenth: the conditional value at risk at 90 %."""
    worst = np.sort(samples)[-max(round(TAIL * len(samples)), 1) :]
    return float(worst.mean())


def profile(samples: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Return the performance profile: the share of samples at or below each level."""
    return np.asarray((samples[:, None] <= levels).mean(axis=0))
