"""Peaks of a spectrum, joined to tracks by a bank of Kalman filters: what one would write today."""

from __future__ import annotations

import copy
import inspect

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.linear import ConstantVelocity
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.base import Tracker, is_missing
from arrivals.trackers.direction_tracker import DirectionTracker
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.multi_target.track_bank import TrackBank, nearest
from arrivals.trackers.registry import find, register
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance, not_negative, positive


@register("peaks_gnn")
class PeaksGNN(DirectionTracker):
    """Peaks, frame by frame, and a global nearest-neighbour bank of Kalman filters behind them.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array.
    detector : str or Tracker
        What finds directions in a snapshot: a registered tracker that a measurement alone makes
        ("cbf", "mvdr", "music", "sbl"), or one with settings of its own.
    walk : MotionModel
        How a direction moves, linear; its entry 0 is the direction, rad.
    std : float
        Standard deviation of a detected direction, rad.
    speed_std : float
        Of the other entries of a new track, rad per unit of time.
    gate : float
        Standard deviations beyond which a detection belongs to no track.
    confirm : int
        Detections in a row that a new track wants before it is reported.
    patience : int
        Steps without a detection that a reported track survives.
    max_sources : int, optional
        Tracks at most, reported or not; twice as many as there are sensors if None.

    Attributes
    ----------
    bank : Bank
        The tracks.
    scan : Tracker
        The detector at work.
    x, P : ndarray, shapes (n_slots,), (n_slots, n_slots)
        The directions reported, rad, NaN in unused places, and their variances on a diagonal.

    Notes
    -----
    `existence` is NaN. A track of a line that leaves ±90° ends.

    References
    ----------
    Blackman and Popoli, *Design and Analysis of Modern Tracking Systems*, 1999, ch. 6.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> z = model.simulate([[0.50], [0.51], [0.52]], 1.0, np.random.default_rng(0))
    >>> run = PeaksGNN(model, max_sources=1).run(z)
    >>> run.doa[:, 0].round(2), run.label[:, 0]
    (array([ nan, 0.51, 0.51]), array([-1,  0,  0]))
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        detector: str | Tracker = "cbf",
        walk: MotionModel = ConstantVelocity(q=1e-5, n_dims=1),  # noqa: B008  (models are immutable)
        std: float = np.deg2rad(3.0),
        speed_std: float = np.deg2rad(1.0),
        gate: float = 3.0,
        confirm: int = 2,
        patience: int = 4,
        max_sources: int | None = None,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.detector = detector
        self.walk = instance("walk", walk, MotionModel)  # type: ignore[type-abstract]  # any
        self.std, self.speed_std = positive("std", std), positive("speed_std", speed_std)
        self.gate = positive("gate", gate)
        self.confirm, self.patience = count("confirm", confirm), count("patience", patience, 0)
        self.max_sources = max_sources
        if max_sources is not None:
            count("max_sources", max_sources)
        self.scan = self._fresh_scan()
        self.bank = TrackBank.empty(self.n_slots, walk.dim_x)
        self._report(np.full(self.n_slots, complex(np.nan, np.nan)))

    @property
    def n_slots(self) -> int:
        """Number of tracks that there may be at once."""
        return self.max_sources or 2 * self.measurement.array.n_sensors

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Move the tracks."""
        not_negative("dt", dt)
        self._settle()
        self.scan.predict(dt=dt)
        self.bank = self.bank.predicted(self.walk, dt)
        self.bank = self.bank.without(self.bank.used & self._outside(self.bank.mean[:, 0]))
        self._report(np.full(self.n_slots, complex(np.nan, np.nan)))

    def update(self, z: ArrayLike | None) -> None:
        """Find peaks, give each to the nearest track, start tracks with what is left."""
        if is_missing(z):
            return
        self._settle()
        self.scan.update(z)
        found = instance("detector's estimate", self.scan.estimate, DirectionEstimate)
        bank, tracks = self.bank, np.flatnonzero(self.bank.used)
        residual = self._difference(found.doa, bank.mean[tracks, :1])
        S = bank.covariance[tracks, 0, 0] + self.std**2
        pair, detection = nearest(residual, S, self.gate)
        bank = bank.corrected(tracks[pair], residual[pair, detection], self.std**2)
        bank = bank.without(bank.misses > np.where(bank.hits < self.confirm, 0, self.patience))
        amplitude = np.full(self.n_slots, complex(np.nan, np.nan))
        amplitude[tracks[pair]] = found.amplitude[detection]
        free = np.delete(np.arange(found.n_found), detection)
        older = bank.used
        self.bank = bank.with_births(found.doa[free], self._new_covariance())
        born = self.bank.used & ~older
        amplitude[born] = found.amplitude[free][: born.sum()]
        self._report(amplitude)

    def _settle(self) -> None:
        """Begin anew with what depends on parameters that were changed."""
        if self._made_for != (self.detector, self.measurement):
            self.scan = self._fresh_scan()
        if self.bank.mean.shape != (self.n_slots, self.walk.dim_x):
            self.bank = TrackBank.empty(self.n_slots, self.walk.dim_x)

    def _fresh_scan(self) -> Tracker:
        self._made_for = (self.detector, self.measurement)
        if isinstance(self.detector, Tracker):
            return copy.deepcopy(self.detector)
        kind = find(self.detector)
        needs = [name for name, p in inspect.signature(kind).parameters.items()
                 if p.default is p.empty]  # fmt: skip
        if needs != ["measurement"]:
            raise ValueError(
                f"the detector must be made from a measurement alone; {self.detector!r} is made "
                f"from {', '.join(needs)}"
            )
        return kind(measurement=self.measurement)  # type: ignore[call-arg]  # looked at above

    def _difference(self, doa: Float, mean: Float) -> Float:
        return wrap(doa - mean) if self.measurement.array.dim > 1 else doa - mean

    def _outside(self, doa: Float) -> Bool:
        line = self.measurement.array.dim == 1
        return np.asarray(line & (np.abs(doa) > np.pi / 2))

    def _new_covariance(self) -> Float:
        variances = np.full(self.walk.dim_x, self.speed_std**2)
        variances[0] = self.std**2
        return np.diag(variances)

    def _report(self, amplitude: Complex) -> None:
        """Report the tracks that were confirmed."""
        bank = self.bank
        on = bank.used & (bank.hits >= self.confirm)
        doa = bank.mean[on, 0]
        self.report(
            doa=wrap(doa) if self.measurement.array.dim > 1 else doa,
            std=np.sqrt(bank.covariance[on, 0, 0]),
            existence=np.full(on.sum(), np.nan),
            amplitude=amplitude[on],
            label=bank.label[on],
        )
