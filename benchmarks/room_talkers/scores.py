"""Scores of directions of talkers: GOSPA with optional sources, errors and label switches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from arrivals.scenarios.metrics.assignment import Matches, label_switches
from arrivals.scenarios.room_acoustics.speech_signals import RATE
from arrivals.scenarios.simulations.rooms import MIN_ACTIVE, RoomRecording, step_samples
from arrivals.typing import Bool, Float, Int

CUT_OFF = 20.0  # degrees
HANGOVER, SHORT_PAUSE = 0.3, 0.5  # s: after an utterance, and within one


@dataclass(frozen=True, eq=False)
class StepTruth:
    """Directions of the talkers in each step, and which are active or optional.

    Parameters
    ----------
    doa_deg : ndarray, shape (n_steps, n_talkers)
        Directions, degrees.
    active, optional : ndarray of bool, shape (n_steps, n_talkers)
        Active in a third of the step or more; else, in part of it, or within a short pause or
        hangover.
    """

    doa_deg: Float
    active: Bool
    optional: Bool


@dataclass(frozen=True)
class Score:
    """Scores of one method on one scene, over the steps with an active talker.

    Parameters
    ----------
    gospa, error : float
        Degrees; cut-off 20, p = 1.
    missed, false : float
        Share of the active talkers, and number a step.
    in_pauses : float
        Number of directions a step in pauses of all talkers.
    switches : float
        Label switches; NaN without labels.
    within68, within95 : float
        Share of the errors within 1 and 1.96 stated standard deviations; NaN without these.
    """

    gospa: float
    error: float
    missed: float
    false: float
    in_pauses: float
    switches: float
    within68: float = np.nan
    within95: float = np.nan


def bridged(active: Bool) -> Bool:
    """Return activity with short pauses filled and a hangover, (n_samples, n_talkers)."""
    wide = active.copy()
    for talker, on in enumerate(active.T):
        edges = np.flatnonzero(np.diff(on.astype(np.int8), prepend=0, append=0))
        starts, ends = edges[::2], edges[1::2]
        following = np.append(starts[1:], len(on) + int(RATE))
        for end, start in zip(ends, following, strict=True):
            until = start if start - end < SHORT_PAUSE * RATE else end + int(HANGOVER * RATE)
            wide[end:until, talker] = True
    return wide


def truth_of(recording: RoomRecording) -> StepTruth:
    """Return the truth of the steps of a recording."""
    centre, rows = step_samples(len(recording.samples))
    active = recording.active[rows].mean(axis=1) >= MIN_ACTIVE
    some = bridged(recording.active)[rows].any(axis=1)
    return StepTruth(np.rad2deg(recording.doa[centre]), active, some & ~active)


def score(
    truth: StepTruth, doa_deg: Float, label: Int | None, std_deg: Float | None = None
) -> Score:
    """Return the scores of directions (n_steps, n_slots), NaN where there is none.

    An optional talker costs nothing, missed or found: a direction within the cut-off of one is not
    false. Of all assignments the cheapest counts.
    """
    pairs: list[tuple[int, int, int, float]] = []
    false = np.zeros(len(doa_deg))
    for step, found in enumerate(doa_deg):
        slots = np.flatnonzero(~np.isnan(found))
        talkers = np.flatnonzero(truth.active[step] | truth.optional[step])
        d = np.abs((truth.doa_deg[step, talkers, None] - found[slots] + 180) % 360 - 180)
        # savings of a pair: a missed and a false one, or a false one alone
        optional = truth.optional[step, talkers, None]
        saved = np.where(d < CUT_OFF, np.where(optional, CUT_OFF / 2, CUT_OFF - d), 0.0)
        rows, columns = linear_sum_assignment(-saved)
        kept = d[rows, columns] < CUT_OFF
        false[step] = len(slots) - kept.sum()
        for i, j in zip(rows[kept], columns[kept], strict=True):
            pairs.append((step, talkers[i], slots[j], d[i, j]))
    steps, talker, slot = np.array([p[:3] for p in pairs], dtype=np.int64).reshape(-1, 3).T
    error = np.array([p[3] for p in pairs])
    counts = truth.active[steps, talker]
    with_talker = truth.active.any(axis=1)
    pause = ~(truth.active | truth.optional).any(axis=1)
    missed = truth.active.sum() - counts.sum()
    total = error[counts].sum() + CUT_OFF / 2 * (missed + false[with_talker].sum())
    matched = Matches(steps, talker, slot, error)
    within = (np.nan, np.nan)
    if std_deg is not None and counts.any():
        z = (error / std_deg[steps, slot])[counts]
        within = float((z < 1).mean()), float((z < 1.96).mean())
    return Score(
        gospa=total / with_talker.sum(),
        error=float(error[counts].mean()) if counts.any() else np.nan,
        missed=missed / truth.active.sum(),
        false=false[with_talker].mean(),
        in_pauses=float(false[pause].mean()) if pause.any() else 0.0,
        switches=np.nan if label is None else label_switches(matched, label),
        within68=within[0],
        within95=within[1],
    )
