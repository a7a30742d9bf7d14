"""ESPRIT: by how much the phases turn from a subarray to its shifted copy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.manifold import UniformLineManifold
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import CovarianceSubspace, Subspaces, on_grid
from arrivals.trackers.subspace.root_music import ENDFIRE
from arrivals.typing import Complex, Float, Int


def esprit_angles(signal_subspace: Complex, first: Int, second: Int) -> Float:
    """Return the phases, rad, by which plane waves turn from subarray `first` to `second`.

    Parameters
    ----------
    signal_subspace : ndarray, shape (..., n_sensors, n_sources)
        Any basis U of it.
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
    turn = np.linalg.pinv(signal_subspace[..., first, :]) @ signal_subspace[..., second, :]
    return np.asarray(np.angle(np.linalg.eigvals(turn)))


def shifted_pairs(places: Int, shift: int) -> tuple[Int, Int]:
    """Return the sensors, (n_pairs,) and (n_pairs,), that lie `shift` grid points apart.

    Examples
    --------
    >>> shifted_pairs(np.array([0, 1, 3, 4]), 1)
    (array([0, 2]), array([1, 3]))
    """
    first, second = np.nonzero(places[None, :] - places[:, None] == shift)
    return first, second


@dataclass(frozen=True, eq=False)
class Shift:
    """Directions by ESPRIT, of the sensors of a line that have a neighbour.

    The shift is the one that most pairs have, of those up to half a wavelength; the larger one
    of equals.
    """

    line: UniformLineManifold

    @property
    def shift(self) -> int:
        """Shift between the subarrays, in grid points."""
        widest = int(np.pi / self.line.step * (1 + 1e-9))
        pairs = [len(shifted_pairs(self.line.places, s)[0]) for s in range(1, widest + 1)]
        return max(range(1, widest + 1), key=lambda s: (pairs[s - 1], s))

    @property
    def limit(self) -> int:
        """One source for each pair of sensors."""
        return len(shifted_pairs(self.line.places, self.shift)[0])

    def directions(self, found: Subspaces) -> Float:
        """Return directions, rad."""
        shift = self.shift
        turn = esprit_angles(found.signal, *shifted_pairs(self.line.places, shift))
        doa = self.line.to_doa(turn / shift, ENDFIRE * self.line.step)
        return doa[~np.isnan(doa)]


@register("esprit")
class ESPRIT(CovarianceSubspace[Shift]):
    """Eigenvalues of the turn between two subarrays that differ by a shift: no search at all.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line on a uniform grid of at most half the wavelength. Sensors may be missing, but as
        many pairs as there are sources must lie equally far apart, half a wavelength at most.
    n_sources, max_sources, forgetting, smoothing, backward, interval
        As in `MUSIC`.

    Attributes
    ----------
    covariance : ndarray, shape (n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products.

    Raises
    ------
    ValueError
        If the array is no such line, or has fewer such pairs than `n_sources`.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions stand in rising order.

    References
    ----------
    Roy and Kailath, "ESPRIT: estimation of signal parameters via rotational invariance
    techniques", IEEE Trans. ASSP 37(7), 1989.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> z = model.simulate(np.full((50, 1), 0.5), 1.0, np.random.default_rng(0))
    >>> ESPRIT(model).run(z).doa[-1, :1].round(2)
    array([0.5])
    """

    def _finder(self, model: ArraySnapshot) -> Shift:
        return Shift(on_grid(model))
