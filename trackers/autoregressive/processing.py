"""Snapshots in, intervals worked off: the loop of sec. 5 over a recording, or over many at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.autoregressive import AutoregressiveSources
from arrivals.motion_models.companion_form import CompanionLayout, blocks
from arrivals.trackers.autoregressive.belief import (
    Settings,
    SourceBelief,
    beginning,
    inside,
    joined,
    measured,
)
from arrivals.trackers.autoregressive.history import History, closes
from arrivals.trackers.autoregressive.initialization import acquired
from arrivals.trackers.autoregressive.interval import interval
from arrivals.trackers.autoregressive.interval_filter import filtered
from arrivals.trackers.autoregressive.steady_state import transposed
from arrivals.typing import Complex, Float

ACQUISITION = 60  # snapshots that the first directions are looked for in
NOTHING = complex(np.nan, np.nan)


def wanted(s: SourceBelief | None, interval: int) -> int:
    """Return the snapshots that are worked off next: an interval, or all that acquisition takes.

    Examples
    --------
    >>> wanted(None, 25)
    75
    """
    return interval * (1 if s is not None else -(-ACQUISITION // interval))


def frame(z: ArrayLike | None, n: int) -> Complex:
    """Return one snapshot of n sensors as complex numbers, a copy; NaN if it is missing.

    Examples
    --------
    >>> frame(None, 2), frame([1.0, 2j], 2)
    (array([nan+nanj, nan+nanj]), array([1.+0.j, 0.+2.j]))
    """
    array = np.asarray(np.nan if z is None else z)
    if array.dtype.kind not in "biufc":
        raise TypeError(f"a snapshot must hold complex numbers; got {array.dtype}")
    if array.ndim == 0 and np.isnan(array):
        return np.full(n, NOTHING)
    if array.shape != (n,):
        raise ValueError(
            f"a snapshot must have shape ({n},), one number a sensor; got {array.shape}"
        )
    return np.array(array, dtype=np.complex128)


def frames(measurements: Iterable[ArrayLike | None], n: int) -> Complex:
    """Return snapshots of n sensors as complex numbers, (n_steps, n)."""
    if isinstance(measurements, np.ndarray) and measurements.shape[1:] == (n,):
        if measurements.dtype.kind not in "biufc":
            raise TypeError(f"snapshots must hold complex numbers; got {measurements.dtype}")
        return measurements.astype(np.complex128)
    return np.array([frame(z, n) for z in measurements], np.complex128).reshape(-1, n)


@dataclass(frozen=True, eq=False)
class BlockProcessor:
    """The tracker's parameters, and what it does with snapshots.

    Attributes
    ----------
    motion : AutoregressiveSources
    manifold : ArrayManifold
    interval : int
    doa : ndarray, shape (n_sources,), or None
    options : Options
    x, P : ndarray, shape (dim_x,), (dim_x, dim_x)
        State to begin with, as trackers show it.
    """

    motion: AutoregressiveSources
    manifold: ArrayManifold
    interval: int
    doa: Float | None
    options: Settings
    x: Float
    P: Float

    def history(
        self, s: SourceBelief | None, z: Complex, pending: int, open_end: bool = False
    ) -> tuple[SourceBelief | None, int, History]:
        """Work off snapshots, (n_sequences, n_snapshots, n_sensors).

        Parameters
        ----------
        s : Sources or None
            What is believed of each sequence; None while nothing is.
        z : ndarray
            The first `pending` of them are known already.
        pending : int
        open_end : bool
            Leave an interval at the end that its last snapshot does not close.

        Returns
        -------
        s : Sources or None
        done : int
            Snapshots worked off.
        history : History
        """
        history = History(z, pending, self.motion, self.options.gate > 0)
        history.add(s, 0)
        done = 0
        while (end := done + wanted(s, self.interval)) <= z.shape[1]:
            if open_end and end == z.shape[1] and not closes(z[0, -1]):
                break
            s, done = self._heard(s, z[:, done:end], end, history), end
        return s, done, history

    def _heard(
        self, s: SourceBelief | None, z: Complex, end: int, history: History
    ) -> SourceBelief | None:
        """Work off the intervals that snapshots consist of, the first once they tell where."""
        y = measured(z, self.manifold, self.motion.n_parts)
        s = self.begun(y) if s is None else s
        if s is None:
            history.signals.append(self._nothing(z))
            return None
        for part in np.split(y, z.shape[1] // self.interval, axis=1):
            s, X = interval(s, part, self.manifold, self.places, self.options)
            history.add(s, end)
            history.signals.append(joined(X, self.motion.n_parts, self.motion.n_sources))
        return s

    def provisional(self, s: SourceBelief | None, z: Complex) -> Complex:
        """Return the signals in snapshots that are no interval yet."""
        if s is None or z.shape[1] == 0:
            return self._nothing(z)
        y = measured(z, self.manifold, self.motion.n_parts)
        A = transposed(self.manifold.real_steering(s.doa))
        X = filtered(s, s, y, A, self.places, self.options).X
        return joined(X, self.motion.n_parts, self.motion.n_sources)

    def begun(self, y: Float) -> SourceBelief | None:
        """Return the belief to start from: where `doa` says, or where measurements do."""
        n = len(y)
        doa = None if self.doa is None else np.tile(self.doa, (n, 1))
        if doa is None:
            telling = self.telling(y)
            if telling is None:
                return None
            doa = np.array([acquired(rows, self.motion, self.manifold) for rows in telling])
        x, P = inside(self.x, self.P, self.motion)
        x, P = (np.repeat(value[None], n, axis=0) for value in (x, P))
        return beginning(doa, x, P, self.motion, self.manifold, self.options)

    def telling(self, y: Float) -> list[Float] | None:
        """Return the rows of each sequence to look for directions in; None if one has none.

        Where there is a gate, they must be louder than what it lets pass.
        """
        rows = [one[np.isfinite(one).all(axis=-1)] for one in y]
        least = self.options.gate * self.motion.power.sum() / self.motion.n_parts
        if all(len(one) > 0 and np.mean(one**2) > least for one in rows):
            return rows
        return None

    @property
    def places(self) -> CompanionLayout:
        """Where the lags stand in a state."""
        return blocks(self.motion.orders, lag_by_lag=True)

    def _nothing(self, z: Complex) -> Complex:
        return np.full((*z.shape[:2], self.motion.n_sources), NOTHING)
