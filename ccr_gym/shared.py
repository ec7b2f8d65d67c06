"""What environments of one vector share, and how their results are told apart."""

from typing import Any

import numpy as np

from ccr_gym.checks import require
from ccr_gym.observation import Observation
from solver.common.validation import shown

Info = dict[str, Any]  # Gymnasium's own type of infos


class SharedAttributes:
    """Gymnasium's access to the attributes of each environment, which all of them share."""

    num_envs: int

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return an attribute of each environment, or what its method returns for these arguments.

        All environments share the attributes of this one, so methods are called once.
        """
        found = getattr(self, name)
        return (found(*args, **kwargs) if callable(found) else found,) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of each environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of this object, which all environments share.

        Raises:
            ValueError: If a list of values holds different ones.
        """
        listed = list(values) if isinstance(values, list | tuple) else [values]
        require(all(value == listed[0] for value in listed), f"values is {shown(values)}; all must be equal")
        setattr(self, name, listed[0])


def entry_of(observation: Observation, index: int) -> Observation:
    """Return the observation of one environment."""
    if isinstance(observation, dict):
        return {key: entry[index] for key, entry in observation.items()}
    return np.asarray(observation[index])


def masked(infos: Info, mask: np.ndarray) -> Info:
    """Return infos in Gymnasium's form: zero outside the mask, and the mask beside every entry."""
    masks = np.empty((len(infos), len(mask)), bool)
    masks[:] = mask
    if not mask.all():
        infos = {key: _zero_outside(value, mask) for key, value in infos.items()}
    return infos | dict(zip((f"_{key}" for key in infos), masks, strict=True))


def _zero_outside(values: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return values with those outside of a mask set to zero."""
    return np.where(mask.reshape(-1, *[1] * (values.ndim - 1)), values, values.dtype.type())
