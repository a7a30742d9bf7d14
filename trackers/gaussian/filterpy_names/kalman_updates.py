"""Steady-state, sequential and correlated updates of the Kalman filter."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.gaussian.arguments import (
    covariance_matrix,
    finite_matrix,
    matrix_with_columns,
    measurement_and_mask,
)
from arrivals.trackers.gaussian.equations import (
    GaussianUpdate,
    log_normal_update,
    update_gaussian,
)
from arrivals.trackers.gaussian.gains import leave_out
from arrivals.trackers.gaussian.linalg import Inverse, cholesky, symmetric
from arrivals.typing import Bool, Float
from arrivals.validation import count, time_step

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.kalman import Kalman


def predict_steadystate(
    self: Kalman, u: ArrayLike | None = None, B: ArrayLike | None = None, *, dt: float = 1.0
) -> None:
    """Predict the mean; the covariance stays.

    Parameters
    ----------
    u : array_like, shape (dim_u,), optional
        Control input; None or 0 for none.
    B : array_like, shape (n, dim_u), optional
        Replaces the motion model's `control` in this step.
    dt : float
        Length of the step.
    """
    (x, P), dt = self.belief(), time_step(dt)
    x = self.held_motion.F(x, dt).dot(x)
    self.record_prediction(self.add_control(x, u, B), P, dt)


def update_steadystate(self: Kalman, z: ArrayLike | None) -> None:
    """Update the mean by the gain `K` of the last update, or an assigned one; P stays.

    Parameters
    ----------
    z : array_like, shape (m,) or (m, 1), or float
        Measurement; None or NaN where it is missing.
    """
    x, P = self.belief()
    measured = self.check_measurement(z, None, None)
    if measured is None:
        self.record_missed()
        return
    z, missing, R = measured
    K, H = finite_matrix("K", self.K, self.dim_x, self.dim_z), self.held_measurement.H(x)
    y = self.innovation(z, H.dot(x), missing, plain=False)
    # S of the last update; S = H P H' + R before the first one
    S = self.S if np.any(self.S) else H @ P @ H.T + R
    likely = log_normal_update(y, S, missing)
    SI = self.SI if np.any(self.SI) else self.inv(S)
    # x = x + K y
    x = x + K.dot(y)
    self.record_update(z, GaussianUpdate(x, P, y, K, S, SI, *likely))


def update_sequential(
    self: Kalman,
    start: int,
    z_i: ArrayLike | None,
    R_i: ArrayLike | None = None,
    H_i: ArrayLike | None = None,
) -> None:
    """Update mean and covariance by some entries of a measurement, from entry `start` on.

    Parameters
    ----------
    start : int
        First entry.
    z_i : array_like, shape (k,) or (k, 1), or float
        Its numbers; None or NaN where one is missing.
    R_i : float or array_like, shape (k, k), optional
        Their noise; that of the measurement model if None.
    H_i : array_like, shape (k, n), optional
        Their rows of H; those of the measurement model if None.

    Warns
    -----
    UserWarning
        If the noise of these entries is correlated with that of others, which is left out.
    """
    x, P = self.belief()
    n, m = self.dim_x, self.dim_z
    given = np.nan if z_i is None else z_i
    values, missing = measurement_and_mask(given, max(np.size(given), 1))
    k = len(values)
    entries = slice(count("start", start, minimum=0), start + k)
    if entries.stop > m:
        raise ValueError(f"start must be at most {m - k} for {k} entries of {m}; got {start}")
    R, H = self.held_measurement.R, self.held_measurement.H(x)
    if R_i is None and np.delete(R[entries], np.r_[entries], axis=1).any():
        text = "R couples entries of z that update_sequential takes apart: use update"
        warnings.warn(text, UserWarning, stacklevel=2)
    R_i = R[entries, entries] if R_i is None else covariance_matrix("R_i", R_i, k)
    H_i = H[entries] if H_i is None else matrix_with_columns("H_i", np.reshape(H_i, (k, -1)), n)
    y = np.where(np.isnan(values), 0.0, values - H_i.dot(x))
    part = update_gaussian(x, P, y, H_i, R_i, missing, self.inv)
    z, residual = np.ravel(self.z).copy(), np.ravel(self.y).copy()
    K, S, SI = self.K.copy(), self.S.copy(), self.SI.copy()
    z[entries], residual[entries], K[:, entries] = values, part.y, part.K
    S[entries, entries], SI[entries, entries] = part.S, part.SI
    self.record_update(z, part._replace(y=residual, K=K, S=S, SI=SI))


def update_correlated(
    self: Kalman, z: ArrayLike | None, R: ArrayLike | None = None, H: ArrayLike | None = None
) -> None:
    """Update mean and covariance where the noises of motion and measurement are correlated.

    The correlation is the attribute `M`, E[w v'], (n, m).

    Parameters
    ----------
    z, R, H
        As in `update`.

    Raises
    ------
    ValueError
        If `M` does not fit P and R: no noises have these correlations.
    """
    x, P = self.belief()
    replaced = None if H is None else matrix_with_columns("H", H, len(x))
    measured = self.check_measurement(z, R, replaced)
    if measured is None:
        self.record_missed()
        return
    z, missing, R = measured
    H = self.held_measurement.H(x) if replaced is None else replaced
    M = finite_matrix("M", self.M, len(x), len(z))
    y = self.innovation(z, H.dot(x), missing, plain=replaced is not None)
    self.record_update(z, correlated_update(x, P, y, (H, R, M), missing, self.inv))


def correlated_update(
    x: Float,
    P: Float,
    y: Float,
    matrices: tuple[Float, Float, Float],
    missing: Bool | None,
    inv: Inverse,
) -> GaussianUpdate:
    """Return the update of a belief by a residual y with the matrices H, R and M.

    References
    ----------
    Simon, *Optimal State Estimation*, 2006, (7.12).

    Examples
    --------
    >>> one, x = np.eye(1), np.zeros(1)
    >>> correlated_update(x, one, x, (one, one, 0.5 * one), None, np.linalg.inv).P
    array([[0.25]])
    """
    H, R, M = matrices
    # S = H P H' + H M + M' H' + R
    HM, PHT = H.dot(M), P.dot(H.T) + M
    S = H.dot(P).dot(H.T) + HM + HM.T + R
    if missing is not None:
        y = np.where(missing, 0.0, y)
        PHT, S = leave_out(missing, PHT, S)
    S, _, _ = cholesky(S)
    SI = inv(S)
    # K = (P H' + M) S^-1
    K = PHT.dot(SI)
    # P = P - K (H P + M') = P - K S K'
    P_post = symmetric(P - K.dot(S).dot(K.T))
    if np.linalg.eigvalsh(P_post)[0] < -1e-9 * np.abs(P).max():
        raise ValueError(f"M must be a correlation that P and R allow; got {M.tolist()}")
    return GaussianUpdate(x + K.dot(y), P_post, y, K, S, SI, *log_normal_update(y, S, missing))
