"""Spatial spectra on a scan grid, and their peaks."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.messages import shown
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import one_of, real, shaped


def scan_directions(array: SensorArray, n: int) -> Float:
    """Return n equally spaced directions: -π/2 to π/2 for a line, the full circle otherwise.

    Parameters
    ----------
    array : SensorArray
        Decides between a line and a circle by its dimension.
    n : int
        Number of directions.

    Returns
    -------
    ndarray, shape (n,)
        Directions, rad.

    Examples
    --------
    >>> np.rad2deg(scan_directions(SensorArray.ula(4, 0.5), 5))
    array([-90., -45.,   0.,  45.,  90.])
    """
    if array.dim == 1:
        return np.linspace(-np.pi / 2, np.pi / 2, n)
    return np.linspace(-np.pi, np.pi, n, endpoint=False)


@lru_cache(maxsize=4)  # arrays are immutable; without the cache it is a third of a step's time
def scan_steering_matrix(array: SensorArray, wavelength: float, n: int) -> tuple[Float, Complex]:
    """Return n scan directions and their steering vectors, cached and read-only.

    Parameters
    ----------
    array : SensorArray
        Array of isotropic sensors.
    wavelength : float
        Wavelength, m.
    n : int
        Number of directions.

    Returns
    -------
    doa_grid : ndarray, shape (n,)
        Directions, rad, as in `scan_directions`.
    A : ndarray, shape (n, n_sensors)
        Rows a(β).

    Examples
    --------
    >>> doa_grid, A = scan_steering_matrix(SensorArray.ula(4, 0.5), 1.0, 5)
    >>> doa_grid.shape, A.shape
    ((5,), (5, 4))
    """
    doa_grid = scan_directions(array, n)
    A = array.steering_vector(doa_grid, wavelength)
    for shared in (doa_grid, A):
        shared.setflags(write=False)
    return doa_grid, A


def bartlett_power(A: Complex, z: ArrayLike) -> Float:
    """Return the Bartlett spectrum |aᴴz|² / ‖a‖² of snapshots.

    Parameters
    ----------
    A : ndarray, shape (n_directions, n_sensors)
        Rows a(β), of entries with unit modulus.
    z : array_like, shape (..., n_sensors)
        Snapshots; sensors that are NaN or infinite are left out.

    Returns
    -------
    ndarray, shape (..., n_directions)
        A plane wave of amplitude w has M|w|² in its direction, M the number of valid sensors.

    Examples
    --------
    >>> bartlett_power(np.ones((1, 3)), [1.0, np.nan, 1.0]).round(6)
    array([2.])
    """
    z = np.asarray(z)
    valid = np.isfinite(z)
    beam = np.where(valid, z, 0) @ A.conj().T
    n_valid = np.maximum(valid.sum(axis=-1, keepdims=True), 1)
    return np.asarray((beam.real**2 + beam.imag**2) / n_valid)


def mean_beam_power(A: Complex, Y: Complex, *, isotropic: bool = False) -> Float:
    """Return the mean of |aᴴy|² / ‖a‖² over bins and snapshots, the largest over a nuisance.

    Parameters
    ----------
    A : ndarray, shape (n_nuisance, n_bins, n_sensors, n_directions)
        Steering vectors for each slowness or elevation.
    Y : ndarray, shape (..., n_bins, n_sensors, n_snapshots)
        Snapshots without valid data are left out, and sensors that are NaN are left out of theirs.
    isotropic : bool
        True if responses have unit modulus: ‖a‖² is the number of valid sensors, without a product.

    Returns
    -------
    ndarray, shape (..., n_directions)
        A plane wave of amplitude w has M|w|² in its direction, M the number of valid sensors.

    Examples
    --------
    >>> mean_beam_power(np.ones((1, 1, 3, 1)), np.array([[[1.0], [np.nan], [1.0]]]))
    array([2.])
    """
    missing = np.isnan(Y)
    if not missing.any():
        return _complete_beam_power(A, Y)
    valid = ~missing
    # axes: ..., nuisance, bins, directions, snapshots; |aᴴy| = |aᵀy*|
    beam = np.swapaxes(A, 2, 3) @ np.where(valid, Y, 0).conj()[..., None, :, :, :]
    if isotropic:
        norm = valid.sum(axis=-2)[..., None, :, None, :]
    else:
        norm = np.swapaxes(A.real**2 + A.imag**2, 2, 3) @ valid[..., None, :, :, :]
    power = (beam.real**2 + beam.imag**2) / np.maximum(norm, 1e-12)
    n_valid = np.maximum(valid.any(axis=-2).sum(axis=(-2, -1)), 1)
    return np.asarray(power.sum(axis=(-3, -1)).max(axis=-2) / n_valid[..., None])


def _complete_beam_power(A: Complex, Y: Complex) -> Float:  # snapshots without gaps
    n_bins, n_sensors, n_snapshots = Y.shape[-3:]
    norm = (A.real**2 + A.imag**2).sum(axis=2)  # (n_nuisance, n_bins, n_directions)
    if n_snapshots > n_sensors:  # aᴴ R a, fewer products than with the snapshots
        RA = (Y @ Y.conj().swapaxes(-1, -2))[..., None, :, :, :] @ A
        beam = np.maximum((A.real * RA.real + A.imag * RA.imag).sum(axis=-2), 0.0)
    else:  # |aᴴy| = |aᵀy*|
        product = Y.conj().swapaxes(-1, -2)[..., None, :, :, :] @ A
        beam = (product.real**2 + product.imag**2).sum(axis=-2)
    power = (beam / np.maximum(norm, 1e-12)).sum(axis=-2).max(axis=-2)
    return np.asarray(power / (n_bins * n_snapshots))


def find_peaks(power: Float, *, circular: bool, joined: bool = False) -> Int:
    """Return the indices of the local maxima of a spectrum, the highest first.

    Parameters
    ----------
    power : ndarray, shape (n_directions,)
        Spectrum on a scan grid.
    circular : bool
        True if the first direction follows the last. The ends of a line's spectrum are peaks if
        they exceed their neighbours.
    joined : bool
        True if the ends of a line's spectrum are one peak at most: `ends_coincide`.

    Returns
    -------
    ndarray of int, shape (n_peaks,)
        Indices into `power`.

    Examples
    --------
    >>> power = np.array([9.0, 1.0, 3.0, 2.0, 4.0, 5.0])
    >>> find_peaks(power, circular=False), find_peaks(power, circular=False, joined=True)
    (array([0, 5, 2]), array([0, 2]))
    """
    power = _spectrum("power", power)
    one_of("circular", circular, (False, True))
    return highest_first(power, circular=circular, joined=joined)


def highest_first(power: Float, *, circular: bool, joined: bool) -> Int:
    """Return what `find_peaks` does, of arguments that need no check.

    Examples
    --------
    >>> highest_first(np.array([9.0, 1.0, 3.0, 2.0]), circular=False, joined=False)
    array([0, 2])
    """
    rise = 1e-9 * power.max()  # the ripple of a flat spectrum is rounding
    peaks = local_maxima(power, circular=circular, joined=joined, rise=rise).nonzero()[0]
    return peaks[(-power[peaks]).argsort(kind="stable")]


def local_maxima(power: Float, *, circular: bool, joined: bool, rise: float = 0.0) -> Bool:
    """Return the mask of the local maxima of spectra.

    Parameters
    ----------
    power : ndarray, shape (..., n_directions)
        Spectra on a scan grid.
    circular, joined : bool
        As in `find_peaks`.
    rise : float
        Minimum difference to the neighbours.

    Returns
    -------
    ndarray of bool, shape (..., n_directions)
    """
    first, last = power[..., :1], power[..., -1:]
    before, after = (last, first) if circular else (power[..., 1:2], power[..., -2:-1])  # even
    extended = np.concatenate([before, power, after], axis=-1)
    is_peak = power > extended[..., :-2] + rise
    is_peak &= power >= extended[..., 2:]
    if joined and not circular and np.count_nonzero(is_peak[..., :: power.shape[-1] - 1]):
        first, last, inner = first[..., 0], last[..., 0], np.maximum(before, after)[..., 0] + rise
        at_last = last > first + rise
        is_peak[..., 0], is_peak[..., -1] = ~at_last & (first > inner), at_last & (last > inner)
    return np.asarray(is_peak)


def refine_peaks(doa_grid: Float, power: Float, peaks: Int) -> Float:
    """Return directions between grid points: vertices of parabolas through the peaks in dB.

    Parameters
    ----------
    doa_grid : ndarray, shape (n_directions,)
        Scan directions, equally spaced, rad.
    power : ndarray, shape (n_directions,)
        Spectrum.
    peaks : ndarray of int, shape (n_peaks,)
        Indices of the peaks.

    Returns
    -------
    ndarray, shape (n_peaks,)
        Directions, rad, at most half a grid step from the peaks.

    Examples
    --------
    >>> level = np.array([3.0, 4.0, 4.0, 3.0])
    >>> refine_peaks(np.arange(4.0), np.exp(level), np.array([1]))
    array([1.5])
    """
    power, doa_grid = _spectrum("power", power), _spectrum("doa_grid", doa_grid)
    shaped("doa_grid", doa_grid, len(power))
    index = real("peaks", peaks)
    is_index = (index >= 0) & (index < len(power)) & (index == np.floor(index))
    if index.ndim != 1 or not is_index.all():
        raise ValueError(f"peaks must be indices below {len(power)}; got {shown(peaks)}")
    level = np.log(np.maximum(power, np.finfo(float).tiny))
    return parabolic_peak(doa_grid, level, index.astype(np.int64))


def _spectrum(name: str, value: ArrayLike) -> Float:
    """Return the values of a function on a scan grid."""
    array = real(name, value)
    if array.ndim != 1 or len(array) < 2:
        raise ValueError(f"{name} must have shape (n_directions,), two or more; got {array.shape}")
    return array


def parabolic_peak(doa_grid: Float, level: Float, peaks: Int) -> Float:
    """Return the vertices of the parabolas through peaks of a level and their two neighbours.

    Parameters
    ----------
    doa_grid : ndarray, shape (n_directions,)
        Scan directions, equally spaced, rad.
    level : ndarray, shape (n_directions,)
        Any function of direction, such as a spectrum in dB.
    peaks : ndarray of int, shape (n_peaks,)
        Indices of the peaks.

    Returns
    -------
    ndarray, shape (n_peaks,)
        Directions, rad, at most half a grid step from the peaks; of a circle in [-π, π).

    Examples
    --------
    >>> parabolic_peak(np.arange(4.0), np.array([3.0, 4.0, 4.0, 3.0]), np.array([1]))
    array([1.5])
    """
    start, end, last = doa_grid.item(0), doa_grid.item(-1), len(level) - 1
    step = doa_grid.item(1) - start
    is_circle = end - start + step > 2 * math.pi * (1 - 1e-9)
    directions = []
    for peak in peaks.tolist():  # numbers: a tenth of the time of arrays for a few peaks
        before, after = peak - 1, peak + 1
        if is_circle:
            after %= last + 1
        else:  # even about the ends
            before, after = abs(before), last - abs(last - after)
        left, middle, right = level.item(before), level.item(peak), level.item(after)
        bend = 2 * middle - left - right
        shift = (right - left) / (2 * bend) if bend > 0 else 0.0
        doa = doa_grid.item(peak) + step * max(min(shift, 0.5), -0.5)
        directions.append(doa + 2 * math.pi if is_circle and doa < -math.pi else doa)
    return np.array(directions, dtype=np.float64)
