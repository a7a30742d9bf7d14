"""Protocol of the measurement models that the gridless direction trackers accept."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from numpy.typing import ArrayLike

from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.measurement_models.observed import ObservedSnapshots
from arrivals.typing import Complex


@runtime_checkable
class DirectionMeasurement(Protocol):
    """Measurements of plane waves whose directions can be estimated, as `ArraySnapshot` has them.

    Models never change, so that results derived from one may be cached.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, Bearing, SensorArray
    >>> isinstance(ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0), DirectionMeasurement)
    True
    >>> isinstance(Bearing([[0.0, 0.0]], noise=0.01), DirectionMeasurement)
    False
    """

    @property
    def is_single(self) -> bool:
        """True if a step is one snapshot at one frequency, without a second unknown."""

    def observe(
        self, z: ArrayLike | None, reference: Reference = "middle"
    ) -> ObservedSnapshots | None:
        """Return the part of a measurement that has valid data; None if all of it is missing."""

    def manifold(self, reference: Reference = "middle") -> Manifold:
        """Return the response, as a Fourier series of an angle or as a function of points."""

    def steering_vector(self, doa: ArrayLike) -> Complex:
        """Return responses to directions (...), rad: (..., [n_bins,] n_sensors)."""

    def ambiguity(self) -> tuple[float, float] | None:
        """Return two directions, rad, with the same response, or None."""
