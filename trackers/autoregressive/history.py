"""Results of intervals over time, as runs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.motion_models.autoregressive.sources import AutoregressiveSources
from arrivals.trackers.autoregressive.belief import SourceBelief, to_state_vector
from arrivals.trackers.autoregressive.direction_covariance import direction_std
from arrivals.trackers.autoregressive.snapshots import completes_interval
from arrivals.trackers.direction_estimates import SourceEstimate
from arrivals.trackers.run import Run
from arrivals.typing import Complex, Int

FIELDS = ("x", "doa", "a", "q", "r", "active", "covariance")


class History:
    """Beliefs and signals of independent sequences of snapshots, interval by interval.

    Parameters
    ----------
    z : ndarray, shape (n_sequences, n_snapshots, n_sensors)
        All snapshots, those that were pending before the run in front.
    n_pending : int
        Number of snapshots that were pending.
    motion : AutoregressiveSources
    gated : bool
        True if inactive sources are distinguished from active ones.
    """

    def __init__(
        self, z: Complex, n_pending: int, motion: AutoregressiveSources, gated: bool
    ) -> None:
        self.z, self.n_pending, self.motion, self.gated = z, n_pending, motion, gated
        self.detected: list[bool] = []
        self.beliefs: list[dict[str, NDArray[Any]]] = []
        self.first_steps: list[Int] = []
        self.signals: list[Complex] = []

    def add(self, belief: SourceBelief | None, end: int) -> None:
        """Append the belief after the first `end` snapshots."""
        lead = (len(self.z),)
        last = completes_interval(self.z[:, end - 1]) if end else np.zeros(lead, dtype=np.bool_)
        self.detected.append(belief is not None)
        self.beliefs.append(self._unknown(lead) if belief is None else self._row_of(belief))
        self.first_steps.append(end - self.n_pending - last)

    def _row_of(self, belief: SourceBelief) -> dict[str, NDArray[Any]]:
        x, active = to_state_vector(belief.x, self.motion), belief.active.astype(float)
        return {name: getattr(belief, name) for name in FIELDS} | {"x": x, "active": active}

    def _unknown(self, lead: tuple[int, ...]) -> dict[str, NDArray[Any]]:
        K, p = self.motion.n_sources, max(self.motion.orders)
        unknown = {name: np.full((*lead, K), np.nan) for name in ("doa", "q", "active")}
        return unknown | {
            "x": np.zeros((*lead, self.motion.dim_x)),
            "a": np.full((*lead, K, p), np.nan),
            "r": np.full(lead, np.nan),
            "covariance": np.full((*lead, K, K), np.nan),
        }

    @property
    def has_intervals(self) -> bool:
        """True if an interval was processed."""
        return len(self.beliefs) > 1

    def run(self, n: int, dt: float, elapsed: float) -> Run:
        """Return the run of sequence n, without the snapshots that were pending before."""
        n_steps, K = self.z.shape[1] - self.n_pending, self.motion.n_sources
        first_steps = [steps[n] for steps in self.first_steps]
        latest = np.searchsorted(first_steps, np.arange(n_steps), side="right") - 1
        detected = np.array(self.detected)[latest]
        column = {name: np.array([b[name][n] for b in self.beliefs])[latest] for name in FIELDS}
        amplitude = self.motion.signals(column["x"])
        amplitude[~detected] = complex(np.nan, np.nan)
        fields = {
            "doa": column["doa"],
            "std": direction_std(column["covariance"], column["doa"]),
            "existence": column["active"] if self.gated else np.full((n_steps, K), np.nan),
            "amplitude": amplitude,
            "label": np.where(detected[:, None], np.arange(K), -1),
            "converged": np.ones(n_steps, dtype=np.bool_),
            "iterations": np.zeros(n_steps, dtype=np.int64),
            "noise": column["r"],
            "coefficients": column["a"],
            "innovation_variance": column["q"],
        }
        signals = np.concatenate([np.zeros((0, K), complex), *(part[n] for part in self.signals)])
        time = dt * np.arange(n_steps, dtype=np.float64)
        extras = {"signals": signals[self.n_pending :]}
        return Run(SourceEstimate, fields, column["x"], detected * K, time, elapsed, extras)
