"""Gate of complex snapshots: missing numbers, and channels that receive nothing."""

from __future__ import annotations

import warnings
from abc import abstractmethod
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.measurement_models.observed import MISSING, ObservedSnapshots, complex_snapshot
from arrivals.typing import Complex, Int


class SnapshotGate:
    """Mixin of models of complex snapshots: a measurement as numbers of its `shape`.

    Attributes
    ----------
    shape : tuple of int
        Shape of one measurement: bins and snapshots, if several; sensors.
    n_bins, n_snapshots : int
        Frequency bins and snapshots of one measurement.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(3, spacing=0.5), wavelength=1.0)
    >>> model.snapshot(np.ma.array([1.0, 2.0, 3.0], mask=[False, False, True]))
    array([ 1. +0.j,  2. +0.j, nan+nanj])
    """

    n_snapshots: int

    @property
    @abstractmethod
    def n_bins(self) -> int:
        """Number of frequency bins."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """Shape of one measurement."""

    @abstractmethod
    def manifold(self, reference: Reference = "middle") -> Manifold:
        """Return the response, as a Fourier series of an angle or as a function of points."""

    def snapshot(self, z: ArrayLike | None, n_snapshots: int | None = None) -> Complex:
        """Return a measurement as complex numbers, NaN where one is missing.

        Parameters
        ----------
        z : array_like, shape `shape`, or None
            Measurement; None or NaN if all of it is missing.
        n_snapshots : int, optional
            Number of snapshots, (n_snapshots, n_sensors), if it is not that of the model.

        Returns
        -------
        ndarray of complex, shape `shape`
            All NaN if the whole measurement is missing, or zero.

        Warns
        -----
        UserWarning
            Once for each channel that has zeros alone and counts as missing.
        """
        shape = self.shape if n_snapshots is None else (n_snapshots, self.shape[-1])
        y = complex_snapshot(z, shape)
        if y.all():  # the usual case; NaN is not zero
            return y
        axes = tuple(range(y.ndim - 1))
        without_power = ~(np.abs(y) > 0).any(axis=axes)
        if not without_power.all():
            self._report(np.flatnonzero(without_power & (y == 0).any(axis=axes)))
        y[..., without_power] = MISSING
        return y

    def snapshots(self, z: ArrayLike | None) -> Complex:
        """Return a measurement with the axes of a `Manifold`: (n_bins, n_sensors, n_snapshots)."""
        return self.with_all_axes(self.snapshot(z))

    def with_all_axes(self, z: Complex) -> Complex:
        """Return the result of `snapshot` as (n_bins, n_sensors, n_snapshots)."""
        return z.reshape(self.n_bins, self.n_snapshots, self.shape[-1]).swapaxes(1, 2)

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
            Data without gaps and their manifold; None if the whole measurement is missing.

        Raises
        ------
        ValueError
            If the shape is wrong, or every sensor has a gap in some snapshot.
        """
        Y = self.snapshots(z)
        if np.isnan(Y).all():
            return None
        return ObservedSnapshots.from_measurement(Y, self.manifold(reference))

    def _report(self, silent: Int) -> None:
        """Warn of channels of zeros alone, of each once."""
        new = sorted(set(silent.tolist()) - self._silent_channels)
        if new:
            self._silent_channels.update(new)
            names = ", ".join(map(str, new))
            what = f"channel {names} has" if len(new) == 1 else f"channels {names} have"
            warnings.warn(
                f"{what} zeros alone in a step (counted from 0): missing there, and in every "
                "other such step",
                stacklevel=3,
            )

    @cached_property
    def _silent_channels(self) -> set[int]:
        return set()  # those reported so far: the model does not change
