"""Sparse Bayesian learning on a grid, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.base import is_missing
from arrivals.trackers.beamforming.cbf import look_directions
from arrivals.trackers.direction_tracker import BatchDirectionTracker
from arrivals.trackers.registry import register
from arrivals.trackers.sparse_bayes.fixed_point import Powers, SparseBayes, highest
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance, not_negative, positive, probability

Heard = tuple[Complex, Bool]


@register("sbl")
class SBL(BatchDirectionTracker):
    """Sparse Bayesian learning: the peaks of a sparse power spectrum, every step on its own.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array; its noise is not used: the method estimates it.
    n_directions : int
        Grid: over ±90° for a line (361: every half degree), else over the circle.
    threshold : float
        Peaks below this share of the highest are not reported.
    start_power, start_noise : float
        Where the powers and the noise start. They are absolute: unlike `VALSE`, the method is not
        quite indifferent to the scale of the snapshots.
    tolerance : float
        Relative change of the powers at which the iteration rests.
    max_iterations : int
    max_sources : int, optional
        Peaks at most; as many as there are sensors if None.

    Attributes
    ----------
    doa_grid, gamma : ndarray, shape (n_directions,)
        Grid, rad, and the powers of the last step heard; NaN before there was one.
    start : ndarray, shape (n_directions,)
        Where the powers of the next update start.
    noise : float
        Estimated variance of the noise of one sensor.
    x, P : ndarray, shapes (n_slots,), (n_slots, n_slots)
        The directions found, rad, NaN in unused places; zeros: they have no variances.

    Notes
    -----
    A step is one snapshot (n_sensors,), or several (n_snapshots, n_sensors) that share their
    directions. Sensors that are NaN in one of them are left out of the step. Directions are grid
    points; `std` and `existence` are NaN, labels -1. Amplitudes are those of the plane waves of
    the peaks that fit the last snapshot of the step best, in least squares.

    References
    ----------
    Gerstoft, Mecklenbräuker, Xenaki and Nannuru, "Multisnapshot sparse Bayesian learning for DOA",
    IEEE Signal Process. Lett. 23(10), 2016.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> z = model.simulate(np.deg2rad([-20.0, 30.5]), [1.0, 1.0j], np.random.default_rng(0))
    >>> tracker = SBL(model)
    >>> tracker.update(z)
    >>> np.rad2deg(np.sort(tracker.estimate.doa)).round(1)
    array([-20. ,  30.5])
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        n_directions: int = 361,
        threshold: float = 0.01,
        start_power: float = 1.0,
        start_noise: float = 0.1,
        tolerance: float = 1e-3,
        max_iterations: int = 1000,
        max_sources: int | None = None,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        measurement.plain_wavelength("sbl")
        self.n_directions = count("n_directions", n_directions, least=3)
        self.threshold = probability("threshold", threshold)
        self.start_power = positive("start_power", start_power)
        self.start_noise = positive("start_noise", start_noise)
        self.tolerance = positive("tolerance", tolerance)
        self.max_iterations = count("max_iterations", max_iterations)
        self.max_sources = max_sources
        if max_sources is not None:
            count("max_sources", max_sources)
        self.doa_grid = look_directions(measurement.array, n_directions)
        self.gamma = np.full(n_directions, np.nan)
        self.predict()

    @property
    def n_slots(self) -> int:
        """Number of peaks that may be reported at once."""
        return self.max_sources or self.measurement.array.n_sensors

    @property
    def circular(self) -> bool:
        """Whether the first direction of the grid follows the last."""
        return self.measurement.array.dim > 1

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Set where the powers start; report nothing until something is heard."""
        not_negative("dt", dt)
        self.start = self.next_start()
        self.report([])

    def next_start(self) -> Float:
        """Return where the powers of the next update start: all alike."""
        return np.full(self.n_directions, self.start_power)

    def update(self, z: ArrayLike | None) -> None:
        """Fit one snapshot, (n_sensors,), or several that share their directions, one a row."""
        heard = None if is_missing(z) else self._heard(np.asarray(z))
        if heard is not None:
            Y, sensors = heard
            self._take(self._fit(Y[None], sensors, self._from()[None]), 0, heard)

    def step_batch(self, trackers: Sequence[Self], step: Sequence[Any], dt: float) -> None:
        """Fit, as one batch each, the steps in which the same sensors gave as many snapshots."""
        groups: dict[tuple[int, bytes], list[tuple[Self, Heard]]] = {}
        for tracker, z in zip(trackers, step, strict=True):
            tracker.predict(dt=dt)
            heard = None if is_missing(z) else tracker._heard(np.asarray(z))
            if heard is not None:
                key = heard[0].shape[1], heard[1].tobytes()
                groups.setdefault(key, []).append((tracker, heard))
        for group in groups.values():
            Y = np.stack([heard[0] for _, heard in group])
            starts = np.stack([tracker._from() for tracker, _ in group])
            powers = self._fit(Y, group[0][1][1], starts)
            for n, (tracker, heard) in enumerate(group):
                tracker._take(powers, n, heard)

    def _heard(self, z: Complex) -> Heard | None:
        """Return the snapshots (n_sensors, n_snapshots) of the sensors heard; None for silence."""
        if z.ndim == 2 and z.dtype.kind in "fc":
            z = z[~np.isnan(z).all(axis=1)]
        rows = z if z.ndim == 2 else z[None]
        Y = np.stack([self.measurement.snapshot(row) for row in rows], axis=1)
        sensors: Bool = np.asarray(~np.isnan(Y).any(axis=1))
        return (Y[sensors], sensors) if sensors.sum() > 1 and Y[sensors].any() else None

    def _from(self) -> Float:
        fits = self.start.shape == (self.n_directions,)
        return self.start if fits else np.full(self.n_directions, self.start_power)

    def _waves(self, doa: Float, sensors: Bool) -> Complex:
        return self.measurement.steering_vector(doa)[:, sensors]

    def _fit(self, Y: Complex, sensors: Bool, start: Float) -> Powers:
        grid = look_directions(self.measurement.array, self.n_directions)
        A = self._waves(grid, sensors) / np.sqrt(sensors.sum())
        rule = SparseBayes(
            tolerance=self.tolerance, max_iterations=self.max_iterations, circular=self.circular
        )
        return rule.fit(A, Y, start, self.start_noise)

    def _take(self, powers: Powers, n: int, heard: Heard) -> None:
        """Report the peaks of the nth fit."""
        gamma = powers.gamma[n]
        grid = look_directions(self.measurement.array, self.n_directions)
        top, there = highest(gamma, min(self.n_slots, len(grid)), self.circular)
        top = top[there & (gamma[top] > self.threshold * gamma[top[0]])]
        nan = np.full(len(top), np.nan)
        self.doa_grid, self.gamma = grid, gamma
        self.report(
            doa=grid[top],
            std=nan,
            existence=nan,
            amplitude=self._amplitudes(grid[top], *heard),
            label=np.full(len(top), -1),
            converged=bool(powers.converged[n]),
            iterations=int(powers.iterations[n]),
            noise=float(powers.noise[n]),
        )

    def _amplitudes(self, doa: Float, Y: Complex, sensors: Bool) -> Complex:
        return np.asarray(np.linalg.lstsq(self._waves(doa, sensors).T, Y[:, -1], rcond=None)[0])
