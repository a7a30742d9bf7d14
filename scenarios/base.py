"""What every scenario promises: simulated truth, and measurements of it."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySamples, ArraySnapshot, LogNormalRSS
from arrivals.motion_models import MotionModel
from arrivals.parameters import FrozenModel
from arrivals.registry import Registry
from arrivals.trackers import Tracker, find
from arrivals.typing import Complex, Float


@dataclass(frozen=True, eq=False)
class Trial:
    """One draw of a scenario, with the models that fit it.

    Parameters
    ----------
    measurements : ndarray, shape (n_steps, n_sensors)
        Complex for an `ArraySnapshot`, real for the others.
    truth : ndarray, shape (n_steps, n_sources) or (n_steps, n_sources, 2)
        Directions, rad, or positions, m; NaN while a source is off.
    measurement : ArraySnapshot, ArraySamples or LogNormalRSS
    motion : MotionModel
    signals : ndarray, shape (n_steps, n_sources), optional
        What the sources send, where it is their own: complex or real.
    """

    measurements: Complex | Float
    truth: Float
    measurement: ArraySnapshot | ArraySamples | LogNormalRSS
    motion: MotionModel
    signals: Complex | Float | None = field(default=None, kw_only=True)

    def tracker(self, name: str | type[Tracker], **params: Any) -> Tracker:
        """Make the tracker of that name, or class, with as many of the trial's models as it takes.

        Examples
        --------
        >>> from arrivals.scenarios import create
        >>> trial = create("svalse_fig4", n_steps=2).sample(np.random.default_rng(0))
        >>> trial.tracker("svalse", reference="first").motion.p_activate
        0.1
        """
        kind = find(name) if isinstance(name, str) else name
        wanted = inspect.signature(kind).parameters
        fitting = {key: value for key, value in self.known().items() if key in wanted}
        return kind(**fitting | params)

    def known(self) -> dict[str, Any]:
        """Return what a tracker may be told, by the names of its parameters."""
        return {"measurement": self.measurement, "motion": self.motion}


class Scenario(FrozenModel, ABC):
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
