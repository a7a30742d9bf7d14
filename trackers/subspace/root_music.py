"""Root-MUSIC: the zeros of MUSIC's null spectrum, which on a grid is a polynomial."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.manifold import UniformLineManifold
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import CovarianceSubspace, Subspaces, on_grid
from arrivals.typing import Complex, Float

ENDFIRE = 0.1  # an angle beyond endfire by less, relative to endfire's, is noise of one there


def null_polynomial(noise_subspace: Complex, places: ArrayLike) -> Complex:
    """Return the coefficients, highest power first, of z^S aᴴ(z) E Eᴴ a(z), z = exp(jθ).

    Parameters
    ----------
    noise_subspace : ndarray, shape (..., n_sensors, n)
        E, orthonormal columns.
    places : array_like of int, shape (n_sensors,)
        Grid points of the sensors; S is their span. Sensors may be missing.

    Returns
    -------
    ndarray, shape (..., 2 S + 1)

    References
    ----------
    Rao and Hari, "Performance analysis of root-MUSIC", IEEE Trans. ASSP 37(12), 1989, (8).

    Examples
    --------
    Two sensors and a wave from broadside: (1 - z)² up to a factor, a double zero at z = 1.

    >>> null_polynomial(np.array([[1.0], [-1.0]]) / np.sqrt(2), [0, 1]).real.round(3)
    array([-0.5,  1. , -0.5])
    """
    places = np.asarray(places)
    C = noise_subspace @ np.swapaxes(noise_subspace.conj(), -1, -2)
    lag = places[None, :] - places[:, None]
    span = int(lag.max())
    # which pairs of sensors have which lag, from S down to -S
    pairs = lag.ravel()[:, None] == np.arange(span, -span - 1, -1)
    return np.asarray(C.reshape(*C.shape[:-2], -1) @ pairs.astype(np.complex128))


def root_music_angles(
    noise_subspace: Complex, places: ArrayLike, n_sources: int, largest: float = np.pi
) -> Float:
    """Return the electrical angles θ of the zeros that lie nearest to the unit circle.

    Zeros come in pairs z, 1/z*. Of each pair one is taken, and its angle from both: without noise
    they coincide on the circle, and rounding parts them.

    Parameters
    ----------
    noise_subspace : ndarray, shape (..., n_sensors, n)
        Orthonormal columns.
    places : array_like of int, shape (n_sensors,)
        Grid points of the sensors.
    n_sources : int
    largest : float
        Zeros whose angle is larger are not those of plane waves, and are passed over.

    Returns
    -------
    ndarray, shape (..., n_sources)
        Angles between neighbouring grid points, rad; NaN where there are not so many.

    References
    ----------
    Barabell, "Improving the resolution performance of eigenstructure-based direction-finding
    algorithms", ICASSP 1983.

    Examples
    --------
    >>> a = np.exp(1j * np.outer(np.arange(4), [0.5, -1.0]))
    >>> noise_subspace = np.linalg.qr(a, mode="complete")[0][:, 2:]
    >>> np.sort(root_music_angles(noise_subspace, range(4), 2)).round(9)
    array([-1. ,  0.5])
    """
    z = polynomial_roots(null_polynomial(noise_subspace, places))
    found = np.full((*z.shape[:-1], n_sources), np.nan)
    distance = np.abs(np.log(np.maximum(np.abs(z), np.finfo(float).tiny)))
    distance = np.where(np.abs(np.angle(z)) <= largest, distance, np.inf)
    for k in range(n_sources):
        best = distance.argmin(axis=-1, keepdims=True)
        one = np.take_along_axis(z, best, axis=-1)
        from_partner = np.abs(z * one.conj() - 1)
        np.put_along_axis(from_partner, best, np.inf, axis=-1)
        partner = from_partner.argmin(axis=-1, keepdims=True)
        other = np.take_along_axis(z, partner, axis=-1)
        is_zero = np.isfinite(np.take_along_axis(distance, best, axis=-1))
        middle = one / np.abs(one) + other / np.maximum(np.abs(other), np.finfo(float).tiny)
        found[..., k] = np.where(is_zero, np.angle(middle), np.nan)[..., 0]
        for taken in (best, partner):
            np.put_along_axis(distance, taken, np.inf, axis=-1)
    return found


def polynomial_roots(c: Complex) -> Complex:
    """Return the roots of polynomials (..., n + 1), highest power first: (..., n).

    Examples
    --------
    >>> polynomial_roots(np.array([1.0, 0.0, -4.0])).real
    array([-2.,  2.])
    """
    size = np.abs(c).max(axis=-1, keepdims=True)
    lead = c[..., :1]
    tiny = np.finfo(float).eps * np.where(size > 0, size, 1.0)
    lead = np.where(np.abs(lead) < tiny, tiny, lead)  # a root far out, in place of one less
    n = c.shape[-1] - 1
    companion = np.zeros((*c.shape[:-1], n, n), dtype=np.complex128)
    companion[..., np.arange(1, n), np.arange(n - 1)] = 1.0
    companion[..., 0, :] = -c[..., 1:] / lead
    return np.asarray(np.sort(np.linalg.eigvals(companion), axis=-1))


@dataclass(frozen=True, eq=False)
class Roots:
    """Directions by root-MUSIC, of a line on a uniform grid."""

    line: UniformLineManifold

    @property
    def limit(self) -> int:
        """One source less than sensors."""
        return self.line.n_sensors - 1

    def directions(self, found: Subspaces) -> Float:
        """Return directions, rad."""
        slack = ENDFIRE * self.line.step
        n_sources, largest = found.signal.shape[-1], self.line.step + slack
        theta = root_music_angles(found.noise, self.line.places, n_sources, largest)
        doa = self.line.to_doa(theta, slack)
        return doa[~np.isnan(doa)]


@register("root_music")
class RootMUSIC(CovarianceSubspace[Roots]):
    """Zeros of MUSIC's null spectrum: no grid of directions, on lines only.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line on a uniform grid of at most half the wavelength; sensors may be missing.
    n_sources, max_sources, forgetting, smoothing, backward, interval
        As in `MUSIC`.

    Attributes
    ----------
    covariance : ndarray, shape (n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products.

    Raises
    ------
    ValueError
        If the array is no such line, or `n_sources` is not below the number of sensors.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions stand in rising order.

    References
    ----------
    Barabell, "Improving the resolution performance of eigenstructure-based direction-finding
    algorithms", ICASSP 1983.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> phases = np.exp(2j * np.pi * np.random.default_rng(0).random((50, 2)))
    >>> z = model.simulate(np.full((50, 2), [-0.2, 0.5]), phases, np.random.default_rng(1))
    >>> RootMUSIC(model).run(z).doa[-1, :2].round(2)
    array([-0.2,  0.5])
    """

    def _finder(self, model: ArraySnapshot) -> Roots:
        return Roots(on_grid(model))
