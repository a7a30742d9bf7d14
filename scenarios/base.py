"""Base classes of scenarios and trials."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from arrivals.measurement_models import ArraySamples, ArraySnapshot, LogNormalRSS
from arrivals.motion_models import MotionModel
from arrivals.parameters import FrozenModel
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
        Directions, rad, or positions, m; NaN while a source is inactive.
    measurement : ArraySnapshot, ArraySamples or LogNormalRSS
        Measurement model of the scenario.
    motion : MotionModel
        Motion model of the sources.
    signals : ndarray, shape (n_steps, n_sources), optional
        Source signals, complex or real, of scenarios that simulate them.
    elevation : ndarray, shape (n_steps, n_sources), optional
        Elevations, rad, where the truth is azimuths on the sphere.
    range : ndarray, shape (n_steps, n_sources), optional
        Ranges, m, where waves are spherical; infinite for a plane wave.
    cut_off : float, optional
        Cut-off c of the metrics, degrees or m; 10 if None.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> trial = create("svalse_fig6", n_steps=3).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.truth.shape
    ((3, 15), (3, 6))
    """

    measurements: Complex | Float
    truth: Float
    measurement: ArraySnapshot | ArraySamples | LogNormalRSS
    motion: MotionModel
    signals: Complex | Float | None = field(default=None, kw_only=True)
    elevation: Float | None = field(default=None, kw_only=True)
    range: Float | None = field(default=None, kw_only=True)
    cut_off: float | None = field(default=None, kw_only=True)

    def tracker(self, name: str | type[Tracker], **params: Any) -> Tracker:
        """Make a tracker with those models of the trial that its constructor takes.

        Parameters
        ----------
        name : str or type
            Registered name, or class.
        **params : object
            Further arguments of the constructor; they replace those of the trial.

        Returns
        -------
        Tracker
            A new tracker.

        Examples
        --------
        >>> from arrivals.scenarios import create
        >>> trial = create("svalse_fig4", n_steps=2).sample(np.random.default_rng(0))
        >>> trial.tracker("svalse", reference="first").motion.p_activate
        0.1
        """
        kind = find(name) if isinstance(name, str) else name
        accepted = inspect.signature(kind).parameters
        arguments = {
            key: value for key, value in self.tracker_arguments().items() if key in accepted
        }
        return kind(**arguments | params)

    def tracker_arguments(self) -> dict[str, Any]:
        """Return the models of the trial by the names of a tracker's parameters.

        Returns
        -------
        dict
            Arguments that `tracker` passes where the constructor takes them.
        """
        return {"measurement": self.measurement, "motion": self.motion}


class Scenario(FrozenModel, ABC):
    """Base class of scenarios: frozen models that draw trials.

    A subclass is a frozen dataclass whose fields are its parameters.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> scenario = create("svalse_fig6", n_steps=3)
    >>> isinstance(scenario, Scenario), scenario.replace(snr_db=10.0).snr_db
    (True, 10.0)
    """

    truth_unit: ClassVar[str] = "degrees"  # of errors; m where the truth has positions

    @abstractmethod
    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of all random numbers of the trial.

        Returns
        -------
        Trial
            Measurements, truth and models.
        """
