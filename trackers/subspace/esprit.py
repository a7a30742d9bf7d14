"""ESPRIT: phase steps between a subarray and its shifted copy."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import DirectionFinder, Subspaces
from arrivals.trackers.subspace.covariance import CovarianceSubspace
from arrivals.trackers.subspace.decompositions import eigenvalues, least_squares
from arrivals.trackers.subspace.line_bins import ENDFIRE_TOLERANCE, LineOfBins, uniform_line
from arrivals.typing import Complex, Float, Int


def esprit_angles(signal_subspace: Complex, first: Int, second: Int) -> Float:
    """Return the phase steps, rad, of plane waves from subarray `first` to `second`.

    Parameters
    ----------
    signal_subspace : ndarray, shape (..., n_sensors, n_sources)
        Any basis U of the signal subspace.
    first, second : ndarray of int, shape (n_pairs,)
        Sensors of the two subarrays, in the same order; at least n_sources.

    Returns
    -------
    ndarray, shape (..., n_sources)
        Arguments of the eigenvalues of U₁⁺U₂.

    References
    ----------
    Roy and Kailath, "ESPRIT: estimation of signal parameters via rotational invariance
    techniques", IEEE Trans. ASSP 37(7), 1989, (36), by least squares.

    Examples
    --------
    >>> a = np.exp(1j * np.outer(np.arange(4), [0.5, -1.0]))
    >>> np.sort(esprit_angles(a, np.arange(3), np.arange(1, 4))).round(9)
    array([-1. ,  0.5])
    """
    # Ψ = U₁⁺U₂   (36)
    rotation = least_squares(signal_subspace[..., first, :], signal_subspace[..., second, :])
    return np.asarray(np.angle(eigenvalues(rotation)))


def shifted_pairs(grid_index: Int, shift: int) -> tuple[Int, Int]:
    """Return the pairs of sensors that lie `shift` grid points apart.

    Parameters
    ----------
    grid_index : ndarray of int, shape (n_sensors,)
        Grid points of the sensors.
    shift : int
        Distance in grid points.

    Returns
    -------
    first, second : ndarray of int, shape (n_pairs,)
        Sensors of the two subarrays.

    Examples
    --------
    >>> shifted_pairs(np.array([0, 1, 3, 4]), 1)
    (array([0, 2]), array([1, 3]))
    """
    first, second = np.nonzero(grid_index[None, :] - grid_index[:, None] == shift)
    return first, second


@dataclass(frozen=True, eq=False)
class ShiftInvariance:
    """Direction finder by ESPRIT, with the sensors of a line that have a shifted partner.

    The shift is the one with most pairs, of those up to half a wavelength; of equals the largest.
    """

    line: UniformLineManifold

    @cached_property
    def shift(self) -> int:
        """Shift between the subarrays, in grid points."""
        half_wave = int(min(np.pi / self.line.step * (1 + 1e-9), 1e9))
        widest = min(half_wave, int(np.ptp(self.line.grid_index)))
        pairs = [len(shifted_pairs(self.line.grid_index, s)[0]) for s in range(1, widest + 1)]
        return max(range(1, widest + 1), key=lambda s: (pairs[s - 1], s))

    @cached_property
    def pairs(self) -> tuple[Int, Int]:
        """Sensors of the two subarrays."""
        return shifted_pairs(self.line.grid_index, self.shift)

    @property
    def max_sources(self) -> int:
        """Number of pairs of sensors."""
        return len(self.pairs[0])

    def needs_noise(self, n_sources: int) -> bool:
        """Return False: the signal subspace is sufficient."""
        return False

    def directions(self, subspaces: Subspaces) -> Float:
        """Return directions, rad."""
        phase = esprit_angles(subspaces.signal, *self.pairs)
        doa = self.line.to_doa(phase / self.shift, ENDFIRE_TOLERANCE * self.line.step)
        return doa[~np.isnan(doa)]


@dataclass(frozen=True, eq=False)
class ShiftInvarianceOfBins:
    """Direction finder by ESPRIT in each of several bins, with one shift for all."""

    line: LineOfBins

    @property
    def max_sources(self) -> int:
        """Number of pairs of sensors."""
        return self.shortest.max_sources

    def needs_noise(self, n_sources: int) -> bool:
        """Return True: the bins are weighted by MUSIC's spectrum."""
        return True

    @cached_property
    def shortest(self) -> ShiftInvariance:
        """ESPRIT at the shortest wavelength within the alias limit."""
        return ShiftInvariance(self.line.shortest)

    def directions(self, subspaces: Subspaces) -> Float:
        """Return directions, rad."""
        phase = esprit_angles(subspaces.signal, *self.shortest.pairs)
        return self.line.directions(phase, self.shortest.shift, subspaces)


@lru_cache(maxsize=16)  # models are immutable
def shift_invariance(model: ArraySnapshot) -> ShiftInvariance | ShiftInvarianceOfBins:
    """Return ESPRIT on the line of a model, for one bin or several."""
    if model.n_bins > 1:
        return ShiftInvarianceOfBins(LineOfBins.of_model(model))
    return ShiftInvariance(uniform_line(model))


@register("esprit")
class ESPRIT(CovarianceSubspace[DirectionFinder]):
    """Eigenvalues of the rotation between two shifted subarrays, without a search.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line on a uniform grid of at most half the wavelength. Sensors may be missing, but as
        many pairs as there are sources must lie equally far apart, half a wavelength at most. Of
        several bins one must be within this limit; directions are those at which the bins agree.
    n_sources : int, "mdl" or "aic"
        As in `MUSIC`.
    max_sources : int, optional
        As in `MUSIC`.
    forgetting : float
        As in `MUSIC`.
    smoothing : int, optional
        As in `MUSIC`.
    backward : bool
        As in `MUSIC`.
    interval : int
        As in `MUSIC`.

    Attributes
    ----------
    covariance : ndarray, shape ([n_bins,] n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products, of each bin if there are several.

    Raises
    ------
    ValueError
        If the array is not such a line, or has fewer such pairs than `n_sources`.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions are in ascending order.

    References
    ----------
    Roy and Kailath, "ESPRIT: estimation of signal parameters via rotational invariance
    techniques", IEEE Trans. ASSP 37(7), 1989. Several bins: Pavlidi, Griffin, Puigt and
    Mouchtaris, IEEE Trans. Audio Speech Lang. Process. 21(10), 2013, sec. III.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> z = model.simulate(np.full((50, 1), 0.5), 1.0, np.random.default_rng(0))
    >>> ESPRIT(model).run(z).doa[-1, :1].round(2)
    array([0.5])
    """

    def direction_finder(self, model: ArraySnapshot) -> DirectionFinder:
        """Return ESPRIT on the line of the model."""
        return shift_invariance(model)
