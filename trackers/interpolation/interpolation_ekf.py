"""One direction from real samples, through the delay between neighbouring sensors."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.delay import DelayWalk
from arrivals.trackers.base import is_missing
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.gaussian.arguments import covariance_matrix
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.equations import GaussianUpdate, update_gaussian
from arrivals.trackers.gaussian.linalg import apply, symmetric
from arrivals.trackers.gaussian.linearization import Linearization
from arrivals.trackers.interpolation.sample_buffer import SampleBuffer
from arrivals.trackers.interpolation.updates import DelayObservation, move
from arrivals.trackers.interpolation.variants import (
    LOBE,
    VARIANTS,
    FilterAssembly,
    Variant,
    VariantName,
    assembled,
)
from arrivals.trackers.registry import register
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import count, instance, number, one_of, positive


@register("interpolation_ekf")
class InterpolationEKF(GaussianFilter):
    """Direction of one source from the delay at which neighbours interpolate each other.

    Parameters
    ----------
    measurement : ArraySamples
        Line array, sampling rate, and what is known of the source.
    motion : MotionModel
        Linear, of a state whose element 0 is the delay: `DelayWalk` or `DelayDrift`.
    variant : str
        "B": the paper's two taps. "Bw": the same, aware of the noise in them. "C": taps that
        cover ±κ, forwards and backwards along the array. "D": baselines 1, 2, 4 and 7. "E": all
        sensors at once, with the source's waveform in the state; "phasor": the same in closed
        form, for one tone. "E2": "E" after "C" has acquired the source.
    doa, std : float, optional
        Start and its standard deviation, rad; if None, the latter is 15°, for "E" and "phasor"
        at most 0.12 in sin β.
    rate_std : float
        Standard deviation of the direction's rate at the start, rad per snapshot.
    offsets, loading, baselines, both_ways, each_sensor : optional
        In place of the variant's own: taps (of baseline 1), ε_c, distances in sensors between
        which is interpolated, whether backwards too, and whether coefficients are taken anew at
        every sensor ("B", "Bw" and "D") or once a snapshot (the others). The former makes four
        times the array calls and finds the source from farther off; see Notes.
    aligned : bool
        All baselines treat the same snapshot, which makes the longer ones no later than the
        others, and all of them as late as the longest.
    drive : float, optional
        q_s of `DelayLine` or `Phasor`.
    acquisition : int
        Snapshots of the first stage of "E2".
    gate : float, optional
        Standard deviations beyond which a residual is dropped; off if None.
    extrapolate : bool
        Allow taps that do not reach the largest delay: the paper's form where it is biased.

    Attributes
    ----------
    x, P : ndarray, shape (dim_x,), (dim_x, dim_x)
        The delay between neighbours, samples, then what else the motion carries; then, in "E",
        the source's waveform at the array's centre.
    y, H, R, K, S : ndarray
        As in every `GaussianFilter`, one row a sensor. `y` is what a sensor's samples say of the
        delay
        beyond the mean, all that is foretold of it from its neighbours taken together; 0 where
        nothing is. With one baseline in one direction, and in "E", it is the plain residual of the
        snapshot `latency` steps ago. The samples are scaled to a source of power 1.
    latency : int
        Snapshots after its own for which a correction waits: an estimate describes the source so
        many snapshots ago.

    Raises
    ------
    ValueError
        If the taps do not serve every delay of the array; or if a parameter is out of range.

    Warns
    -----
    UserWarning
        If a joint filter is to start from a prior that is wider than the main lobe.

    Notes
    -----
    A measurement is one real sample of every sensor, (n_sensors,); NaN where one is missing, and
    None for a snapshot that is. Snapshots are one unit of time apart.

    `std` is the filter's own: 1.2 to 1.6 times too large for "B" and "C", whose residuals share
    noise; about right for "D" and "E".

    Of 400 trials of a tone at 60° and 5 dB that start at 0°, those that end within 3° are 65 %
    with coefficients at every sensor and 8 % with those once a snapshot for "B", 88 and 64 % for
    "D", 88 and 93 % for "C". From 20° all but 4 % do, with any (benchmarks/interpolation.py).

    The index of the paper's (3) and (11) is one sample off (4); offsets (0, 1) follow (4).

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, "Performance evaluation of an algorithm for
    estimation of DOA using model estimation technique", (9)-(22). Variants other than "B": ours.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray, Tones
    >>> array = SensorArray.ula(10, spacing=0.5, speed=1000.0)
    >>> model = ArraySamples(array, rate=4000.0, correlation=Tones(0.25), snr_db=20.0)
    >>> lag = model.places * model.delay(np.deg2rad(40.0))
    >>> z = np.cos(np.pi / 2 * (np.arange(30)[:, None] - lag))
    >>> tracker = InterpolationEKF(model, doa=np.deg2rad(30.0))
    >>> np.rad2deg(tracker.run(z).doa[-1]).round(1), tracker.latency
    (array([40.]), 3)
    """

    measurement: ArraySamples  # type: ignore[assignment]  # its h depends on what was heard

    def __init__(
        self,
        measurement: ArraySamples,
        motion: MotionModel = DelayWalk(),  # noqa: B008  (models are immutable)
        *,
        variant: VariantName = "C",
        doa: float = 0.0,
        std: float | None = None,
        rate_std: float = np.deg2rad(0.2),
        offsets: Sequence[int] | None = None,
        loading: float | None = None,
        baselines: Sequence[int] | None = None,
        both_ways: bool | None = None,
        each_sensor: bool | None = None,
        aligned: bool = False,
        drive: float | None = None,
        acquisition: int = 25,
        gate: float | None = None,
        extrapolate: bool = False,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySamples)
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        self.variant: VariantName = one_of("variant", variant, tuple(VARIANTS))  # type: ignore[arg-type]  # its keys
        self.doa, self.std, self.rate_std = number("doa", doa), std, positive("rate_std", rate_std)
        self.offsets, self.loading = offsets, loading
        self.baselines, self.both_ways = baselines, both_ways
        self.each_sensor, self.aligned, self.extrapolate = each_sensor, aligned, extrapolate
        self.drive, self.gate = drive, gate
        self.acquisition = count("acquisition", acquisition)
        for name in ("std", "drive", "gate"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))
        if not abs(self.doa) <= np.pi / 2:
            raise ValueError(f"doa must lie within ±π/2 rad; got {doa}")
        self.restart()

    def restart(self) -> None:
        """Forget what was heard, and start again from `doa` and `std`."""
        parts = self._parts
        delay = float(self.measurement.delay(self.doa))
        self.x, self.P = parts.start(delay, self._delay_std() ** 2, self.rate_std)
        self.initialize_record()
        self.heard = SampleBuffer.nothing(parts.span, parts.n_places)

    def update(
        self, z: ArrayLike | None, R: ArrayLike | None = None, H: ArrayLike | None = None
    ) -> None:
        """Correct the belief by a snapshot.

        Parameters
        ----------
        z : array_like, shape (n_sensors,) or (n_sensors, 1), real
            NaN where a sample is missing, None where all are.
        R : float or array_like, shape (n_sensors, n_sensors), optional
            In place of the noise of `y`, which then is one vector measurement, linear at the
            present mean; scaled to a source of power 1.
        H : array_like, shape (m, dim_x), optional
            For once another measurement of the state, z = H x + v with z (m,): no snapshot.
        """
        if H is not None:
            super().update(z, self.measurement.noise_ratio if R is None else R, H)
            return
        x, P = self.belief()
        snapshot = self._snapshot(z)
        noise = None if R is None else covariance_matrix("R", R, self.dim_z)
        heard = self.heard.then(self.measurement.frame(snapshot))
        found = self._by_sensors(x, P, heard, noise)
        if noise is None:
            x, P = self._parts.update(x, P, self._frames(heard), heard.n_snapshots)
            found = found._replace(x=x, P=P)
        self.set_belief(found.x, found.P)
        self.heard = heard
        if is_missing(snapshot):
            self.record_missed()
        else:
            self.record_update(snapshot, found)
        self.x_post, self.P_post = self.x.copy(), self.P.copy()

    @property
    def estimate(self) -> DirectionEstimate:  # type: ignore[override]  # what users ask for
        """The direction, and the filter's own standard deviation of it."""
        doa, std = self._direction(np.ravel(self.x), self.P)
        nan = np.full(1, np.nan)
        return DirectionEstimate(
            doa=doa[None], std=std[None], existence=nan, amplitude=nan.astype(complex),
            label=np.zeros(1, dtype=np.int64),
        )  # fmt: skip

    @property
    def state_motion(self) -> MotionModel:
        """How the whole state moves: the delay, and the source's waveform if it is part of it."""
        return self._parts.motion

    @property
    def dim_z(self) -> int:
        """Number of sensors."""
        return self.measurement.array.n_sensors

    @property
    def H(self) -> Float:
        """Slopes of `y`, at the present mean and the newest snapshots, (n_sensors, dim_x)."""
        return self._seen(np.ravel(self.x), self.P, self.heard).H

    @property
    def R(self) -> Float:
        """Noise of `y` at the present mean, scaled to a source of power 1."""
        return np.diag(self._seen(np.ravel(self.x), self.P, self.heard).R)

    @property
    def latency(self) -> int:
        """Snapshots after its own for which a correction waits."""
        return self._parts.last.latency

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences at once, as one array program over the leading axis.

        The tracker itself stays as it is.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, n_sensors)
            Sequences of different lengths, or with None in them, are run one by one.
        dt : float
            Time between snapshots.
        """
        positive("dt", dt)
        sequences = [list(sequence) for sequence in measurements]
        shapes = {(len(s), np.asarray(z).shape) for s in sequences for z in s}
        if len(shapes) != 1:
            return super().run_batch(sequences, dt)
        started = time.perf_counter()
        x, P = self.trajectory(np.array(sequences), dt)
        doa, std = self._direction(x, P)
        elapsed = (time.perf_counter() - started) / len(sequences)
        return [_run(*each, dt, elapsed) for each in zip(doa, std, x, strict=True)]

    def trajectory(self, measurements: ArrayLike, dt: float = 1.0) -> tuple[Float, Float]:
        """Return the beliefs after every snapshot of independent sequences; stay as it is.

        Parameters
        ----------
        measurements : array_like, shape (..., n_steps, n_sensors)
        dt : float

        Returns
        -------
        x : ndarray, shape (..., n_steps, dim_x)
        P : ndarray, shape (..., n_steps, dim_x, dim_x)
        """
        frames = self.measurement.frame(measurements)
        if frames.ndim < 2:
            raise ValueError(
                f"measurements must have shape (..., n_steps, n_sensors); got {frames.shape}"
            )
        n, shape, parts = self.dim_x, frames.shape[:-2], self._parts
        F, Q = parts.motion.F(np.zeros(n), dt), parts.motion.Q(dt)
        x, P = self.belief()
        x, P = np.broadcast_to(x, (*shape, n)), np.broadcast_to(P, (*shape, n, n))
        heard = self.heard.copies(shape)
        xs, Ps = np.empty((*frames.shape[:-1], n)), np.empty((*frames.shape[:-1], n, n))
        for k in range(frames.shape[-2]):
            heard = heard.then(frames[..., k, :])
            x, P = parts.update(*move(x, P, F, Q), self._frames(heard), heard.n_snapshots)
            xs[..., k, :], Ps[..., k, :, :] = x, P
        return xs, Ps

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name; keep the belief where it still fits, else start again."""
        super().set_params(**params)
        parts = self._parts
        spans = (parts.span, parts.n_places)
        if self.heard.frames.shape != spans or len(self.x) != parts.motion.dim_x:
            self.restart()
        return self

    # -- what the parameters amount to ---------------------------------------------------------

    @property
    def recipe(self) -> Variant:
        """What the variant is made of, with the parameters given in its place."""
        own = VARIANTS[self.variant]
        return replace(
            own,
            offsets=own.offsets if self.offsets is None else tuple(self.offsets),
            loading=own.loading if self.loading is None else self.loading,
            baselines=own.baselines if self.baselines is None else tuple(self.baselines),
            both_ways=own.both_ways if self.both_ways is None else self.both_ways,
            each_sensor=own.each_sensor if self.each_sensor is None else self.each_sensor,
        )

    @property
    def _parts(self) -> FilterAssembly:
        """The models that do the work; the same ones as long as no parameter changes."""
        return assembled(
            self.measurement, self.motion, self.recipe, self.aligned,
            self.drive, self.acquisition, self.gate, self.extrapolate,
        )  # fmt: skip

    def _delay_std(self) -> float:
        """Return the standard deviation to start from, samples; warn if it is too wide."""
        kappa, parts = self.measurement.kappa, self._parts
        slope = kappa * max(float(np.cos(self.doa)), 0.05)
        if parts.joint is None or parts.acquire is not None:
            return slope * (np.deg2rad(15.0) if self.std is None else self.std)
        lobe = 2 / parts.n_places
        if self.std is not None and slope * self.std > lobe * kappa:
            warnings.warn(
                f"variant {self.variant!r} finds the source only from inside the main lobe, "
                f"|sin doa - sin truth| < {lobe:.3g}; std reaches {slope * self.std / kappa:.3g}. "
                "Start nearer, or use 'E2'.",
                stacklevel=4,
            )
        return min(LOBE * kappa, slope * (np.deg2rad(15.0) if self.std is None else self.std))

    # -- one snapshot --------------------------------------------------------------------------

    def predict_belief(
        self,
        x: Float,
        P: Float,
        dt: float,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
    ) -> tuple[Float, Float]:
        """Return the predictions of beliefs, symmetric to the last bit."""
        x, P = super().predict_belief(x, P, dt, F, Q)
        return x, symmetric(P)

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return F x and F."""
        F = self.state_motion.F(np.zeros(self.dim_x), dt)
        return Linearization(apply(F, x), F)

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return what is expected of `y`, nothing, and its slopes."""
        return Linearization(np.zeros(self.dim_z), self._seen(x, P, self.heard).H)

    def _snapshot(self, z: ArrayLike | None) -> NDArray[Any]:
        n = self.dim_z
        snapshot = np.full(n, np.nan) if z is None or is_missing(z) else np.asarray(z)
        if snapshot.shape == (n, 1):
            return snapshot[:, 0]
        if snapshot.ndim != 1:
            raise ValueError(f"a snapshot must have shape ({n},) or ({n}, 1); got {snapshot.shape}")
        return snapshot

    def _frames(self, heard: SampleBuffer) -> Float:
        return heard.scaled(self.measurement.power, self.measurement.noise_ratio)

    def _seen(self, x: Float, P: Float, heard: SampleBuffer) -> DelayObservation:
        """Return what the newest snapshot says near a belief, in the order of the sensors."""
        stage, places = self._parts.stage(max(heard.n_snapshots, 1)), self.measurement.places
        y, H, R = stage.linearise(x, P, self._frames(heard))
        return DelayObservation(y[places], H[places], R[places])

    def _by_sensors(
        self, x: Float, P: Float, heard: SampleBuffer, R: Float | None
    ) -> GaussianUpdate:
        """Correct a belief by one vector update of what the sensors say."""
        y, H, own = self._seen(x, P, heard)
        silent = np.asarray(~H.any(axis=-1))
        return update_gaussian(x, P, y, H, np.diag(own) if R is None else R, silent, self.inv)

    def _direction(self, x: Float, P: Float) -> tuple[Float, Float]:
        delay, variance = x[..., 0], np.maximum(P[..., 0, 0], 0.0)
        return self.measurement.doa(delay), self.measurement.doa_std(delay, np.sqrt(variance))


def _run(doa: Float, std: Float, x: Float, dt: float, elapsed: float) -> Run:
    """Return the run that a recorder would have made of one direction a step."""
    n = len(doa)
    nan = np.full((n, 1), np.nan)
    fields = {
        "doa": doa[:, None],
        "std": std[:, None],
        "existence": nan,
        "amplitude": nan.astype(complex),
        "label": np.zeros((n, 1), dtype=np.int64),
        "converged": np.ones(n, dtype=np.bool_),
        "iterations": np.zeros(n, dtype=np.int64),
        "noise": np.full(n, np.nan),
    }
    ones = np.ones(n, dtype=np.int64)
    return Run(DirectionEstimate, fields, x, ones, dt * np.arange(n, dtype=np.float64), elapsed)
