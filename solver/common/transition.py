"""The kernel's steps of environments: command, equilibria, sensing, estimate, reward and observation, with slopes.

Environments describe themselves by settings and hand over their arrays, which the kernel reads and writes.
"""

from solver import _kernel
from solver._kernel import Actuation as Actuation
from solver._kernel import EstimatorSettings as EstimatorSettings
from solver._kernel import ObserverSettings as ObserverSettings
from solver._kernel import Stage as Stage
from solver._kernel import TaskSettings as TaskSettings
from solver._kernel import TipSlopes as TipSlopes
from solver._kernel import correlate as correlate

Estimator = _kernel.Estimator | _kernel.SpatialEstimator
Transition = _kernel.Transition | _kernel.SpatialTransition
ESTIMATORS = {2: _kernel.Estimator, 3: _kernel.SpatialEstimator}  # by the dimensions of a point
TRANSITIONS = {2: _kernel.Transition, 3: _kernel.SpatialTransition}
