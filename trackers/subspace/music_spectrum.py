"""MUSIC's spectrum, and the search for its peaks on a line, the circle and the sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.trackers.beamforming.block_scan import (
    has_plain_response,
    scan_responses,
    whitened_responses,
)
from arrivals.trackers.beamforming.scan_ends import scan_is_joined
from arrivals.trackers.beamforming.scan_grid import AngleGrid, ScanGrid, inverse_level
from arrivals.trackers.beamforming.spectrum import scan_steering_matrix
from arrivals.trackers.subspace.base import Subspaces
from arrivals.typing import Complex, Float

MAX_SPECTRUM = 1e10  # without noise the spectrum is infinite at the sources
TINY = np.finfo(float).tiny


def music_spectrum(A: ArrayLike, noise_subspace: Complex) -> Float:
    """Return MUSIC's spectrum ‖a‖² / ‖Eᴴa‖²: 1 in the noise subspace, large at the sources.

    Parameters
    ----------
    A : array_like, shape (n_directions, n_sensors)
        Rows a(β).
    noise_subspace : ndarray, shape (..., n_sensors, n)
        E, orthonormal columns.

    Returns
    -------
    ndarray, shape (..., n_directions)
        At most 1e10.

    References
    ----------
    Schmidt, "Multiple emitter location and signal parameter estimation", IEEE Trans. Antennas
    Propag. 34(3), 1986, (6).

    Examples
    --------
    >>> music_spectrum([[1.0, 1.0], [1.0, 0.0]], np.array([[0.0], [1.0]]))
    array([2.e+00, 1.e+10])
    """
    A = np.asarray(A)
    norm = (A.real**2 + A.imag**2).sum(axis=-1)
    # P(β) = aᴴa / aᴴE Eᴴa   (6)
    return np.asarray(norm / np.maximum(projected_power(A, noise_subspace), norm / MAX_SPECTRUM))


def projected_power(A: ArrayLike, basis: Complex) -> Float:
    """Return the power ‖Eᴴa‖² of the projections of rows a onto a subspace.

    Parameters
    ----------
    A : array_like, shape (n_directions, n_sensors)
        Rows a(β).
    basis : ndarray, shape (..., n_sensors, n_basis)
        E, orthonormal columns.

    Returns
    -------
    ndarray, shape (..., n_directions)
        Powers.

    Examples
    --------
    >>> projected_power([[1.0, 1.0], [1.0, 0.0]], np.array([[0.0], [1.0]]))
    array([1., 0.])
    """
    A = np.asarray(A, dtype=np.complex128)
    projection = basis.conj().swapaxes(-1, -2) @ A.swapaxes(-1, -2)
    squares = np.square(projection.view(np.float64))  # of real and imaginary parts in turn
    power = np.add.reduce(squares, axis=-2)
    return np.asarray(power[..., ::2] + power[..., 1::2])


@dataclass(frozen=True, eq=False)
class SpectrumSearch:
    """Direction finder by the peaks of MUSIC's spectrum, for any array."""

    array: SensorArray
    wavelength: float
    n_directions: int

    @property
    def max_sources(self) -> int:
        """Number of sensors minus one."""
        return self.array.n_sensors - 1

    def needs_noise(self, n_sources: int) -> bool:
        """Return True if the basis of the noise is the smaller one."""
        return self.array.n_sensors < 2 * n_sources

    def spectrum(self, subspaces: Subspaces) -> tuple[Float, Float]:
        """Return scan directions and `music_spectrum` there, by the smaller of the subspaces."""
        doa_grid, A = scan_steering_matrix(self.array, self.wavelength, self.n_directions)
        n, K = subspaces.signal.shape
        if n < 2 * K:
            return doa_grid, music_spectrum(A, subspaces.noise)
        null = n - projected_power(A, subspaces.signal)  # ‖a‖² = n, null = ‖Eᴴa‖²
        return doa_grid, n / np.maximum(null, n / MAX_SPECTRUM)

    def directions(self, subspaces: Subspaces) -> Float:
        """Return the highest peaks, rad, (1, n), by parabolas through the null spectrum."""
        doa_grid, power = self.spectrum(subspaces)
        joined, n = scan_is_joined(self.array, (self.wavelength,)), subspaces.signal.shape[-1]
        grid = AngleGrid(doa_grid[None], self.array.dim > 1)
        return grid.peaks(power, inverse_level, np.ones_like, n, joined)[0]


@dataclass(frozen=True, eq=False)
class NormalizedSearch:
    """Direction finder by the mean of the bins' MUSIC spectra, each relative to its maximum.

    A second unknown, slowness or elevation, is that of the largest mean at each direction. The
    spectrum of one bin is not normalized.
    """

    model: ArraySnapshot
    grid: ScanGrid

    @property
    def max_sources(self) -> int:
        """Number of sensors minus one."""
        return self.model.array.n_sensors - 1

    def needs_noise(self, n_sources: int) -> bool:
        """Return True if the basis of the noise is the smaller one."""
        return self.model.array.n_sensors < 2 * n_sources

    def spectrum(self, subspaces: Subspaces) -> tuple[Float, Float]:
        """Return scan directions, of the sphere the azimuths, and the mean spectrum there."""
        power = self._bin_powers(*scan_responses(self.model, self.grid), subspaces)
        return self.grid.doa, _mean(power, _highest(power))

    def directions(self, subspaces: Subspaces) -> Float:
        """Return the highest peaks, rad, (n_unknowns, n), refined as those of `SpectrumSearch`."""
        power = self._bin_powers(*scan_responses(self.model, self.grid), subspaces)
        highest, model = _highest(power), self.model

        def power_at(directions: Float) -> Float:
            A = whitened_responses(model, directions)
            norm = (A.real**2 + A.imag**2).sum(axis=2)
            return _mean(self._bin_powers(A, norm, subspaces), highest)

        joined, n = scan_is_joined(model.array, model.wavelengths), subspaces.signal.shape[-1]
        return self.grid.peaks(_mean(power, highest), inverse_level, power_at, n, joined)[0]

    def _bin_powers(self, A: Complex, norm: Float, subspaces: Subspaces) -> Float:
        """Return the spectra of the bins, (n_nuisance, n_bins, n)."""
        rows = np.swapaxes(A, 2, 3)  # (n_nuisance, n_bins, n_directions, n_sensors)
        n, K = subspaces.signal.shape[-2:]
        if n < 2 * K:
            null = projected_power(rows, subspaces.noise)
        else:
            null = norm - projected_power(rows, subspaces.signal)
        return np.asarray(norm / np.maximum(null, np.maximum(norm / MAX_SPECTRUM, TINY)))


def _highest(power: Float) -> Float:
    """Return the maximum of each bin (n_bins, 1); 1 for a single one."""
    if power.shape[1] == 1:
        return np.ones((1, 1))
    return np.asarray(np.maximum(power.max(axis=(0, 2))[:, None], TINY))


def _mean(power: Float, highest: Float) -> Float:
    """Return the mean over the bins, the largest over a second unknown, (n,)."""
    mean = np.add.reduce(power / highest, axis=1) / power.shape[1]
    return np.asarray(np.maximum(mean[0] if len(mean) == 1 else mean.max(axis=0), TINY))


def spectrum_search(model: ArraySnapshot, grid: ScanGrid) -> SpectrumSearch | NormalizedSearch:
    """Return the peak search on a grid for the bins, elements and unknowns of a model."""
    if has_plain_response(model):
        return SpectrumSearch(model.array, model.wavelengths[0], len(grid.doa))
    return NormalizedSearch(model, grid)
