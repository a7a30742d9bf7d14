"""Many independent sequences by one Gaussian filter, as one array program."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import real_numbers, rows
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import has_own_steps, measurement_vector, missing_mask
from arrivals.trackers.gaussian.circular import wrapped
from arrivals.trackers.gaussian.sequences.linear_steps import LinearSteps
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import positive

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter


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
    zs = _rectangle(measurements, self.dim_z)
    if isinstance(zs, list):
        return Tracker.run_batch(self, zs, dt)
    started = time.perf_counter()
    filtered = _filter_linear if has_own_steps(self, "linear_steps") else _filter_block
    xs, Ps = filtered(self, zs, dt)
    elapsed = (time.perf_counter() - started) / xs.shape[1]
    steps = dt * np.arange(len(xs), dtype=np.float64)
    n_entries = np.full(len(xs), self.dim_x)
    return [
        Run(StateEstimate, {"x": x, "P": P}, x, n_entries, steps, elapsed)
        for x, P in zip(xs.swapaxes(0, 1), Ps.swapaxes(0, 1), strict=True)
    ]


def _rectangle(
    measurements: Iterable[Iterable[ArrayLike | None]], m: int
) -> Float | list[list[ArrayLike | None]]:
    """Return measurements (n_sequences, n_steps, m), or sequences if they form no array."""
    is_array = isinstance(measurements, np.ndarray) and measurements.shape[2:] == (m,)
    if is_array and np.size(measurements):  # type: ignore[arg-type]  # an array
        return real_numbers("measurements", measurements)
    sequences = [list(rows("measurements", each)) for each in rows("measurements", measurements)]
    if len({len(sequence) for sequence in sequences}) != 1 or not sequences[0]:
        return sequences
    vectors = [[measurement_vector(z, m) for z in sequence] for sequence in sequences]
    return real_numbers("measurements", vectors)


def _filter_block(tracker: GaussianFilter, zs: Float, dt: float) -> tuple[Float, Float]:
    """Return means (n_steps, n_sequences, n) and covariances of all sequences at once."""
    x, P = tracker.belief()
    return _filter_from(tracker, np.repeat(x[None], len(zs), axis=0), P, zs, dt)


def _filter_linear(tracker: GaussianFilter, zs: Float, dt: float) -> tuple[Float, Float]:
    """Return the same of a linear filter: one covariance, while all sequences lack the same."""
    x, P = tracker.belief()
    x = np.repeat(x[None], len(zs), axis=0)
    steps, missing = LinearSteps(tracker, dt), np.isnan(zs)
    n_steps = zs.shape[1]
    differs = np.flatnonzero((missing != missing[:1]).any(axis=(0, 2)))
    n_shared = int(differs[0]) if len(differs) else n_steps
    xs, Ps = np.empty((n_steps, *x.shape)), np.empty((n_steps, *x.shape, x.shape[1]))
    for k in range(n_shared):
        entries = missing[0, k] if missing[0, k].any() else None
        covariances = steps.covariances(P, entries)
        _, x = steps.mean(x, zs[:, k], entries, covariances)
        P = covariances.gain.P
        xs[k], Ps[k] = x, P
    if n_shared < n_steps:
        xs[n_shared:], Ps[n_shared:] = _filter_from(tracker, x, P, zs[:, n_shared:], dt)
    return xs, Ps


def _filter_from(
    tracker: GaussianFilter, x: Float, P: Float, zs: Float, dt: float
) -> tuple[Float, Float]:
    """Return those of `_filter_block` from means (n_sequences, n) and one covariance."""
    P = np.repeat(P[None], len(zs), axis=0)
    xs, Ps = [], []
    for z in zs.swapaxes(0, 1):
        x, P = tracker.predict_belief(x, P, dt)
        x, P = tracker.update_belief(x, P, z, missing_mask(z), tracker.held_measurement.R)[:2]
        x = wrapped(x, tracker.state_angles)
        xs.append(x)
        Ps.append(P)
    return np.array(xs), np.array(Ps)
