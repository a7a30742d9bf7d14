"""Filtering and smoothing of whole sequences by Gaussian filters."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import real_numbers, rows
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import (
    PerStep,
    measurement_vector,
    missing_mask,
    per_step_values,
)
from arrivals.trackers.gaussian.circular import difference, wrapped
from arrivals.trackers.gaussian.equations import predict_gaussian, smooth_gaussian
from arrivals.trackers.gaussian.linalg import Inverse, cholesky
from arrivals.trackers.gaussian.linearization import linear_step
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import positive, real, time_step

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter

Smoothed = tuple[Float, Float, Float, Float]


class BatchOptions(TypedDict, total=False):
    """Keyword arguments of `batch_filter` after filterpy's positional ones."""

    saver: Any
    dts: PerStep


def batch_filter(
    self: GaussianFilter,
    zs: Sequence[ArrayLike | None] | Float,
    Fs: PerStep = None,
    Qs: PerStep = None,
    Hs: PerStep = None,
    Rs: PerStep = None,
    Bs: PerStep = None,
    us: PerStep = None,
    update_first: bool = False,
    **options: Unpack[BatchOptions],
) -> tuple[Float, Float, Float, Float]:
    """Filter a sequence, with the arguments and results of filterpy's method.

    Parameters
    ----------
    zs : sequence of array_like
        One measurement for each step; None or NaN where one is missing.
    Fs, Qs, Hs, Rs, Bs, us : sequence, optional
        One matrix or control input for each step; they replace those of the models.
    update_first : bool
        Update, then predict.
    **options
        saver : filterpy.common.Saver, whose `save` is called after each step.
        dts : sequence of float, the lengths of the steps.

    Returns
    -------
    means, covariances, means_prior, covariances_prior : ndarray
        Shapes (n_steps, *x.shape) and (n_steps, n, n).

    Raises
    ------
    ValueError
        If the length of a sequence differs from that of `zs`.
    """
    saver, dts = _saver_and_dts(**options)
    zs = list(rows("zs", zs))
    n_steps, before = len(zs), dict(vars(self))
    arguments = (per_step_values(name, values, n_steps) for name, values in zip(
        ("Fs", "Qs", "Hs", "Rs", "Bs", "us", "dts"), (Fs, Qs, Hs, Rs, Bs, us, dts), strict=True
    ))  # fmt: skip
    prior, post = [], []
    try:
        for z, F, Q, H, R, B, u, dt in zip(zs, *arguments, strict=True):
            if update_first:
                self.update(z, R, H)
                post.append((self.x, self.P))
            self.predict(u, dt=1.0 if dt is None else dt, F=F, Q=Q, B=B)
            prior.append((self.x, self.P))
            if not update_first:
                self.update(z, R, H)
                post.append((self.x, self.P))
            if saver is not None:
                saver.save()
    except Exception:
        vars(self).update(before)  # arrays are never written into
        raise
    return *_stack(post, self), *_stack(prior, self)


def _saver_and_dts(saver: Any = None, dts: PerStep = None) -> tuple[Any, PerStep]:
    return saver, dts


def _stack(beliefs: list[tuple[Float, Float]], tracker: GaussianFilter) -> tuple[Float, Float]:
    n_steps, n = len(beliefs), tracker.dim_x
    x = np.array([x for x, _ in beliefs], dtype=np.float64)
    P = np.array([P for _, P in beliefs], dtype=np.float64)
    return x.reshape(n_steps, *np.shape(tracker.x)), P.reshape(n_steps, n, n)


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
    Fs, Qs = per_step_values("Fs", Fs, n_steps), per_step_values("Qs", Qs, n_steps)
    us, dts = per_step_values("us", us, n_steps), per_step_values("dts", dts, n_steps)
    for k in range(n_steps - 2, -1, -1):
        dt = 1.0 if dts[k + 1] is None else time_step(dts[k + 1])
        motion, Q = linear_step(self, x[k], P[k], dt, Fs[k + 1], Qs[k + 1])
        # x_pred = f(x) + B u,  P_pred = F P F' + Q
        x_pred = self.add_control(motion.mean, us[k + 1], None)
        P_pred[k], _, _ = cholesky(predict_gaussian(P[k], motion.jacobian, Q))
        # G = P F' P_pred^-1
        G[k] = P[k] @ motion.jacobian.T @ inv(P_pred[k])
        # x = x + G (x_next - x_pred),  P = P + G (P_next - P_pred) G'   (8.6)
        dx = difference(x[k + 1], x_pred, self.state_angles)
        x_smooth, P[k] = smooth_gaussian(x[k], P[k], G[k], dx, P[k + 1] - P_pred[k])
        x[k] = wrapped(x_smooth, self.state_angles)
    return x.reshape(means.shape), P, G, P_pred


def run_batch(
    self: GaussianFilter, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
) -> list[Run]:
    """Run independent sequences, each from the present state, as one array program.

    The tracker itself is not changed. Sequences of unequal lengths are run one by one.

    Parameters
    ----------
    measurements : array_like, shape (n_sequences, n_steps, m), or nested iterables
        NaN or None where one is missing.
    dt : float
        Time between steps.

    Returns
    -------
    list of Run
    """
    positive("dt", dt)
    sequences = [list(rows("measurements", each)) for each in rows("measurements", measurements)]
    if len({len(sequence) for sequence in sequences}) != 1 or not sequences[0]:
        return Tracker.run_batch(self, sequences, dt)
    started = time.perf_counter()
    if not (isinstance(measurements, np.ndarray) and measurements.shape[2:] == (self.dim_z,)):
        measurements = [[measurement_vector(z, self.dim_z) for z in row] for row in sequences]
    xs, Ps = _filter_block(self, real_numbers("measurements", measurements), dt)
    elapsed = (time.perf_counter() - started) / xs.shape[1]
    steps = dt * np.arange(len(xs), dtype=np.float64)
    n_entries = np.full(len(xs), self.dim_x)
    return [
        Run(StateEstimate, {"x": x, "P": P}, x, n_entries, steps, elapsed)
        for x, P in zip(xs.swapaxes(0, 1), Ps.swapaxes(0, 1), strict=True)
    ]


def _filter_block(tracker: GaussianFilter, zs: Float, dt: float) -> tuple[Float, Float]:
    """Return means (n_steps, n_sequences, n) and covariances of all sequences at once."""
    x, P = tracker.belief()
    x = np.repeat(x[None], len(zs), axis=0)
    P = np.repeat(P[None], len(zs), axis=0)
    xs, Ps = [], []
    for z in zs.swapaxes(0, 1):
        x, P = tracker.predict_belief(x, P, dt)
        x, P = tracker.update_belief(x, P, z, missing_mask(z), tracker.held_measurement.R)[:2]
        x = wrapped(x, tracker.state_angles)
        xs.append(x)
        Ps.append(P)
    return np.array(xs), np.array(Ps)
