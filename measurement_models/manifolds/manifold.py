"""Protocols of an array's response: as a Fourier series of an angle, or as a function of points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, Self, TypeGuard

from numpy.typing import ArrayLike

from arrivals.typing import Bool, Complex, Float, Int

Reference = Literal["middle", "first"]
UNIFORM_STD_OF_LINE = math.pi / math.sqrt(12)  # rad, of a uniform direction in ±90°
UNIFORM_STD_OF_CIRCLE = 2 * math.pi / math.sqrt(12)


class Manifold(Protocol):
    """A response of an array, as a function of the unknowns of one source.

    A tracker that uses this protocol needs no positions, wavelengths or signs. Manifolds never
    change, so that what follows from one may be cached. What there is beside these properties
    depends on the kind: `AngleManifold`, a Fourier series of one angle, or `PointManifold`.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0).manifold().n_unknowns
    1
    """

    def __hash__(self) -> int:
        """Return the same for the same manifold."""

    @property
    def n_unknowns(self) -> int:
        """Unknowns of a source: 1, a direction; 2, azimuth and elevation, or with a range."""

    @property
    def n_sensors(self) -> int:
        """Number of sensors."""

    @property
    def n_bins(self) -> int:
        """Number of frequency bins."""

    def without(self, sensors: Sequence[int] | Int) -> Self:
        """Return the manifold of the array without some sensors."""

    def only(self, bins: Sequence[int] | Int) -> Self:
        """Return the manifold of some of the bins."""


class AngleManifold(Manifold, Protocol):
    """A response a(θ) = G d(θ), d_k = exp(jkθ), periodic in an angle θ.

    The axes of data are (n_bins, n_sensors, n_snapshots); those of `coefficients` are
    (n_nuisance, n_bins, n_sensors, n_harmonics).

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0).manifold().harmonics
    array([-2, -1,  0,  1,  2])
    """

    @property
    def harmonics(self) -> Int:
        """The integers k, shape (n_harmonics,)."""

    @property
    def coefficients(self) -> Complex | None:
        """The matrices G; None for the identity, without a product."""

    @property
    def front_back_ambiguous(self) -> bool:
        """True if two angles stand for one direction."""

    @property
    def nuisance_weights(self) -> Float:
        """Prior of the values of a second parameter, shape (n_nuisance,); [1.0] as a rule."""

    def steering(self, theta: ArrayLike) -> Complex:
        """Return the responses to angles (n,): (n_nuisance, n_bins, n_sensors, n)."""

    def norm_squared(self) -> float | Complex:
        """Return ‖a(θ)‖², or the (n_nuisance, n_bins, i) cᵢ of its series Re Σ cᵢ exp(jiθ)."""

    def to_doa(self, theta: ArrayLike, slack: ArrayLike = 0.0) -> Float:
        """Return directions, rad; NaN where there is none within `slack` of the angle."""

    def doa_std(self, theta: ArrayLike, std: ArrayLike) -> Float:
        """Return standard deviations of the directions from those of the angles."""

    def slope(self, theta: ArrayLike) -> Float:
        """Return how fast angles turn with their directions, |dθ/dβ|, bounded away from 0."""

    def from_doa(self, doa: ArrayLike) -> Float:
        """Return the angles of directions, rad."""

    def to_amplitude(self, w: ArrayLike, theta: ArrayLike) -> Complex:
        """Return amplitudes at the origin of the array's coordinates."""


@dataclass(frozen=True, eq=False)
class CandidatePoints:
    """Points at which sources may appear, and their prior there.

    Parameters
    ----------
    points : ndarray, shape (point_size, n_points)
        Points.
    log_measure : float
        Constant of the KL divergence of a density from this prior: the logarithm of the volume of
        the domain, in units of displacement; with ½ ln 2π/p of each unknown of precision p.
    precision : ndarray, shape (n_pairs,)
        Prior precision: the upper triangle; zeros where the prior is uniform.
    mean : ndarray, shape (point_size,), or None
        Mean of an informative prior.
    """

    points: Float
    log_measure: float
    precision: Float
    mean: Float | None = None


class PointManifold(Manifold, Protocol):
    """A response a(x) of points x with a chart: how they move, and how far apart they are.

    Displacements are in units that turn the phases over the array by 1 rad rms. Arrays have
    sources on the last axis and the numbers of each on the one before it: points (..., point_size,
    L), displacements (..., d, L), symmetric matrices as their upper triangles (..., d(d+1)/2, L),
    in the order 11, 12, 22. The phase at each sensor is counted so that the phase of the amplitude
    is uncorrelated with all unknowns. ‖a(x)‖² is the number of sensors.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> is_point_manifold(ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0).manifold())
    False
    """

    @property
    def point_size(self) -> int:
        """Numbers of a point."""

    @property
    def is_linear(self) -> bool:
        """True if phases are linear in the displacement: then (∂ᵢa)ᴴ∂ⱼa' = -(∂ᵢ∂ⱼa)ᴴa'."""

    @property
    def spike_precision(self) -> float | None:
        """Prior precision of the second unknown of a plane wave, where waves may be curved."""

    @property
    def slab_precision(self) -> float | None:
        """Prior precision of the second unknown of a curved wave, where it may be plane."""

    @property
    def walk_range(self) -> float:
        """Default standard deviation of the step of 1/R per unit of time, 1/m; 0 without."""

    @property
    def merge_correlation(self) -> float | None:
        """Correlation of two responses above which their sources count as one.

        None where a distance in direction decides.
        """

    def responses(self, x: Float, covariance: Float) -> Complex:
        """Return ⟨a⟩, ∂ᵢ⟨a⟩ and ∂ᵢⱼ⟨a⟩, i ≤ j, at points (B, p, L): (B, F, 1+d+d(d+1)/2, L, M)."""

    def at(self, x: Float) -> tuple[Complex, Float]:
        """Return a(x) (F, G, M) of points (p, G), and Σₘ Re ∂ᵢa* ∂ⱼa (F, d(d+1)/2, G or 1)."""

    def move(self, x: Float, step: Float) -> Float:
        """Return the points after displacements."""

    def offset(self, x: Float, mean: Float) -> tuple[Float, Float | None]:
        """Return δ (..., d, L) in the chart at `mean`, and ∂δᵢ/∂xⱼ (..., d, d, L) or None for I."""

    def walk(self, x: Float, variance: float, curvature_variance: float) -> Float:
        """Return the covariance of a step of some variance, rad², along a great circle.

        `curvature_variance` is that of 1/R, 1/m².
        """

    def candidates(self) -> CandidatePoints:
        """Return the points at which sources may appear."""

    def distance(self, x: Float, others: Float) -> Float:
        """Return distances in direction, rad, of (..., p, L) and ([...,] p, G): (..., L, G)."""

    def exists(self, x: Float, covariance: Float) -> Bool:
        """Return which points (p, L) lie within three standard deviations of a direction."""

    def located(self, x: Float, covariance: Float) -> dict[str, Float]:
        """Return the fields of an estimate of points (p, L): doa, std, and those of the second."""

    def to_amplitude(self, w: ArrayLike, x: Float) -> Complex:
        """Return amplitudes at the origin of coordinates; of several bins their size alone."""


def is_angle_manifold(manifold: Manifold) -> TypeGuard[AngleManifold]:
    """Return True for a Fourier series of an angle.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> is_angle_manifold(ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0).manifold())
    True
    """
    return not is_point_manifold(manifold)  # the harmonics of some are computed on each access


def is_point_manifold(manifold: Manifold) -> TypeGuard[PointManifold]:
    """Return True for a function of points."""
    return hasattr(manifold, "point_size")


def angle_manifold(method: str, manifold: Manifold) -> AngleManifold:
    """Return a manifold for a method that needs a Fourier series of one angle.

    Raises
    ------
    ValueError
        If it has another form.
    """
    if not is_angle_manifold(manifold):
        got = f"a manifold of {manifold.n_unknowns} unknowns a source"
        raise ValueError(f"{method} requires directions of one angle; got {got}")
    return manifold
