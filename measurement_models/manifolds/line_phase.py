"""Lines of sensors whose phases are linear: in sin β, and in sin β and curvature."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.located import range_estimate
from arrivals.measurement_models.manifolds.manifold import CandidatePoints
from arrivals.measurement_models.manifolds.phase import PhaseManifold
from arrivals.measurement_models.manifolds.points import (
    SPACING_OF_ONE,
    cell_centres,
    cell_count,
    cosine_squared,
    line_direction,
    sine_exists,
    sine_limits,
)
from arrivals.typing import Bool, Float

CURVATURE_WALK_SHARE = 0.2  # of the slab's standard deviation: the default step of the curvature

SPIKE_STD = 0.05  # of the curvature of a plane wave, rad rms of the phases over the array


@dataclass(frozen=True, eq=False)
class SineLine(PhaseManifold):
    """A line of sensors in sin β, at one frequency or several.

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`.
    period : float or None
        Difference of sines of equal responses of the whole array; None without.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> line = sine_line(PlaneWaves(SensorArray.ula(8, 0.5), (1.0, 1.2)))
    >>> float(line.located(line.from_doa([0.3]), np.zeros((1, 1)))["doa"][0].round(6))
    0.3
    """

    period: float | None

    @property
    def path(self) -> Float:
        """Coordinates of the sensors, (1, M)."""
        return self.positions.T

    def from_doa(self, doa: ArrayLike) -> Float:
        """Return the points (1, n) of directions (n,), rad."""
        return np.asarray(np.sin(doa)[None] / self.scale)

    def move(self, x: Float, step: Float) -> Float:
        """Return the points after displacements; beyond ±1 their images within, if any."""
        moved = x + step
        if self.period is not None:
            sine = self.sine(moved)
            image = sine - self.period * np.round(sine / self.period)
            moved[..., 0, :] = np.where(np.abs(sine) > 1, image / self.unit[0], moved[..., 0, :])
        return moved

    def sine(self, x: Float) -> Float:
        """Return sin β of points (..., d, L), (..., L)."""
        return x[..., 0, :] * self.unit[0]

    def direction(self, x: Float) -> Float:
        """Return sin β within ±1: (..., 1, L)."""
        return sine_limits(self.sine(x))[..., None, :]

    def walk(self, x: Float, variance: float, curvature_variance: float = 0.0) -> Float:
        """Return the covariance of a step of some variance, rad²: (..., 1, L)."""
        # Q = σ² cos²β
        return variance * cosine_squared(self.direction(x)) / self.unit[0] ** 2

    def sine_grid(self) -> Float:
        """Return the first coordinates of candidates: (n,)."""
        (n,) = cell_count(2 / (SPACING_OF_ONE * self.unit[0]))
        return cell_centres(n) / self.unit[0]

    def new_candidates(self) -> CandidatePoints:
        """Return an even grid of sines, of uniform density."""
        log_measure = float(np.log(2 / self.unit[0]))
        return CandidatePoints(self.sine_grid()[None], log_measure, np.zeros(1))

    def distance(self, x: Float, others: Float) -> Float:
        """Return differences of direction, rad, of (..., d, L) and (d, G): (..., L, G)."""
        doa, other = (np.arcsin(self.direction(each)[..., 0, :]) for each in (x, others))
        return np.asarray(np.abs(doa[..., None] - other[..., None, :]))

    def exists(self, x: Float, covariance: Float) -> Bool:
        """Return which points (d, L) are within three standard deviations of a direction."""
        return sine_exists(self.sine(x), self.unit[0] * np.sqrt(covariance[0]))

    def located(self, x: Float, covariance: Float) -> dict[str, Float]:
        """Return doa and std of points (1, L)."""
        doa, std = line_direction(self.sine(x), self.unit[0] * np.sqrt(covariance[0]))
        return {"doa": doa, "std": std}


@dataclass(frozen=True, eq=False)
class FresnelLine(SineLine):
    """A line of sensors in sin β and the curvature c = cos²β/R of the wavefront.

    Of second order in the distance of a sensor over R: for ranges beyond a quarter of the
    Fraunhofer distance. The prior of c is a spike, N(0, (0.05 units)²), for plane waves, and a
    slab, N(0, σ²), for curved ones. Candidates are plane waves.

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`.
    period : float or None
        As in `SineLine`.
    curvature_std : float
        σ, 1/m.

    Notes
    -----
    The steps of `walk` are those of c, which is 1/R at broadside; by default a fifth of σ.
    A range is infinite where c is within three standard deviations of zero.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> line = fresnel_line(PlaneWaves(SensorArray.ula(16, 0.5), (1.0,)), curvature_std=0.05)
    >>> np.round(line.unit, 6), round(line.spike_precision), round(line.slab_precision, 2)
    (array([0.069051, 0.067387]), 400, 1.82)
    """

    curvature_std: float

    @property
    def spike_precision(self) -> float:
        """Prior precision of c of a plane wave."""
        return (1 / SPIKE_STD) ** 2

    @property
    def walk_range(self) -> float:
        """Default standard deviation of the step of c per unit of time, 1/m."""
        return CURVATURE_WALK_SHARE * self.curvature_std

    @property
    def slab_precision(self) -> float:
        """Prior precision of c of a curved wave, at most that of a plane one."""
        return min(self.unit[1] / self.curvature_std, 1 / SPIKE_STD) ** 2

    @property
    def path(self) -> Float:
        """Coordinates of the sensors p and -p²/2, (2, M)."""
        p = self.positions[:, 0]
        return np.stack([p, -0.5 * p * p])

    def from_doa(self, doa: ArrayLike, distance: ArrayLike = np.inf) -> Float:
        """Return the points (2, n) of directions and distances (n,), rad and m."""
        sine = np.sin(np.asarray(doa, dtype=np.float64))
        # c = cos²β/R
        return np.stack([sine, (1 - sine**2) / np.asarray(distance)]) / self.scale

    def origin_phase(self, x: Float) -> Float:
        """Return the phase that is left out of a response, rad: (L,), at the first bin."""
        c = x[1] * self.unit[1]
        bend = -0.5 * c * (self.positions**2).mean()
        return np.asarray(super().origin_phase(x) + self.waves.wavenumber[0] * bend)

    def walk(self, x: Float, variance: float, curvature_variance: float = 0.0) -> Float:
        """Return the covariance of a step of some variance, rad², and of one of c: (..., 3, L)."""
        along = super().walk(x, variance)
        return np.concatenate(
            [along, 0 * along, 0 * along + curvature_variance / self.unit[1] ** 2], axis=-2
        )

    def new_candidates(self) -> CandidatePoints:
        """Return plane waves on an even grid of sines, and the spike."""
        u = self.sine_grid()
        # ln ∫ over sin β, and ½ ln 2π/p of the curvature
        log_measure = np.log(2 / self.unit[0]) + 0.5 * np.log(2 * np.pi / self.spike_precision)
        precision = np.array([0.0, 0.0, self.spike_precision])
        points = np.stack([u, np.zeros_like(u)])
        return CandidatePoints(points, float(log_measure), precision, np.zeros(2))

    def located(self, x: Float, covariance: Float) -> dict[str, Float]:
        """Return doa, std, range, range_std and covariance of points (2, L)."""
        sine = self.direction(x)[0]
        square = cosine_squared(sine)
        one, two = self.unit
        # 1/R = c / cos²β
        by_c = two / square + 0 * sine
        inverse_range = x[1] * by_c
        by_sine = one * 2 * sine * inverse_range / square
        return range_estimate(sine, one, inverse_range, (by_sine, by_c), covariance)


@lru_cache(maxsize=256)
def sine_line(waves: PlaneWaves) -> SineLine:
    """Return the manifold of a line in sin β."""
    p = waves.array.positions[:, 0] - waves.centre
    unit = 1 / np.sqrt((waves.wavenumber**2).mean() * (p**2).mean())
    return SineLine(waves, (float(unit),), tuple(waves.centre.tolist()), sine_period(waves))


@lru_cache(maxsize=256)
def fresnel_line(waves: PlaneWaves, curvature_std: float) -> FresnelLine:
    """Return the manifold of a line in sin β and curvature.

    Parameters
    ----------
    waves : PlaneWaves
        A line of isotropic sensors.
    curvature_std : float
        Standard deviation of the curvature of waves that are not plane, 1/m.
    """
    centre, period = tuple(waves.centre.tolist()), sine_period(waves)
    return FresnelLine(waves, line_units(waves), centre, period, curvature_std)


def sine_period(waves: PlaneWaves) -> float | None:
    """Return the difference of sines of equal responses, of one bin on a uniform grid, or None."""
    spacing = waves.array.spacing
    return None if spacing is None or len(waves.wavelengths) > 1 else waves.wavelengths[0] / spacing


def line_units(waves: PlaneWaves) -> tuple[float, float]:
    """Return the units of sin β and of curvature of a line."""
    p = waves.array.positions[:, 0] - waves.centre
    k2 = (waves.wavenumber**2).mean()
    return float((k2 * p.var()) ** -0.5), float((k2 * (p**2).var() / 4) ** -0.5)
