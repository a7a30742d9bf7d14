"""Many sequences of readings side by side."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from arrivals.trackers.estimates import PositionEstimate
from arrivals.trackers.rss.belief import SourceBeliefs
from arrivals.trackers.rss.inference.goodness_of_fit import Quality
from arrivals.trackers.rss.inference.solution import Solution, Status
from arrivals.trackers.rss.model_order.birth_death import TrackTable
from arrivals.trackers.run import Run
from arrivals.typing import Float, Int

if TYPE_CHECKING:
    from arrivals.trackers.rss.base import RSSTracker

AT_ONCE = 20_000  # readings side by side: what stays in the cache


def run_in_chunks(tracker: RSSTracker, xi: Float, dt: float) -> list[Run]:
    """Run sequences of readings (n_sequences, n_steps, n_sensors), some at a time."""
    size = max(1, AT_ONCE // xi.shape[-1])
    chunks = (xi[first : first + size] for first in range(0, len(xi), size))
    return [run for chunk in chunks for run in run_together(tracker, chunk, dt)]


def run_together(tracker: RSSTracker, xi: Float, dt: float) -> list[Run]:
    """Run sequences of readings (n_sequences, n_steps, n_sensors) side by side."""
    started = time.perf_counter()
    B, T, _ = xi.shape
    sources = SourceBeliefs(*(np.repeat(part[None], B, axis=0) for part in tracker.by_source()))
    elapsed = np.full(B, tracker.elapsed)
    recorded = _Recorded(tracker, B, T, len(sources.u[0]))
    for t in range(T):
        sources = sources.predicted(tracker.motion, dt, tracker.q_u)
        elapsed = elapsed + dt
        heard = np.flatnonzero(~np.isnan(xi[:, t]).all(axis=1))
        if len(heard):
            told = tracker.told(xi[heard, t], elapsed[heard])
            moved, found, judged = tracker.correct(sources.take(heard), told)
            for part, new in zip(sources, moved, strict=True):
                part[heard] = new
            elapsed[heard] = 0.0
            recorded.note(t, heard, found, judged)
        recorded.add(t, sources)
    took = (time.perf_counter() - started) / B
    return recorded.runs(tracker.census, dt * np.arange(T, dtype=np.float64), took)


class _Recorded:
    """Beliefs of a batch over time, and the runs that they make."""

    def __init__(self, tracker: RSSTracker, n_batch: int, n_steps: int, n_sources: int) -> None:
        n = tracker.motion.dim_x
        shape = (n_batch, n_steps, n_sources)
        self.xy = tracker.xy
        self.n_slots = max(tracker.n_slots, n_sources)
        self.sources = SourceBeliefs(
            np.empty((*shape, n)), np.empty((*shape, n, n)), np.empty(shape), np.empty(shape)
        )
        default = Status()
        self.status = {
            name: np.full(shape[:2], value)
            for name, value in zip(Status._fields, default, strict=True)
        }

    def note(self, t: int, rows: Int, found: Solution, judged: Quality) -> None:
        """Enter what a step says of its own making."""
        values = (found.converged, found.iterations, judged.fit, judged.poor_fit, judged.diverged)
        for name, value in zip(Status._fields, values, strict=True):
            self.status[name][rows, t] = value

    def add(self, t: int, sources: SourceBeliefs) -> None:
        """Enter the beliefs after a step."""
        for mine, part in zip(self.sources, sources, strict=True):
            mine[:, t] = part

    def runs(self, census: TrackTable, times: Float, elapsed: float) -> list[Run]:
        """Return one run a sequence."""
        n_steps, K = self.sources.u.shape[1:]
        everywhere = (n_steps, K)
        runs = []
        for b in range(len(self.sources.u)):
            own = self.sources.take(b)
            fields = {
                "position": own.x[..., self.xy],
                "covariance": own.P[..., self.xy, :][..., self.xy],
                "log_amplitude": own.u,
                "existence": np.broadcast_to(census.existence, everywhere).copy(),
                "label": np.broadcast_to(census.label, everywhere).copy(),
                **{name: values[b] for name, values in self.status.items()},
            }
            x = np.full((n_steps, self.n_slots, own.x.shape[-1] + 1), np.nan)
            x[:, :K, :-1], x[:, :K, -1] = own.x, own.u
            n_found = np.full(n_steps, K)
            runs.append(
                Run(PositionEstimate, fields, x.reshape(n_steps, -1), n_found, times, elapsed)
            )
        return runs
