"""Interpolation-delay filters over whole sequences, many at once."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.measurements import real_numbers, rows
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.gaussian.arguments import has_own_steps
from arrivals.trackers.interpolation.assembly import ErrorCovariance
from arrivals.trackers.interpolation.channel_filters import ChannelFilters
from arrivals.trackers.interpolation.gating import widened
from arrivals.trackers.interpolation.sample_buffer import SampleBuffer, receive, to_snapshot
from arrivals.trackers.interpolation.updates import predict, transition
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import positive

if TYPE_CHECKING:
    from arrivals.trackers.interpolation.interpolation_ekf import InterpolationEKF


class FilterState(NamedTuple):
    """All that a filter carries from one snapshot to the next."""

    x: Float
    P: Float
    error: ErrorCovariance
    channels: ChannelFilters
    buffer: SampleBuffer


def run(self: InterpolationEKF, measurements: Iterable[ArrayLike | None], dt: float = 1.0) -> Run:
    """Predict and update for each measurement; parameters and result as in `Tracker.run`.

    Of an array of snapshots, only the last steps set the attributes of an update.
    """
    is_array = isinstance(measurements, np.ndarray) and measurements.shape[1:] == (self.dim_z,)
    if not (is_array and has_own_steps(self, "block_steps")):
        return Tracker.run(self, measurements, dt)
    positive("dt", dt)
    started = time.perf_counter()
    snapshots = real_numbers("measurements", measurements)
    valid = np.flatnonzero(np.isfinite(snapshots).any(axis=-1))
    n_before = int(valid[-1]) if len(valid) else 0
    x, _, variance, end = _filtered(self, snapshots[:n_before], dt)
    if n_before:
        self.set_belief(end.x, end.P)
        self.error, self.channels, self.buffer = end.error, end.channels, end.buffer
    xs, variances = list(x), variance.tolist()
    for z in snapshots[n_before:]:
        self.predict(dt=dt)
        self.update(z)
        xs.append(np.ravel(self.x))
        variances.append(float(self.error.of(self.P).variance))
    states = np.array(xs).reshape(len(snapshots), self.dim_x)
    doa, std = directions(self.measurement, states, np.array(variances))
    run = direction_run(doa, std, states, dt, time.perf_counter() - started)
    return run.made_by(self)


def run_batch(
    self: InterpolationEKF, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
) -> list[Run]:
    """Track independent sequences at once, as one array program over the leading axis.

    The tracker itself is not changed.

    Parameters
    ----------
    measurements : array_like, shape (n_sequences, n_steps, n_sensors)
        NaN or None where data are missing; sequences of different lengths run one by one.
    dt : float
        Time between snapshots.

    Returns
    -------
    list of Run
    """
    positive("dt", dt)
    sequences: Sequence[Any] | Float
    if getattr(measurements, "shape", ())[2:] == (self.dim_z,):
        sequences = real_numbers("measurements", measurements)
    else:
        sequences = [
            [to_snapshot(z, self.dim_z) for z in rows("measurements", sequence)]
            for sequence in rows("measurements", measurements)
        ]
    if len({len(sequence) for sequence in sequences}) != 1 or len(sequences[0]) == 0:
        return Tracker.run_batch(self, sequences, dt)
    started = time.perf_counter()
    x, _, variance = beliefs(self, np.array(sequences), dt)
    doa, std = directions(self.measurement, x, variance)
    elapsed = (time.perf_counter() - started) / len(sequences)
    runs = (direction_run(*each, dt, elapsed) for each in zip(doa, std, x, strict=True))
    return [run.made_by(self) for run in runs]


def trajectory(
    self: InterpolationEKF, measurements: ArrayLike, dt: float = 1.0
) -> tuple[Float, Float]:
    """Return the beliefs after every snapshot of independent sequences.

    The tracker itself is not changed.

    Parameters
    ----------
    measurements : array_like, shape (..., n_steps, n_sensors)
        NaN where data are missing.
    dt : float
        Time between snapshots.

    Returns
    -------
    x : ndarray, shape (..., n_steps, dim_x)
    P : ndarray, shape (..., n_steps, dim_x, dim_x)
    """
    return beliefs(self, measurements, dt)[:2]


def beliefs(
    self: InterpolationEKF, measurements: ArrayLike, dt: float
) -> tuple[Float, Float, Float]:
    """Return those of `trajectory`, and the variances of the errors of delays, (..., n_steps)."""
    snapshots = real_numbers("measurements", measurements)
    if snapshots.ndim < 2 or snapshots.shape[-1] != self.dim_z:
        raise ValueError(
            f"measurements must have shape (..., n_steps, {self.dim_z}); got {snapshots.shape}"
        )
    return _filtered(self, snapshots, dt)[:3]


def _filtered(
    self: InterpolationEKF, snapshots: Float, dt: float
) -> tuple[Float, Float, Float, FilterState]:
    """Return those of `beliefs`, and the state after the last snapshot."""
    assembly, lead = self.assembly, snapshots.shape[:-2]
    F, Q = transition(assembly.motion, dt)
    x, P = (np.broadcast_to(a, (*lead, *a.shape)) for a in self.belief())
    M = self.error.of(self.P).M
    error = ErrorCovariance(P, None if M is None else np.broadcast_to(M, (*lead, *M.shape)))
    channels, buffer = self.channels.broadcast(lead), self.buffer.broadcast(lead)
    n_steps = snapshots.shape[-2]
    xs, Ps = np.empty((*lead, n_steps, len(F))), np.empty((*lead, n_steps, *F.shape))
    variances = np.empty((*lead, n_steps))
    for k in range(n_steps):
        x, P = predict(x, P, F, Q)
        P = prior = widened(P, buffer.missing, assembly.largest_variance)
        error = assembly.predicted_error(error, P, F, Q, buffer.missing)
        channels, buffer = receive(self, channels, buffer, snapshots[..., k, :])
        samples = buffer.scaled(self.measurement)
        x, P, misfit = assembly.update(x, P, samples, buffer.n_snapshots, buffer.misfit)
        buffer = buffer.with_misfit(misfit)
        error = assembly.updated_error(error, prior, x, P, buffer.n_snapshots)
        xs[..., k, :], Ps[..., k, :, :], variances[..., k] = x, P, error.variance
    return xs, Ps, variances, FilterState(x, P, error, channels, buffer)


def directions(measurement: ArraySamples, x: Float, variance: Float) -> tuple[Float, Float]:
    """Return the directions of beliefs and their standard deviations, rad."""
    delay, std = x[..., 0], np.sqrt(np.maximum(variance, 0.0))
    return measurement.doa(delay), measurement.doa_std(delay, std)


def direction_run(doa: Float, std: Float, x: Float, dt: float, elapsed: float) -> Run:
    """Return a run of one direction a step, (n_steps,), with states x (n_steps, dim_x)."""
    n = len(doa)
    nan = np.full((n, 1), np.nan)
    fields = {
        "doa": doa[:, None],
        "std": std[:, None],
        "existence": nan,
        "amplitude": nan.astype(complex),
        "label": np.zeros((n, 1), dtype=np.int64),
        "converged": np.ones(n, dtype=np.bool_),
        "iterations": np.zeros(n, dtype=np.int64),
        "noise": np.full(n, np.nan),
    }
    ones = np.ones(n, dtype=np.int64)
    return Run(DirectionEstimate, fields, x, ones, dt * np.arange(n, dtype=np.float64), elapsed)
