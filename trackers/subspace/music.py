"""MUSIC: directions whose steering vectors are orthogonal to what holds noise alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.trackers.beamforming.cbf import look_directions, look_vectors, parabolic, peaks
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import CovarianceSubspace, NumberOfSources, Subspaces
from arrivals.typing import Complex, Float
from arrivals.validation import count

HIGHEST = 1e10  # of the spectrum, which without noise would be infinite


def music_spectrum(A: ArrayLike, noise_subspace: Complex) -> Float:
    """Return ‖a‖² / ‖Eᴴa‖² of steering vectors: 1 in the noise, large at the sources.

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
    return np.asarray(norm / np.maximum(power_inside(A, noise_subspace), norm / HIGHEST))


def power_inside(A: ArrayLike, basis: Complex) -> Float:
    """Return ‖Eᴴa‖² of rows a, (n_directions, n), for orthonormal columns E, (..., n, n_basis).

    Examples
    --------
    >>> power_inside([[1.0, 1.0], [1.0, 0.0]], np.array([[0.0], [1.0]]))
    array([1., 0.])
    """
    inside = np.asarray(A) @ basis.conj()
    return np.asarray((inside.real**2 + inside.imag**2).sum(axis=-1))


@dataclass(frozen=True, eq=False)
class Scan:
    """Directions by the peaks of MUSIC's spectrum, of any array."""

    array: SensorArray
    wavelength: float
    n_directions: int

    @property
    def limit(self) -> int:
        """One source less than sensors."""
        return self.array.n_sensors - 1

    def spectrum(self, found: Subspaces) -> tuple[Float, Float]:
        """Return look directions, and `music_spectrum` in them, by the smaller of the subspaces."""
        doa_grid, A = look_vectors(self.array, self.wavelength, self.n_directions)
        n, K = found.signal.shape
        if n < 2 * K:
            return doa_grid, music_spectrum(A, found.noise)
        null = n - power_inside(A, found.signal)  # ‖a‖² = n
        return doa_grid, n / np.maximum(null, n / HIGHEST)

    def directions(self, found: Subspaces) -> Float:
        """Return the highest peaks, rad, each refined by a parabola through the null spectrum."""
        doa_grid, power = self.spectrum(found)
        top = peaks(power, circular=self.array.dim > 1)[: found.signal.shape[-1]]
        return parabolic(doa_grid, -1 / power, top)


@register("music")
class MUSIC(CovarianceSubspace[Scan]):
    """Peaks of MUSIC's spectrum, on any array.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array: a line, or sensors in a plane, where directions are azimuths on the full
        circle. Its noise is not used.
    n_sources : int, "mdl" or "aic"
        How many sources there are, fewer than sensors; or the criterion by which the number is
        found anew each time. None is "mdl".
    max_sources : int, optional
        The most that a criterion may find; as many as the method can if None.
    forgetting : float
        Weight that the past keeps from step to step; the covariance is that of the last
        1 / (1 - forgetting) snapshots or so.
    smoothing : int, optional
        Sensors of the subarrays that the covariance is averaged over, so that echoes of one
        source are told apart; for uniform lines without gaps. None: no smoothing.
    backward : bool
        Average the line read from its other end too; for uniform lines without gaps.
    interval : int
        Directions are looked for each `interval`-th snapshot, and stay until then.
    n_directions : int
        Look directions: over ±90° for a line (361: every half degree), else over the circle.

    Attributes
    ----------
    covariance : ndarray, shape (n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products.
    doa_grid, power : ndarray, shape (n_directions,)
        Look directions, rad, and the spectrum; NaN while there is no source.

    Raises
    ------
    ValueError
        If `n_sources` is not below the number of sensors (of a subarray, with smoothing), or
        smoothing is asked for an array that is no uniform line.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions stand in rising order; `amplitude` is the
    least-squares fit to the last snapshot. Sensors that have not been heard for long are left
    out; with smoothing, nothing is found then.

    References
    ----------
    Schmidt, "Multiple emitter location and signal parameter estimation", IEEE Trans. Antennas
    Propag. 34(3), 1986.

    Examples
    --------
    >>> model = ArraySnapshot(SensorArray.uca(8, radius=0.6), wavelength=1.0, noise=0.1)
    >>> phases = np.exp(2j * np.pi * np.random.default_rng(0).random((50, 2)))
    >>> z = model.simulate(np.full((50, 2), [-2.0, 0.5]), phases, np.random.default_rng(1))
    >>> MUSIC(model).run(z).doa[-1, :2].round(2)
    array([-2. ,  0.5])
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        n_sources: NumberOfSources = "mdl",
        *,
        max_sources: int | None = None,
        forgetting: float = 0.96,
        smoothing: int | None = None,
        backward: bool = False,
        interval: int = 1,
        n_directions: int = 361,
    ) -> None:
        self.n_directions = count("n_directions", n_directions, least=3)
        super().__init__(
            measurement,
            n_sources,
            max_sources=max_sources,
            forgetting=forgetting,
            smoothing=smoothing,
            backward=backward,
            interval=interval,
        )

    def _finder(self, model: ArraySnapshot) -> Scan:
        return Scan(model.array, model.plain_wavelength("music"), self.n_directions)

    @property
    def doa_grid(self) -> Float:
        """Look directions, rad, (n_directions,)."""
        return look_directions(self.measurement.array, self.n_directions)

    @property
    def power(self) -> Float:
        """The spectrum as of now, (n_directions,); NaN while there is no source."""
        looked = self._looked()
        nothing = np.full(self.n_directions, np.nan)
        return nothing if looked is None else looked[0].spectrum(looked[1])[1]
