"""Complex snapshots of an array: one number a sensor, at one frequency or several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.ambiguity import ambiguous_pair, check_directions
from arrivals.measurement_models.arrays.element_response import ElementResponse
from arrivals.measurement_models.arrays.noise_coherence import (
    NoiseCoherence,
    coherence_of,
    white_share,
)
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves, frequency_bins, grid_of
from arrivals.measurement_models.arrays.sensor_array import SensorArray, direction
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.manifolds.fourier import fourier_manifold
from arrivals.measurement_models.manifolds.manifold import (
    AngleManifold,
    Manifold,
    Reference,
    angle_manifold,
)
from arrivals.measurement_models.manifolds.two_unknowns import (
    Unknowns,
    check_unknowns,
    is_planar,
    two_unknowns_manifold,
)
from arrivals.measurement_models.manifolds.uniform_line import grid_line
from arrivals.measurement_models.manifolds.whitened import whitened_manifold
from arrivals.measurement_models.snapshot_likelihood import (
    of_state,
)
from arrivals.measurement_models.snapshots.noise import SnapshotNoise
from arrivals.typing import Complex
from arrivals.validation import count, instance, one_of, positive


@dataclass(frozen=True)
class ArraySnapshot(SnapshotNoise):
    """Snapshots of plane waves on an array: z = Σ w a(β) + u, one or several in a step.

    Gridless methods use `observe` and `manifold`. A particle filter on directions uses
    `log_likelihood(z, doa)`, in which the amplitudes w ~ CN(0, power) are integrated out. The
    Gaussian interface (`h`, `H`, `R`) is that of one source with a state [β, Re w, Im w] and real
    measurements, `composite(z)`; it is for a single snapshot a step.

    Parameters
    ----------
    array : SensorArray
        Positions of the sensors.
    wavelength : float or sequence of float
        Metres; one of each frequency bin.
    noise : float
        Variance of the complex noise of one sensor. SVALSE and VALSE estimate it instead.
    power : float
        Prior variance of a source's complex amplitude, for `log_likelihood`.
    n_snapshots : int
        Snapshots in one step, during which directions are constant.
    response : ElementResponse, optional
        Gains of directional or measured elements; isotropic ones if None. For arrays in a plane.
    slowness : sequence of float, optional
        Grid of an unknown slowness, as factors of the nominal one.
    elevation : sequence of float, optional
        Grid of an unknown elevation, rad; waves are horizontal if None.
    angle : {"auto", "doa"}
        Angle in which a line is tracked: "auto" is the electrical angle where the sensors are on
        a uniform grid, gaps allowed, of at most half of one wavelength, and the noise is white;
        "doa" the direction.
    noise_coherence : {"white", "diffuse"} or array_like
        Coherence Γ of the noise between sensors: none; that of waves from all directions of the
        sphere on isotropic elements, such as reverberation of a room or ambient noise of the sea,
        Γ = (1 - white) sinc(2 d/λ) + white I; or matrices (n_bins, n_sensors, n_sensors) or
        (n_sensors, n_sensors), Hermitian and positive definite with ones on the diagonal.
    white : float
        White share of the variance of "diffuse" noise, at least 1e-8.
    unknowns : {"azimuth", "sphere", "range"}
        What is unknown of a source: its direction, from broadside on a line and else the azimuth
        of a horizontal wave; azimuth and elevation; or direction and range, on a line. The latter
        two are for isotropic elements and white noise. An array in a plane has the same response
        to a direction and its mirror image: `half_space`.
    nearest : float, optional
        Distance of the nearest source of unknown range from the centroid, m; a quarter of the
        Fraunhofer distance 2 extent²/λ of the shortest wavelength if None. From there on,
        wavefronts are parabolic, and plane unless the data support a curvature, which has a
        standard deviation of 1/nearest a priori. Below, they are spherical.

    Notes
    -----
    Shapes: `shape` is that of one measurement, (n_bins, n_snapshots, n_sensors), where axes of
    length one are left out; complex, any leading axes. Directions (..., n_sources), rad.
    What marks a missing number: `arrivals.measurements`. A channel of zeros alone, in all bins and
    snapshots of a step, is missing, too, with one warning; a step of zeros alone is missing.
    `observe` leaves out bins and snapshots without valid data, then sensors with gaps.

    Noise that is coherent is whitened: `observe` and `manifold` give L z and L a of the valid
    sensors, L = chol(Γ)⁻¹; `whitening` and `whitened` are for other methods. `noise` remains the
    variance at one sensor, amplitudes those of the waves, and `snapshot`, `steering_vector` and
    `wave` are not whitened.

    Examples
    --------
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> z = model.array.steering_vector(0.3, 1.0)
    >>> bool(model.log_likelihood(z, [0.3]) > model.log_likelihood(z, [-0.3]))
    True
    >>> ArraySnapshot(SensorArray.uca(8, 0.65), [1.0, 1.2], n_snapshots=10).shape
    (2, 10, 8)
    >>> ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, unknowns="sphere").manifold().n_unknowns
    2
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
    noise_coherence: Literal["white", "diffuse"] | ArrayLike | NoiseCoherence = "white"
    white: float = 0.1
    unknowns: Unknowns = "azimuth"
    nearest: float | None = None

    def __post_init__(self) -> None:
        instance("array", self.array, SensorArray)
        object.__setattr__(self, "wavelength", frequency_bins(self.wavelength))
        for name in ("noise", "power"):
            positive(name, getattr(self, name))
        count("n_snapshots", self.n_snapshots, maximum=100_000)
        one_of("angle", self.angle, ("auto", "doa"))
        for name in ("slowness", "elevation"):
            object.__setattr__(self, name, grid_of(name, getattr(self, name)))
        if self.response is not None:
            instance("response", self.response, ElementResponse)
        object.__setattr__(self, "white", white_share(self.white))
        coherence = coherence_of("noise_coherence", self.noise_coherence, self.n_bins, self.array)
        object.__setattr__(self, "noise_coherence", coherence)
        self.waves  # noqa: B018  (refuses parts that do not fit each other)
        check_unknowns(self.waves, self.unknowns, self.nearest, self.coherence is None)

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """Wavelengths of the bins, m."""
        return self.wavelength if isinstance(self.wavelength, tuple) else (self.wavelength,)

    @property
    def n_bins(self) -> int:
        """Number of frequency bins."""
        return len(self.wavelengths)

    def plain_wavelength(self, method: str, *, white_noise: bool = True) -> float:
        """Return the wavelength, m, for a method of one snapshot a step of isotropic sensors.

        `white_noise` is True for a method that takes the noise for white.
        """
        self.check_one_unknown(method)
        if white_noise and self.coherence is not None:
            raise ValueError(f"{method} requires noise_coherence='white'; got coherent noise")
        if not (self.is_single and self.response is None):
            elements = "isotropic" if self.response is None else "directional"
            raise ValueError(
                f"{method} requires one snapshot a step, at one frequency, of isotropic sensors; "
                f"got shape {self.shape} of {elements} ones"
            )
        return self.wavelengths[0]

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Shape of one measurement: bins and snapshots, if several; sensors."""
        axes = [n for n in (self.n_bins, self.n_snapshots) if n > 1]
        return (*axes, self.array.n_sensors)

    @property
    def is_single(self) -> bool:
        """True if a step is one snapshot at one frequency, without a second unknown."""
        return len(self.shape) == 1 and self.slowness is None and self.elevation is None

    @property
    def is_plain(self) -> bool:
        """True if `is_single`, the elements are isotropic and the noise is white."""
        return self.is_single and self.response is None and self.coherence is None

    @property
    def half_space(self) -> bool:
        """True if directions on the sphere are those of a half: sensors in a plane.

        The half is that of elevations from 0 to 90 degrees; of a plane that is not horizontal, the
        side of its normal, which points upwards.
        """
        return self.unknowns == "sphere" and is_planar(self.array)

    def check_one_unknown(self, method: str) -> None:
        """Raise a ValueError for a method of one unknown a source, if there are two."""
        if self.unknowns != "azimuth":
            raise ValueError(f"{method} requires unknowns='azimuth'; got {self.unknowns!r}")

    @cached_property
    def waves(self) -> PlaneWaves:
        """Response of the array to plane waves."""
        parts = self.response, self.slowness, self.elevation
        return PlaneWaves(self.array, self.wavelengths, *parts)

    def manifold(self, reference: Reference = "middle") -> Manifold:
        """Return the response, as a Fourier series of an angle or as a function of points.

        With two unknowns a source it is a `PointManifold`; with one, a series. For lines on a
        uniform grid of at most half of one wavelength the angle is the electrical one and the
        series is that of the sensors; for every other array, and where the noise is coherent, it
        is the direction.

        Raises
        ------
        ValueError
            If directions are not identifiable: fewer than 3 sensors in a plane or in space, or
            all of them collinear there (front and back are ambiguous); a line of one sensor.
        """
        if reference not in self._manifolds:
            one_of("reference", reference, ("middle", "first"))
            if self.unknowns == "azimuth":
                check_directions(self.waves)
            self._manifolds[reference] = self._new_manifold(reference)
        return self._manifolds[reference]

    def angle_manifold(self, reference: Reference = "middle") -> AngleManifold:
        """Return the response as a Fourier series of one angle.

        Raises
        ------
        ValueError
            As `manifold` does, and if a source has two unknowns.
        """
        return angle_manifold("this method", self.manifold(reference))

    def _new_manifold(self, reference: Reference) -> Manifold:
        if self.unknowns != "azimuth":
            if reference != "middle":
                raise ValueError(f"reference must be 'middle' with two unknowns; got {reference!r}")
            return two_unknowns_manifold(self.waves, self.unknowns, self.nearest)
        if self.coherence is not None:
            return whitened_manifold(self.waves, self.coherence, reference)
        line = None
        if self.angle == "auto" and self.n_bins == 1 and not self.slowness:
            line = grid_line(self.array, self.wavelengths[0], reference)
        return line or fourier_manifold(self.waves, reference)

    @cached_property
    def _manifolds(self) -> dict[str, Manifold]:
        return {}  # those made so far, by reference: the model does not change

    def ambiguity(self) -> tuple[float, float] | None:
        """Return the first two directions, rad, of equal response at every frequency, or None.

        On the sphere None: pairs are not searched there, and the mirror images of an array in a
        plane are left out by `half_space`.
        """
        return None if self.unknowns == "sphere" else ambiguous_pair(self.waves)

    @property
    def dim_z(self) -> int:
        """Twice the number of sensors: real and imaginary parts."""
        return 2 * int(np.prod(self.shape))

    def response_to(self, doa: ArrayLike) -> Complex:
        """Return a(β) of directions (...), rad: (..., n_sensors); for a single snapshot a step."""
        self.check_one_unknown("the Gaussian interface")
        if not self.is_single:
            raise ValueError(
                "Gaussian interface must have one snapshot a step at one wavelength; got "
                f"measurements of shape {self.shape}"
                + ("" if self.slowness is self.elevation else " and a second unknown")
            )
        return self.steering_vector(doa)

    def response_slope(self, doa: float) -> Complex:
        """Return da/dβ at one direction, rad: (n_sensors,)."""
        turned = direction(doa + np.pi / 2, max(self.array.dim, 2))  # du/dβ in the plane
        slope = turned[..., 1:2] if self.array.dim == 1 else turned
        path = 2 * np.pi / self.wavelengths[0] * (self.array.positions @ slope)
        da = 1j * path * self.steering_vector(doa)
        if self.response is not None:
            isotropic = self.array.steering_vector(doa, self.wavelengths[0])
            da = da + isotropic * self.response(doa, slope=True)[0]
        return np.asarray(da)

    def for_likelihood(self, names: Sequence[str]) -> MeasurementModel:
        """Return this model for `log_likelihood`; amplitudes that are no states are integrated."""
        self.check_one_unknown("a filter of states")
        return self if tuple(names) in ((), ("doa",)) else of_state(self, names)
