"""Predictions, updates and likelihoods that leave a filter unchanged."""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.gaussian.arguments import (
    belief_arrays,
    finite_matrix,
    matrix_with_columns,
    measurement_and_mask,
    measurement_vector,
)
from arrivals.trackers.gaussian.equations import log_normal_update
from arrivals.typing import Float
from arrivals.validation import LARGEST, number

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter as Base
else:
    Base = object


class Queries(Base):
    """Results that leave the filter unchanged, under filterpy's names.

    Examples
    --------
    >>> from arrivals.trackers.filterpy import KalmanFilter
    >>> kf = KalmanFilter(dim_x=1, dim_z=1)
    >>> kf.x, kf.H = np.array([2.0]), np.array([[1.0]])
    >>> kf.get_update(4.0), kf.x
    ((array([3.]), array([[0.5]])), array([2.]))
    """

    def get_prediction(
        self,
        u: ArrayLike | None = None,
        B: ArrayLike | None = None,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
        *,
        dt: float = 1.0,
    ) -> tuple[Float, Float]:
        """Return mean and covariance that `predict` would give; parameters as there."""
        changed = copy.deepcopy(self)
        changed.predict(u, dt=dt, F=F, Q=Q, B=B)
        return changed.x, changed.P

    def get_update(self, z: ArrayLike | None = None) -> tuple[Float, Float]:
        """Return mean and covariance that `update` would give."""
        changed = copy.deepcopy(self)
        changed.update(z)
        return changed.x, changed.P

    def residual_of(self, z: ArrayLike | None) -> Float:
        """Return the residual of a measurement from the last prediction; 0 where missing."""
        values, missing = measurement_and_mask(z, self.dim_z)
        x, _ = belief_arrays(self.x_prior, self.P_prior, self.dim_x)
        y = self.innovation(values, self.measurement.h(x), missing, plain=False)
        return y.reshape(np.shape(self.measurement_of_state(self.x_prior)))

    def measurement_of_state(self, x: ArrayLike) -> Float:
        """Return the measurement expected of a state, (n,) or (n, 1): (m,) or (m, 1)."""
        state, _ = belief_arrays(x, np.eye(self.dim_x), self.dim_x)
        z = self.measurement.h(state)
        return z if np.ndim(x) == 1 else z[:, None]

    def log_likelihood_of(self, z: ArrayLike | None) -> float:
        """Return ln N(z; h(x), S) with S of the last update; 0 of a missing measurement.

        Raises
        ------
        ValueError
            Before the first update.
        """
        values, missing = measurement_and_mask(z, self.dim_z)
        if not self.S.any():
            raise ValueError("S must be that of an update; got none yet: call update first")
        x, _ = self.belief()
        y = self.innovation(values, self.measurement.h(x), missing, plain=False)
        return float(log_normal_update(y, self.S, missing)[0])

    def test_matrix_dimensions(
        self,
        z: ArrayLike | None = None,
        H: ArrayLike | None = None,
        R: ArrayLike | None = None,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
    ) -> None:
        """Raise a ValueError if the belief or one of the arguments does not fit the filter."""
        n = self.dim_x
        self.belief()
        m = self.dim_z if H is None else len(matrix_with_columns("H", H, n))
        if R is not None and not (m == 1 and np.size(R) == 1):
            finite_matrix("R", R, m, m)
        for name, value in (("F", F), ("Q", Q)):
            if value is not None:
                finite_matrix(name, value, n, n)
        if z is not None:
            measurement_vector(z, m)


class FadingMemory(Base):
    """Fading memory: each step multiplies the covariance F P F' by alpha².

    References
    ----------
    Simon, *Optimal State Estimation*, 2006, sec. 7.4.

    Examples
    --------
    >>> from arrivals.trackers.filterpy import KalmanFilter
    >>> kf = KalmanFilter(dim_x=1, dim_z=1)
    >>> kf.alpha = 2.0
    >>> kf.predict()
    >>> kf.P
    array([[5.]])
    """

    @property
    def alpha(self) -> float:
        """Factor of fading memory, at least 1; 1 for none."""
        return math.sqrt(self.fading)

    @alpha.setter
    def alpha(self, alpha: float) -> None:
        if not (number("alpha", alpha) >= 1 and alpha * alpha < LARGEST):
            raise ValueError(f"alpha must be from 1 to {math.sqrt(LARGEST):g}; got {alpha}")
        self.fading = alpha * alpha
