"""Waves of sources on an array: responses, noiseless snapshots, and draws."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.element_response import ElementResponse
from arrivals.measurement_models.arrays.plane_waves import source_paths
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurements import numbers
from arrivals.typing import Complex, Float
from arrivals.validation import instance, real


class SnapshotWaves:
    """Mixin of models of complex snapshots: what sources contribute.

    Attributes
    ----------
    array : SensorArray
        Positions of the sensors.
    response : ElementResponse or None
        Gains of the elements, functions of the azimuth.
    n_bins, n_snapshots : int
        Frequency bins and snapshots of one measurement.
    shape : tuple of int
        Shape of one measurement: bins and snapshots, if several; sensors.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot
    >>> line = ArraySnapshot(SensorArray([-1.0, 0.0, 1.0]), wavelength=1.0, unknowns="range")
    >>> np.abs(line.steering_vector(np.pi / 2, distance=2.0)).round(3)
    array([0.667, 1.   , 2.   ])
    """

    array: SensorArray
    response: ElementResponse | None
    n_snapshots: int

    @property
    @abstractmethod
    def n_bins(self) -> int:
        """Number of frequency bins."""

    @property
    @abstractmethod
    def wavelengths(self) -> tuple[float, ...]:
        """Wavelengths of the bins, m."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """Shape of one measurement."""

    @abstractmethod
    def draw_noise(self, shape: tuple[int, ...], rng: np.random.Generator) -> Complex:
        """Draw noise of measurements (..., *self.shape), complex."""

    def steering_vector(
        self,
        doa: ArrayLike,
        elevation: ArrayLike | None = None,
        distance: ArrayLike | None = None,
    ) -> Complex:
        """Return responses to directions (...): (..., n_sensors), or (..., n_bins, n_sensors).

        Parameters
        ----------
        doa : array_like, shape (...)
            Azimuths, or directions from broadside, rad.
        elevation : array_like, shape (...), optional
            Elevations, rad; horizontal waves if None.
        distance : array_like, shape (...), optional
            Distances of the sources from the centroid of the sensors, m, infinite for a plane
            wave; plane waves if None. Amplitudes decay as 1/r and are those at the centroid; their
            phases are those of a plane wave at the origin of coordinates.

        Returns
        -------
        ndarray of complex, shape (..., [n_bins,] n_sensors)
            Of the nominal slowness.
        """
        doa = real("doa", doa)
        wavelengths = np.asarray(self.wavelengths)
        if elevation is None and distance is None:
            a = self.array.steering_vector(doa[..., None], wavelengths)
        else:
            second = _second("elevation", elevation, doa), _second("distance", distance, doa)
            path, gain = source_paths(self.array, doa, *second)
            phase = 2 * np.pi / wavelengths[:, None] * path[..., None, :]
            a = np.asarray(gain[..., None, :] * np.exp(1j * phase))
        if self.response is not None:
            a = a * np.moveaxis(self.response(doa), 0, -2)
        return a if self.n_bins > 1 else np.asarray(a[..., 0, :])

    def wave(
        self,
        doa: ArrayLike,
        amplitude: ArrayLike,
        elevation: ArrayLike | None = None,
        distance: ArrayLike | None = None,
    ) -> Complex:
        """Return noiseless measurements of sources at `doa` (..., n_sources), as in `simulate`."""
        doa, amplitude = np.atleast_1d(real("doa", doa)), numbers("amplitude", amplitude)
        active = ~np.isnan(doa)
        height, far = _second("elevation", elevation, doa), _second("distance", distance, doa)
        A = self.steering_vector(  # (..., K, [F], M)
            np.where(active, doa, 0.0),
            None if height is None else np.where(active, height, 0.0),
            None if far is None else np.where(active, far, np.inf),
        )
        if self.n_bins > 1:
            A = np.swapaxes(A, -2, -3)
        axes = tuple(range(doa.ndim - 1, doa.ndim + len(self.shape) - 2))  # bins, snapshots
        if self.n_snapshots > 1:
            A = np.expand_dims(A, -3)
        try:
            w = np.where(np.expand_dims(active, axes), amplitude, 0.0)
            return np.asarray((w[..., None, :] @ A)[..., 0, :])
        except (ValueError, RuntimeError):
            shapes = f"{doa.shape} and {amplitude.shape}"
            raise ValueError(f"doa and amplitude must have shapes that fit; got {shapes}") from None

    def simulate(
        self,
        doa: ArrayLike,
        amplitude: ArrayLike,
        rng: np.random.Generator,
        elevation: ArrayLike | None = None,
        distance: ArrayLike | None = None,
    ) -> Complex:
        """Draw measurements (..., *shape) of sources.

        Parameters
        ----------
        doa : array_like, shape (..., n_sources)
            Directions, rad; a source of NaN direction is inactive.
        amplitude : array_like, shape (..., [n_bins,] [n_snapshots,] n_sources)
            Complex, at the origin of coordinates; broadcast.
        rng : numpy.random.Generator
            Source of random numbers.
        elevation, distance : array_like, shape (..., n_sources), optional
            As in `steering_vector`.

        Returns
        -------
        ndarray of complex, shape (..., *shape)
        """
        instance("rng", rng, np.random.Generator)
        wave = self.wave(doa, amplitude, elevation, distance)
        shape = np.broadcast_shapes(wave.shape, self.shape)
        return np.asarray(wave + self.draw_noise(shape, rng))


def _second(name: str, values: ArrayLike | None, doa: Float) -> Float | None:
    """Return elevations or distances of the shape of the directions."""
    if values is None:
        return None
    values = real(name, values)
    values = np.atleast_1d(values) if doa.ndim else values
    if values.shape != doa.shape:
        raise ValueError(f"{name} must have the shape of doa, {doa.shape}; got {values.shape}")
    return values
