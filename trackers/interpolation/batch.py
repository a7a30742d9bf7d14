"""Interpolation-delay filters over whole sequences, many at once."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.interpolation.sample_buffer import to_snapshot
from arrivals.trackers.interpolation.updates import predict, transition
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import positive

if TYPE_CHECKING:
    from arrivals.trackers.interpolation.interpolation_ekf import InterpolationEKF


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
    sequences = [[to_snapshot(z, self.dim_z) for z in sequence] for sequence in measurements]
    if len({len(sequence) for sequence in sequences}) != 1 or not sequences[0]:
        return Tracker.run_batch(self, sequences, dt)
    started = time.perf_counter()
    x, P = self.trajectory(np.array(sequences), dt)
    doa, std = directions(self.measurement, x, P)
    elapsed = (time.perf_counter() - started) / len(sequences)
    return [direction_run(*each, dt, elapsed) for each in zip(doa, std, x, strict=True)]


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
    frames = self.measurement.frame(measurements)
    if frames.ndim < 2:
        raise ValueError(
            f"measurements must have shape (..., n_steps, n_sensors); got {frames.shape}"
        )
    power, noise_ratio = self.measurement.power, self.measurement.noise_ratio
    assembly, lead = self.assembly, frames.shape[:-2]
    F, Q = transition(assembly.motion, dt)
    x, P = (np.broadcast_to(a, (*lead, *a.shape)) for a in self.belief())
    buffer = self.buffer.broadcast(lead)
    xs, Ps = np.empty((*frames.shape[:-1], len(F))), np.empty((*frames.shape[:-1], *F.shape))
    for k in range(frames.shape[-2]):
        buffer = buffer.append(frames[..., k, :])
        x, P = predict(x, P, F, Q)
        x, P = assembly.update(x, P, buffer.scaled(power, noise_ratio), buffer.n_snapshots)
        xs[..., k, :], Ps[..., k, :, :] = x, P
    return xs, Ps


def directions(measurement: ArraySamples, x: Float, P: Float) -> tuple[Float, Float]:
    """Return the directions of beliefs and their standard deviations, rad."""
    delay, variance = x[..., 0], np.maximum(P[..., 0, 0], 0.0)
    return measurement.doa(delay), measurement.doa_std(delay, np.sqrt(variance))


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
