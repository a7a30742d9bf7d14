"""Complex snapshots of an array: one number a sensor, at one frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.ambiguity import ambiguous_pair, in_a_line
from arrivals.measurement_models.arrays.element_response import ElementResponse
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sensor_array import SensorArray, direction
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.manifolds.fourier import fourier_manifold
from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.measurement_models.manifolds.uniform_line import grid_line
from arrivals.measurement_models.observed import ObservedSnapshots
from arrivals.measurement_models.snapshot_likelihood import (
    composite,
    from_composite,
    log_known,
    log_marginal,
    of_state,
)
from arrivals.typing import Complex, Float
from arrivals.validation import count, instance, one_of, positive, real, shaped, state

LARGEST, SMALLEST = 1e140, 1e-140


@dataclass(frozen=True)
class ArraySnapshot(MeasurementModel):
    """What an array hears of plane waves: z = Σ w a(β) + u, once or several times in a step.

    Three faces. The gridless methods ask for `manifold()`. A particle filter on directions asks
    for `log_likelihood(z, doa)`, in which the amplitudes w ~ CN(0, power) are integrated out.
    The Gaussian face (`h`, `H`, `R`) is that of one source with a state [β, Re w, Im w], and its
    measurements are real, `composite(z)`; it is for a single look.

    Parameters
    ----------
    array : SensorArray
    wavelength : float or sequence of float
        Metres; one of each frequency bin.
    noise : float
        Variance of the complex noise of one sensor. SVALSE and VALSE estimate it instead.
    power : float
        Prior variance of a source's complex amplitude, for `log_likelihood`.
    n_snapshots : int
        Snapshots in one step, during which sources stand still.
    response : ElementResponse, optional
        Gains of directional or measured elements; isotropic ones if None. For arrays in a plane.
    slowness : sequence of float, optional
        Grid of an unknown slowness, as factors of that which the wavelengths stand for.
    elevation : sequence of float, optional
        Grid of an unknown elevation, rad; waves are horizontal if None.
    angle : {"auto", "doa"}
        In which angle a line is tracked: "auto" takes the electrical one where there is one
        (a uniform grid, gaps allowed, within half of one wavelength); "doa" the direction itself.

    Notes
    -----
    Shapes: `shape` is that of one measurement, (n_bins, n_snapshots, n_sensors), where axes of
    length one are left out; complex, any leading axes. Directions (..., n_sources), rad.
    A bin or a snapshot in which no sensor gave a number is left out, and then every sensor that
    is NaN in any of the other looks of the step.

    Examples
    --------
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> z = model.array.steering_vector(0.3, 1.0)
    >>> bool(model.log_likelihood(z, [0.3]) > model.log_likelihood(z, [-0.3]))
    True
    >>> ArraySnapshot(SensorArray.uca(8, 0.65), [1.0, 1.2], n_snapshots=10).shape
    (2, 10, 8)
    """

    array: SensorArray
    wavelength: float | Sequence[float]
    noise: float = 1.0
    power: float = 1.0
    n_snapshots: int = 1
    response: ElementResponse | None = None
    slowness: Sequence[float] | None = None
    elevation: Sequence[float] | None = None
    angle: Literal["auto", "doa"] = "auto"

    def __post_init__(self) -> None:
        instance("array", self.array, SensorArray)
        if isinstance(self.wavelength, Sequence | np.ndarray) and not isinstance(
            self.wavelength, str
        ):
            bins = tuple(positive("wavelength", each) for each in self.wavelength)
            if not bins:
                raise ValueError("wavelength must name at least one bin; got none")
            object.__setattr__(self, "wavelength", bins if len(bins) > 1 else bins[0])
        else:
            positive("wavelength", self.wavelength)
        for name in ("noise", "power"):
            positive(name, getattr(self, name))
        count("n_snapshots", self.n_snapshots)
        one_of("angle", self.angle, ("auto", "doa"))
        for name in ("slowness", "elevation"):
            if getattr(self, name) is not None:
                grid = real(name, getattr(self, name))
                if grid.ndim != 1 or len(grid) == 0 or not np.isfinite(grid).all():
                    raise ValueError(f"{name} must be a list of finite numbers; got {grid}")
                object.__setattr__(self, name, tuple(grid.tolist()))
        if self.response is not None:
            instance("response", self.response, ElementResponse)
        self.waves  # noqa: B018  (refuses parts that do not fit each other)

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """Wavelengths of the bins, m."""
        return self.wavelength if isinstance(self.wavelength, tuple) else (self.wavelength,)

    def plain_wavelength(self, method: str) -> float:
        """Return the wavelength, m, for methods of one snapshot a step of isotropic sensors.

        Raises
        ------
        ValueError
            If a step holds more, or the sensors are directional; `method` is the one named.

        Examples
        --------
        >>> pair = SensorArray.ula(2, spacing=0.5)
        >>> ArraySnapshot(pair, wavelength=[1.0, 2.0]).plain_wavelength("esprit")
        Traceback (most recent call last):
        ValueError: esprit takes one snapshot a step, at one frequency, of isotropic sensors; ...
        """
        if not (self.is_single and self.response is None):
            raise ValueError(
                f"{method} takes one snapshot a step, at one frequency, of isotropic sensors; this "
                f"model has measurements of shape {self.shape}"
                + ("" if self.response is None else " and directional elements")
            )
        return self.wavelengths[0]

    @property
    def n_bins(self) -> int:
        """Number of frequency bins."""
        return len(self.wavelengths)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one measurement: bins and snapshots, where there are several; sensors."""
        looks = [n for n in (self.n_bins, self.n_snapshots) if n > 1]
        return (*looks, self.array.n_sensors)

    @property
    def is_single(self) -> bool:
        """Whether a step is one snapshot at one frequency, without a second unknown."""
        return len(self.shape) == 1 and self.slowness is None and self.elevation is None

    @property
    def waves(self) -> PlaneWaves:
        """The array's answer to plane waves."""
        return PlaneWaves(
            self.array, self.wavelengths, self.response, self.slowness, self.elevation
        )

    def steering_vector(self, doa: ArrayLike) -> Complex:
        """Return responses to `doa` (...), rad: (..., n_sensors), or (..., n_bins, n_sensors).

        Those of horizontal waves of the nominal slowness.
        """
        doa = np.asarray(doa, dtype=np.float64)
        a = self.array.steering_vector(doa[..., None], np.asarray(self.wavelengths))
        if self.response is not None:
            a = a * np.moveaxis(self.response(doa), 0, -2)
        return a if self.n_bins > 1 else np.asarray(a[..., 0, :])

    def snapshot(self, z: ArrayLike) -> Complex:
        """Return a measurement as complex numbers, of `shape`, NaN where a sensor gave none.

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
        if array.shape != self.shape:
            axes = "" if len(self.shape) == 1 else " in every look"
            raise ValueError(
                f"a snapshot must have shape {self.shape}, one number a sensor{axes}; "
                f"got {array.shape}"
            )
        array = array.astype(np.complex128)
        size = np.abs(array)
        array[~(size < LARGEST)] = complex(np.nan, np.nan)
        array[size < SMALLEST] = 0
        if np.isnan(array).all():
            raise ValueError("no sensor of the snapshot gave a finite number")
        return array

    def observe(
        self, z: ArrayLike | None, reference: Reference = "middle"
    ) -> ObservedSnapshots | None:
        """Return the bins, sensors and snapshots of a measurement that have valid data.

        Parameters
        ----------
        z : array_like, shape `shape`, or None
            Complex; NaN where a sensor gave no number.
        reference : {"middle", "first"}
            As in `manifold`.

        Returns
        -------
        ObservedSnapshots or None
            The data without gaps, with the manifold of their bins and sensors; None if the whole
            measurement is missing.

        Raises
        ------
        ValueError
            If the shape is wrong, or every sensor has a gap in some snapshot.
        """
        if z is None:
            return None
        z = np.asarray(z)
        if z.dtype.kind in "fc" and z.size and np.isnan(z).all():
            return None
        return ObservedSnapshots.of(self.looks(z), self.manifold(reference))

    def looks(self, z: ArrayLike) -> Complex:
        """Return a snapshot with the axes of a `Manifold`: (n_bins, n_sensors, n_snapshots)."""
        looks = self.snapshot(z).reshape(self.n_bins, self.n_snapshots, self.array.n_sensors)
        return np.swapaxes(looks, 1, 2)

    def manifold(self, reference: Reference = "middle") -> Manifold:
        """Return the response as a Fourier series of an angle.

        Lines on a uniform grid within half of one wavelength are seen in the electrical angle,
        where the series is that of the sensors themselves; every other array in the direction.

        Raises
        ------
        ValueError
            If the array cannot give directions: fewer than 3 sensors in a plane or in space, or
            all of them in a line there, which cannot tell front from back; a line of one sensor.
        """
        one_of("reference", reference, ("middle", "first"))
        self._check_directions()
        line = None
        if self.angle == "auto" and self.n_bins == 1 and not self.slowness:
            line = grid_line(self.array, self.wavelengths[0], reference)
        return fourier_manifold(self.waves, reference) if line is None else line

    def ambiguity(self) -> tuple[float, float] | None:
        """Return the first two directions, rad, that look alike at every frequency, or None."""
        return ambiguous_pair(self.waves)

    def _check_directions(self) -> None:
        n, least = self.array.n_sensors, 2 if self.array.dim == 1 else 3
        if n < least:
            what = "directions" if self.array.dim == 1 else "azimuths"
            raise ValueError(f"{what} want at least {least} sensors; this array has {n}")
        if self.array.dim > 1 and (azimuth := in_a_line(self.waves)) is not None:
            along = np.rad2deg(azimuth)
            one, other = (f"{(along + side) % 360:.0f}" for side in (30, -30))
            raise ValueError(
                f"the {n} sensors stand in a line, which cannot tell front from back: azimuths "
                f"{one} and {other} degrees look alike. Give the sensors' coordinates along the "
                "line, one number each, for directions from broadside"
            )

    def log_likelihood(
        self, z: ArrayLike, doa: ArrayLike, amplitude: ArrayLike | None = None
    ) -> Float:
        """Return ln p(z | β) for directions (..., n_sources), rad.

        z ~ CN(0, power Σ a aᴴ + noise I) in every snapshot, the amplitudes integrated out; sensors
        that are NaN are left out of theirs. An unknown slowness or elevation is averaged over,
        each value as likely.

        Parameters
        ----------
        z : array_like, shape `shape` or (dim_z,)
            One measurement, complex, or real as `composite` makes it.
        doa : array_like, shape (..., n_sources)
            Directions, rad.
        amplitude : array_like, shape (..., n_sources), optional
            Complex amplitudes where they are known: then z ~ CN(Σ w a, noise I).

        Returns
        -------
        ndarray, shape (...)
        """
        z = from_composite(z, self.shape)
        doa = np.asarray(doa, dtype=np.float64)
        if amplitude is not None:
            return log_known(self.snapshot(z), self.wave(doa, amplitude), self.noise)
        Y = np.moveaxis(self.looks(z), 1, 2)[..., None, :]  # (F, N, 1, M): a row a snapshot
        a = self.waves.steering(doa.ravel())  # (S, F, M, n)
        A = np.moveaxis(a, 3, 2).reshape(*a.shape[:2], 1, *doa.shape, self.array.n_sensors)
        each = log_marginal(
            Y.reshape(*Y.shape[:2], *[1] * (doa.ndim - 1), -1), A, self.noise, self.power
        )
        total = each.sum(axis=(1, 2))  # over bins and snapshots
        top = total.max(axis=0)
        return np.asarray(top + np.log(np.exp(total - top).mean(axis=0)))

    def wave(self, doa: ArrayLike, amplitude: ArrayLike) -> Complex:
        """Return noiseless measurements of sources at `doa` (..., n_sources), as in `simulate`."""
        doa = np.asarray(doa, dtype=np.float64)
        on = ~np.isnan(doa)
        A = self.steering_vector(np.where(on, doa, 0.0))  # (..., K, [F], M)
        if self.n_bins > 1:
            A = np.swapaxes(A, -2, -3)
        looks = tuple(range(doa.ndim - 1, doa.ndim - 1 + len(self.shape) - 1))
        on = np.expand_dims(on, looks)
        if self.n_snapshots > 1:
            A = np.expand_dims(A, -3)
        w = np.where(on, amplitude, 0.0)
        return np.asarray((w[..., None, :] @ A)[..., 0, :])

    def simulate(self, doa: ArrayLike, amplitude: ArrayLike, rng: np.random.Generator) -> Complex:
        """Draw measurements (..., *shape) of sources at `doa` (..., n_sources), rad.

        Amplitudes are complex, at the origin of coordinates, and are broadcast to
        (..., bins and snapshots as in `shape`, n_sources); a NaN direction is a source that is
        off.
        """
        wave = self.wave(doa, amplitude)
        shape = np.broadcast_shapes(wave.shape, self.shape)
        u = rng.standard_normal((*shape, 2)) @ np.array([1, 1j]) * np.sqrt(self.noise / 2)
        return np.asarray(wave + u)

    @property
    def dim_z(self) -> int:
        """Twice the number of sensors: real and imaginary parts."""
        return 2 * int(np.prod(self.shape))

    @property
    def R(self) -> Float:
        """Covariance of the composite noise: half the variance for each part."""
        return self.noise / 2 * np.eye(self.dim_z)

    @property
    def needs(self) -> tuple[str, ...]:
        """doa, amplitude_re, amplitude_im."""
        return "doa", "amplitude_re", "amplitude_im"

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
        path = 2 * np.pi / self.wavelengths[0] * (self.array.positions @ slope)
        da = 1j * path * a
        if self.response is not None:
            plain = self.array.steering_vector(doa, self.wavelengths[0])
            da = da + plain * self.response(doa, slope=True)[0]
        return np.stack([composite((re + 1j * im) * da), composite(a), composite(1j * a)]).T

    def for_likelihood(self, names: Sequence[str]) -> MeasurementModel:
        """Return this model for `log_likelihood` at states with these names.

        The direction is needed; the amplitudes are integrated out if the state has none.
        """
        return self if tuple(names) in ((), ("doa",)) else of_state(self, names)

    def _a(self, doa: ArrayLike) -> Complex:
        if not self.is_single:
            raise ValueError(
                "the Gaussian face is that of one snapshot at one wavelength; this model has "
                f"measurements of shape {self.shape}"
                + ("" if self.slowness is self.elevation else " and a second unknown")
            )
        return self.steering_vector(doa)
