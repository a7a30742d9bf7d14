"""Reports of the prediction, computed when they are read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.trackers.direction_tracker import MISSING, BatchDirectionTracker
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.svalse.reporting import is_direction, located, prior_spread
from arrivals.typing import Bool, Float, Int


@dataclass(frozen=True, eq=False)
class PredictedReport:
    """Predicted components of which an estimate can be made.

    Parameters
    ----------
    kind : type of DirectionEstimate
        Class of the estimate.
    manifold : Manifold
        Response of all sensors.
    mu, kappa, existence, label, curved : ndarray, shape (L, ...)
        As in `SVALSE`.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(5, spacing=0.5), wavelength=1.0)
    >>> one = np.ones(1)
    >>> report = PredictedReport(
    ...     DirectionEstimate, model.manifold(), 0 * one, 100 * one, 0.7 * one, np.array([3]),
    ...     curved=one > 0,
    ... )
    >>> report.estimate().doa, report.estimate().label
    (array([0.]), array([3]))
    """

    kind: type[DirectionEstimate]
    manifold: Manifold
    mu: Float
    kappa: Float
    existence: Float
    label: Int
    curved: Bool

    def estimate(self) -> DirectionEstimate:
        """Return the estimate of the components of existence 0.5 and more that have a label.

        Returns
        -------
        DirectionEstimate
            Of class `kind`, without amplitudes.
        """
        tracked = ~np.isnan(self.mu if self.mu.ndim == 1 else self.mu[:, 0])
        likely = np.flatnonzero(tracked & (self.existence >= 0.5) & (self.label >= 0))
        spread = prior_spread(self.kappa[likely])
        real = is_direction(self.manifold, self.mu[likely], spread)
        likely, spread = likely[real], spread[real]
        return self.kind(
            **located(self.manifold, self.mu[likely], spread, self.curved[likely]),
            existence=self.existence[likely],
            amplitude=np.full(len(likely), MISSING),
            label=self.label[likely],
        )


class ReportWhenRead(BatchDirectionTracker):
    """Base of direction trackers with a report that may wait until it is read.

    A tracker that predicts and updates in turn does not use the report of the prediction.

    Attributes
    ----------
    x, P : ndarray, shapes (L,), (L, L)
        As in `DirectionTracker`.
    """

    _due: PredictedReport | None = None

    def report_when_read(self, report: PredictedReport) -> None:
        """Make predicted components the present estimate, computed when it is read.

        Parameters
        ----------
        report : PredictedReport
            Of arrays that nothing writes into.
        """
        self._due = report

    def report_estimate(self, estimate: DirectionEstimate) -> None:
        """Make an estimate the present one, as in `DirectionTracker`."""
        self._due = None
        super().report_estimate(estimate)

    @property
    def estimate(self) -> DirectionEstimate:
        """Directions reported last."""
        if self._due is not None:
            self.report_estimate(self._due.estimate())
        return super().estimate
