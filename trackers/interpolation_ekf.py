"""One direction from real samples, through the delay between neighbouring sensors."""

from __future__ import annotations

import copy
import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from arrivals.checks import count, instance, not_negative, number, one_of, positive
from arrivals.measurement_models.correlation import SourceCorrelation, Tones
from arrivals.measurement_models.delay_line import DelayLine, Phasor, SourceAtCentre
from arrivals.measurement_models.interpolation import (
    DelayInterpolator,
    InterpolationDelay,
    window,
)
from arrivals.measurement_models.samples import ArraySamples
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.delay import DelayWalk
from arrivals.motion_models.linear import LinearMotion
from arrivals.motion_models.stacked import Stacked
from arrivals.trackers.base import Tracker, missed
from arrivals.trackers.delay_updates import AllSensors, Neighbours, move
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.recorder import Run
from arrivals.trackers.registry import register
from arrivals.typing import Float

Variant: TypeAlias = Literal["B", "Bw", "C", "D", "E", "E2", "phasor"]
LOBE = 0.12  # of κ: the largest standard deviation of a delay that the joint filters start from


@dataclass(frozen=True)
class Recipe:
    """What a variant is made of; None leaves the choice to the source and the array."""

    offsets: tuple[int, ...] | None = None
    loading: float | None = None
    baselines: tuple[int, ...] = (1,)
    both_ways: bool = False
    joint: Literal["delay_line", "phasor"] | None = None
    acquire: bool = False


VARIANTS: dict[str, Recipe] = {
    "B": Recipe(offsets=(0, 1), loading=0.0),
    "Bw": Recipe(offsets=(0, 1)),
    "C": Recipe(both_ways=True),
    "D": Recipe(baselines=(1, 2, 4, 7)),
    "E": Recipe(joint="delay_line"),
    "E2": Recipe(both_ways=True, joint="delay_line", acquire=True),
    "phasor": Recipe(joint="phasor"),
}


@register("interpolation_ekf")
class InterpolationEKF(Tracker):
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
    offsets, loading, baselines, both_ways : optional
        In place of the variant's own: taps (of baseline 1), ε_c, distances in sensors between
        which is interpolated, and whether backwards too.
    each_sensor : bool
        Take new coefficients at every sensor instead of at every snapshot.
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

    The index of the paper's (3) and (11) is one sample off (4); offsets (0, 1) follow (4).

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, "Performance evaluation of an algorithm for
    estimation of DOA using model estimation technique", (9)-(22). Variants other than "B": ours.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> array = SensorArray.ula(10, spacing=0.5, speed=1000.0)
    >>> model = ArraySamples(array, rate=4000.0, correlation=Tones(0.25), snr_db=20.0)
    >>> lag = model.places * model.delay(np.deg2rad(40.0))
    >>> z = np.cos(np.pi / 2 * (np.arange(30)[:, None] - lag))
    >>> tracker = InterpolationEKF(model, doa=np.deg2rad(30.0))
    >>> np.rad2deg(tracker.run(z).doa[-1]).round(1), tracker.latency
    (array([40.]), 3)
    """

    def __init__(
        self,
        measurement: ArraySamples,
        motion: MotionModel = DelayWalk(),  # noqa: B008  (models are immutable)
        *,
        variant: Variant = "C",
        doa: float = 0.0,
        std: float | None = None,
        rate_std: float = np.deg2rad(0.2),
        offsets: Sequence[int] | None = None,
        loading: float | None = None,
        baselines: Sequence[int] | None = None,
        both_ways: bool | None = None,
        each_sensor: bool = False,
        aligned: bool = False,
        drive: float | None = None,
        acquisition: int = 25,
        gate: float | None = None,
        extrapolate: bool = False,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySamples)
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        self.variant: Variant = one_of("variant", variant, tuple(VARIANTS))  # type: ignore[arg-type]  # its keys
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
        self.frames = np.full((parts.span, parts.n_places), np.nan)
        self.n_snapshots = 0
        self.n_heard, self.energy = np.zeros(()), np.zeros(())

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Move the delay, and the source's waveform if it is part of the state."""
        motion = self.state_motion
        F = motion.F(np.zeros(motion.dim_x), dt)
        self.x, self.P = move(self.x, self.P, F, motion.Q(dt))

    def update(self, z: ArrayLike | None) -> None:
        """Correct the delay by one snapshot, (n_sensors,), real; leave out what is NaN."""
        n = self.measurement.array.n_sensors
        snapshot = np.full(n, np.nan) if z is None or missed(z) else np.asarray(z)
        if snapshot.ndim != 1:
            raise ValueError(f"a snapshot must have shape ({n},); got {snapshot.shape}")
        self._hear(self.measurement.frame(snapshot))

    @property
    def estimate(self) -> DirectionEstimate:
        """The direction, and the filter's own standard deviation of it."""
        doa, std = self._direction(self.x, self.P)
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
        filters = copy.copy(self)
        for name in ("x", "P", "frames", "n_heard", "energy"):
            value = getattr(self, name)
            setattr(filters, name, np.broadcast_to(value, frames.shape[:-2] + value.shape))
        xs = np.empty((*frames.shape[:-1], self.x.size))
        Ps = np.empty((*frames.shape[:-1], self.x.size, self.x.size))
        for k in range(frames.shape[-2]):
            filters.predict(dt=dt)
            filters._hear(frames[..., k, :])
            xs[..., k, :], Ps[..., k, :, :] = filters.x, filters.P
        return xs, Ps

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name; keep the belief where it still fits, else start again."""
        super().set_params(**params)
        parts = self._parts
        if self.frames.shape != (parts.span, parts.n_places) or len(self.x) != parts.motion.dim_x:
            self.restart()
        return self

    # -- what the parameters amount to ---------------------------------------------------------

    @property
    def recipe(self) -> Recipe:
        """What the variant is made of, with the parameters given in its place."""
        own = VARIANTS[self.variant]
        return replace(
            own,
            offsets=own.offsets if self.offsets is None else tuple(self.offsets),
            loading=own.loading if self.loading is None else self.loading,
            baselines=own.baselines if self.baselines is None else tuple(self.baselines),
            both_ways=own.both_ways if self.both_ways is None else self.both_ways,
        )

    @property
    def _parts(self) -> _Parts:
        """The models that do the work; the same ones as long as no parameter changes."""
        return _assembled(
            self.measurement, self.motion, self.recipe, self.each_sensor, self.aligned,
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

    def _hear(self, frame: Float) -> None:
        """Correct beliefs by snapshots, (..., n_places)."""
        parts, n = self._parts, self.n_snapshots + 1
        frames = np.concatenate([self.frames[..., 1:, :], frame[..., None, :]], axis=-2)
        n_heard = self.n_heard + np.isfinite(frame).sum(axis=-1)
        energy = self.energy + np.nansum(frame * frame, axis=-1)
        scaled = frames / np.sqrt(self._power(energy, n_heard))[..., None, None]
        acquiring = parts.acquire is not None and n <= self.acquisition
        stage = parts.acquire if parts.acquire is not None and acquiring else parts.last
        x, P = stage.update(self.x, self.P, scaled)
        if acquiring and n == self.acquisition:
            x, P = parts.replayed(x, P, scaled[..., -n:, :])
        self.x, self.P, self.frames = x, P, frames
        self.n_snapshots, self.n_heard, self.energy = n, n_heard, energy

    def _power(self, energy: Float, n_heard: Float) -> Float:
        """Return the source's power, given or learned: total power over 1 + ε."""
        if self.measurement.power is not None:
            return np.full(energy.shape, self.measurement.power)
        mean = energy / np.maximum(n_heard, 1)
        return np.maximum(mean / (1 + self.measurement.noise_ratio), np.finfo(float).tiny)

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


@dataclass(frozen=True)
class _Parts:
    """The models that a recipe makes of a source, an array and a motion."""

    motion: MotionModel
    acquire: Neighbours | None
    last: Neighbours | AllSensors
    kappa: float
    n_places: int
    acquisition: int

    @property
    def joint(self) -> SourceAtCentre | None:
        return self.last.line if isinstance(self.last, AllSensors) else None

    @property
    def n_delay(self) -> int:
        """Elements of the state that come before the source's."""
        return self.motion.dim_x - (0 if self.joint is None else self.joint.dim_source)

    @property
    def span(self) -> int:
        return self.last.span if self.acquire is None else max(self.acquire.span, self.acquisition)

    def start(self, delay: float, variance: float, rate_std: float) -> tuple[Float, Float]:
        """Return the belief before anything is heard."""
        x, P = np.zeros(self.motion.dim_x), np.zeros((self.motion.dim_x, self.motion.dim_x))
        P[np.diag_indices(self.n_delay)] = (self.kappa * rate_std) ** 2
        x[0], P[0, 0] = delay, variance
        if self.joint is not None:
            P[self.n_delay :, self.n_delay :] = self.joint.covariance
        return x, P

    def replayed(self, x: Float, P: Float, frames: Float) -> tuple[Float, Float]:
        """Start the joint filter where acquisition ended, and let it hear `frames` again."""
        n = self.n_delay
        fresh, prior = self.start(0.0, 0.0, 0.0)
        fresh, prior = np.zeros_like(x) + fresh, np.zeros_like(P) + prior
        fresh[..., :n], prior[..., :n, :n] = x[..., :n], P[..., :n, :n]
        prior[..., 0, 0] = np.minimum(2 * P[..., 0, 0], (LOBE * self.kappa) ** 2)
        x, P = fresh, prior
        F, Q = self.motion.F(np.zeros(self.motion.dim_x)), self.motion.Q()
        for k in range(frames.shape[-2]):
            x, P = self.last.update(*move(x, P, F, Q), frames[..., k : k + 1, :])
        return x, P


@lru_cache(maxsize=128)
def _assembled(
    measurement: ArraySamples,
    motion: MotionModel,
    recipe: Recipe,
    each_sensor: bool,
    aligned: bool,
    drive: float | None,
    acquisition: int,
    gate: float | None,
    extrapolate: bool,
) -> _Parts:
    """Build the parts of a recipe."""
    kappa, n_places = measurement.kappa, measurement.n_places
    line = _line(measurement, recipe, drive)
    looks, highest = _looks(measurement, recipe, extrapolate), measurement.correlation.highest
    neighbours = Neighbours(looks, kappa, highest, each_sensor, aligned, gate)
    if line is None:
        return _Parts(motion, None, neighbours, kappa, n_places, acquisition)
    both = Stacked(motion, LinearMotion(line.transition, line.innovation))
    first = neighbours if recipe.acquire else None
    return _Parts(both, first, AllSensors(line, kappa, gate), kappa, n_places, acquisition)


def _line(measurement: ArraySamples, recipe: Recipe, drive: float | None) -> SourceAtCentre | None:
    n, ratio, source = measurement.n_places, measurement.noise_ratio, measurement.correlation
    if recipe.joint is None:
        return None
    if recipe.joint == "delay_line":
        return DelayLine(n, ratio, source, measurement.kappa, drive)
    if not isinstance(source, Tones) or source.order != 2:
        raise ValueError(f"variant 'phasor' is for one tone; the source is {source!r}")
    return Phasor(n, ratio, source.highest, 1e-2 if drive is None else drive)


def _looks(
    measurement: ArraySamples, recipe: Recipe, extrapolate: bool
) -> tuple[InterpolationDelay, ...]:
    """Return the models of all baselines, forwards and, if wanted, backwards."""
    source, kappa, ratio = measurement.correlation, measurement.kappa, measurement.noise_ratio
    loading = ratio if recipe.loading is None else not_negative("loading", recipe.loading)
    looks = []
    for m in recipe.baselines:
        if m >= measurement.n_places:
            continue
        own = recipe.offsets if m == 1 else None
        offsets = window(m * kappa) if own is None else own
        if not extrapolate:
            _check_reach(source, offsets, m * kappa)
        taps = DelayInterpolator(source, offsets, loading)
        inflation = 3.0 if len(recipe.baselines) > 1 else 1.0
        looks += [
            InterpolationDelay(taps, measurement.n_places, ratio, way * m, inflation)
            for way in ((1, -1) if recipe.both_ways else (1,))
        ]
    return tuple(looks)


def _check_reach(source: SourceCorrelation, offsets: tuple[int, ...], reach: float) -> None:
    """Refuse taps that would have to extrapolate; tones may, it is exact for them."""
    exact = source.order is not None and len(offsets) >= source.order
    if not exact and not min(offsets) - 1 <= -reach + 1e-9 <= reach - 1e-9 <= max(offsets):
        raise ValueError(
            f"delays reach ±{reach:.4g} samples, which taps {offsets} cannot serve on this "
            f"source: use offsets={window(reach)}"
        )
