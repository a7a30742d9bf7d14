"""Batches of independent sequences of readings in array calls."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.estimates import PositionEstimate
from arrivals.trackers.rss.belief import Entries, SourceBeliefs
from arrivals.trackers.rss.inference.solution import Diagnostics
from arrivals.trackers.rss.model_order.track_table import TrackTable
from arrivals.trackers.run import Run
from arrivals.typing import Float, Int

if TYPE_CHECKING:
    from arrivals.trackers.rss.base import RSSTracker

READINGS_PER_CHUNK = 20_000  # in one array call: fits into the cache

Predict = Callable[[SourceBeliefs, float], SourceBeliefs]
Update = Callable[[SourceBeliefs, Float, Float], tuple[SourceBeliefs, Diagnostics]]


class BatchStart(NamedTuple):
    """Belief that all sequences of a batch start from.

    Parameters
    ----------
    sources : SourceBeliefs
        Leading axis: sources.
    tracks : TrackTable
    elapsed : float
        Time since the last readings.
    n_slots : int
        Sources in one row of a `Run`.
    position : tuple of two int
        Entries of a state that are the position.
    """

    sources: SourceBeliefs
    tracks: TrackTable
    elapsed: float
    n_slots: int
    position: Entries


def run_in_chunks(
    start: BatchStart, xi: Float, dt: float, predict: Predict, update: Update
) -> list[Run]:
    """Run sequences of readings, as many in one array call as the cache holds.

    Parameters
    ----------
    start : BatchStart
    xi : ndarray, shape (n_sequences, n_steps, n_sensors)
        Readings, Np; NaN where missing.
    dt : float
        Time between steps.
    predict : callable
        Returns a batch of beliefs after `dt`.
    update : callable
        Returns a batch of beliefs after readings (n_batch, n_sensors), given the time since the
        last ones (n_batch,), and its diagnostics.
    """
    size = max(1, READINGS_PER_CHUNK // xi.shape[-1])
    chunks = (xi[first : first + size] for first in range(0, len(xi), size))
    return [run for chunk in chunks for run in run_chunk(start, chunk, dt, predict, update)]


def run_apart(
    tracker: RSSTracker, sequences: Sequence[Sequence[ArrayLike | None]], dt: float
) -> list[Run]:
    """Run sequences one by one, in as many processes as `joblib.parallel_config` sets.

    Without it all run in this process. What births a sequence has decides how its arrays grow, so
    that sequences do not share array calls.
    """
    from joblib import Parallel, delayed

    calls = (delayed(_run_copy)(tracker, sequence, dt) for sequence in sequences)
    return list(Parallel()(calls))


def _run_copy(tracker: RSSTracker, sequence: Sequence[ArrayLike | None], dt: float) -> Run:
    return copy.deepcopy(tracker).run(sequence, dt)


def run_chunk(
    start: BatchStart, xi: Float, dt: float, predict: Predict, update: Update
) -> list[Run]:
    """Run sequences of readings in one array call a step; parameters as in `run_in_chunks`."""
    started = time.perf_counter()
    B, T, _ = xi.shape
    sources = SourceBeliefs(*(np.repeat(part[None], B, axis=0) for part in start.sources))
    elapsed = np.full(B, start.elapsed)
    history = BatchHistory(start, B, T)
    for t in range(T):
        sources = predict(sources, dt)
        elapsed = elapsed + dt
        rows = np.flatnonzero(~np.isnan(xi[:, t]).all(axis=1))
        if len(rows):
            updated, diagnostics = update(sources.select(rows), xi[rows, t], elapsed[rows])
            for part, new in zip(sources, updated, strict=True):
                part[rows] = new
            elapsed[rows] = 0.0
            history.store_diagnostics(t, rows, diagnostics)
        history.store_beliefs(t, sources)
    return history.runs(dt * np.arange(T, dtype=np.float64), (time.perf_counter() - started) / B)


class BatchHistory:
    """Beliefs and diagnostics of a batch over time, and the runs of its sequences."""

    def __init__(self, start: BatchStart, n_batch: int, n_steps: int) -> None:
        K, n = start.sources.x.shape
        shape = (n_batch, n_steps, K)
        self.start = start
        self.sources = SourceBeliefs(
            np.empty((*shape, n)), np.empty((*shape, n, n)), np.empty(shape), np.empty(shape)
        )
        self.diagnostics = {
            name: np.full(shape[:2], value)
            for name, value in zip(Diagnostics._fields, Diagnostics(), strict=True)
        }

    def store_diagnostics(self, t: int, rows: Int, diagnostics: Diagnostics) -> None:
        """Store the diagnostics of some rows at step t."""
        for name, value in zip(Diagnostics._fields, diagnostics, strict=True):
            self.diagnostics[name][rows, t] = value

    def store_beliefs(self, t: int, sources: SourceBeliefs) -> None:
        """Store the beliefs after step t."""
        for stored, part in zip(self.sources, sources, strict=True):
            stored[:, t] = part

    def runs(self, times: Float, elapsed: float) -> list[Run]:
        """Return one run a sequence."""
        return [self._run(b, times, elapsed) for b in range(len(self.sources.u))]

    def _run(self, b: int, times: Float, elapsed: float) -> Run:
        xy, tracks, sources = self.start.position, self.start.tracks, self.sources.select(b)
        n_steps, K, n = sources.x.shape
        fields = {
            "position": sources.x[..., xy],
            "covariance": sources.P[..., xy, :][..., xy],
            "log_amplitude": sources.u,
            "existence": np.broadcast_to(tracks.existence, (n_steps, K)).copy(),
            "label": np.broadcast_to(tracks.label, (n_steps, K)).copy(),
            **{name: values[b] for name, values in self.diagnostics.items()},
        }
        x = np.full((n_steps, max(self.start.n_slots, K), n + 1), np.nan)
        x[:, :K, :-1], x[:, :K, -1] = sources.x, sources.u
        n_found = np.full(n_steps, K)
        return Run(PositionEstimate, fields, x.reshape(n_steps, -1), n_found, times, elapsed)
