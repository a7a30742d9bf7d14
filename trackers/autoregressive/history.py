"""Recordings of autoregressive sources, worked off interval by interval, as runs over time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.motion_models.autoregressive import AutoregressiveSources
from arrivals.trackers.autoregressive.belief import SourceBelief, outside
from arrivals.trackers.estimates import SourceEstimate
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Complex, Int


class History:
    """What independent sequences of snapshots tell, interval after interval.

    Parameters
    ----------
    z : ndarray, shape (n_sequences, n_snapshots, n_sensors)
        All snapshots, those that were pending before the run in front.
    pending : int
        How many those are.
    motion : AutoregressiveSources
    gated : bool
        Whether silent sources are told from others.
    """

    def __init__(
        self, z: Complex, pending: int, motion: AutoregressiveSources, gated: bool
    ) -> None:
        self.z, self.pending, self.motion, self.gated = z, pending, motion, gated
        self.found: list[bool] = []
        self.beliefs: list[dict[str, NDArray[Any]]] = []
        self.shown_from: list[Int] = []
        self.signals: list[Complex] = []

    def add(self, s: SourceBelief | None, end: int) -> None:
        """Note what is believed after the first `end` snapshots."""
        K, lead = self.motion.n_sources, (len(self.z),)
        belief = {
            "x": np.zeros((*lead, self.motion.dim_x)) if s is None else outside(s.x, self.motion),
            "doa": np.full((*lead, K), np.nan) if s is None else s.doa,
            "a": np.full((*lead, K, max(self.motion.orders)), np.nan) if s is None else s.a,
            "q": np.full((*lead, K), np.nan) if s is None else s.q,
            "r": np.full(lead, np.nan) if s is None else s.r,
            "active": np.full((*lead, K), np.nan) if s is None else s.active.astype(float),
        }
        last = closes(self.z[:, end - 1]) if end else np.zeros(lead, dtype=np.bool_)
        self.found.append(s is not None)
        self.beliefs.append(belief)
        self.shown_from.append(end - self.pending - last)

    @property
    def moved(self) -> bool:
        """Whether there was an interval to work off."""
        return len(self.beliefs) > 1

    def run(self, n: int, dt: float, elapsed: float) -> Run:
        """Return the run of sequence n, less what was pending before."""
        n_steps, K = self.z.shape[1] - self.pending, self.motion.n_sources
        shown_from = [steps[n] for steps in self.shown_from]
        now = np.searchsorted(shown_from, np.arange(n_steps), side="right") - 1
        found = np.array(self.found)[now]
        column = {name: np.array([b[name][n] for b in self.beliefs])[now] for name in ("x", "doa",
                  "a", "q", "r", "active")}  # fmt: skip
        amplitude = self.motion.signals(column["x"])
        amplitude[~found] = complex(np.nan, np.nan)
        fields = {
            "doa": column["doa"],
            "std": np.full((n_steps, K), np.nan),
            "existence": column["active"] if self.gated else np.full((n_steps, K), np.nan),
            "amplitude": amplitude,
            "label": np.where(found[:, None], np.arange(K), -1),
            "converged": np.ones(n_steps, dtype=np.bool_),
            "iterations": np.zeros(n_steps, dtype=np.int64),
            "noise": column["r"],
            "coefficients": column["a"],
            "driving_noise": column["q"],
        }
        signals = np.concatenate([np.zeros((0, K), complex), *(part[n] for part in self.signals)])
        time = dt * np.arange(n_steps, dtype=np.float64)
        extras = {"signals": signals[self.pending :]}
        return Run(SourceEstimate, fields, column["x"], found * K, time, elapsed, extras)


def closes(z: Complex) -> Bool:
    """Tell whether snapshots (..., n_sensors), the last of an interval, are there to close it.

    Examples
    --------
    >>> closes(np.array([[np.nan, 1j], [np.nan, np.nan]]))
    array([ True, False])
    """
    return np.asarray(np.isfinite(z).any(axis=-1))
