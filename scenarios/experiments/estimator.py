"""A tracker as a scikit-learn estimator, for its grid searches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator

from arrivals.scenarios.metrics.distances import Distance
from arrivals.scenarios.metrics.gospa import mean_gospa
from arrivals.trackers import Run, Tracker
from arrivals.typing import Float
from arrivals.validation import instance, positive


class TrackerEstimator(BaseEstimator):  # type: ignore[misc]  # scikit-learn has no types
    """Wrap a tracker of directions for scikit-learn; the score is minus GOSPA.

    Parameters
    ----------
    tracker : Tracker
        Initial state of every sequence. Its parameters are `tracker__...` of the estimator:
        `tracker__motion__p_activate`.
    c_deg : float
        Cut-off of GOSPA, degrees.

    Notes
    -----
    A sample is a sequence of measurements, (n_steps, n_sensors), its target the true directions,
    (n_steps, n_sources), rad, NaN for inactive sources; azimuths and elevations,
    (n_steps, n_sources, 2), for a tracker of both. `fit` only checks the parameters.

    Examples
    --------
    >>> from sklearn.model_selection import GridSearchCV
    >>> from arrivals.scenarios import create
    >>> from arrivals.trackers import CBF
    >>> trials = [create("svalse_fig6").sample(np.random.default_rng(n)) for n in range(4)]
    >>> X, y = [t.measurements for t in trials], [t.truth for t in trials]
    >>> estimator = TrackerEstimator(CBF(trials[0].measurement))
    >>> grid = {"tracker__threshold_db": [1.0, 10.0]}
    >>> GridSearchCV(estimator, grid, cv=2).fit(X, y).best_params_
    {'tracker__threshold_db': 10.0}
    """

    def __init__(self, tracker: Tracker, c_deg: float = 10.0) -> None:
        self.tracker = tracker
        self.c_deg = c_deg

    def fit(self, X: Sequence[ArrayLike], y: Sequence[ArrayLike] | None = None) -> TrackerEstimator:
        """Check the parameters.

        Raises
        ------
        TypeError, ValueError
            If `tracker` is not a Tracker, or the cut-off is not positive.
        """
        instance("tracker", self.tracker, Tracker)  # type: ignore[type-abstract]  # any
        self.c_deg_ = positive("c_deg", self.c_deg)
        return self

    def runs(self, X: Sequence[ArrayLike]) -> list[Run]:
        """Run the tracker on each sequence."""
        return self.tracker.run_batch([np.asarray(sequence) for sequence in X])

    def predict(self, X: Sequence[ArrayLike]) -> list[Float]:
        """Return the estimated directions, rad, (n_steps, n_slots[, 2]) for each sequence."""
        return [_directions(run) for run in self.runs(X)]

    def score(self, X: Sequence[ArrayLike], y: Sequence[ArrayLike]) -> float:
        """Return minus the mean GOSPA, degrees, over steps and sequences: larger is better."""
        planar = getattr(getattr(self.tracker, "measurement", None), "array", None)
        period = 360.0 if planar is not None and planar.dim > 1 else None
        scores = []
        for truth, estimate in zip(y, self.predict(X), strict=True):
            distance: Distance = "great_circle" if estimate.ndim == 3 else "euclidean"
            degrees = np.rad2deg(truth), np.rad2deg(estimate)
            one = mean_gospa(*degrees, c=self.c_deg_, period=period, distance=distance)
            scores.append(one.total)
        return -float(np.mean(scores))


def _directions(run: Run) -> Float:
    doa = run.fields["doa"]
    return np.stack([doa, run.elevation], axis=-1) if "elevation" in run.fields else doa
