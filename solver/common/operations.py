"""What is written once for a number and for an array of them; the bits are the same."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Operations(NamedTuple):
    """Operations whose form for plain numbers is another than for arrays."""

    minimum: Callable[[Any, Any], Any]
    maximum: Callable[[Any, Any], Any]
    where: Callable[[Any, Any, Any], Any]


ARRAYS = Operations(np.minimum, np.maximum, np.where)
NUMBERS = Operations(min, max, lambda condition, yes, no: yes if condition else no)
