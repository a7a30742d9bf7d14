"""Log evidence of a source in every time-frequency bin and direction, against diffuse sound."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.trackers.wideband.density_grid import DensityGrid
from arrivals.trackers.wideband.sphere_waves import SphereWaves
from arrivals.typing import Bool, Complex, Float, Int

Single: TypeAlias = NDArray[np.float32]  # evidence of many bins: memory limits the speed
SingleComplex: TypeAlias = NDArray[np.complex64]
MAX_COHERENCE = np.float32(1 - 1e-6)


@dataclass(frozen=True, eq=False)
class ScanResponse:
    """Whitened responses ã of an array on a grid: values of the second unknown times directions.

    Parameters
    ----------
    beam : ndarray of complex, shape (n_bins, n_sensors, n_nuisance * n_directions)
        Conjugate unit vectors ã / |ã|.
    norm : ndarray, shape (n_bins, n_nuisance * n_directions)
        g = |ã|².
    ratio : float
        Power ξ of a source over that of the diffuse sound.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers.wideband.direction_grid import DirectionGrid
    >>> manifold = ArraySnapshot(SensorArray.uca(5, 0.4), [1.0, 1.2]).manifold()
    >>> scan_response(manifold, DirectionGrid(False, np.pi / 4), 3.0).beam.shape
    (2, 5, 8)
    """

    beam: SingleComplex
    norm: Single
    ratio: float

    def at(self, points: Int) -> ScanResponse:
        """Return the responses at some points of the grid."""
        return ScanResponse(self.beam[..., points], self.norm[:, points], self.ratio)

    def coherence(self, unit: SingleComplex, bins: Int) -> Single:
        """Return s = |ã^H z̃|² / (g |z̃|²) of snapshots of some bins, in [0, 1].

        Parameters
        ----------
        unit : ndarray of complex, shape (len(bins), n_snapshots, n_sensors)
            z̃ / |z̃|, as of `unit_snapshots`.
        bins : ndarray of int
            Bins.
        """
        beam = unit @ self.beam[bins]
        return np.asarray(beam.real**2 + beam.imag**2)

    def log_ratio(self, coherence: Single, bins: Int) -> Single:
        """Return ℓ = -ln(1 + ξ g) - M ln(1 - ξ g / (1 + ξ g) s) of rows of coherence.

        The complex angular central Gaussian of Γ + ξ a a^H against that of Γ: scale-free.

        Parameters
        ----------
        coherence : ndarray, shape (n, n_points)
            s.
        bins : ndarray of int, shape (n,)
            Bin of each row.
        """
        s = np.minimum(coherence, MAX_COHERENCE)
        n_sensors = self.beam.shape[1]
        return np.asarray(-self._log_det[bins] - n_sensors * np.log1p(-self._weight[bins] * s))

    @cached_property
    def _log_det(self) -> Single:
        return np.asarray(np.log1p(self.ratio * self.norm), dtype=np.float32)

    @cached_property
    def _weight(self) -> Single:
        return np.asarray(1 - 1 / (1 + self.ratio * self.norm), dtype=np.float32)


def unit_snapshots(snapshots: Complex, bins: Bool) -> tuple[SingleComplex, Float]:
    """Return snapshots as unit vectors, and their energies.

    Parameters
    ----------
    snapshots : ndarray of complex, shape (n_valid_bins, n_sensors, n_snapshots)
        Whitened snapshots of the bins with data.
    bins : ndarray of bool, shape (n_bins,)
        Which these are.

    Returns
    -------
    unit : ndarray of complex, shape (n_bins, n_snapshots, n_sensors)
        z̃ / |z̃|, NaN of bins without data.
    energy : ndarray, shape (n_bins, n_snapshots)
        e = |z̃|², NaN of bins without data.
    """
    if not bins.all():
        of_all = np.full((len(bins), *snapshots.shape[1:]), np.nan, dtype=np.complex128)
        of_all[bins] = snapshots
        snapshots = of_all
    z = np.swapaxes(snapshots, 1, 2)
    energy = (z.real**2 + z.imag**2).sum(axis=-1)
    size = np.sqrt(np.where(energy > 0, energy, 1.0))
    return (z / size[..., None]).astype(np.complex64), np.asarray(energy)


@lru_cache(maxsize=16)  # one for each set of sensors with valid data
def scan_response(
    manifold: AngleManifold | SphereWaves, grid: DensityGrid, ratio: float
) -> ScanResponse:
    """Return the responses of a manifold on a grid, cached.

    Parameters
    ----------
    manifold : AngleManifold or SphereWaves
        Whitened response of the array.
    grid : DensityGrid
        Directions.
    ratio : float
        Power of a source over that of the diffuse sound.

    Returns
    -------
    ScanResponse
    """
    a = grid.responses(manifold)  # (n_nuisance, F, M, G)
    a = np.concatenate(list(a), axis=-1)
    norm = (a.real**2 + a.imag**2).sum(axis=1)
    beam = a.conj() / np.sqrt(np.maximum(norm, 1e-30))[:, None]
    return ScanResponse(beam.astype(np.complex64), norm.astype(np.float32), ratio)


def bin_evidence(response: ScanResponse, unit: SingleComplex, counted: Bool) -> Single:
    """Return the log evidence ℓ of the bins and snapshots that count, (n, n_points).

    Parameters
    ----------
    response : ScanResponse
        Responses on the grid.
    unit : ndarray of complex, shape (n_bins, n_snapshots, n_sensors)
        Whitened snapshots as unit vectors.
    counted : ndarray of bool, shape (n_bins, n_snapshots)
        Which count.
    """
    bins = np.flatnonzero(counted.any(axis=1))
    rows = counted[bins]
    s = response.coherence(unit[bins], bins)[rows]
    return response.log_ratio(s, bins[rows.nonzero()[0]])


def mean_powers(
    at_sources: ScanResponse, unit: SingleComplex, energy: Float, loud: Bool, share: Float
) -> Float:
    """Return the mean power of each source over all bins and snapshots with data, (K,).

    Those that are loud are assigned to the sources and to diffuse sound.

    Parameters
    ----------
    at_sources : ScanResponse
        Responses in the directions of the sources.
    unit : ndarray of complex, shape (n_bins, n_snapshots, n_sensors)
        Whitened snapshots as unit vectors.
    energy : ndarray, shape (n_bins, n_snapshots)
        e, their energies; NaN of bins without data.
    loud : ndarray of bool, shape (n_bins, n_snapshots)
        Which are louder than the noise.
    share : ndarray, shape (K + 1,)
        Shares π of diffuse sound and of the sources.
    """
    bins = loud.nonzero()[0]
    s = at_sources.coherence(unit, np.arange(len(unit)))[loud]
    w = np.log(share) + np.pad(at_sources.log_ratio(s, bins), ((0, 0), (1, 0)))
    r = np.exp(w - np.logaddexp.reduce(w, axis=1, keepdims=True))[:, 1:]
    # |w|² = |ã^H z̃|² / g² = s e / g
    power = s * energy[loud][:, None] / at_sources.norm[bins]
    return np.asarray((r * power).sum(axis=0) / np.count_nonzero(~np.isnan(energy)))
