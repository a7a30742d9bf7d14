"""EKF of one direction from real samples, by interpolation between neighbouring sensors."""

from __future__ import annotations

from operator import is_
from types import SimpleNamespace
from typing import Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.delay import DelayWalk
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.gaussian.arguments import covariance_matrix
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.linearization import Linearization
from arrivals.trackers.interpolation.assembly import FilterAssembly
from arrivals.trackers.interpolation.batch import directions, run, run_batch, trajectory
from arrivals.trackers.interpolation.channel_filters import ChannelFilters
from arrivals.trackers.interpolation.deferred import Deferring, SnapshotObservation
from arrivals.trackers.interpolation.gating import widened
from arrivals.trackers.interpolation.sample_buffer import SampleBuffer, receive, to_snapshot
from arrivals.trackers.interpolation.updates import DelayObservation, predict, transition
from arrivals.trackers.interpolation.variants import (
    RENAMED,
    Variant,
    VariantName,
    assemble_filter,
    initial_std,
    to_variant,
)
from arrivals.trackers.registry import register
from arrivals.typing import Float
from arrivals.validation import count, instance, number, positive, shaped, time_step


@register("interpolation_ekf")
class InterpolationEKF(Deferring, GaussianFilter):
    """Direction of one source from the delay at which neighbours interpolate each other.

    Parameters
    ----------
    measurement : ArraySamples
        Line array, sampling rate, and model of the source.
    motion : MotionModel
        Linear, of a state whose element 0 is the delay: `DelayWalk` or `DelayDrift`.
    variant : str or Variant
        "B": two taps, the paper's method. "literal": as printed, section 2.4. "Bw": "B" with the
        noise of the taps in the coefficients. "C": taps that cover ±κ, both ways along the array.
        "D": baselines 1, 2, 4 and 7. "E": all sensors at once, the source waveform in the state;
        "phasor": the same in closed form, for one tone. "E2": "E" after acquisition by "C". A name
        selects its `Variant`, whose settings are reached by `variant__offsets` and so on.
    doa : float
        Initial direction, rad.
    std : float, optional
        Its standard deviation, rad; if None 15°, for "E" and "phasor" at most 0.12 in sin β.
    rate_std : float
        Initial standard deviation of the rate of the direction, rad per snapshot.
    acquisition : int
        Snapshots of the first stage of "E2".
    gate : float, optional
        Standard deviations beyond which a residual is left out; twice as many for a sample.

    Attributes
    ----------
    x, P : ndarray, shape (dim_x,), (dim_x, dim_x)
        The delay between neighbours, samples, then the other elements of the motion; then, in
        "E", the source waveform at the centre of the array.
    y, H, R, K, S : ndarray
        As in every `GaussianFilter`, one row a sensor. `y` combines the residuals of all
        baselines of a sensor into one measurement of the delay; 0 where no baseline was used. With
        one baseline in one direction, and in "E", it is the residual of the snapshot `latency`
        steps ago. The samples are scaled to a source of power 1. They are computed when read.
    latency : int
        Snapshots between a snapshot and its update.

    Raises
    ------
    ValueError
        If the taps do not cover every delay of the array; or if a parameter is out of range.

    Warns
    -----
    UserWarning
        If a joint filter starts from a prior that is wider than the main lobe; once, if a channel
        is zero for so long that it counts as missing.

    Notes
    -----
    A measurement is one real sample of every sensor, (n_sensors,), NaN where it is missing; None
    if the snapshot is missing. Snapshots are one unit of time apart. After a missing snapshot, the
    variance of the direction grows by 1 %, until it may be any.

    Where the model has a `band`, samples are filtered to it, and missing until the filter settles:
    at the start, after a gap or a click. The filter delays the estimate too.

    `std` is that of the error of the delay `latency` snapshots ago, true if the prior is; `P` takes
    residuals that share samples to be independent. docs/trackers.md says how many errors it covers.

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, "Performance evaluation of an algorithm for
    estimation of DOA using model estimation technique", (9)-(23). Variants other than "B": ours.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray, Tones
    >>> array = SensorArray.ula(10, spacing=0.5, speed=1000.0)
    >>> model = ArraySamples(array, rate=4000.0, correlation=Tones(0.25), snr_db=20.0)
    >>> lag = model.grid_index * model.delay(np.deg2rad(40.0))
    >>> z = np.cos(np.pi / 2 * (np.arange(30)[:, None] - lag))
    >>> tracker = InterpolationEKF(model, doa=np.deg2rad(30.0))
    >>> np.rad2deg(tracker.run(z).doa[-1]).round(1), tracker.latency
    (array([40.]), 3)
    """

    renamed: ClassVar[dict[str, str]] = RENAMED
    measurement: ArraySamples  # type: ignore[assignment]  # its h depends on earlier samples

    def __init__(
        self,
        measurement: ArraySamples,
        motion: MotionModel = DelayWalk(),  # noqa: B008  (models are immutable)
        *,
        variant: VariantName | Variant = "C",
        doa: float = 0.0,
        std: float | None = None,
        rate_std: float = np.deg2rad(0.2),
        acquisition: int = 25,
        gate: float | None = 5.0,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySamples)
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        self.variant = to_variant(variant)
        self.doa, self.std, self.rate_std = number("doa", doa), std, positive("rate_std", rate_std)
        self.acquisition, self.gate = count("acquisition", acquisition), gate
        for name, value in (("std", std), ("gate", gate)):
            if value is not None:
                positive(name, value)
        if not abs(self.doa) <= np.pi / 2:
            raise ValueError(f"doa must lie within ±π/2 rad; got {doa}")
        self._built = SimpleNamespace(key=(None,) * 5)
        self.restart()

    block_steps = True
    run, run_batch, trajectory = run, run_batch, trajectory

    def restart(self) -> None:
        """Discard all samples, and start again from `doa` and `std`."""
        assembly, delay = self.assembly, float(self.measurement.delay(self.doa))
        std = initial_std(assembly, self.doa, self.std)
        self.x, self.P = assembly.initial_belief(delay, std**2, self.rate_std)
        self.initialize_record()
        self.error = assembly.initial_error(self.P)
        self.buffer = SampleBuffer.empty(assembly.span, assembly.n_grid_points)
        self.channels = ChannelFilters.start(self.measurement)

    def predict(
        self,
        u: ArrayLike | None = None,
        *,
        dt: float = 1.0,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
        B: ArrayLike | None = None,
    ) -> None:
        """Predict mean and covariance; parameters as in `GaussianFilter.predict`."""
        x, P = self.belief()
        assembly = self.assembly
        own_F, own_Q = transition(assembly.motion, time_step(dt))
        F = own_F if F is None else shaped("F", F, len(x), len(x))
        Q = own_Q if Q is None else covariance_matrix("Q", Q, len(x))
        # x = F x (18) + B u,   P = F P F' + Q   (19)
        x, P = predict(x, P, F, Q)
        P, error = widened(P, self.buffer.missing, assembly.largest_variance), self.error.of(self.P)
        error = assembly.predicted_error(error, P, F, Q, self.buffer.missing)
        self.record_prediction(self.add_control(x, u, B), P, dt)
        self.error = error

    def update(
        self, z: ArrayLike | None, R: ArrayLike | None = None, H: ArrayLike | None = None
    ) -> None:
        """Update mean and covariance by a snapshot.

        Parameters
        ----------
        z : array_like, shape (n_sensors,) or (n_sensors, 1), real
            NaN where a sample is missing.
        R : float or array_like, shape (n_sensors, n_sensors), optional
            Replaces the noise of `y`, one vector measurement, linear at the present mean.
        H : array_like, shape (m, dim_x), optional
            Replaces the snapshot by another measurement of the state: z = H x + v.
        """
        if H is not None:
            super().update(z, self.measurement.noise_ratio if R is None else R, H)
            return
        x, P = self.belief()
        snapshot, prior, error = to_snapshot(z, self.dim_z), P, self.error.of(self.P)
        noise = None if R is None else covariance_matrix("R", R, len(snapshot))
        channels, buffer = receive(self, self.channels, self.buffer, snapshot)
        observation = self._observation(x, P, buffer)
        if noise is None:
            # baseline after baseline, or sensor after sensor, with Δ in ±κ
            samples, n = observation.samples, buffer.n_snapshots
            x, P, misfit = self.assembly.update(x, P, samples, n, buffer.misfit)
            buffer = buffer.with_misfit(misfit)
            self.error = self.assembly.updated_error(error, prior, x, P, n)
        else:
            update = observation.update(self.inv, noise)
            x, P = update.x, update.P
        self.channels, self.buffer = channels, buffer
        if not np.isfinite(snapshot).any():  # earlier samples may still update the belief
            self.set_belief(x, P)
            self.record_missed()
        elif noise is None:
            self.record_deferred(snapshot, x, P, observation)
        else:
            self.record_update(snapshot, update)

    @property
    def estimate(self) -> DirectionEstimate:  # type: ignore[override]  # not the state
        """Direction, and the standard deviation of its error."""
        doa, std = directions(self.measurement, np.ravel(self.x), self.error.of(self.P).variance)
        nan = np.full(1, np.nan)
        return DirectionEstimate(
            doa=doa[None], std=std[None], existence=nan, amplitude=nan.astype(complex),
            label=np.zeros(1, dtype=np.int64),
        )  # fmt: skip

    @property
    def state_motion(self) -> MotionModel:
        """Motion of the whole state: the delay, and the source waveform if it is part of it."""
        return self.assembly.motion

    @property
    def state_angles(self) -> tuple[int, ...]:
        """No entry of the state is an angle."""
        return ()

    @property
    def dim_z(self) -> int:
        """Number of sensors."""
        return len(self.measurement.grid_index)

    @property  # type: ignore[misc]  # it follows the samples
    def H(self) -> Float:
        """Slopes of `y`, at the present mean and the newest snapshots, (n_sensors, dim_x)."""
        return self._present().H

    @property  # type: ignore[misc]  # it follows the samples
    def R(self) -> Float:
        """Noise of `y` at the present mean, scaled to a source of power 1."""
        return np.diag(self._present().R)

    @property
    def latency(self) -> int:
        """Snapshots between a snapshot and its update."""
        return self.assembly.final.latency

    @property
    def assembly(self) -> FilterAssembly:
        """Models and updates of the variant; the same ones as long as no parameter changes."""
        key = (self.measurement, self.motion, self.variant, self.acquisition, self.gate)
        if not all(map(is_, key, self._built.key)):
            self._built = SimpleNamespace(key=key, assembly=assemble_filter(*key))
        return cast(FilterAssembly, self._built.assembly)

    def set_params(self, **params: Any) -> Self:
        """Change parameters by (nested) names; start again if the belief does not fit any more."""
        if "variant" in params:
            params["variant"] = to_variant(params["variant"])
        super().set_params(**params)
        assembly = self.assembly
        shape = (assembly.span, assembly.n_grid_points)
        filters = self.channels.band_filter, self.measurement.band_filter
        fits = filters[0] == filters[1] and len(self.x) == assembly.motion.dim_x
        if not fits or self.buffer.frames.shape != shape:
            self.restart()
        return self

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return F x and F."""
        F, Q = transition(self.state_motion, dt)
        return Linearization(predict(x, P, F, Q)[0], F)

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return the expectation of `y`, 0, and its slopes."""
        return Linearization(np.zeros(self.dim_z), self.H)

    def _present(self) -> DelayObservation:
        """Return the residuals of the latest snapshot near the present belief."""
        return self._observation(np.ravel(self.x), self.P, self.buffer).linearized()

    def _observation(self, x: Float, P: Float, buffer: SampleBuffer) -> SnapshotObservation:
        measurement, samples = self.measurement, buffer.scaled(self.measurement)
        return SnapshotObservation(self.assembly, measurement.grid_index, x, P, samples, buffer)
