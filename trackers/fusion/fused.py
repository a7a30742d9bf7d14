"""Positions from the snapshots or bearings of several stations, and from signal strength."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import LogNormalRSS, Station
from arrivals.measurements import is_missing, numbers
from arrivals.messages import shown
from arrivals.motion_models import MotionModel
from arrivals.trackers.base import Tracker
from arrivals.trackers.direction_state import padded
from arrivals.trackers.fusion.arguments import (
    area_of,
    checked_readings,
    checked_stations,
    default_speed_std,
    ready_made,
    station_trackers,
    valid_readings,
)
from arrivals.trackers.fusion.births.initiation import Labels
from arrivals.trackers.fusion.fused_estimate import FusedEstimate, report
from arrivals.trackers.fusion.fusion_step import FusionModel, fused_step, predicted_bank
from arrivals.trackers.fusion.hypotheses import Bank, Hypothesis
from arrivals.trackers.fusion.settings import BearingDetection, GlobalHypotheses
from arrivals.trackers.fusion.signal_strength import ValidReadings
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.trackers.fusion.stations.feedback import expected_directions, guided_fit
from arrivals.trackers.fusion.stations.single_step_bearings import (
    StepSnapshots,
    fit_directions,
    step_snapshots,
)
from arrivals.trackers.fusion.stations.station_update import StationBearings
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.trackers.registry import register
from arrivals.trackers.rss.settings import AmplitudePrior
from arrivals.typing import Float
from arrivals.validation import instance, items, no_control, positive, time_step


@register("fused")
class Fused(Tracker):
    """Positions of an unknown number of sources from several arrays, with labels and existence.

    Each station runs a tracker of directions. Bearings that only the step's snapshots support are
    shared out to tracks by belief propagation, station after station; new tracks are the best
    packing of crossings of bearings without a track; rival packings, and a challenger that starts
    anew, keep false crossings from staying.

    Parameters
    ----------
    motion : MotionModel
        With the entries x and y, such as `ConstantVelocity`.
    stations : sequence of Station
        At least two, or one with `rss`.
    trackers : str or sequence of (Tracker or None)
        Registered name of a tracker of directions, or one for each station; copied.
    rss : LogNormalRSS, optional
        Signal strength, one entry more in each measurement; with `log_noise`.
    amplitude : AmplitudePrior
        Log amplitude of a new source for `rss`.
    area : (float, float, float, float), optional
        x0, y0, x1, y1 of the expected positions, m. If None, the bounding box of stations and
        sensors, wider by half of its longer side at each end.
    speed_std : float, optional
        Standard deviation of each coordinate of a new source's velocity, m/s; a hundredth of the
        longer side of the area if None.
    detection : BearingDetection
        Detections, births and false bearings.
    hypotheses : GlobalHypotheses
        Rivals and challenger.
    feedback : bool
        Whether stations search for the sure tracks that their own trackers do not report.

    Attributes
    ----------
    bank : Bank
        The hypotheses.
    active_trackers : tuple of (Tracker or None)
        Trackers of the stations, with their states.
    x, P : ndarray
        States of the reported sources, one after the other, by label, and their covariances; NaN
        and 0 in unused places.
    estimate : FusedEstimate
        Sources of the best hypothesis with an existence of at least 1/2 and a standard deviation
        below 5 % of the area's longer side; read-only.

    Raises
    ------
    TypeError, ValueError
        If the motion has no position, there are fewer than two stations without `rss`, two of
        them are at one place, or a setting is invalid.

    Notes
    -----
    `existence` is the sum over hypotheses. Above 0.99 it is right; between 0.5 and 0.99 it is too
    sure. Constant errors of stations are estimated by each track for itself. Stations need no
    common phase, only a common clock.

    References
    ----------
    Williams and Lau, IEEE T-AES 50, 2014, for the association; Musicki and Evans, IEEE T-AES 40,
    2004, for existence; Meyer et al., Proc. IEEE 106, 2018.

    Examples
    --------
    >>> from arrivals.motion_models import ConstantVelocity
    >>> places = [[0.0, 0.0], [1000.0, 0.0], [500.0, 900.0]]
    >>> stations = [Station(None, place) for place in places]
    >>> d = np.array([400.0, 300.0]) - np.array(places)
    >>> z = [([azimuth], [3e-4]) for azimuth in np.arctan2(d[:, 1], d[:, 0])]
    >>> tracker = Fused(ConstantVelocity(q=0.05), stations)
    >>> tracker.run([z, z, z]).position.round(1)[-1]
    array([[400., 300.]])
    """

    def __init__(
        self,
        motion: MotionModel,
        stations: Sequence[Station],
        trackers: str | Sequence[Tracker | None] = "svalse",
        *,
        rss: LogNormalRSS | None = None,
        amplitude: AmplitudePrior = AmplitudePrior(),
        area: ArrayLike | None = None,
        speed_std: float | None = None,
        detection: BearingDetection = BearingDetection(),
        hypotheses: GlobalHypotheses = GlobalHypotheses(),
        feedback: bool = True,
    ) -> None:
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        self.rss = checked_readings(rss)
        self.stations = checked_stations(stations, rss is not None)
        self.trackers = trackers
        self.amplitude = instance("amplitude", amplitude, AmplitudePrior)
        if np.ndim(amplitude.mean) or np.ndim(amplitude.variance):
            raise ValueError(f"amplitude must have one mean and variance; got {shown(amplitude)}")
        self.area = area
        self.speed_std = None if speed_std is None else positive("speed_std", speed_std)
        self.detection = instance("detection", detection, BearingDetection)
        self.hypotheses = instance("hypotheses", hypotheses, GlobalHypotheses)
        self.feedback = instance("feedback", feedback, bool)
        self.reset()

    def reset(self) -> None:
        """Return to the state after construction: no track, the stations' trackers as given."""
        self.active_trackers = station_trackers(self.trackers, self.stations)
        self._prepare()
        self.bank = Bank((Hypothesis(Tracks.empty(self._model.layout.n, len(self.stations))),))
        self._next_label = 0
        self._report()

    @property
    def n_slots(self) -> int:
        """Largest number of sources in one estimate."""
        return self.hypotheses.max_tracks

    @property
    def estimate(self) -> FusedEstimate:
        """Sources reported last."""
        return self._estimate

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Predict the trackers of the stations, and the tracks of all hypotheses."""
        dt = time_step(dt)
        no_control(u)
        self._apply_changed_parameters()
        for tracker in self.active_trackers:
            if tracker is not None:
                tracker.predict(dt=dt)
        self.bank = predicted_bank(self.bank, self._model, dt)
        self._report()

    def update(self, z: Sequence[Any] | ArrayLike | None) -> None:
        """Update the tracks by the measurements of one step.

        Parameters
        ----------
        z : sequence, or None
            One entry a station: a measurement of its model, azimuths and variances as in
            `update_bearings` if it has no model, or None; with `rss`, then the readings, Np. A
            station whose entry is missing counts neither for nor against a track.
        """
        entries = self._entries(z)
        readings = None if self.rss is None else valid_readings(self.rss, entries[-1])
        entries = entries[: len(self.stations)]
        steps: list[StepSnapshots | StationBearings | None] = []
        for station, entry in zip(self.stations, entries, strict=True):
            if station.measurement is None:
                steps.append(ready_made(entry))
            else:
                steps.append(step_snapshots(station.measurement, entry))
        self._apply_changed_parameters()
        found = [self._bearings(s, step, entries[s]) for s, step in enumerate(steps)]
        self._fuse(found, readings)

    def update_bearings(self, bearings: Sequence[Any]) -> None:
        """Update the tracks by bearings of one step.

        Parameters
        ----------
        bearings : sequence of (array_like, array_like) or None
            For each station azimuths (n_bearings,) on the map, rad, anticlockwise from the x
            axis, and their variances (n_bearings,), rad²; None if it has no data. A station with
            data and no bearing counts against tracks.

        Raises
        ------
        TypeError, ValueError
            If there is not one entry a station, or a variance is not in (0, 1] rad².
        """
        entries = items("bearings", bearings)
        if len(entries) != len(self.stations):
            raise ValueError(f"bearings must be one a station, {len(self.stations)}; "
                             f"got {len(entries)}")  # fmt: skip
        found = [ready_made(each) for each in entries]
        self._apply_changed_parameters()
        self._fuse(found, None)

    def _entries(self, z: Any) -> tuple[Any, ...]:
        """Return one entry a station, and one for readings."""
        n = len(self.stations) + (self.rss is not None)
        if not isinstance(z, list | tuple):  # masked and labelled arrays, too
            z = numbers("z", np.nan if z is None else z)
            if is_missing(z):
                return (None,) * n
        entries = items("z", z)
        if len(entries) != n:
            readings = ", and one for the readings" if self.rss is not None else ""
            raise ValueError(f"z must have one entry a station{readings}, {n}; got {len(entries)}")
        return entries

    def _bearings(
        self, s: int, step: StepSnapshots | StationBearings | None, entry: Any
    ) -> StationBearings | None:
        """Return the bearings of a station that only this step supports."""
        tracker = self.active_trackers[s]
        if step is None or isinstance(step, StationBearings) or tracker is None:
            return step if isinstance(step, StationBearings) else None
        station = self.stations[s]
        tracker.update(entry)
        doa: Float = tracker.estimate.doa  # type: ignore[attr-defined]  # of directions
        if self.feedback:
            best = self.bank.hypotheses[0].tracks
            expected = expected_directions(best, station, self._model.layout.of_station(s))
            fit = guided_fit(step, doa, *expected)
        else:
            fit = fit_directions(step, doa)
        variance = self.detection.inflation**2 * np.diagonal(fit.covariance)
        return StationBearings(station.to_map(fit.doa), variance)

    def _fuse(
        self, found: Sequence[StationBearings | None], readings: ValidReadings | None
    ) -> None:
        if readings is None and all(each is None for each in found):
            return
        labels = Labels(self._next_label)
        self.bank = fused_step(self.bank, found, readings, self._model, labels)
        self._next_label = labels.next_label
        self._report()

    def _prepare(self) -> None:
        """Derive the model of a step from the parameters."""
        area = area_of(self.area, self.stations, self.rss)
        speed_std = default_speed_std(area) if self.speed_std is None else self.speed_std
        amplitude = None if self.rss is None else self.amplitude
        layout = StateLayout.of(self.motion, self.stations, speed_std, amplitude)
        self._model = FusionModel(self.stations, layout, area, self.detection, self.hypotheses)
        self._prepared: dict[str, Any] = self.get_params(deep=False)

    def _apply_changed_parameters(self) -> None:
        """Follow changed parameters; start anew if a state has other entries then."""
        before, now = self._prepared, self.get_params(deep=False)
        changed = {name for name, value in now.items() if value is not before[name]}
        if not changed:
            return
        n = self._model.layout.n
        self._prepare()
        if changed & {"stations", "trackers"}:
            self.active_trackers = station_trackers(self.trackers, self.stations)
        if self._model.layout.n != n or len(before["stations"]) != len(self.stations):
            self.reset()

    def _report(self) -> None:
        """Make the likely tracks of the best hypothesis the present estimate."""
        reported, self._estimate = report(self.bank, self._model)
        m, n = self._model.layout.first_error, self.n_slots
        self.x = padded(reported.x[:, :m].ravel(), n * m, np.nan)
        blocks = np.zeros((n, m, n, m))
        index = np.arange(reported.n_tracks)
        blocks[index, :, index] = reported.P[:, :m, :m]
        self.P = blocks.reshape(n * m, n * m)
