"""Select the bins, sensors and snapshots of a step with valid data."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.measurements import LARGEST, SMALLEST, numbers
from arrivals.typing import Bool, Complex, Float

MISSING = complex(np.nan, np.nan)


@dataclass(frozen=True, eq=False)
class ObservedSnapshots:
    """The snapshots of a step without gaps.

    Parameters
    ----------
    snapshots : ndarray of complex, shape (n_bins, n_sensors, n_snapshots)
        Data of the valid bins, sensors and snapshots.
    bins, sensors, times : ndarray of bool
        Which bins, sensors and snapshots of the whole measurement are valid.
    full_manifold : Manifold, optional
        Response of the whole array at all frequencies.
    """

    snapshots: Complex
    bins: Bool
    sensors: Bool
    times: Bool
    full_manifold: Manifold | None = None

    @classmethod
    def from_measurement(cls, Y: Complex, manifold: Manifold | None = None) -> ObservedSnapshots:
        """Remove bins and snapshots without data, then sensors with a gap in the others.

        Bins of zeros alone are left out, too, as long as others have data.

        Parameters
        ----------
        Y : ndarray of complex, shape (n_bins, n_sensors, n_snapshots)
            A measurement, NaN where a sensor gave no number.
        manifold : Manifold, optional
            Response of the array.

        Returns
        -------
        ObservedSnapshots

        Raises
        ------
        ValueError
            If every sensor has a gap in some snapshot.

        Examples
        --------
        >>> Y = np.ones((2, 3, 4), dtype=complex)
        >>> Y[1], Y[0, 2, 3] = np.nan, np.nan
        >>> observed = ObservedSnapshots.from_measurement(Y)
        >>> observed.bins, observed.sensors, observed.snapshots.shape
        (array([ True, False]), array([ True,  True, False]), (1, 2, 4))
        """
        valid = ~np.isnan(Y)
        if valid.all() and Y.any(axis=(1, 2)).all():
            bins, sensors, times = (np.ones(n, dtype=np.bool_) for n in Y.shape)
            return cls(Y, bins, sensors, times, manifold)
        bins = np.asarray(valid.any(axis=(1, 2)))
        times = np.asarray(valid.any(axis=(0, 1)))
        sensors = np.asarray(valid[bins][:, :, times].all(axis=(0, 2)))
        if not sensors.any():
            n_valid = int(valid.sum(axis=1).max())
            raise ValueError(
                "z must have sensors without a gap in any bin and snapshot; got at most "
                f"{n_valid} of {Y.shape[1]} sensors at once, each with a NaN elsewhere"
            )
        has_power = (np.where(valid, Y, 0)[:, sensors][:, :, times] != 0).any(axis=(1, 2))
        if has_power.any():
            bins = np.asarray(bins & has_power)
        return cls(Y[np.ix_(bins, sensors, times)], bins, sensors, times, manifold)

    @cached_property
    def manifold(self) -> Manifold:
        """Response of the valid sensors at the valid bins."""
        if self.full_manifold is None:
            raise ValueError(
                "manifold must be passed to ObservedSnapshots.from_measurement; got None"
            )
        at_bins = self.full_manifold.only(np.flatnonzero(self.bins))
        return at_bins.without(np.flatnonzero(~self.sensors))

    @property
    def key(self) -> bytes:
        """Equal for steps with the same valid data."""
        return b"".join(each.tobytes() for each in (self.bins, self.sensors, self.times))


def complex_snapshot(z: ArrayLike | None, shape: tuple[int, ...]) -> Complex:
    """Return a measurement as complex numbers of a shape, NaN where one is missing.

    All are NaN where the whole measurement is missing. Numbers whose squares would vanish are
    zero.

    Examples
    --------
    >>> complex_snapshot([1.0, np.inf, 1e-200], (3,))
    array([ 1. +0.j, nan+nanj,  0. +0.j])
    """
    if type(z) is np.ndarray and z.dtype == np.complex128 and z.shape == shape:
        power = np.vdot(z, z).real  # far below the limit, |z|² does not overflow
        if power < LARGEST and (_none_is_tiny(z.real) or _none_is_tiny(z)):
            return z.copy()  # the usual case
    array = numbers("z", np.nan if z is None else z)
    if array.shape != shape:
        if array.size and np.isnan(array).all():
            return np.full(shape, MISSING)
        axes = "" if len(shape) == 1 else " in every bin and snapshot"
        raise ValueError(f"z must have shape {shape}, one number a sensor{axes}; got {array.shape}")
    array = array.astype(np.complex128)
    size = _size(array)
    if not (size >= SMALLEST).all():
        array[size < SMALLEST], array[np.isnan(size)] = 0, MISSING
    return array


def _none_is_tiny(z: Complex | Float) -> bool:
    return bool(np.abs(z).min() >= SMALLEST)


def _size(z: Complex) -> Float:
    with np.errstate(over="ignore"):  # at the end of the range
        return np.abs(z)


def merge_noise(noise: Float, bins: Bool, values: Float | None) -> Float:
    """Return the noise of all bins, with new values of the valid ones.

    Examples
    --------
    >>> merge_noise(np.array([1.0, 2.0]), np.array([False, True]), np.array([5.0]))
    array([1., 5.])
    """
    if values is None:
        return noise
    merged = noise.copy()
    merged[bins] = values
    return merged
