"""Rauch-Tung-Striebel smoother of Gaussian filters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.gaussian.arguments import PerStep, has_own_steps, per_step_values
from arrivals.trackers.gaussian.circular import difference, wrapped
from arrivals.trackers.gaussian.equations import predict_gaussian, smooth_gaussian
from arrivals.trackers.gaussian.linalg import Inverse, cholesky, transposed
from arrivals.trackers.gaussian.linearization import linear_step
from arrivals.typing import Float
from arrivals.validation import real, time_step

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter

Smoothed = tuple[Float, Float, Float, Float]


def rts_smoother(
    self: GaussianFilter,
    Xs: ArrayLike,
    Ps: ArrayLike,
    Fs: PerStep = None,
    Qs: PerStep = None,
    inv: Inverse = np.linalg.inv,
    *,
    us: PerStep = None,
    dts: PerStep = None,
) -> Smoothed:
    """Smooth the results of `batch_filter` or `run`: Rauch-Tung-Striebel smoother.

    Parameters
    ----------
    Xs : array_like, shape (n_steps, n) or (n_steps, n, 1)
        Filtered means.
    Ps : array_like, shape (n_steps, n, n)
        Filtered covariances.
    Fs, Qs, us, dts : sequence, optional
        One for each step, as in `batch_filter`; those of step k+1 lead from k to k+1.
    inv : callable
        Inverts predicted covariances.

    Returns
    -------
    x, P, K, Pp : ndarray
        Smoothed means and covariances, gains, and predicted covariances; the last of `K` is
        zero, the last of `Pp` that of `Ps`, as in filterpy.

    Raises
    ------
    ValueError
        If lengths differ.

    References
    ----------
    Särkkä, *Bayesian Filtering and Smoothing*, 2013, (8.6), (9.6) and (9.17).
    """
    self.take_back()
    means, P = real("Xs", Xs), np.array(real("Ps", Ps))
    n_steps, n = len(means), self.dim_x
    if P.shape != (n_steps, n, n):
        raise ValueError(f"Ps must have shape {(n_steps, n, n)}; got {P.shape}")
    x, P_pred, G = means.reshape(n_steps, n).copy(), P.copy(), np.zeros_like(P)
    f, F, Q = _motions(self, x, P, (Fs, Qs, us, dts))
    # x_pred = f(x) + B u,  P_pred = F P F' + Q
    P_pred[:-1] = _with_factors(predict_gaussian(P[:-1], F, Q))
    # G = P F' P_pred^-1
    G[:-1] = P[:-1] @ transposed(F) @ _inverses(P_pred[:-1], inv)
    for k in range(n_steps - 2, -1, -1):
        # x = x + G (x_next - x_pred),  P = P + G (P_next - P_pred) G'   (8.6)
        dx = difference(x[k + 1], f[k], self.state_angles)
        x_smooth, P[k] = smooth_gaussian(x[k], P[k], G[k], dx, P[k + 1] - P_pred[k])
        x[k] = wrapped(x_smooth, self.state_angles)
    return x.reshape(means.shape), P, G, P_pred


def _motions(
    tracker: GaussianFilter, x: Float, P: Float, replaced: tuple[PerStep, ...]
) -> tuple[Float, Float, Float]:
    """Return f(x) + B u, F and Q of the steps from each belief to the next one."""
    n_steps, constant = len(x), all(each is None for each in replaced)
    names = ("Fs", "Qs", "us", "dts")
    Fs, Qs, us, dts = (
        per_step_values(*each, n_steps) for each in zip(names, replaced, strict=True)
    )
    if constant and has_own_steps(tracker, "linear_steps") and n_steps > 1:
        motion, Q = linear_step(tracker, x[:-1], P[:-1], 1.0)
        return motion.mean, motion.jacobian, Q
    f, F, noise = np.zeros((n_steps - 1, x.shape[1])), np.zeros_like(P[1:]), np.zeros_like(P[1:])
    for k in range(n_steps - 1):
        dt = 1.0 if dts[k + 1] is None else time_step(dts[k + 1])
        motion, noise[k] = linear_step(tracker, x[k], P[k], dt, Fs[k + 1], Qs[k + 1])
        f[k], F[k] = tracker.add_control(motion.mean, us[k + 1], None), motion.jacobian
    return f, F, noise


def _with_factors(P: Float) -> Float:
    """Return covariances (n_steps, n, n), with jitter where one has no Cholesky factor."""
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        return np.array([cholesky(each)[0] for each in P])
    return P


def _inverses(P: Float, inv: Inverse) -> Float:
    """Return the inverses of matrices (n_steps, n, n) by a function of one matrix."""
    return np.array(inv(P) if inv is np.linalg.inv else [inv(each) for each in P])
