"""The chain from solver to observation, made for scenes of a fixed number of obstacles."""

from dataclasses import astuple
from typing import Any, NamedTuple

from ccr_gym.adapters import AnyAdapter
from ccr_gym.arrays import EpisodeArrays, Readings, StepSlopes
from ccr_gym.estimation import ForceEstimator
from ccr_gym.noise import noise_table
from ccr_gym.observation import Observer
from ccr_gym.sensing import SensorModel
from ccr_gym.settings import AnySettings
from ccr_gym.task import PROFILE_STEPS, AnyTask
from solver.common.batch import BaseBatch
from solver.common.transition import TRANSITIONS, TaskSettings


class Pipeline(NamedTuple):
    """The chain from solver to observation, made for scenes of a fixed number of obstacles.

    Attributes:
        batch: The robots.
        adapter: Adapter of the robots.
        observer: Columns of observations.
        estimator: Estimator of the contact forces.
        model: What is known of the robots: themselves where sensing is ideal, otherwise robots of the nominal rigidity
            in the known scenes, at what the encoders read.
        sensors: Model of the imperfections; ``None`` where sensing is ideal.
    """

    batch: BaseBatch
    adapter: AnyAdapter
    observer: Observer
    estimator: ForceEstimator
    model: BaseBatch
    sensors: SensorModel | None

    @classmethod
    def make(cls, task: AnyTask, settings: AnySettings, obstacles: int, count: int, threads: int) -> "Pipeline":
        """Return the chain of N robots among a number of obstacles."""
        batch, sensors = task.adapter.make_batch(settings, count, obstacles, threads), None
        model, adapter = batch, task.adapter(settings, batch.layout)
        observer, ideal = Observer(adapter, task), settings.sensors is None
        if not ideal:
            model = task.adapter.make_batch(settings, count, obstacles, threads)
            sensors = SensorModel(count, adapter.body, adapter.actions, observer.columns)
        estimator = ForceEstimator(adapter, model, learns=not ideal)
        return cls(batch, adapter, observer, estimator, model, sensors)

    def kernel(self, task: AnyTask, episodes: EpisodeArrays, readings: Readings, slopes: StepSlopes | None) -> Any:
        """Return the kernel's steps of episodes in these arrays."""
        adapter, robots, settings = self.adapter, self.batch.kernel_arrays, self.adapter.settings
        return TRANSITIONS[adapter.space](
            robots=robots,
            model=robots if self.model is self.batch else self.model.kernel_arrays,
            actuation=adapter.kernel_actuation,
            sensors=None if self.sensors is None else self.sensors.arrays,
            noise=noise_table(),
            estimator=self.estimator.kernel,
            observer=self.observer.kernel_settings,
            task=TaskSettings(
                target=-1 if task.target is None else task.target,
                vector=task.force_vector,
                estimated=settings.regulate == "estimate",
                profile_steps=PROFILE_STEPS,
                force_limit=settings.force_limit,
                length_mm=adapter.scales.length_mm,
                weights=astuple(settings.weights),
            ),
            episodes=episodes.given,
            readings=readings._asdict(),
            slopes=None if slopes is None else slopes._asdict(),
        )
