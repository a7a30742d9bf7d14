"""Samples on their way into a tracker: zeros, clicks and other bands are left out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.measurement_models.delays.band_filter import BandFilter
from arrivals.trackers.interpolation.zero_runs import ZeroRuns
from arrivals.typing import Float

LEARNING = 20  # samples of a channel before its steps are limited
LONGEST_HOLD = 20  # missing samples that a held sample replaces in a filter
NEGLIGIBLE = 1e-9  # of the tolerance: errors that count as none
UNKNOWN = 1e3  # variance, over the power of the source, of what preceded the first sample


def settling_steps(band_filter: BandFilter | None, noise_ratio: float) -> int:
    """Return the number of first samples that a filter does not pass on.

    Examples
    --------
    >>> settling_steps(BandFilter(0.1, 0.2), 0.01)
    82
    """
    if band_filter is None:
        return 0
    tolerance = min(noise_ratio, 1.0)
    return math.ceil(math.log(tolerance / UNKNOWN) / math.log(band_filter.radius**2))


@dataclass(frozen=True, eq=False)
class ChannelFilters:
    """Filters of all channels to the band of the source, and the samples they need.

    In front of the filter, a sample that steps away from the last one by `2 gate` times the
    usual step is missing, unless it stays there. A missing sample is replaced by the last one. What
    that does to the filtered samples decays with the filter; until it is below the noise, they are
    missing.

    Parameters
    ----------
    band_filter : BandFilter or None
        Nothing is filtered if None.
    tolerance : float
        Largest error of filtered samples, over the power of the source.
    zero_runs : ZeroRuns
    state : ndarray, shape (..., n_states, n_channels)
        Of the filters.
    last : ndarray, shape (..., n_channels)
        Last valid sample; NaN before the first.
    age : ndarray, shape (..., n_channels)
        Steps from it to the next sample.
    error : ndarray, shape (..., n_channels)
        Variance of filtered samples due to replaced ones, over the power of the source.
    energy, n_steps : ndarray, shape (..., n_channels)
        Sum of squares of all steps so far, without their outliers, and their number.
    settled : bool
        True if no sample is missing and no error is left.
    """

    band_filter: BandFilter | None
    tolerance: float
    zero_runs: ZeroRuns
    state: Float
    last: Float
    age: Float
    error: Float
    energy: Float
    n_steps: Float
    settled: bool = False

    @classmethod
    def start(cls, measurement: ArraySamples) -> ChannelFilters:
        """Return the state before the first sample."""
        band_filter, nothing = measurement.band_filter, np.zeros(len(measurement.grid_index))
        n_states = 0 if band_filter is None else len(band_filter.rest)
        return cls(
            band_filter, min(measurement.noise_ratio, 1.0), ZeroRuns.start(len(nothing)),
            np.zeros((n_states, len(nothing))), nothing + np.nan, nothing + 1, nothing + UNKNOWN,
            nothing, nothing,
        )  # fmt: skip

    def broadcast(self, shape: tuple[int, ...]) -> ChannelFilters:
        """Return the same state for recordings of leading axes `shape`."""
        names = ("state", "last", "age", "error", "energy", "n_steps")
        arrays: dict[str, Any] = {
            name: np.broadcast_to(value := getattr(self, name), shape + value.shape)
            for name in names
        }
        return replace(self, zero_runs=self.zero_runs.broadcast(shape), **arrays)

    def accept(self, z: Float, gate: float | None) -> tuple[ChannelFilters, Float]:
        """Return the state after samples (..., n_channels), and those for the tracker, or NaN."""
        zero_runs, z = self.zero_runs.without_zeros(z)
        if self.band_filter is None:
            return self if zero_runs is self.zero_runs else replace(self, zero_runs=zero_runs), z
        step = z - self.last
        square, limit = step * step, self._limit(gate)
        if self.settled and (square <= limit).all():  # the usual case; NaN is not
            y, state = _filtered(self.band_filter, z, self.state)
            energy, n_steps = self.energy + square, self.n_steps + 1
            return replace(
                self, zero_runs=zero_runs, state=state, last=z, energy=energy, n_steps=n_steps
            ), y
        known = np.isfinite(square)
        square = np.where(known, square, 0.0)
        jumped, valid = square > limit, np.isfinite(z) & (square <= limit * self.age**2)
        energy = self.energy + np.minimum(square / self.age**2, limit)
        restarted = valid & (jumped | np.isnan(self.last) | (self.age > LONGEST_HOLD))
        held = np.where(valid, z, np.nan_to_num(self.last))
        rest = self.band_filter.rest[:, None] * held[..., None, :]
        y, state = _filtered(
            self.band_filter, held, np.where(restarted[..., None, :], rest, self.state)
        )
        # an error decays by r² in each step; that of a held sample grows with its age
        decay = self.band_filter.radius**2
        added = np.where(valid, 0.0, np.minimum(self.age**2, UNKNOWN))
        error = np.where(restarted, UNKNOWN, decay * self.error + (1 - decay) * added)
        error = np.where(error < NEGLIGIBLE * self.tolerance, 0.0, error)
        after = ChannelFilters(
            self.band_filter, self.tolerance, zero_runs, state, np.where(valid, z, self.last),
            np.where(valid, 1.0, self.age + 1), error, energy, self.n_steps + known,
            bool(valid.all()) and not error.any(),
        )  # fmt: skip
        return after, np.where(valid & (error <= self.tolerance), y, np.nan)

    def _limit(self, gate: float | None) -> Float | float:
        """Return the largest square of a step that is no jump."""
        if gate is None:
            return np.inf
        if self.settled:
            return (2 * gate) ** 2 * self.energy / self.n_steps
        limit = (2 * gate) ** 2 * self.energy / np.maximum(self.n_steps, 1)
        return np.where(self.n_steps < LEARNING, np.inf, limit)


def _filtered(band_filter: BandFilter, x: Float, state: Float) -> tuple[Float, Float]:
    """Return filtered samples and the states after them: [y; s'] = M [x; s]."""
    new = band_filter.step @ np.concatenate([x[..., None, :], state], axis=-2)
    return new[..., 0, :], new[..., 1:, :]
