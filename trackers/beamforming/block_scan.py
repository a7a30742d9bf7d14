"""Scans of several bins and snapshots: responses on the grid, the part in use, amplitudes."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.noise_coherence import NoiseCoherence
from arrivals.measurements import all_true, is_complete
from arrivals.trackers.beamforming.scan_grid import ScanGrid
from arrivals.trackers.beamforming.spectrum import mean_beam_power
from arrivals.trackers.gaussian.linalg import identity, lapack
from arrivals.typing import Bool, Complex, Float

TINY = np.finfo(float).tiny


class ScanResponses(NamedTuple):
    """Responses A, (n_nuisance, n_bins, n_sensors, n_directions), on a grid, and their ‖a‖²."""

    A: Complex
    norm: Float


def has_plain_response(model: ArraySnapshot) -> bool:
    """Return True if the scan is of azimuth, with one bin of isotropic sensors in white noise.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), wavelength=1.0, n_snapshots=8)
    >>> has_plain_response(model), has_plain_response(model.replace(slowness=[0.9, 1.1]))
    (True, False)
    """
    return (
        model.unknowns == "azimuth"
        and model.n_bins == 1
        and model.response is None
        and model.slowness is None
        and model.elevation is None
        and model.coherence is None
    )


def plane_wave_responses(model: ArraySnapshot, directions: Float) -> Complex:
    """Return responses (n_nuisance, n_bins, n_sensors, n) to directions (n,) or (n_unknowns, n).

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), [1.0, 1.2])
    >>> plane_wave_responses(model, np.zeros(3)).shape
    (1, 2, 5, 3)
    """
    if directions.ndim == 1 or len(directions) == 1:
        return model.waves.steering(directions.ravel())
    doa, *others = directions
    a = model.steering_vector(doa, *others).reshape(len(doa), model.n_bins, model.array.n_sensors)
    return np.moveaxis(a, 0, -1)[None]


def whitened_responses(model: ArraySnapshot, directions: Float) -> Complex:
    """Return `plane_wave_responses`, whitened where noise is coherent.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), 1.0, noise_coherence="diffuse")
    >>> whitened_responses(model, np.zeros(3)).shape
    (1, 1, 5, 3)
    """
    A = plane_wave_responses(model, directions)
    return A if model.coherence is None else np.asarray(model.whitening() @ A)


def whitened_covariance(model: ArraySnapshot, R: Complex) -> Complex:
    """Return L R Lᴴ of covariances ([n_bins,] n_sensors, n_sensors); R if the noise is white.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), 1.0, noise_coherence="diffuse")
    >>> whitened_covariance(model, model.coherence.matrix[0]).real.diagonal().round(6)
    array([1., 1., 1., 1., 1.])
    """
    if model.coherence is None:
        return R
    L = model.whitening()
    return np.asarray(L @ R @ np.swapaxes(L.conj(), 1, 2)).reshape(R.shape)


@lru_cache(maxsize=2)  # models are immutable; the responses of a grid can be large
def scan_responses(model: ArraySnapshot, grid: ScanGrid, *, whitened: bool = True) -> ScanResponses:
    """Return the responses of a model on a grid, cached and read-only.

    Parameters
    ----------
    model : ArraySnapshot
        Any array, bins and second unknown.
    grid : ScanGrid
        Directions.
    whitened : bool
        True for responses that are whitened where the noise is coherent.

    Returns
    -------
    ScanResponses
        Responses and norms (n_nuisance, n_bins, n_directions).

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> from arrivals.trackers.beamforming.model_grid import scan_grid
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), [1.0, 1.2])
    >>> scan = scan_responses(model, scan_grid(model, 90))
    >>> scan.A.shape, scan.norm.shape
    ((1, 2, 5, 90), (1, 2, 90))
    """
    A = (whitened_responses if whitened else plane_wave_responses)(model, grid.directions)
    scan = ScanResponses(A, (A.real**2 + A.imag**2).sum(axis=2))
    for shared in scan:
        shared.setflags(write=False)
    return scan


@lru_cache(maxsize=2)
def scan_rows(model: ArraySnapshot, grid: ScanGrid) -> Complex:
    """Return rows a of a model of one snapshot on a grid, (n_directions, n_sensors), cached.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> from arrivals.trackers.beamforming.model_grid import scan_grid
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), 1.0)
    >>> scan_rows(model, scan_grid(model, 90)).shape
    (90, 5)
    """
    A = model.steering_vector(*grid.directions)
    A.setflags(write=False)
    return A


def can_scan(model: ArraySnapshot, sensors: Bool) -> bool:
    """Return False if some sensors, (n_sensors,), are too few for azimuth and elevation.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), 1.0, unknowns="sphere")
    >>> can_scan(model, np.arange(5) > 0), can_scan(model, np.arange(5) > 1)
    (True, False)
    """
    if model.unknowns == "azimuth":
        return True
    try:
        part_in_use(model, sensors, None)
    except ValueError:
        return False
    return True


def part_in_use(model: ArraySnapshot, sensors: Bool, bins: Bool | None) -> ArraySnapshot:
    """Return the model of some sensors, (n_sensors,), and of some bins, (n_bins,); all if None.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), [1.0, 1.2])
    >>> part_in_use(model, np.arange(5) > 0, np.array([False, True])).shape
    (4,)
    """
    if all_true(sensors) and (bins is None or all_true(bins)):
        return model
    return _part(model, sensors.tobytes(), b"" if bins is None else bins.tobytes())


@lru_cache(maxsize=64)
def _part(model: ArraySnapshot, sensors: bytes, bins: bytes) -> ArraySnapshot:
    missing = np.flatnonzero(~np.frombuffer(sensors, dtype=np.bool_))
    waves = model.waves.without(missing)
    noise = model.coherence if isinstance(model.noise_coherence, NoiseCoherence) else None
    used = np.flatnonzero(np.frombuffer(bins, dtype=np.bool_))
    if bins:
        waves = waves.only(used)
    if noise is not None:
        noise = (noise.only(used) if bins else noise).without(missing)
    return model.replace(
        array=waves.array,
        response=waves.response,
        wavelength=list(waves.wavelengths),
        noise_coherence=model.noise_coherence if noise is None else noise,
    )


def root_mean_amplitudes(model: ArraySnapshot, directions: Float, Y: Complex) -> Complex:
    """Return amplitudes of plane waves: the root of the mean power over bins and snapshots.

    The least-squares fit of all waves to each snapshot, each wave at the slowness or elevation of
    its largest beam power.

    Parameters
    ----------
    model : ArraySnapshot
        Model of the snapshots.
    directions : ndarray, shape (n_sources,) or (n_unknowns, n_sources)
        Directions, rad.
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
        Snapshots, NaN where a sensor is missing.

    Returns
    -------
    ndarray, shape (n_sources,)
        Amplitudes, real.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), [1.0, 1.2])
    >>> Y = 3j * model.waves.steering([0.3])[0]
    >>> root_mean_amplitudes(model, np.array([0.3]), Y).real.round(6)
    array([3.])
    """
    if directions.size == 0:
        return np.zeros(0, dtype=np.complex128)
    A = plane_wave_responses(model, directions)
    A = A[0] if len(A) == 1 else strongest(A, [mean_beam_power(a[None], Y) for a in A])
    AH = A.conj().swapaxes(1, 2)
    if is_complete(Y):  # normal equations of a bin, (n_bins, K, K)
        w, n_valid = _least_squares(A, AH, Y), len(Y) * Y.shape[2]
    else:  # of each snapshot, (n_bins, n_snapshots, K, K)
        missing = np.isnan(Y)
        valid, y = ~missing, np.where(missing, 0, Y)
        products = np.einsum("fkm,fmn,fml->fnkl", AH, valid, A, optimize=True)
        right = np.swapaxes(AH @ y, 1, 2)[..., None]
        w = np.swapaxes(np.linalg.solve(_loaded(products), right)[..., 0], 1, 2)
        n_valid = max(int(valid.any(axis=1).sum()), 1)
    return np.asarray(np.sqrt((w.real**2 + w.imag**2).sum(axis=(0, 2)) / n_valid) + 0j)


def strongest(A: Complex, power: ArrayLike) -> Complex:
    """Return responses or filters of directions, each at the nuisance of its largest power.

    Parameters
    ----------
    A : ndarray, shape (n_nuisance, n_bins, n_sensors, n)
        Responses or filters.
    power : array_like, shape (n_nuisance, n)
        Powers.

    Returns
    -------
    ndarray, shape (n_bins, n_sensors, n)

    Examples
    --------
    >>> A = np.array([[1.0, 1.0], [1.0, -1.0]]).reshape(2, 1, 2, 1)
    >>> strongest(A, [[1.0], [3.0]]).ravel()
    array([ 1., -1.])
    """
    best = np.argmax(power, axis=0)
    return np.asarray(np.moveaxis(A[best, :, :, np.arange(len(best))], 0, -1))


def _least_squares(A: Complex, AH: Complex, Y: Complex) -> Complex:
    """Return (AᴴA)⁻¹AᴴY of responses (n_bins, n_sensors, K), AᴴA loaded as by `_loaded`."""
    if len(A) > 1:
        return np.asarray(np.linalg.solve(_loaded(AH @ A), AH @ Y))
    _, w, failed = lapack().zposv(_loaded(AH[0].dot(A[0])), AH[0].dot(Y[0]))  # a third of the time
    if failed:
        raise np.linalg.LinAlgError("steering vectors must be finite")
    return np.asarray(w[None])


def _loaded(G: Complex) -> Complex:
    """Return Gram matrices with 1e-12 of their mean diagonal added: equal waves share."""
    K = G.shape[-1]
    load = np.maximum(1e-12 / K * G.trace(axis1=-2, axis2=-1).real, TINY)
    return np.asarray(G + load[..., None, None] * identity(K))
