"""Protocol of the measurement models that the gridless direction trackers accept."""

from __future__ import annotations

import warnings
from typing import Protocol, runtime_checkable

import numpy as np
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
        """Whether a step is one snapshot at one frequency, without a second unknown."""

    def observe(
        self, z: ArrayLike | None, reference: Reference = "middle"
    ) -> ObservedSnapshots | None:
        """Return the part of a measurement that has valid data; None if all of it is missing."""

    def manifold(self, reference: Reference = "middle") -> Manifold:
        """Return the response as a Fourier series of an angle."""

    def steering_vector(self, doa: ArrayLike) -> Complex:
        """Return responses to directions (...), rad: (..., [n_bins,] n_sensors)."""

    def ambiguity(self) -> tuple[float, float] | None:
        """Return two directions, rad, with the same response, or None."""


def check_directions(
    measurement: DirectionMeasurement, reference: Reference, *, mixture: bool
) -> None:
    """Reject arrays without identifiable directions; warn of ambiguous ones.

    Raises
    ------
    ValueError
        If the measurement has no manifold, or none that the mixture serves.
    """
    manifold = measurement.manifold(reference)
    if manifold.coefficients is None:
        if mixture and not measurement.is_single:
            raise ValueError('posterior="mixture" requires one snapshot a step at one frequency')
        return
    if mixture:
        raise ValueError('posterior="mixture" requires a line on a uniform grid, at one wavelength')
    if (pair := measurement.ambiguity()) is not None:
        one, other = np.rad2deg(pair)
        warnings.warn(
            f"directions {one:.1f} and {other:.1f} degrees have equal responses at every "
            "frequency: sources may be reported at either. Several frequencies, or sensors "
            "nearer to each other, resolve the ambiguity",
            stacklevel=4,
        )
