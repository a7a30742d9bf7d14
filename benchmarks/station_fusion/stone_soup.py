"""Stone Soup's JPDA with an extended Kalman filter, one station after another.

Its tracks begin at intersections of single steps: Stone Soup has no initiator for bearings.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from arrivals.scenarios.simulations.stations import StationsTrial
from arrivals.trackers import PositionEstimate
from arrivals.typing import Float
from station_fusion.draws import Bearings
from station_fusion.intersections import Intersections, positions

P_DETECT, P_GATE, CLUTTER = 0.9, 0.999, 0.2 / (2 * np.pi)  # CLUTTER: per rad, station and step
MIN_SUPPORT = 0.5  # probability of an associated bearing that counts as one
CONFIRM, DELETE = 3, 2  # steps with support of two stations; successive ones without
NEW_GATE = 9.0  # of d² of an intersection from every track
DUPLICATE_GATE = 2.0
WIDEST = 0.1  # of the size, of a track's standard deviation
START = datetime(2000, 1, 1)
XY = np.ix_([0, 2], [0, 2])


@dataclass
class Candidate:
    """A track of Stone Soup with its label, steps with support, and successive ones without."""

    track: Any
    label: int
    hits: int = 0
    misses: int = 0
    support: int = 0

    @property
    def xy(self) -> Float:
        """Position, m, (2,)."""
        return np.asarray(self.track.state_vector, dtype=np.float64).ravel()[[0, 2]]

    @property
    def P(self) -> Float:
        """Covariance of the position, m², (2, 2)."""
        return np.asarray(self.track.covar, dtype=np.float64)[XY]


class StoneSoupJPDA:
    """Tracks of Stone Soup: confirmed by three steps with support, deleted after two without."""

    def __init__(self, trial: StationsTrial) -> None:
        from stonesoup.dataassociator.probability import JPDA
        from stonesoup.hypothesiser.probability import PDAHypothesiser
        from stonesoup.models.transition.linear import (
            CombinedLinearGaussianTransitionModel,
            ConstantVelocity,
        )
        from stonesoup.predictor.kalman import ExtendedKalmanPredictor
        from stonesoup.updater.kalman import ExtendedKalmanUpdater

        self.trial, self.initiator = trial, Intersections(trial)
        axis = ConstantVelocity(trial.motion.q)
        predictor = ExtendedKalmanPredictor(CombinedLinearGaussianTransitionModel([axis, axis]))
        self.updater = ExtendedKalmanUpdater(measurement_model=None)
        hypothesiser = PDAHypothesiser(
            predictor, self.updater, CLUTTER, prob_detect=P_DETECT, prob_gate=P_GATE
        )
        self.associator = JPDA(hypothesiser)
        self.candidates: list[Candidate] = []
        self.n_steps = self.n_labels = 0

    def step(self, found: list[Bearings]) -> PositionEstimate:
        """Return the confirmed tracks after a step."""
        now = START + timedelta(seconds=self.n_steps)
        self.n_steps += 1
        for candidate in self.candidates:
            candidate.support = 0
        n_on = 0
        for station, bearings in enumerate(found):
            if bearings is not None:
                n_on += 1
                self._associate(station, bearings, now)
        self._tidy(min(2, n_on))
        self._initiate(found, now)
        on = [each for each in self.candidates if each.hits >= CONFIRM]
        return positions(
            np.array([each.xy for each in on]),
            np.array([each.P for each in on]),
            np.array([each.label for each in on], dtype=np.int64),
        )

    def _associate(self, station: int, bearings: tuple[Float, Float], now: datetime) -> None:
        from stonesoup.functions import gm_reduce_single
        from stonesoup.models.measurement.nonlinear import Cartesian2DToBearing
        from stonesoup.types.array import StateVectors
        from stonesoup.types.detection import Detection
        from stonesoup.types.update import GaussianStateUpdate

        place = self.trial.stations[station].position[:, None]
        detections = {
            Detection(
                [[azimuth]],
                timestamp=now,
                measurement_model=Cartesian2DToBearing(
                    4, (0, 2), np.array([[variance]]), translation_offset=place
                ),
            )
            for azimuth, variance in zip(*bearings, strict=True)
        }
        tracks = {each.track for each in self.candidates}
        associated = self.associator.associate(tracks, detections, now)
        for candidate in self.candidates:
            hypotheses = associated[candidate.track]
            states = [self.updater.update(h) if h else h.prediction for h in hypotheses]
            weights = np.array([float(h.probability) for h in hypotheses])
            mean, covar = gm_reduce_single(
                StateVectors([state.state_vector for state in states]),
                np.stack([state.covar for state in states], axis=2),
                weights,
            )
            candidate.track.append(GaussianStateUpdate(mean, covar, hypotheses, timestamp=now))
            missed = sum(w for w, h in zip(weights, hypotheses, strict=True) if not h)
            candidate.support += int(1 - missed > MIN_SUPPORT)

    def _tidy(self, required: int) -> None:
        """Count hits and misses, and delete tracks that are lost, wide, or double."""
        kept: list[Candidate] = []
        for each in sorted(self.candidates, key=lambda one: -one.hits):
            supported = each.support >= required
            each.hits += int(supported)
            each.misses = 0 if supported else each.misses + 1
            lost = each.misses >= (DELETE if each.hits >= CONFIRM else 1)
            wide = np.trace(each.P) > (WIDEST * self.trial.size) ** 2
            double = any(_apart(each, one.xy, one.P) < DUPLICATE_GATE for one in kept)
            if not (lost or wide or double):
                kept.append(each)
        self.candidates = kept

    def _initiate(self, found: list[Bearings], now: datetime) -> None:
        from stonesoup.types.state import GaussianState
        from stonesoup.types.track import Track

        new = self.initiator.step(found)
        for x, C in zip(new.position, new.covariance, strict=True):
            if any(_apart(each, x, C) < NEW_GATE for each in self.candidates):
                continue
            P = np.diag([0.0, self.trial.speed_std**2] * 2)
            P[XY] = C
            state = GaussianState([[x[0]], [0.0], [x[1]], [0.0]], P, timestamp=now)
            self.candidates.append(Candidate(Track([state]), self.n_labels))
            self.n_labels += 1


def _apart(one: Candidate, x: Float, C: Float) -> float:
    """Return d² of a track from a position."""
    e = one.xy - x
    return float(e @ np.linalg.solve(one.P + C, e))
