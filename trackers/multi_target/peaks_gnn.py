"""Peak detection with global nearest-neighbour association and a bank of Kalman filters."""

from __future__ import annotations

import copy
import inspect
import warnings
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sphere import azimuth_elevation, unit_vectors
from arrivals.measurement_models.manifolds.manifold import (
    UNIFORM_STD_OF_CIRCLE,
    UNIFORM_STD_OF_LINE,
)
from arrivals.measurements import numbers
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.linear import ConstantVelocity
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.base import Tracker
from arrivals.trackers.beamforming.sphere_grid import half_space_normal
from arrivals.trackers.direction_estimates import SphereEstimate
from arrivals.trackers.direction_tracker import DirectionTracker, warn_of_ambiguity
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.kinds_of_estimates import kind_of_estimate
from arrivals.trackers.multi_target.sphere_bank import SphereBank, offsets
from arrivals.trackers.multi_target.track_bank import TrackBank, nearest
from arrivals.trackers.registry import find, register
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance, no_control, positive, time_step

UNIFORM_VARIANCE_OF_SPHERE = (np.pi**2 - 4) / 4  # rad², along each axis


@register("peaks_gnn")
class PeaksGNN(DirectionTracker):
    """Peak detection, global nearest-neighbour association and a bank of Kalman filters.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, of one angle or of azimuth and elevation.
    detector : str or Tracker
        Method that detects directions in a snapshot: a registered tracker whose only required
        argument is a measurement ("cbf", "mvdr", "music", "sbl"), or an instance with settings.
    motion : MotionModel
        Linear motion of a direction; entry 0 of its state is the direction, rad. On the sphere,
        of each of two axes of the tangent plane.
    std : float
        Standard deviation of a detected direction, rad.
    speed_std : float
        Standard deviation of the other entries of a new track, rad per unit of time.
    gate : float
        Maximum distance of a detection from its track, on the sphere along a great circle, in
        standard deviations.
    confirm_steps : int
        Consecutive detections after which a new track is reported.
    patience : int
        Maximum number of steps without a detection before a reported track ends.
    max_sources : int, optional
        Maximum number of tracks, reported or not; twice the number of sensors if None.

    Attributes
    ----------
    bank : TrackBank
        The tracks.
    active_detector : Tracker
        The detector and its state.
    x, P : ndarray, shapes (n_slots,), (n_slots, n_slots)
        Reported directions, rad, NaN in unused slots, and their variances on a diagonal; on the
        sphere two entries a slot, azimuth and elevation.

    Notes
    -----
    `existence` is NaN. The stated deviations follow from `std` and `motion`: they are true where
    both are. The default of 3 degrees covers 91 and 100 % of the errors at 68 and 95 % for one
    source (`walk`), 68 and 94 % for six (Fig. 6 of SVALSE's paper): most of the error is then
    interference, which the curvature of a peak does not show. A track of a line that leaves ±90°
    ends, as does one after `patience` steps without a detection, those without data included, and
    one whose standard deviation exceeds that of a uniform direction. One that would pass below the
    plane of the sensors is mirrored.

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

    renamed: ClassVar[dict[str, str]] = {"walk": "motion", "confirm": "confirm_steps"}

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        detector: str | Tracker = "cbf",
        motion: MotionModel = ConstantVelocity(q=1e-5, n_dims=1),  # noqa: B008  (models are immutable)
        std: float = np.deg2rad(3.0),
        speed_std: float = np.deg2rad(1.0),
        gate: float = 3.0,
        confirm_steps: int = 2,
        patience: int = 4,
        max_sources: int | None = None,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.detector = detector
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        self.std, self.speed_std = positive("std", std), positive("speed_std", speed_std)
        self.gate = positive("gate", gate)
        self.confirm_steps = count("confirm_steps", confirm_steps)
        self.patience = count("patience", patience, 0)
        self.max_sources = max_sources
        if max_sources is not None:
            count("max_sources", max_sources, maximum=1000)
        warn_of_ambiguity(measurement)
        self.reset()

    def reset(self) -> None:
        """Return to the state after construction: no track, the detector as it was given."""
        self.active_detector = self._new_detector()
        self.bank = self._empty_bank()
        self._report_confirmed(self._no_amplitude())

    @property
    def n_slots(self) -> int:
        """Maximum number of tracks."""
        return self.max_sources or 2 * self.measurement.array.n_sensors

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Predict the tracks; end those that leave ±90° of a line, or had no data for long."""
        dt = time_step(dt)
        no_control(u)
        self._apply_changed_parameters()
        self.active_detector.predict(dt=dt)
        bank = self.bank.predict(self.motion, dt)
        unknown = bank.covariance[:, 0, 0] > self._max_variance
        has_ended = self._is_outside(bank) | unknown | (bank.misses > self.patience + 1)
        self.bank = bank.remove(bank.used & has_ended)
        self._report_confirmed(self._no_amplitude())

    def update(self, z: ArrayLike | None) -> None:
        """Detect peaks, assign them to tracks, and initiate tracks from the others."""
        z = numbers("z", np.nan if z is None else z)
        if not np.nan_to_num(z).any():
            return
        self._apply_changed_parameters()
        self.active_detector.update(z)
        detected = instance(
            "detector's estimate", self.active_detector.estimate, self.estimate_kind
        )
        bank, tracks = self.bank, np.flatnonzero(self.bank.used)
        directions = self._directions(detected)
        residual = self._difference(directions, bank.mean[tracks, :1])
        S = bank.covariance[tracks, 0, 0] + self.std**2  # S = H P H' + R
        pair, detection = nearest(residual, S, self.gate)
        bank = bank.update(tracks[pair], residual[pair, detection], self.std**2)
        allowed_misses = np.where(bank.hits < self.confirm_steps, 0, self.patience)
        bank = bank.remove(bank.misses > allowed_misses)
        amplitude = self._no_amplitude()
        amplitude[tracks[pair]] = detected.amplitude[detection]
        unassigned = np.delete(np.arange(detected.n_found), detection)
        self.bank = bank.add(directions[unassigned], self._initial_covariance())
        is_new = self.bank.used & ~bank.used
        amplitude[is_new] = detected.amplitude[unassigned][: is_new.sum()]
        self._report_confirmed(amplitude)

    def _apply_changed_parameters(self) -> None:
        """Reset the parts that depend on parameters that `set_params` changed."""
        if self._detector_parameters != (self.detector, self.measurement):
            self.active_detector = self._new_detector()
        empty = self._empty_bank()
        if self.bank.mean.shape != empty.mean.shape:
            self.bank = empty

    def _new_detector(self) -> Tracker:
        self._detector_parameters = (self.detector, self.measurement)
        if isinstance(self.detector, Tracker):
            return copy.deepcopy(self.detector)
        kind = find(self.detector)
        required = [name for name, p in inspect.signature(kind).parameters.items()
                    if p.default is p.empty]  # fmt: skip
        if required != ["measurement"]:
            raise ValueError(
                f"detector must require only the argument measurement; got {self.detector!r}, "
                f"which requires {', '.join(required)}"
            )
        with warnings.catch_warnings():  # the constructor has warned
            warnings.filterwarnings("ignore", "directions .* are ambiguous", UserWarning)
            return kind(measurement=self.measurement)  # type: ignore[call-arg]  # checked above

    def _no_amplitude(self) -> Complex:
        return np.full(self.n_slots, complex(np.nan, np.nan))

    def _empty_bank(self) -> TrackBank:
        """Return a bank without tracks, and set the class of the estimates."""
        model = self.measurement
        self.estimate_kind = kind_of_estimate(model, type(self).__name__, "azimuth", "sphere")
        if model.unknowns == "azimuth":
            return TrackBank.empty(self.n_slots, self.motion.dim_x)
        bank = SphereBank.empty(self.n_slots, self.motion.dim_x)
        return replace(bank, normal=half_space_normal(model))

    def _directions(self, detected: DirectionEstimate) -> Float:
        """Return directions as entries of the bank, (n,) or (n, 3)."""
        if isinstance(detected, SphereEstimate):
            return unit_vectors(detected.doa, detected.elevation)
        return detected.doa

    def _difference(self, directions: Float, mean: Float) -> Float:
        """Return residuals (n_tracks, n) or (n_tracks, n, 3)."""
        if directions.ndim > 1:
            return offsets(mean, directions)
        is_circle = self.measurement.array.dim > 1
        return wrap(directions - mean) if is_circle else directions - mean

    def _is_outside(self, bank: TrackBank) -> Bool:
        if self.measurement.array.dim > 1:
            return np.zeros(len(bank.mean), dtype=np.bool_)
        return np.asarray(np.abs(bank.mean[:, 0]) > np.pi / 2)

    @property
    def _max_variance(self) -> float:
        """Variance of a uniform direction along each axis, rad²."""
        if self.measurement.unknowns == "sphere":
            return UNIFORM_VARIANCE_OF_SPHERE
        is_line = self.measurement.array.dim == 1
        return (UNIFORM_STD_OF_LINE if is_line else UNIFORM_STD_OF_CIRCLE) ** 2

    def _initial_covariance(self) -> Float:
        variances = np.full(self.motion.dim_x, self.speed_std**2)
        variances[0] = self.std**2
        return np.diag(variances)

    def _report_confirmed(self, amplitude: Complex) -> None:
        """Report the confirmed tracks with a detection not too long ago."""
        bank = self.bank
        confirmed = bank.used & (bank.hits >= self.confirm_steps) & (bank.misses <= self.patience)
        mean, variance = bank.mean[confirmed, 0], bank.covariance[confirmed, 0, 0]
        if isinstance(bank, SphereBank):
            directions, axes = np.stack(azimuth_elevation(mean)), np.eye(2)
        else:
            directions = (wrap(mean) if self.measurement.array.dim > 1 else mean)[None]
            axes = np.eye(1)
        self.report_directions(
            directions,
            variance[:, None, None] * axes,
            amplitude=amplitude[confirmed],
            label=bank.label[confirmed],
        )
