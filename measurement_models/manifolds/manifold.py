"""Protocol of an array's response as a short Fourier series of an angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, Protocol

from numpy.typing import ArrayLike

from arrivals.typing import Complex, Float, Int

Reference = Literal["middle", "first"]
UNIFORM_STD_OF_LINE = math.pi / math.sqrt(12)  # rad, of a uniform direction in ±90°
UNIFORM_STD_OF_CIRCLE = 2 * math.pi / math.sqrt(12)


class Manifold(Protocol):
    """A response a(θ) = G d(θ), d_k = exp(jkθ), periodic in an angle θ.

    The axes of data are (n_bins, n_sensors, n_snapshots); those of `coefficients` are
    (n_nuisance, n_bins, n_sensors, n_harmonics). A tracker that uses this protocol needs no
    positions, wavelengths or signs. Manifolds never change, so that what follows from one may be
    cached.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0).manifold().harmonics
    array([-2, -1,  0,  1,  2])
    """

    def __hash__(self) -> int:
        """Return the same for the same manifold."""

    @property
    def n_sensors(self) -> int:
        """Number of sensors."""

    @property
    def n_bins(self) -> int:
        """Number of frequency bins."""

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

    def without(self, sensors: Sequence[int] | Int) -> Manifold:
        """Return the manifold of the array without some sensors."""

    def only(self, bins: Sequence[int] | Int) -> Manifold:
        """Return the manifold of some of the bins."""
