"""Base class of all trackers."""

from __future__ import annotations

import copy
import time
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, Self

from numpy.typing import ArrayLike

from arrivals.measurements import rows
from arrivals.parameters import Configurable
from arrivals.trackers.estimates import Estimate
from arrivals.trackers.run import Run, RunRecorder
from arrivals.typing import Float
from arrivals.validation import positive


class Tracker(Configurable, ABC):
    """Base of all trackers: a method with a belief, `predict`, then `update`, as in filterpy.

    A tracker has models; their numbers are its parameters. The constructor names every parameter
    and keeps it as an attribute of that name. `predict` and `update` rebind arrays and never write
    into them, and a call that raises does not change the belief.

    Attributes
    ----------
    x : ndarray, shape (dim_x,)
        Mean of the belief; NaN in unused slots where the number of sources varies.
    P : ndarray, shape (dim_x, dim_x)
        Covariance of the belief; zero in unused slots.

    Examples
    --------
    >>> import numpy as np
    >>> from arrivals.trackers import StateEstimate
    >>> class Smoothing(Tracker):
    ...     def __init__(self, gain=0.5):
    ...         self.gain, self.x, self.P = gain, np.zeros(1), np.eye(1)
    ...     def predict(self, u=None, *, dt=1.0):
    ...         pass
    ...     def update(self, z):
    ...         if z is not None:
    ...             self.x = self.x + self.gain * (z - self.x)
    ...     @property
    ...     def estimate(self):
    ...         return StateEstimate(self.x, self.P)
    >>> Smoothing(gain=0.5).run([1.0, None, 1.0]).x
    array([[0.5 ],
           [0.5 ],
           [0.75]])
    """

    x: Float
    P: Float

    @abstractmethod
    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Predict the belief after a time step.

        Parameters
        ----------
        u : array_like, optional
            Control input, as in filterpy; None or 0 for none.
        dt : float
            Time step.
        """

    @abstractmethod
    def update(self, z: ArrayLike | None) -> None:
        """Update the belief with a measurement.

        A number is missing if it is NaN, None, masked, infinite, or so large that its square
        overflows; a sensor of an array also if it has zeros alone in a step, with one warning.
        The other numbers of the measurement are used.

        A missing measurement does not change the belief. In a gap `predict` alone moves it: the
        variances grow, and sources whose existence is tracked end. A method that estimates
        neither reports nothing on a step without data; its memory, which `predict` weighs down,
        remains, so that it resumes with the next measurement.

        Parameters
        ----------
        z : array_like or None
            Measurement; None or NaN if it is missing.
        """

    @property
    @abstractmethod
    def estimate(self) -> Estimate:
        """Present estimate, a frozen record."""

    def run(self, measurements: Iterable[ArrayLike | None], dt: float = 1.0) -> Run:
        """Predict and update for each measurement, starting from the present state.

        Parameters
        ----------
        measurements : array_like, shape (n_steps, ...), or any iterable
            One per step; None or NaN where it is missing.
        dt : float
            Time between steps.

        Returns
        -------
        Run
            The estimates as rectangular arrays over time.
        """
        positive("dt", dt)
        recorder = RunRecorder(type(self.estimate))
        started = time.perf_counter()
        for z in rows("measurements", measurements):
            self.predict(dt=dt)
            self.update(z)
            recorder.add(self.estimate, self.x)
        return recorder.run(dt=dt, elapsed=time.perf_counter() - started).made_by(self)

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences, each starting from the present state.

        The tracker itself does not change.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, ...), or nested iterables
            Sequences of measurements, as in `run`.
        dt : float
            Time between steps.

        Returns
        -------
        list of Run
            One per sequence.
        """
        return [
            copy.deepcopy(self).run(sequence, dt) for sequence in rows("measurements", measurements)
        ]

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name and keep the belief.

        Parameters
        ----------
        **params : object
            New values; `motion__kappa=300.0` changes a parameter of a part.

        Returns
        -------
        Tracker
            The tracker itself.

        Raises
        ------
        ValueError, TypeError
            If there is no such parameter or its value is invalid; nothing has changed then.
        """
        changed = self.changed_params(params)
        checked = type(self)(**changed)
        for name in changed:
            setattr(self, name, getattr(checked, name))
        return self
