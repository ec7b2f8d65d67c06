"""Checks of what is read from a checkpoint or from the file of a trained policy, before any of it is used."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import torch

from agents.arguments import LARGEST, check_real, check_whole
from agents.learning.network import EPSILON
from agents.learning.tensors import Tensors

WEIGHT = torch.finfo(torch.float16).max  # in which policies are kept
LOG = 40.0  # largest logarithm, so that single precision holds the square of its exponential
BOUNDS = {  # of tensors by the last part of their names; the others are weights
    "mean": (-LARGEST, LARGEST),
    "var": (0.0, LARGEST**2),
    "count": (EPSILON, LARGEST),
    "deviation": (EPSILON, LARGEST),
    "step": (1.0, LARGEST),
    "exp_avg": (-LARGEST, LARGEST),
    "exp_avg_sq": (0.0, LARGEST**2),
    "log_std": (-LOG, LOG),
    "log_ent_coef": (-LOG, LOG),
    "observations": (-LARGEST, LARGEST),
    "next_observations": (-LARGEST, LARGEST),
    "rows": (-LARGEST, LARGEST),
    "rewards": (-LARGEST, LARGEST),
    "actions": (-1.0, 1.0),
    "labels": (-1.0, 1.0),
    "dones": (0.0, 1.0),
    "timeouts": (0.0, 1.0),
}


@dataclass(frozen=True, slots=True)
class Form:
    """What a tensor must look like.

    Attributes:
        shape: Its shape.
        dtype: Its type.
    """

    shape: tuple[int, ...]
    dtype: torch.dtype = torch.float32

    @classmethod
    def of(cls, tensor: torch.Tensor) -> "Form":
        """Return the form of a tensor."""
        return cls(tuple(tensor.shape), tensor.dtype)


def moment_forms(name: str, optimizer: torch.optim.Optimizer) -> dict[str, Form]:
    """Return the forms of the moments that Adam keeps of every parameter, under the names of ``flatten_states``."""
    parameters = [parameter for group in optimizer.param_groups for parameter in group["params"]]
    forms: dict[str, Form] = {}
    for index, parameter in enumerate(parameters):
        moment = Form.of(parameter)
        forms |= {f"{name}/{index}.{key}": moment for key in ("exp_avg", "exp_avg_sq")}
        forms[f"{name}/{index}.step"] = Form(())
    return forms


def check_tensors(tensors: Tensors, forms: Mapping[str, Form]) -> None:
    """Refuse tensors of other names, shapes, types or sizes than they must have.

    Args:
        tensors: The tensors.
        forms: What must be there, by name.

    Raises:
        ValueError: Naming the tensor and what is wrong.
    """
    check_names(tensors, forms)
    for name, tensor in tensors.items():
        if (found := Form.of(tensor)) != forms[name]:
            raise ValueError(f"{name} is of {_text(found)}; it must be of {_text(forms[name])}")
        _check_values(name, tensor)


def check_names(found: Iterable[str], names: Iterable[str]) -> None:
    """Refuse other names than there must be.

    Raises:
        ValueError: Naming the first that is missing, or that is too many.
    """
    if missing := sorted({*names} - {*found}):
        raise ValueError(f"{missing[0]} is missing")
    if other := sorted({*found} - {*names}):
        raise ValueError(f"{other[0]!r} is not part of it")


def _check_values(name: str, tensor: torch.Tensor) -> None:
    if not tensor.isfinite().all():
        raise ValueError(f"{name} is not finite")
    low, high = BOUNDS.get(name.replace("/", ".").rsplit(".", 1)[-1], (-WEIGHT, WEIGHT))
    if tensor.numel() and not (tensor.min() >= low and tensor.max() <= high):
        raise ValueError(f"{name} is from {tensor.min():.6g} to {tensor.max():.6g}; it must be from {low} to {high}")


def _text(form: Form) -> str:
    return f"shape {form.shape} and type {form.dtype}"


def check_curve(steps: object, returns: object, most: float = math.inf) -> tuple[list[int], list[float]]:
    """Return the steps and the mean returns of a learning curve, whose last point is at most at so many steps.

    Raises:
        ValueError: If the steps do not increase, or not every step has a finite return.
    """
    if not isinstance(steps, list) or not isinstance(returns, list) or len(steps) != len(returns):
        raise ValueError("the learning curve has no list of as many returns as steps")
    before, checked = 0, []
    for value in steps:
        before = check_whole("a step of the learning curve", value, before + 1, most)
        checked.append(before)
    return checked, [check_real("a return of the learning curve", value, -LARGEST) for value in returns]
