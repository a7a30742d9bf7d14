"""What every scenario promises: simulated truth, and measurements of it."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySamples, ArraySnapshot
from arrivals.motion_models import MotionModel
from arrivals.params import Model
from arrivals.trackers import Tracker, find
from arrivals.trackers.registry import Registry
from arrivals.typing import Complex, Float


@dataclass(frozen=True, eq=False)
class Trial:
    """One draw of a scenario, with the models that fit it.

    Parameters
    ----------
    measurements : ndarray, shape (n_steps, n_sensors)
        Complex for an `ArraySnapshot`, real for `ArraySamples`.
    truth : ndarray, shape (n_steps, n_sources)
        Directions, rad; NaN while a source is off.
    measurement : ArraySnapshot or ArraySamples
    motion : MotionModel
    """

    measurements: Complex | Float
    truth: Float
    measurement: ArraySnapshot | ArraySamples
    motion: MotionModel

    def tracker(self, name: str | type[Tracker], **params: Any) -> Tracker:
        """Make the tracker of that name, or class, with as many of the trial's models as it takes.

        Examples
        --------
        >>> from arrivals.scenarios import create
        >>> trial = create("svalse_fig4", n_steps=2).sample(np.random.default_rng(0))
        >>> trial.tracker("svalse", snr_db=10.0).motion.p_activate
        0.1
        """
        kind = find(name) if isinstance(name, str) else name
        wanted = inspect.signature(kind).parameters
        models = {"measurement": self.measurement, "motion": self.motion}
        fitting = {key: model for key, model in models.items() if key in wanted}
        return kind(**fitting | params)


class Scenario(Model, ABC):
    """A situation that trackers are tried on; frozen, its numbers are its parameters."""

    @abstractmethod
    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial."""


_scenarios: Registry[Scenario] = Registry(Scenario, "arrivals.scenarios", "scenario")  # type: ignore[type-abstract]  # only its subclasses are made
available, create, find_scenario, register = (
    _scenarios.available,
    _scenarios.create,
    _scenarios.find,
    _scenarios.register,
)
