"""Labels and existence of the tracked sources."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arrivals.trackers.direction_state import padded
from arrivals.typing import Bool, Float, Int

MAX_LOG_ODDS = float(np.log(99.0))  # log odds at which a source is confirmed; deleted at minus that


@dataclass(frozen=True, eq=False)
class TrackTable:
    """Labels and log odds of existence of the sources.

    Parameters
    ----------
    label : ndarray of int, shape (n_sources,)
    log_odds : ndarray, shape (n_sources,)
        Log odds of existence, within ± ln 99; infinite for sources that exist for certain.
    confirmed : ndarray of bool, shape (n_sources,)
        Whether the log odds have reached ln 99 at least once.
    next_label : int
        Label of the next new source.
    stated : ndarray, shape (n_sources,)
        Log odds before the last step plus its whole evidence, within ± ln 99, of which `existence`
        is the probability: `log_odds` delay decisions, and are too cautious to be stated.
    """

    label: Int
    log_odds: Float
    confirmed: Bool
    next_label: int
    stated: Float

    @classmethod
    def certain(cls, n: int) -> TrackTable:
        """Return n sources that exist for certain.

        Examples
        --------
        >>> TrackTable.certain(2).existence
        array([1., 1.])
        """
        certain = np.full(n, np.inf)
        return cls(np.arange(n), certain, np.ones(n, dtype=np.bool_), n, certain)

    @property
    def existence(self) -> Float:
        """Probabilities of existence."""
        from scipy.special import expit

        return np.asarray(expit(self.stated))

    @property
    def active(self) -> Bool:
        """True for the sources that are not to be deleted."""
        return np.asarray(self.log_odds > -MAX_LOG_ODDS + 1e-9)

    def padded(self, n_slots: int) -> tuple[Int, Float]:
        """Return labels and probabilities in slots, -1 and NaN in unused ones."""
        label = padded(self.label, n_slots, -1).astype(np.int64)
        return label, padded(self.existence, n_slots, np.nan)

    def select(self, rows: Int | Bool) -> TrackTable:
        """Return some of the sources."""
        return TrackTable(
            self.label[rows], self.log_odds[rows], self.confirmed[rows], self.next_label,
            self.stated[rows],
        )  # fmt: skip

    def updated(self, evidence: Float, confirm_steps: int) -> TrackTable:
        """Return the table after the log evidence of one step for each source.

        The evidence of a step is limited to ± 2 ln 99 / `confirm_steps`, so that a confirmation
        or a deletion takes as many steps.
        """
        limit = 2 * MAX_LOG_ODDS / confirm_steps
        before = np.clip(self.log_odds, -MAX_LOG_ODDS, MAX_LOG_ODDS)
        log_odds = before + np.clip(evidence, -limit, limit)
        log_odds = np.clip(log_odds, -MAX_LOG_ODDS, MAX_LOG_ODDS)
        confirmed = self.confirmed | (log_odds >= MAX_LOG_ODDS - 1e-9)
        stated = np.clip(before + evidence, -MAX_LOG_ODDS, MAX_LOG_ODDS)
        return replace(self, log_odds=log_odds, confirmed=confirmed, stated=stated)

    def extended(self, evidence: list[float], confirm_steps: int) -> TrackTable:
        """Return the table with new sources, given the log evidence for each of them."""
        n = len(evidence)
        new = TrackTable(
            self.next_label + np.arange(n),
            np.full(n, -MAX_LOG_ODDS),
            np.zeros(n, dtype=np.bool_),
            self.next_label + n,
            np.full(n, -MAX_LOG_ODDS),
        ).updated(np.array(evidence), confirm_steps)
        return TrackTable(
            np.append(self.label, new.label),
            np.append(self.log_odds, new.log_odds),
            np.append(self.confirmed, new.confirmed),
            new.next_label,
            np.append(self.stated, new.stated),
        )
