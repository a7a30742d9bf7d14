"""What every tracker promises."""

from __future__ import annotations

import copy
import time
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import Configurable
from arrivals.trackers.estimates import Estimate
from arrivals.trackers.run import Run, RunRecorder
from arrivals.typing import Float
from arrivals.validation import positive


class Tracker(Configurable, ABC):
    """A method with a belief that moves: `predict`, then `update`, as in filterpy.

    A tracker has models; their numbers are its parameters. Its constructor names every parameter
    and keeps it under that name. `predict` and `update` rebind arrays and never write into them,
    and a call that raises leaves the belief as it was.

    Attributes
    ----------
    x : ndarray, shape (dim_x,)
        The belief's mean; NaN in unused places where the number of sources varies.
    P : ndarray, shape (dim_x, dim_x)
        Its covariance; zero in unused places.
    """

    x: Float
    P: Float

    @abstractmethod
    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Move the belief by `dt`; `u` is filterpy's control input, None or 0 for none."""

    @abstractmethod
    def update(self, z: ArrayLike | None) -> None:
        """Correct the belief by a measurement; None or NaN: it was missed."""

    @property
    @abstractmethod
    def estimate(self) -> Estimate:
        """What the tracker believes now."""

    def run(self, measurements: Iterable[ArrayLike | None], dt: float = 1.0) -> Run:
        """Predict and update for each measurement, from the present state.

        Parameters
        ----------
        measurements : array_like, shape (n_steps, ...), or any iterable
            One a step; None or NaN where one was missed.
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
        for z in measurements:
            self.predict(dt=dt)
            self.update(z)
            recorder.add(self.estimate, self.x)
        return recorder.run(dt=dt, elapsed=time.perf_counter() - started)

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences, the leading axis, each from the present state.

        The tracker itself stays as it is.
        """
        return [copy.deepcopy(self).run(sequence, dt) for sequence in measurements]

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name (`motion__kappa=300.0` reaches into a part); keep the belief.

        Raises
        ------
        ValueError, TypeError
            If there is no such parameter or its value is refused; nothing has changed then.
        """
        changed = self.changed_params(params)
        checked = type(self)(**changed)
        for name in changed:
            setattr(self, name, getattr(checked, name))
        return self

    @classmethod
    def type_name(cls) -> str:
        """Return the registered name, or "module:Class" of a class that is not registered."""
        from arrivals.trackers.registry import TRACKERS

        return TRACKERS.name_of(cls) or super().type_name()


def is_missing(z: ArrayLike | None) -> bool:
    """Tell whether a measurement is missing: None, or nothing but NaN.

    Examples
    --------
    >>> is_missing(None), is_missing(np.nan), is_missing([np.nan, 1.0])
    (True, True, False)
    """
    if z is None:
        return True
    array = np.asarray(z)
    return array.dtype.kind in "fc" and array.size > 0 and bool(np.isnan(array).all())
