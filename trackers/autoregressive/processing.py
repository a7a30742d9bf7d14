"""Trackers that process snapshots interval by interval, in one or many recordings."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.measurements import rows
from arrivals.motion_models.autoregressive.companion_form import CompanionLayout, companion_layout
from arrivals.motion_models.autoregressive.sources import AutoregressiveSources
from arrivals.trackers.autoregressive.belief import (
    GRID_STD,
    SourceBelief,
    initialize_belief,
    repeat_belief,
    samples_needed,
    to_internal,
    to_signals,
    to_state_covariance,
    to_state_vector,
)
from arrivals.trackers.autoregressive.direction_covariance import with_acquisition_errors
from arrivals.trackers.autoregressive.history import History
from arrivals.trackers.autoregressive.initialization import acquire_directions, manifold_of
from arrivals.trackers.autoregressive.interval import SILENCE
from arrivals.trackers.autoregressive.interval_filter import filter_interval
from arrivals.trackers.autoregressive.settings import RegressionSettings
from arrivals.trackers.autoregressive.snapshots import (
    MISSING,
    completes_interval,
    to_real_rows,
    to_snapshots,
    without_clicks,
)
from arrivals.trackers.autoregressive.steady_state import StateSpace
from arrivals.trackers.base import Tracker
from arrivals.trackers.run import Run
from arrivals.typing import Complex, Float
from arrivals.validation import covariance, positive, real, shaped


class BlockProcessor(Tracker):
    """Bookkeeping of intervals: pending snapshots, acquisition, runs and batches.

    A method defines `update_interval` and `state_space`.

    Attributes
    ----------
    belief : SourceBelief or None
        Belief after the last interval; None before acquisition.
    snapshots : ndarray of complex, shape (n, n_sensors)
        Buffer of the latest snapshots, as many as acquisition, or an interval, needs.
    n_pending : int
        How many of them came after the last interval.
    """

    measurement: ArraySnapshot
    motion: AutoregressiveSources
    doa: Sequence[float] | Float | None
    doa_std: float
    interval: int
    gate: float
    regression: RegressionSettings

    @abstractmethod
    def update_interval(self, belief: SourceBelief, y: Float) -> tuple[SourceBelief, Float]:
        """Return the belief after an interval of transformed snapshots, and the states."""

    @abstractmethod
    def state_space(self, belief: SourceBelief, new: SourceBelief) -> StateSpace:
        """Return F, Q (3) and A_T (5) of `new`, and r of `belief`."""

    def restart(self) -> None:
        """Discard all data, and start again from `doa` and the models."""
        n_sensors = self.measurement.array.n_sensors
        self.x, self.P = np.zeros(self.motion.dim_x), self.motion.stationary_covariance()
        self._known_x, self._known_P = self.x, self.P
        no_rows = np.zeros((1, 0, n_sensors))
        self.belief = None if self.doa is None else self.initial_belief(no_rows)
        self.snapshots = np.full((samples_needed(self.belief, self.interval), n_sensors), MISSING)
        self.n_pending = 0
        self.signals = np.full((self.interval, self.motion.n_sources), MISSING)

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name; keep the belief if it still fits, else start again."""
        before = self._shapes()
        super().set_params(**params)
        if self._shapes() != before:
            self.restart()
        return self

    def _shapes(self) -> tuple[Any, ...]:
        """Return the parameters that define the shapes of the belief."""
        motion = self.motion
        return motion.orders, motion.real_valued, self.measurement.array.n_sensors, self.interval

    @property
    def manifold(self) -> ArrayManifold:
        """Real response of the array."""
        return manifold_of(self.measurement)

    @property
    def layout(self) -> CompanionLayout:
        """Layout of the internal state, lag by lag."""
        return companion_layout(self.motion.orders, lag_by_lag=True)

    # Intervals

    def append(self, snapshot: Complex) -> None:
        """Add a snapshot, (n_sensors,), to the pending ones."""
        self.snapshots = np.concatenate([self.snapshots[1:], snapshot[None]])
        self.n_pending += 1

    def process_if_full(self) -> None:
        """Process the pending snapshots if they fill the next interval, or acquisition."""
        if self.n_pending == samples_needed(self.belief, self.interval):
            self._process(self._pending())

    def _pending(self) -> Complex:
        return self.snapshots[len(self.snapshots) - self.n_pending :]

    def _process(self, z: Complex, open_end: bool = False) -> History:
        """Process snapshots, (n_snapshots, n_sensors), pending ones in front; keep the rest."""
        belief, done, history = self._process_intervals(self._present_belief(), z[None], open_end)
        if belief is not None and history.has_intervals:
            self.belief = belief
            self.x = to_state_vector(belief.x[0], self.motion)
            self.P = to_state_covariance(belief.P[0], self.motion)
            self._known_x, self._known_P = self.x, self.P
            self.signals = history.signals[-1][0]
        self.n_pending = len(z) - done
        past = np.full((len(self.snapshots) - self.n_pending, z.shape[1]), MISSING)
        self.snapshots = np.concatenate([past, z[done:]])
        return history

    def _present_belief(self) -> SourceBelief | None:
        """Return the present belief, with `x` and `P` if they were assigned."""
        if self.belief is None or (self.x is self._known_x and self.P is self._known_P):
            return self.belief
        n = self.motion.dim_x
        x, P = to_internal(shaped("x", self.x, n), covariance("P", self.P, n), self.motion)
        return replace(self.belief, x=x[None], P=P[None])

    def _process_intervals(
        self, belief: SourceBelief | None, z: Complex, open_end: bool = False
    ) -> tuple[SourceBelief | None, int, History]:
        """Process snapshots (n_sequences, n_snapshots, n_sensors), pending ones in front.

        With `open_end`, an interval at the end that its last snapshot does not complete is left
        out. Returns the belief, the number of processed snapshots, and the history.
        """
        history = History(z, self.n_pending, self.motion, self.gate > 0)
        history.add(belief, 0)
        done = 0
        while (end := done + samples_needed(belief, self.interval)) <= z.shape[1]:
            if open_end and end == z.shape[1] and not completes_interval(z[0, -1]):
                break
            belief, done = self._process_block(belief, z[:, done:end], end, history), end
        return belief, done, history

    def _process_block(
        self, belief: SourceBelief | None, z: Complex, end: int, history: History
    ) -> SourceBelief | None:
        """Process a block of intervals; the first block once it contains usable data."""
        y = self._rows(z, belief)
        start = self.initial_belief(y) if (first := belief is None) else belief
        if start is None:
            history.signals.append(self._no_signals(z))
            return None
        belief = start
        for part in np.split(y, z.shape[1] // self.interval, axis=1):
            belief, X = self.update_interval(belief, part)
            history.signals.append(to_signals(X, self.motion.n_parts, self.motion.n_sources))
        if first and self.regression.states_deviations:
            model, manifold = self.state_space(start, start), self.manifold
            belief = with_acquisition_errors(start, belief, y, model, manifold, self.regression)
        history.add(belief, end)
        return belief

    def _provisional_signals(self, belief: SourceBelief | None, z: Complex) -> Complex:
        """Return the signals in snapshots that do not fill an interval yet."""
        if belief is None or z.shape[1] == 0:
            return self._no_signals(z)
        model = self.state_space(belief, belief)
        X = filter_interval(belief, self._rows(z, belief), model, self.regression).X
        return to_signals(X, self.motion.n_parts, self.motion.n_sources)

    def _no_signals(self, z: Complex) -> Complex:
        return np.full((*z.shape[:2], self.motion.n_sources), MISSING)

    def _rows(self, z: Complex, belief: SourceBelief | None) -> Float:
        n_parts = self.motion.n_parts
        if belief is None:
            power = np.full(len(z), self.motion.power.sum() + self.measurement.noise)
        else:
            power = belief.power.sum(axis=-1) + belief.r
        return without_clicks(to_real_rows(z, self.manifold, n_parts), n_parts, power)

    # Acquisition

    def initial_belief(self, y: Float) -> SourceBelief | None:
        """Return the belief at the start, with directions from `doa` or from the rows y."""
        n = len(y)
        if self.doa is None:
            usable = self.usable_rows(y)
            if usable is None:
                return None
            std, manifold = GRID_STD, self.manifold
            doa = np.array([acquire_directions(r, self.motion, manifold) for r in usable])
        else:
            std, doa = self.doa_std, np.tile(real("doa", self.doa), (n, 1))
        x, P = to_internal(self.x, self.P, self.motion)
        x, P = (np.repeat(value[None], n, axis=0) for value in (x, P))
        return initialize_belief(doa, std, x, P, self.motion, self.manifold, self.regression)

    def usable_rows(self, y: Float) -> list[Float] | None:
        """Return the complete rows of each sequence; None if a sequence has no usable ones.

        Their mean power must exceed the gate, and that of silence.
        """
        usable = [one[np.isfinite(one).all(axis=-1)] for one in y]
        least = max(self.gate, SILENCE)
        minimum = least * self.motion.power.sum() / self.motion.n_parts
        if all(len(one) > 0 and np.mean(one**2) > minimum for one in usable):
            return usable
        return None

    # Runs

    def run(self, measurements: Iterable[ArrayLike | None], dt: float = 1.0) -> Run:
        """Track snapshots from the present state, interval by interval.

        Parameters
        ----------
        measurements : array_like of complex, shape (n_steps, n_sensors), or any iterable
        dt : float
            Time between snapshots.

        Returns
        -------
        Run
            The numbers of `predict` and `update` for each snapshot. `run.signals` (n_steps,
            n_sources) are the samples of the sources; those after the last full interval are
            provisional: they belong to the present directions and models.
        """
        positive("dt", dt)
        started = time.perf_counter()
        snapshots = to_snapshots(measurements, self.measurement)
        history = self._process(np.concatenate([self._pending(), snapshots]), open_end=True)
        history.signals.append(self._provisional_signals(self.belief, self._pending()[None]))
        return history.run(0, dt, time.perf_counter() - started).made_by(self)

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Track independent sequences at once, as one array program over the leading axis.

        The tracker itself is not changed.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, n_sensors)
            Sequences of different lengths are tracked one by one; so are all if one of them has
            no data for the initial directions.
        dt : float
            Time between snapshots.

        Returns
        -------
        list of Run
        """
        positive("dt", dt)
        sequences = [
            to_snapshots(each, self.measurement) for each in rows("measurements", measurements)
        ]
        if len({len(z) for z in sequences}) != 1:
            return super().run_batch(sequences, dt)
        started = time.perf_counter()
        z = np.array([np.concatenate([self._pending(), sequence]) for sequence in sequences])
        belief = self._present_belief()
        first = self._rows(z[:, : samples_needed(belief, self.interval)], None)
        if belief is None and self.usable_rows(first) is None:
            return super().run_batch(sequences, dt)
        belief = None if belief is None else repeat_belief(belief, len(z))
        belief, done, history = self._process_intervals(belief, z)
        history.signals.append(self._provisional_signals(belief, z[:, done:]))
        elapsed = (time.perf_counter() - started) / len(z)
        return [history.run(n, dt, elapsed).made_by(self) for n in range(len(z))]
