"""Symmetric line arrays by real numbers: the odd-unitary transformation of their snapshots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurement_models.single_source import SingleSourceSnapshot
from arrivals.typing import Complex, Float, Int
from arrivals.validation import instance, positive


@dataclass(frozen=True)
class ArrayManifold(SingleSourceSnapshot):
    """Snapshots of a symmetric array, transformed to a real response.

    Sums and differences of the two sensors of a pair turn a(β) into
    [√2 cos φ_1 ... √2 cos φ_M, 1, √2 sin φ_1 ... √2 sin φ_M], φ_m = 2π d_m/λ sin β, the inner pair
    first. Both rows of a pair belong to the same distance. M pairs and a centre sensor are 2M + 1
    sensors; without one the row of ones is missing.

    Parameters
    ----------
    array : SensorArray
        A line, symmetric about a sensor in its centre, `SensorArray.symmetric`, or about a place
        without a sensor, such as two sensors.
    wavelength : float
        Metres; at least twice the distance of the inner pair from the centre, and four times
        without a centre sensor.
    noise : float
        Variance of the complex noise of one sensor; the transformation leaves it white.

    Raises
    ------
    ValueError
        If the array is not symmetric, or its inner pair is ambiguous.

    Notes
    -----
    Without a centre sensor the sign of a source is arbitrary, and φ_m known up to half a turn.

    Shapes: snapshots (..., n_sensors), complex; directions (..., n_sources), rad. The Gaussian
    interface is that of one source with a state [β, Re w, Im w], and its measurements are real,
    `composite(transform(snapshot))`.

    References
    ----------
    Gu, Chan, Zhu and Swamy, IEEE TCAS-II 60(1), 2013. Our rows √2 Re, 1, √2 Im; the report on
    that paper prints another scale and order, with which the transformed response is not real.

    Examples
    --------
    >>> manifold = ArrayManifold(SensorArray.symmetric([0.25, 0.5]), wavelength=1.0)
    >>> a = manifold.real_steering(np.pi / 2)
    >>> a.round(3)
    array([ 0.   , -1.414,  1.   ,  1.414,  0.   ])
    >>> z = manifold.array.steering_vector(np.pi / 2, 1.0)
    >>> bool(abs(manifold.transform(z) - a).max() < 1e-15)
    True
    """

    array: SensorArray
    wavelength: float
    noise: float = 1.0

    def __post_init__(self) -> None:
        instance("array", self.array, SensorArray)
        for name in ("wavelength", "noise"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        _pairs(self.array)
        inner = self.distances[0]
        limit, name = (0.25, "a quarter") if self.centre is None else (0.5, "half a")
        if inner > limit * (1 + 1e-6):
            raise ValueError(
                f"the inner pair must lie at most {name} wavelength, {self.wavelength * limit:.6g} "
                f"m, from the centre; got {inner * self.wavelength:.6g} m: directions are ambiguous"
            )

    @cached_property
    def distances(self) -> Float:
        """Distances of the pairs from the centre in wavelengths, (n_pairs,), the inner first."""
        left, _, right = _pairs(self.array)
        positions = self.array.positions[:, 0]
        distances = np.asarray((positions[right] - positions[left]) / (2 * self.wavelength))
        distances.setflags(write=False)
        return distances

    @property
    def n_pairs(self) -> int:
        """M, of 2M + 1 sensors, or of 2M without a centre sensor."""
        return self.array.n_sensors // 2

    @property
    def T(self) -> Complex:
        """The unitary matrix (n_sensors, n_sensors), a real response is Tᴴ a."""
        return _transformation(self.array)

    @property
    def centre(self) -> int | None:
        """Row of the ones, which settles scale and sign of the sources; None without it."""
        return self.n_pairs if self.array.n_sensors % 2 else None

    def between(self, cosines: Float, middle: Float | float, sines: Float) -> Float:
        """Return rows (..., n_sensors) of cosines and sines, `middle` in the row of the centre."""
        if self.centre is None:
            return np.concatenate([cosines, sines], axis=-1)
        row = np.broadcast_to(middle, (*cosines.shape[:-1], 1))
        return np.concatenate([cosines, row, sines], axis=-1)

    def pairs_of(self, rows: Float) -> Float:
        """Return rows (..., n_sensors) without that of the centre sensor."""
        n = self.centre
        return rows if n is None else np.concatenate([rows[..., :n], rows[..., n + 1 :]], axis=-1)

    def transform(self, z: ArrayLike) -> Complex:
        """Return Tᴴ z of snapshots (..., n_sensors); the noise stays white."""
        return np.asarray(np.asarray(z) @ self.T.conj())

    def phases(self, doa: ArrayLike) -> Float:
        """Return φ_m of directions (...), rad: shape (..., n_pairs)."""
        u = np.sin(np.asarray(doa, dtype=np.float64))
        return np.asarray(2 * np.pi * self.distances * u[..., None])

    def real_steering(self, doa: ArrayLike) -> Float:
        """Return the response to directions (...), rad: shape (..., n_sensors), real."""
        phi = self.phases(doa)
        root = np.sqrt(2.0)
        return self.between(root * np.cos(phi), 1.0, root * np.sin(phi))

    def doa(self, phases: ArrayLike) -> Float:
        """Return the directions, rad, of the pairs' phases, each known up to whole turns.

        Parameters
        ----------
        phases : array_like, shape (..., n_pairs)
            rad, the inner pair first.

        Returns
        -------
        ndarray, shape (...)
            arcsin of the least-squares fit of sin β, cut to ±1. Each pair takes the whole turns
            that come nearest to the fit of those inside it: right as long as the fit is off by
            less than half a wavelength over the pair's distance.

        Examples
        --------
        >>> wide = ArrayManifold(SensorArray.symmetric([0.5, 4.0]), wavelength=1.0)
        >>> turns = 2 * np.pi * np.array([0, -3])
        >>> wide.doa(wide.phases(0.8) + turns).round(6)
        np.float64(0.8)
        """
        d, given = 2 * np.pi * self.distances, np.asarray(phases, dtype=np.float64)
        if given.shape[-1:] != d.shape:
            raise ValueError(f"phases must have shape (..., {len(d)}); got {given.shape}")
        num, den = d[0] * given[..., 0], d[0] ** 2  # equal noise in all phases: weights d²
        for m, d_m in enumerate(d[1:], 1):
            phi_m = given[..., m]
            turns = np.rint((d_m * num / den - phi_m) / (2 * np.pi))
            num, den = num + d_m * (phi_m + 2 * np.pi * turns), den + d_m**2
        return np.asarray(np.arcsin(np.minimum(np.maximum(num / den, -1.0), 1.0)))

    @property
    def dim_z(self) -> int:
        """Twice the number of sensors: real and imaginary parts."""
        return 2 * self.array.n_sensors

    def response_to(self, doa: ArrayLike) -> Float:
        """Return `real_steering`."""
        return self.real_steering(doa)

    def response_slope(self, doa: float) -> Float:
        """Return the derivative of `real_steering` at one direction, rad: (n_sensors,)."""
        return self.slope(doa)

    def slope(self, doa: ArrayLike) -> Float:
        """Return the derivative of `real_steering`, √2 φ'_m (-sin φ_m, cos φ_m); same shape."""
        doa = np.asarray(doa, dtype=np.float64)
        phi = self.phases(doa)
        rate = np.sqrt(2.0) * 2 * np.pi * self.distances * np.cos(doa)[..., None]
        return self.between(-rate * np.sin(phi), 0.0, rate * np.cos(phi))


@lru_cache(maxsize=64)
def _pairs(array: SensorArray) -> tuple[Int, int | None, Int]:
    """Return the sensors left of the centre, the centre, and those right of it, inner first.

    Raises
    ------
    ValueError
        If the array is not a line, has no pair, or is not symmetric about its centre.
    """
    if array.dim != 1:
        raise ValueError(f"array must be a line; got sensors in {array.dim} dimensions")
    positions = array.positions[:, 0]
    order = np.argsort(positions)
    n = len(order)
    if n < 2:
        raise ValueError(f"array must have a pair of sensors; got {n}")
    middle = int(order[n // 2]) if n % 2 else None
    left, right = order[: n // 2][::-1], order[(n + 1) // 2 :]
    centre = positions[order].mean() if middle is None else positions[middle]
    off = np.abs(positions[left] + positions[right] - 2 * centre)
    worst = int(np.argmax(off))
    if off[worst] > 1e-6 * np.ptp(positions):
        raise ValueError(
            f"array must be symmetric about its centre at {centre:g} m; got "
            f"sensors at {positions[left[worst]]:g} and {positions[right[worst]]:g} m"
        )
    return left, middle, right


@lru_cache(maxsize=64)
def _transformation(array: SensorArray) -> Complex:
    left, middle, right = _pairs(array)
    M, n = len(left), array.n_sensors
    T = np.zeros((n, n), dtype=np.complex128)
    pair = np.arange(M)
    T[right, pair] = T[left, pair] = np.sqrt(0.5)
    if middle is not None:
        T[middle, M] = 1.0
    T[right, n - M + pair], T[left, n - M + pair] = 1j * np.sqrt(0.5), -1j * np.sqrt(0.5)
    T.setflags(write=False)
    return T
