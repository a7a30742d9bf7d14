"""Root-MUSIC: zeros of MUSIC's null spectrum, a polynomial on a uniform grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import DirectionFinder, Subspaces
from arrivals.trackers.subspace.covariance import CovarianceSubspace
from arrivals.trackers.subspace.decompositions import eigenvalues
from arrivals.trackers.subspace.line_bins import ENDFIRE_TOLERANCE, LineOfBins, uniform_line
from arrivals.typing import Complex, Float

TINY, EPS = np.finfo(float).tiny, np.finfo(float).eps


def null_polynomial(noise_subspace: Complex, grid_index: ArrayLike) -> Complex:
    """Return the coefficients, highest power first, of z^S aᴴ(z) E Eᴴ a(z), z = exp(jθ).

    Parameters
    ----------
    noise_subspace : ndarray, shape (..., n_sensors, n)
        E, orthonormal columns.
    grid_index : array_like of int, shape (n_sensors,)
        Grid points of the sensors; S is their span. Grid points without a sensor are allowed.

    Returns
    -------
    ndarray, shape (..., 2 S + 1)
        Coefficients.

    References
    ----------
    Rao and Hari, "Performance analysis of root-MUSIC", IEEE Trans. ASSP 37(12), 1989, (8).

    Examples
    --------
    Two sensors and a wave from broadside: (1 - z)² up to a factor, a double zero at z = 1.

    >>> null_polynomial(np.array([[1.0], [-1.0]]) / np.sqrt(2), [0, 1]).real.round(3)
    array([-0.5,  1. , -0.5])
    """
    C = noise_subspace @ np.swapaxes(noise_subspace.conj(), -1, -2)
    pairs = _pairs_of_lags(tuple(np.asarray(grid_index).tolist()))
    # coefficient of z^l: the sum of C over the pairs of lag l   (8)
    return np.asarray(C.reshape(*C.shape[:-2], -1) @ pairs)


@lru_cache(maxsize=16)
def _pairs_of_lags(grid_index: tuple[int, ...]) -> Complex:
    """Return the indicator of the pairs of sensors of each lag, from S down to -S, read-only."""
    lag = np.subtract.outer(grid_index, grid_index).T
    span = int(lag.max())
    pairs = np.asarray(lag.ravel()[:, None] == np.arange(span, -span - 1, -1), np.complex128)
    pairs.setflags(write=False)
    return pairs


def root_music_angles(
    noise_subspace: Complex, grid_index: ArrayLike, n_sources: int, max_angle: ArrayLike = np.pi
) -> Float:
    """Return the electrical angles θ of the zeros nearest to the unit circle.

    Zeros come in pairs z, 1/z*. Each pair gives one angle, the mean of both: without noise they
    coincide on the circle up to rounding.

    Parameters
    ----------
    noise_subspace : ndarray, shape (..., n_sensors, n)
        Orthonormal columns.
    grid_index : array_like of int, shape (n_sensors,)
        Grid points of the sensors.
    n_sources : int
        Number of angles.
    max_angle : float or array_like, shape (...)
        Zeros of larger angle, rad, do not belong to plane waves and are left out.

    Returns
    -------
    ndarray, shape (..., n_sources)
        Phase steps between neighbouring grid points, rad; NaN where there are fewer zeros.

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
    z = polynomial_roots(null_polynomial(noise_subspace, grid_index))
    batch, z = z.shape[:-1], z.reshape(-1, z.shape[-1])
    rows, theta = np.arange(len(z)), np.full((len(z), n_sources), np.nan)
    distance = np.abs(np.log(np.maximum(np.abs(z), TINY)))
    is_wave = np.abs(np.angle(z)) <= np.broadcast_to(max_angle, batch).reshape(-1, 1)
    distance[~is_wave] = np.inf
    for k in range(n_sources):
        best = distance.argmin(axis=1)
        one = z[rows, best]
        from_partner = np.abs(z * one.conj()[:, None] - 1)
        from_partner[rows, best] = np.inf
        partner = from_partner.argmin(axis=1)
        other = z[rows, partner]
        is_zero = np.isfinite(distance[rows, best])
        middle = one / np.abs(one) + other / np.maximum(np.abs(other), TINY)
        theta[is_zero, k] = np.angle(middle)[is_zero]
        distance[rows, best] = distance[rows, partner] = np.inf
    return theta.reshape(*batch, n_sources)


def polynomial_roots(c: Complex) -> Complex:
    """Return the roots of polynomials.

    Parameters
    ----------
    c : ndarray, shape (..., n + 1)
        Coefficients, highest power first.

    Returns
    -------
    ndarray, shape (..., n)
        Eigenvalues of the companion matrix, sorted.

    Examples
    --------
    >>> polynomial_roots(np.array([1.0, 0.0, -4.0])).real
    array([-2.,  2.])
    """
    size = np.abs(c).max(axis=-1, keepdims=True)
    lead = c[..., :1]
    tiny = EPS * np.where(size > 0, size, 1.0)
    # a vanishing leading coefficient gives a root at a large radius, not a lower degree
    lead = np.where(np.abs(lead) < tiny, tiny, lead)
    n = c.shape[-1] - 1
    companion = np.zeros((*c.shape[:-1], n, n), dtype=np.complex128)
    companion[..., np.arange(1, n), np.arange(n - 1)] = 1.0
    companion[..., 0, :] = -c[..., 1:] / lead
    return np.asarray(np.sort(eigenvalues(companion), axis=-1))


@dataclass(frozen=True, eq=False)
class PolynomialRooting:
    """Direction finder by root-MUSIC, for a line on a uniform grid."""

    line: UniformLineManifold

    @property
    def max_sources(self) -> int:
        """Number of sensors minus one."""
        return self.line.n_sensors - 1

    def needs_noise(self, n_sources: int) -> bool:
        """Return True: the null spectrum is that of the noise."""
        return True

    def directions(self, subspaces: Subspaces) -> Float:
        """Return directions, rad."""
        tolerance = ENDFIRE_TOLERANCE * self.line.step
        n_sources, max_angle = subspaces.signal.shape[-1], self.line.step + tolerance
        theta = root_music_angles(subspaces.noise, self.line.grid_index, n_sources, max_angle)
        doa = self.line.to_doa(theta, tolerance)
        return doa[~np.isnan(doa)]


@dataclass(frozen=True, eq=False)
class RootingOfBins:
    """Direction finder by root-MUSIC in each of several bins."""

    line: LineOfBins

    @property
    def max_sources(self) -> int:
        """Number of sensors minus one."""
        return len(self.line.grid_index) - 1

    def needs_noise(self, n_sources: int) -> bool:
        """Return True: the null spectrum is that of the noise."""
        return True

    def directions(self, subspaces: Subspaces) -> Float:
        """Return directions, rad."""
        line, n_sources = self.line, subspaces.signal.shape[-1]
        max_angle = (1 + ENDFIRE_TOLERANCE) * line.steps
        theta = root_music_angles(subspaces.noise, line.grid_index, n_sources, max_angle)
        return line.directions(theta, 1, subspaces)


@lru_cache(maxsize=16)  # models are immutable
def polynomial_rooting(model: ArraySnapshot) -> PolynomialRooting | RootingOfBins:
    """Return root-MUSIC on the line of a model, for one bin or several."""
    if model.n_bins > 1:
        return RootingOfBins(LineOfBins.of_model(model))
    return PolynomialRooting(uniform_line(model))


@register("root_music")
class RootMUSIC(CovarianceSubspace[DirectionFinder]):
    """Zeros of MUSIC's null spectrum, without a scan grid, for lines only.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line on a uniform grid of at most half the wavelength, gaps allowed. Of several bins one
        must be within this limit; directions are those at which the bins agree.
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
        If the array is not such a line, or `n_sources` is not below the number of sensors.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions are in ascending order.

    References
    ----------
    Barabell, "Improving the resolution performance of eigenstructure-based direction-finding
    algorithms", ICASSP 1983. Several bins: Pavlidi, Griffin, Puigt and Mouchtaris, IEEE Trans.
    Audio Speech Lang. Process. 21(10), 2013, sec. III.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> phases = np.exp(2j * np.pi * np.random.default_rng(0).random((50, 2)))
    >>> z = model.simulate(np.full((50, 2), [-0.2, 0.5]), phases, np.random.default_rng(1))
    >>> RootMUSIC(model).run(z).doa[-1, :2].round(2)
    array([-0.2,  0.5])
    """

    def direction_finder(self, model: ArraySnapshot) -> DirectionFinder:
        """Return root-MUSIC on the line of the model."""
        return polynomial_rooting(model)
