"""The conventional beamformer: peaks of the beam power, frame by frame."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.trackers.base import is_missing
from arrivals.trackers.direction_tracker import DirectionTracker
from arrivals.trackers.registry import register
from arrivals.typing import Complex, Float, Int
from arrivals.validation import count, instance, not_negative, positive


def look_directions(array: SensorArray, n: int) -> Float:
    """Return n directions, rad: -π/2 to π/2 for a line, the full circle otherwise.

    Examples
    --------
    >>> np.rad2deg(look_directions(SensorArray.ula(4, 0.5), 5))
    array([-90., -45.,   0.,  45.,  90.])
    """
    if array.dim == 1:
        return np.linspace(-np.pi / 2, np.pi / 2, n)
    return np.linspace(-np.pi, np.pi, n, endpoint=False)


@lru_cache(maxsize=4)  # of parts that never change; it was a third of the time of a step
def look_vectors(array: SensorArray, wavelength: float, n: int) -> tuple[Float, Complex]:
    """Return n look directions and their steering vectors, (n, n_sensors), not to be written to.

    Examples
    --------
    >>> doa_grid, A = look_vectors(SensorArray.ula(4, 0.5), 1.0, 5)
    >>> doa_grid.shape, A.shape
    ((5,), (5, 4))
    """
    doa_grid = look_directions(array, n)
    A = array.steering_vector(doa_grid, wavelength)
    for shared in (doa_grid, A):
        shared.setflags(write=False)
    return doa_grid, A


def beam_power(A: Complex, z: ArrayLike) -> Float:
    """Return |aᴴz|² of unit-norm steering vectors: the Bartlett spectrum.

    Parameters
    ----------
    A : ndarray, shape (n_directions, n_sensors)
        Rows a(β), of entries with unit modulus.
    z : array_like, shape (..., n_sensors)
        Snapshots; sensors that are NaN or infinite are left out.

    Returns
    -------
    ndarray, shape (..., n_directions)
        A plane wave of amplitude w gives M|w|² in its direction, M the sensors left.

    Examples
    --------
    >>> beam_power(np.ones((1, 3)), [1.0, np.nan, 1.0]).round(6)
    array([2.])
    """
    z = np.asarray(z)
    heard = np.isfinite(z)
    beam = np.where(heard, z, 0) @ A.conj().T
    n_heard = np.maximum(heard.sum(axis=-1, keepdims=True), 1)
    return np.asarray((beam.real**2 + beam.imag**2) / n_heard)


def looks_power(A: Complex, Y: Complex) -> Float:
    """Return the mean of |aᴴy|² / ‖a‖² over looks, the largest over a second unknown.

    Parameters
    ----------
    A : ndarray, shape (n_nuisance, n_bins, n_sensors, n_directions)
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
        Looks without a number are left out, and sensors that are NaN are left out of theirs.

    Returns
    -------
    ndarray, shape (n_directions,)

    Examples
    --------
    >>> looks_power(np.ones((1, 1, 3, 1)), np.array([[[1.0], [np.nan], [1.0]]]))
    array([2.])
    """
    heard = ~np.isnan(Y)
    beam = np.swapaxes(A.conj(), 2, 3) @ np.where(heard, Y, 0)  # (S, F, n, N)
    norm = np.swapaxes(A.real**2 + A.imag**2, 2, 3) @ heard
    power = (beam.real**2 + beam.imag**2) / np.maximum(norm, 1e-12)
    n_looks = max(int(heard.any(axis=1).sum()), 1)
    return np.asarray(power.sum(axis=(1, 3)).max(axis=0) / n_looks)


def peaks(power: Float, *, circular: bool) -> Int:
    """Return the indices of the local maxima of a spectrum, the highest first.

    The ends of a line's spectrum are never peaks.

    Examples
    --------
    >>> peaks(np.array([9.0, 1.0, 3.0, 2.0, 4.0, 0.0]), circular=False)
    array([4, 2])
    """
    rise = 1e-9 * power.max()  # a flat spectrum has none: its ripple is rounding
    around = np.concatenate([power[-1:], power, power[:1]])
    top = (power > around[:-2] + rise) & (power >= around[2:])
    if not circular:
        top[[0, -1]] = False
    found = top.nonzero()[0]
    return np.asarray(found[np.argsort(-power[found], kind="stable")])


def refined(doa_grid: Float, power: Float, top: Int) -> Float:
    """Return the vertices of the parabolas through peaks and neighbours, in dB.

    Parameters
    ----------
    doa_grid, power : ndarray, shape (n_directions,)
        Look directions, equally far apart, rad, and the spectrum.
    top : ndarray of int, shape (n_peaks,)
        Indices of the peaks.

    Examples
    --------
    >>> level = np.array([3.0, 4.0, 4.0, 3.0])
    >>> refined(np.arange(4.0), np.exp(level), np.array([1]))
    array([1.5])
    """
    return parabolic(doa_grid, np.log(np.maximum(power, np.finfo(float).tiny)), top)


def parabolic(doa_grid: Float, level: Float, top: Int) -> Float:
    """Return the vertices of the parabolas through peaks of a level and their neighbours.

    Examples
    --------
    >>> parabolic(np.arange(4.0), np.array([3.0, 4.0, 4.0, 3.0]), np.array([1]))
    array([1.5])
    """
    left, middle, right = level[top - 1], level[top], level[(top + 1) % len(level)]
    bend = 2 * middle - left - right
    shift = (right - left) / (2 * np.where(bend > 0, bend, np.inf))
    step = doa_grid[1] - doa_grid[0]
    return np.asarray(doa_grid[top] + step * np.maximum(np.minimum(shift, 0.5), -0.5))


@register("cbf")
class CBF(DirectionTracker):
    """Peaks of the conventional beamformer, within some dB of the highest.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array; its noise is not used. Of several looks a step the powers are averaged, each
        direction at the slowness or elevation that suits it best.
    n_directions : int
        Look directions: over ±90° for a line (361: every half degree), else over the circle.
    threshold_db : float
        Peaks lower than this below the highest are not reported.
    max_sources : int, optional
        Peaks at most; as many as there are sensors if None.

    Attributes
    ----------
    doa_grid, power : ndarray, shape (n_directions,)
        Look directions, rad, and the beam power of the last snapshot; NaN before there was one.

    Notes
    -----
    It looks at one frame at a time: labels are -1, `std` and `existence` NaN. A peak is refined
    by a parabola through three points of the spectrum in dB.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, section VI (the comparator CBF).

    Examples
    --------
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0)
    >>> tracker = CBF(model, threshold_db=3.0)
    >>> tracker.update(model.array.steering_vector(0.5, 1.0))
    >>> tracker.estimate.doa.round(3), abs(tracker.estimate.amplitude).round(3)
    (array([0.5]), array([1.]))
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        n_directions: int = 361,
        threshold_db: float = 10.0,
        max_sources: int | None = None,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.n_directions = count("n_directions", n_directions, least=3)
        self.threshold_db = positive("threshold_db", threshold_db)
        self.max_sources = max_sources
        if max_sources is not None:
            count("max_sources", max_sources)
        self.doa_grid = look_directions(measurement.array, n_directions)
        self.predict()

    @property
    def n_slots(self) -> int:
        """Number of peaks that may be reported at once."""
        return self.max_sources or self.measurement.array.n_sensors

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Forget: nothing is carried from snapshot to snapshot."""
        not_negative("dt", dt)
        self.power = np.full(self.n_directions, np.nan)
        self.report([])

    def update(self, z: ArrayLike | None) -> None:
        """Scan one measurement; sensors that are NaN or infinite are left out."""
        if is_missing(z):
            return
        z = self.measurement.snapshot(np.asarray(z))
        array = self.measurement.array
        self.doa_grid = look_directions(array, self.n_directions)
        self.power = self._scan(z)
        top = peaks(self.power, circular=array.dim > 1)
        high = self.power[top] > self.power.max() * 10 ** (-self.threshold_db / 10)
        doa = refined(self.doa_grid, self.power, top[high][: self.n_slots])
        self.report(
            doa=doa,
            std=np.full(len(doa), np.nan),
            existence=np.full(len(doa), np.nan),
            amplitude=self._amplitude(doa, z),
            label=np.full(len(doa), -1),
        )

    def _scan(self, z: Complex) -> Float:
        model = self.measurement
        if model.is_single and model.response is None:
            return self.spectrum(model.steering_vector(self.doa_grid), z)
        return looks_power(model.waves.steering(self.doa_grid), model.looks(z))

    def _amplitude(self, doa: Float, z: Complex) -> Complex:
        """Return amplitudes; of several looks, or unequal elements, the root of the mean power."""
        model = self.measurement
        if model.is_single and model.response is None:
            return self.beam(model.steering_vector(doa), z)
        A = model.waves.steering(doa)
        norm = (A.real**2 + A.imag**2).sum(axis=2).mean(axis=(0, 1))
        return np.asarray(np.sqrt(looks_power(A, model.looks(z)) / norm) + 0j)

    def spectrum(self, A: Complex, z: Complex) -> Float:
        """Return the power of one snapshot from directions with steering vectors A."""
        return beam_power(A, z)

    def beam(self, A: Complex, z: Complex) -> Complex:
        """Return the amplitudes of plane waves with steering vectors A, each as if alone."""
        heard = ~np.isnan(z)
        return np.asarray(A[:, heard].conj() @ z[heard] / heard.sum())
