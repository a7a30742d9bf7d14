"""Complex snapshots of an array: one number a sensor, at one frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.checks import instance, positive, shaped, state
from arrivals.measurement_models.arrays import SensorArray, direction
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.manifolds import GridLine, Manifold, Reference
from arrivals.typing import Complex, Float

LARGEST, SMALLEST = 1e140, 1e-140


def composite(z: ArrayLike) -> Float:
    """Return complex vectors (..., n) as real ones (..., 2n): [Re; Im].

    Examples
    --------
    >>> composite([1 + 2j, 3 - 4j])
    array([ 1.,  3.,  2., -4.])
    """
    z = np.asarray(z)
    return np.concatenate([z.real, z.imag], axis=-1).astype(np.float64)


@dataclass(frozen=True)
class ArraySnapshot(MeasurementModel):
    """What an array hears of plane waves: z = Σ w a(β) + u.

    Three faces. The gridless methods ask for `manifold()`. A particle filter on directions asks
    for `log_likelihood(z, doa)`, in which the amplitudes w ~ CN(0, power) are integrated out.
    The Gaussian face (`h`, `H`, `R`) is that of one source with a state [β, Re w, Im w], and its
    measurements are real, `composite(z)`.

    Parameters
    ----------
    array : SensorArray
    wavelength : float
        Metres.
    noise : float
        Variance of the complex noise of one sensor. SVALSE and VALSE estimate it instead.
    power : float
        Prior variance of a source's complex amplitude, for `log_likelihood`.

    Notes
    -----
    Shapes: snapshots (..., n_sensors), complex; directions (..., n_sources), rad.

    Examples
    --------
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> z = model.array.steering_vector(0.3, 1.0)
    >>> bool(model.log_likelihood(z, [0.3]) > model.log_likelihood(z, [-0.3]))
    True
    """

    array: SensorArray
    wavelength: float
    noise: float = 1.0
    power: float = 1.0

    def __post_init__(self) -> None:
        instance("array", self.array, SensorArray)
        for name in ("wavelength", "noise", "power"):
            positive(name, getattr(self, name))

    def snapshot(self, z: ArrayLike) -> Complex:
        """Return a snapshot as complex numbers, (n_sensors,), NaN where a sensor gave none.

        Numbers whose squares would overflow count as infinite, those that would vanish as zero.

        Raises
        ------
        ValueError
            If the shape is wrong or no sensor gave a finite number.
        """
        array = np.asarray(z)
        if array.dtype.kind not in "biufc":
            raise TypeError(
                f"a snapshot must hold complex numbers, NaN for a missing one; got {array.dtype}"
            )
        if array.shape != (self.array.n_sensors,):
            raise ValueError(
                f"a snapshot must have shape ({self.array.n_sensors},), one number a sensor; "
                f"got {array.shape}"
            )
        array = array.astype(np.complex128)
        size = np.abs(array)
        array[~(size < LARGEST)] = complex(np.nan, np.nan)
        array[size < SMALLEST] = 0
        if np.isnan(array).all():
            raise ValueError("no sensor of the snapshot gave a finite number")
        return array

    def looks(self, z: ArrayLike) -> Complex:
        """Return a snapshot with the axes of a `Manifold`: (n_bins, n_sensors, n_snapshots)."""
        return self.snapshot(z)[None, :, None]

    def manifold(self, reference: Reference = "middle") -> Manifold:
        """Return the response as a Fourier series, for lines on a uniform grid.

        Raises
        ------
        ValueError
            If the array is not such a line, or its grid is wider than half the wavelength, so
            that directions would be ambiguous.
        """
        spacing = self.array.spacing
        if spacing is None:
            raise ValueError(
                "a gridless method needs a line of sensors on a uniform grid (gaps are allowed); "
                f"this array has {self.array.n_sensors} sensors in {self.array.dim} dimension(s) "
                "on no such grid"
            )
        if self.wavelength < 2 * spacing * (1 - 1e-6):
            raise ValueError(
                f"the wavelength, {self.wavelength:.6g} m, is below the array's alias limit of two "
                f"grid spacings, {2 * spacing:.6g} m: directions are ambiguous"
            )
        coordinates = self.array.positions[:, 0]
        places = np.rint((coordinates - coordinates.min()) / spacing).astype(np.int64)
        step = min(2 * np.pi * spacing / self.wavelength, np.pi)
        return GridLine(places, step, -float(coordinates.min()) / spacing, reference)

    def log_likelihood(self, z: ArrayLike, doa: ArrayLike) -> Float:
        """Return ln p(z | β), the amplitudes integrated out, for directions (..., n_sources).

        z ~ CN(0, power Σ a aᴴ + noise I); sensors that are NaN are left out.
        """
        z = self.snapshot(z)
        heard = ~np.isnan(z)
        y, n = z[heard], int(heard.sum())
        A = self.array.steering_vector(doa, self.wavelength)[..., heard]  # rows a(β), (..., K, M)
        K = A.shape[-2]
        # matrix determinant lemma and Woodbury: only K x K matrices are factored
        G = A.conj() @ np.swapaxes(A, -1, -2) + self.noise / self.power * np.eye(K)
        b = A.conj() @ y
        explained = np.einsum("...k,...k->...", b.conj(), np.linalg.solve(G, b[..., None])[..., 0])
        log_det = np.linalg.slogdet(G)[1] + K * np.log(self.power / self.noise)
        misfit = (np.vdot(y, y) - explained).real / self.noise
        return np.asarray(-n * np.log(np.pi * self.noise) - log_det - misfit)

    def wave(self, doa: ArrayLike, amplitude: ArrayLike) -> Complex:
        """Return noiseless snapshots of sources at `doa` (..., n_sources), as in `simulate`."""
        doa = np.asarray(doa, dtype=np.float64)
        on = ~np.isnan(doa)
        A = self.array.steering_vector(np.where(on, doa, 0.0), self.wavelength)
        return np.asarray(np.einsum("...k,...km->...m", np.where(on, amplitude, 0.0), A))

    def simulate(self, doa: ArrayLike, amplitude: ArrayLike, rng: np.random.Generator) -> Complex:
        """Draw snapshots (..., n_sensors) of sources at `doa` (..., n_sources), rad.

        Amplitudes (..., n_sources) are complex, at the origin of coordinates; a NaN direction is
        a source that is off.
        """
        wave = self.wave(doa, amplitude)
        u = rng.standard_normal((*wave.shape, 2)) @ np.array([1, 1j]) * np.sqrt(self.noise / 2)
        return np.asarray(wave + u)

    @property
    def dim_z(self) -> int:
        """Twice the number of sensors: real and imaginary parts."""
        return 2 * self.array.n_sensors

    @property
    def R(self) -> Float:
        """Covariance of the composite noise: half the variance for each part."""
        return self.noise / 2 * np.eye(self.dim_z)

    def h(self, x: ArrayLike) -> Float:
        """Return the composite snapshot of states [β, Re w, Im w]: (..., 3) -> (..., dim_z)."""
        doa, re, im = np.moveaxis(state(x, 3), -1, 0)
        return composite((re + 1j * im)[..., None] * self._a(doa))

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, 3)."""
        doa, re, im = shaped("x", x, 3)
        a = self._a(doa)
        turned = direction(doa + np.pi / 2, max(self.array.dim, 2))  # du/dβ in the plane
        slope = turned[..., 1:2] if self.array.dim == 1 else turned
        path = 2 * np.pi / self.wavelength * (self.array.positions @ slope)
        return np.stack(
            [composite((re + 1j * im) * 1j * path * a), composite(a), composite(1j * a)]
        ).T

    def _a(self, doa: ArrayLike) -> Complex:
        return self.array.steering_vector(doa, self.wavelength)
