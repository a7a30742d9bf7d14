"""Which bins, sensors and snapshots of a step were heard, and how noise is kept for those not."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.manifold import Reference
from arrivals.typing import Bool, Complex, Float


@dataclass(frozen=True, eq=False)
class ObservedSnapshots:
    """What of a step can be used: a block of looks without gaps.

    Parameters
    ----------
    bins, sensors, snapshots : ndarray of bool, shapes (n_bins,), (n_sensors,), (n_snapshots,)
    """

    bins: Bool
    sensors: Bool
    snapshots: Bool

    @classmethod
    def of(cls, Y: Complex) -> ObservedSnapshots:
        """Leave out bins and snapshots without a number, then sensors with a gap in the others.

        Bins that hold nothing but zeros are left out, too, as long as others do not.

        Raises
        ------
        ValueError
            If every sensor has a gap in one look or another.

        Examples
        --------
        >>> Y = np.ones((2, 3, 4), dtype=complex)
        >>> Y[1], Y[0, 2, 3] = np.nan, np.nan
        >>> heard = ObservedSnapshots.of(Y)
        >>> heard.bins, heard.sensors
        (array([ True, False]), array([ True,  True, False]))
        """
        there = ~np.isnan(Y)
        if there.all() and Y.any(axis=(1, 2)).all():
            return cls(*(np.ones(n, dtype=np.bool_) for n in Y.shape))
        bins: Bool = np.asarray(there.any(axis=(1, 2)))
        snapshots: Bool = np.asarray(there.any(axis=(0, 1)))
        sensors: Bool = np.asarray(there[bins][:, :, snapshots].all(axis=(0, 2)))
        if not sensors.any():
            most = int(there.sum(axis=1).max())
            raise ValueError(
                "a snapshot must have sensors that gave a number in all of its looks; in the best "
                f"look {most} of {Y.shape[1]} did, but each has a NaN in some other"
            )
        sounding = (np.where(there, Y, 0)[:, sensors][:, :, snapshots] != 0).any(axis=(1, 2))
        if sounding.any():
            bins = np.asarray(bins & sounding)
        return cls(bins, sensors, snapshots)

    @property
    def key(self) -> bytes:
        """The same for steps of which the same was heard."""
        return b"".join(each.tobytes() for each in (self.bins, self.sensors, self.snapshots))

    def block(self, Y: Complex) -> Complex:
        """Return the looks without gaps."""
        if Y.shape == (self.bins.sum(), self.sensors.sum(), self.snapshots.sum()):
            return Y
        return Y[np.ix_(self.bins, self.sensors, self.snapshots)]


def updated(known: Float, bins: Bool, values: Float | None) -> Float:
    """Return the noise of all bins: new values where there are some.

    Examples
    --------
    >>> updated(np.array([1.0, 2.0]), np.array([False, True]), np.array([5.0]))
    array([1., 5.])
    """
    if values is None:
        return known
    fresh = known.copy()
    fresh[bins] = values
    return fresh


def check_directions(measurement: ArraySnapshot, reference: Reference, *, mixture: bool) -> None:
    """Refuse arrays that give no directions, and warn of those that give several for one.

    Raises
    ------
    ValueError
        If the measurement has no manifold, or none that the mixture serves.
    """
    manifold = measurement.manifold(reference)
    if manifold.coefficients is None:
        if mixture and not measurement.is_single:
            raise ValueError('posterior "mixture" takes one look a step')
        return
    if mixture:
        raise ValueError('posterior "mixture" wants a line on a uniform grid, at one wavelength')
    if (pair := measurement.ambiguity()) is not None:
        one, other = np.rad2deg(pair)
        warnings.warn(
            f"directions {one:.1f} and {other:.1f} degrees look alike to this array at every "
            "frequency: sources may be reported at either. Several frequencies, or sensors "
            "nearer to each other, would tell them apart",
            stacklevel=4,
        )
