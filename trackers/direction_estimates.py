"""Estimates of one step with more than directions: elevation, range, or models of the signals."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from arrivals.trackers.estimates import DirectionEstimate
from arrivals.typing import Float


def no_number() -> Float:
    """Return the field of an estimate without a source."""
    return np.zeros(0)


def no_covariance() -> Float:
    """Return the covariances of an estimate without a source."""
    return np.zeros((0, 2, 2))


@dataclass(frozen=True, eq=False)
class SphereEstimate(DirectionEstimate):
    """Directions of arrival on the sphere of the sources detected in one step.

    Parameters
    ----------
    doa : ndarray, shape (n_sources,)
        Azimuth, rad.
    std : ndarray, shape (n_sources,)
        Standard deviation of the azimuth, rad; that of a uniform azimuth at the zenith.
    existence : ndarray, shape (n_sources,)
        Probability of existence; NaN if the method does not estimate it.
    amplitude : ndarray, shape (n_sources,)
        Complex amplitude at the origin of the array's coordinates; NaN if not estimated.
    label : ndarray of int, shape (n_sources,)
        Identity of a tracked source; -1 for methods that do not track.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Number of iterations of this step; 0 for methods without iteration.
    noise : float
        Estimated noise variance of one sensor; NaN if the method does not estimate it.
    elevation : ndarray, shape (n_sources,)
        Elevation over the xy plane, rad.
    covariance : ndarray, shape (n_sources, 2, 2)
        Covariance in the tangent plane, rad²: elevation, and azimuth along its circle, which is
        cos(elevation) times the azimuth. NaN if the method does not estimate it.

    Examples
    --------
    >>> one = np.ones(1)
    >>> estimate = SphereEstimate(
    ...     0.5 * one, 0.02 * one, one, one + 0j, np.array([7]),
    ...     elevation=np.pi / 3 * one, covariance=1e-4 * np.eye(2)[None],
    ... )
    >>> [round(float(cell), 2) for cell in estimate.rows()[0][1:5]]
    [28.65, 1.15, 60.0, 0.57]
    """

    elevation: Float = field(default_factory=no_number)
    covariance: Float = field(default_factory=no_covariance)

    per_source: ClassVar[dict[str, Any]] = DirectionEstimate.per_source | {
        "elevation": np.nan,
        "covariance": np.nan,
    }
    n_unknowns: ClassVar[int] = 2
    columns: ClassVar[tuple[str, ...]] = (
        "label", "doa_deg", "std_deg", "elevation_deg", "elevation_std_deg", "existence",
        "level_db",
    )  # fmt: skip

    def rows(self) -> list[tuple[Any, ...]]:
        """Return label, azimuth and elevation with deviations, degrees, existence, level in dB.

        Returns
        -------
        list of tuple
            One row per source.
        """
        elevation = np.rad2deg([self.elevation, np.sqrt(self.covariance[:, 0, 0])]).T.tolist()
        return [
            (*row[:3], *each, *row[3:]) for row, each in zip(super().rows(), elevation, strict=True)
        ]

    def unknowns(self) -> tuple[Float, Float]:
        """Return azimuth and elevation, (n_sources, 2), and covariances in this order."""
        return np.stack([self.doa, self.elevation], axis=1), self.covariance[:, ::-1, ::-1]


@dataclass(frozen=True, eq=False)
class RangeEstimate(DirectionEstimate):
    """Directions and ranges of the sources detected in one step.

    Parameters
    ----------
    doa : ndarray, shape (n_sources,)
        Directions of arrival, rad.
    std : ndarray, shape (n_sources,)
        Standard deviations, rad; NaN if the method does not estimate them.
    existence : ndarray, shape (n_sources,)
        Probability of existence; NaN if the method does not estimate it.
    amplitude : ndarray, shape (n_sources,)
        Complex amplitude at the origin of the array's coordinates; NaN if not estimated.
    label : ndarray of int, shape (n_sources,)
        Identity of a tracked source; -1 for methods that do not track.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Number of iterations of this step; 0 for methods without iteration.
    noise : float
        Estimated noise variance of one sensor; NaN if the method does not estimate it.
    range : ndarray, shape (n_sources,)
        Distance from the centroid of the sensors, m; infinite of a plane wave.
    range_std : ndarray, shape (n_sources,)
        Standard deviation of the range, m: R² times that of 1/R; NaN of a plane wave.
    covariance : ndarray, shape (n_sources, 2, 2)
        Covariance of direction and 1/R, rad and 1/m; NaN if the method does not estimate it.

    Examples
    --------
    >>> one = np.ones(1)
    >>> estimate = RangeEstimate(
    ...     0 * one, 0.02 * one, one, one + 0j, np.array([7]), range=50 * one, range_std=2 * one
    ... )
    >>> [round(float(cell), 2) for cell in estimate.rows()[0][1:5]]
    [0.0, 1.15, 50.0, 2.0]
    """

    range: Float = field(default_factory=no_number)
    range_std: Float = field(default_factory=no_number)
    covariance: Float = field(default_factory=no_covariance)

    per_source: ClassVar[dict[str, Any]] = DirectionEstimate.per_source | {
        "range": np.nan,
        "range_std": np.nan,
        "covariance": np.nan,
    }
    n_unknowns: ClassVar[int] = 2
    columns: ClassVar[tuple[str, ...]] = (
        "label", "doa_deg", "std_deg", "range_m", "range_std_m", "existence", "level_db",
    )  # fmt: skip

    def rows(self) -> list[tuple[Any, ...]]:
        """Return label, direction and range with deviations, degrees and m, existence, level in dB.

        Returns
        -------
        list of tuple
            One row per source; the range of a plane wave is not finite.
        """
        ranges = zip(self.range.tolist(), self.range_std.tolist(), strict=True)
        return [
            (*row[:3], *each, *row[3:]) for row, each in zip(super().rows(), ranges, strict=True)
        ]

    def unknowns(self) -> tuple[Float, Float]:
        """Return direction and 1/R, (n_sources, 2), and their covariances."""
        return np.stack([self.doa, 1 / self.range], axis=1), self.covariance


@dataclass(frozen=True, eq=False)
class SourceEstimate(DirectionEstimate):
    """Directions of arrival and autoregressive models of the sources.

    Parameters
    ----------
    doa : ndarray, shape (n_found,)
        Directions of arrival, rad.
    std : ndarray, shape (n_found,)
        Their standard deviations, rad; NaN where the method gives none.
    existence : ndarray, shape (n_found,)
        Probability that the source is active; NaN where the method gives none.
    amplitude : ndarray, shape (n_found,)
        Latest complex sample of each source.
    label : ndarray of int, shape (n_found,)
        Index of the source in the motion model.
    converged : bool
        False if an iterative method stopped before it met its tolerance.
    iterations : int
        Iterations of this step; 0 for a method without.
    noise : float
        Estimated variance of the noise at one sensor; NaN where the method gives none.
    coefficients : ndarray, shape (n_found, largest order)
        AR coefficients, zero beyond the order of a source.
    innovation_variance : ndarray, shape (n_found,)
        Variance of the innovations of each source.

    Examples
    --------
    >>> SourceEstimate.empty(coefficients=np.zeros((0, 2))).n_found
    0
    """

    coefficients: Float = field(default_factory=lambda: np.zeros((0, 0)))
    innovation_variance: Float = field(default_factory=lambda: np.zeros(0))

    per_source: ClassVar[dict[str, Any]] = DirectionEstimate.per_source | {
        "coefficients": np.nan,
        "innovation_variance": np.nan,
    }
