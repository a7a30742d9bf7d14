"""Directions and signals of autoregressive sources: Kalman filter and regularised QRD-RLS."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.autoregressive import AutoregressiveSources
from arrivals.trackers.autoregressive.belief import (
    Settings,
    SourceBelief,
    covariance_outside,
    inside,
    measured,
    outside,
    repeated,
)
from arrivals.trackers.autoregressive.history import History, closes
from arrivals.trackers.autoregressive.processing import (
    NOTHING,
    BlockProcessor,
    frame,
    frames,
    wanted,
)
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import SourceEstimate
from arrivals.trackers.registry import register
from arrivals.trackers.run import Run
from arrivals.typing import Complex, Float
from arrivals.validation import count, covariance, instance, not_negative, positive, real, shaped

SEPARATE = 1e-6  # rad


@register("ar_kalman_qrd_rls")
class ARKalmanQRDRLS(Tracker):
    """Directions of autoregressive sources, and what each of them sends.

    In each interval of snapshots: a Kalman filter estimates the sources' samples with the present
    directions and AR models; a regression of the snapshots on them gives new directions; one of
    the samples on their past, new AR models. There may be more sources than sensors.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line, symmetric about a centre sensor; its noise is where the estimate of it starts.
    motion : AutoregressiveSources
        Where the estimates of the AR models start; its powers, those that the sources are
        expected to have over a long time, should be right within 10 dB. Real-valued sources are
        heard with half of the noise.
    doa : sequence of float, optional
        Directions to start from, one a source, rad: nearer to their own source than to the next.
        If None, the likeliest places on a grid for the first 60 snapshots or so that are not
        silent by the gate; all placings are tried: 210 of two sources, 2730 of three and 32760
        of four that differ.
    interval : int
        Snapshots N of an interval.
    forgetting, ar_forgetting : float
        λ and λ_a, per snapshot, of directions and AR models.
    ridge, ar_ridge : float
        μ and μ_a, which draw to the present values; in snapshots at a source's long-term power.
    gate : float
        γ: a source below this part of its long-term power is silent, and its direction stays.
    inner : int
        How often an interval is gone through.
    correction : bool
        Whether the covariance of the estimated samples enters the regressions. Without it, the
        plain regression of the report, directions are biased where there is noise.
    adapt_drive, adapt_noise : bool
        Whether to estimate the driving and the measurement noise. A driving noise that is not
        estimated keeps its relation to the source's long-term power, as is right for speech.
    r_start, tau : float
        Noise at the start in terms of the sources' mean power, and in how many intervals it falls
        by e, where acquisition needs it: many sources, or little noise. 0: none.
    memory : float
        Intervals that a source's long-term power is the mean of, pauses included.

    Attributes
    ----------
    x, P : ndarray, shape (dim_x,), (dim_x, dim_x)
        Mean and covariance of the sources' samples, as `motion` arranges them.
    signals : ndarray of complex, shape (interval, n_sources)
        The sources' samples in the last interval; in a `Run`, of all steps.

    Raises
    ------
    ValueError
        If the array is not symmetric or ambiguous, an AR order is longer than the interval, two
        initial directions coincide, or a parameter is out of range.

    Notes
    -----
    A measurement is a complex snapshot, (n_sensors,), NaN where a sensor gave none, and None for
    one that is missing. The belief moves at the end of an interval; if the last snapshot of it is
    missing, at the next `predict`. `dt` is the time between snapshots, in any unit.

    Labels are the sources' numbers in `motion`. `std` is NaN. `existence` is 1 for a source that
    sounded in the last interval and 0 for a silent one, where there is a gate, else NaN.

    A pair of sensors one of which is missing is left out of that snapshot.

    References
    ----------
    Gu, Chan, Zhu and Swamy, IEEE TCAS-II 60(1), 46-50, 2013. The covariance rows, the targets of
    the regularisation, the gate and the noise estimates: ours.

    Examples
    --------
    Three sources on three sensors:

    >>> from arrivals.measurement_models import SensorArray
    >>> motion = AutoregressiveSources([[0.77, -0.45], [0.96, -0.77], [-1.2, -0.72]]).scaled(1.0)
    >>> model = ArraySnapshot(SensorArray.symmetric([0.5]), wavelength=1.0, noise=0.1)
    >>> rng, x, s = np.random.default_rng(0), np.zeros(motion.dim_x), []
    >>> for _ in range(3000):
    ...     x = motion.sample(x, rng)
    ...     s.append(motion.signals(x))
    >>> z = model.simulate(np.deg2rad([-35.0, 5.0, 40.0]), s, rng)
    >>> tracker = ARKalmanQRDRLS(model, motion, doa=np.deg2rad([-32.0, 2.0, 43.0]))
    >>> run = tracker.run(z)
    >>> bool(abs(np.rad2deg(run.doa[-1]) - [-35, 5, 40]).max() < 1), run.signals.shape
    (True, (3000, 3))
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        motion: AutoregressiveSources = AutoregressiveSources(((0.0, 0.0), (0.0, 0.0))),  # noqa: B008  (models are immutable)
        *,
        doa: Sequence[float] | Float | None = None,
        interval: int = 30,
        forgetting: float = 0.98,
        ar_forgetting: float = 0.998,
        ridge: float = 0.01,
        ar_ridge: float = 0.01,
        gate: float = 0.0,
        inner: int = 1,
        correction: bool = True,
        adapt_drive: bool = True,
        adapt_noise: bool = True,
        r_start: float = 0.0,
        tau: float = 25.0,
        memory: float = 1000.0,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.motion = instance("motion", motion, AutoregressiveSources)
        self.doa, self.interval = doa, count("interval", interval)
        self.forgetting, self.ar_forgetting = forgetting, ar_forgetting
        self.ridge, self.ar_ridge = positive("ridge", ridge), positive("ar_ridge", ar_ridge)
        self.gate, self.inner = not_negative("gate", gate), count("inner", inner)
        self.correction, self.adapt_drive, self.adapt_noise = correction, adapt_drive, adapt_noise
        self.r_start, self.tau = not_negative("r_start", r_start), positive("tau", tau)
        self.memory = positive("memory", memory)
        _manifold(measurement)  # refuses an array that does not fit
        for name in ("forgetting", "ar_forgetting"):
            if not 0 < positive(name, getattr(self, name)) < 1:
                raise ValueError(f"{name} must lie in (0, 1); got {getattr(self, name)}")
        if max(self.motion.orders) > self.interval:
            raise ValueError(
                f"an AR order must not be longer than the interval, {self.interval} snapshots; "
                f"got {max(self.motion.orders)}"
            )
        if doa is not None:
            _check_directions(doa, self.motion.n_sources)
        self.restart()

    def restart(self) -> None:
        """Forget what was heard, and start again from `doa` and the models."""
        shape = (1, 0, self.measurement.array.n_sensors)
        self.x, self.P = np.zeros(self.motion.dim_x), self.motion.stationary_covariance()
        self._known_x, self._known_P = self.x, self.P
        self._sources = None if self.doa is None else self._program.begun(np.zeros(shape))
        most = wanted(self._sources, self.interval)
        self.frames = np.full((most, shape[-1]), NOTHING)
        self.n_pending = 0
        self.signals = np.full((self.interval, self.motion.n_sources), NOTHING)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Close an interval whose last snapshot was missing; the sources move within intervals."""
        if dt != 1.0:
            positive("dt", dt)
        self._close_if_full()

    def update(self, z: ArrayLike | None) -> None:
        """Take one snapshot, (n_sensors,), complex; with the last of an interval, work it off."""
        new = frame(z, self.measurement.array.n_sensors)
        self._close_if_full()
        self.frames = np.concatenate([self.frames[1:], new[None]])
        self.n_pending += 1
        if self._full() and closes(new):
            self._moved(self._pending())

    @property
    def estimate(self) -> SourceEstimate:
        """Directions, AR models and the latest samples of the sources, as of the last interval."""
        s, n, p = self._sources, self.motion.n_sources, max(self.motion.orders)
        if s is None:
            return SourceEstimate.empty(coefficients=np.zeros((0, p)))
        return SourceEstimate(
            doa=s.doa[0],
            std=np.full(n, np.nan),
            existence=s.active[0].astype(float) if self.gate > 0 else np.full(n, np.nan),
            amplitude=self.motion.signals(self.x),
            label=np.arange(n),
            noise=float(s.r[0]),
            coefficients=s.a[0],
            driving_noise=s.q[0],
        )

    @property
    def coefficients(self) -> Float:
        """AR coefficients, (n_sources, largest order), zero where a source's order is less."""
        return self.motion.padded if self._sources is None else self._sources.a[0]

    @property
    def driving_noise(self) -> Float:
        """Variances of what drives the sources, (n_sources,)."""
        return np.array(self.motion.noise) if self._sources is None else self._sources.q[0]

    @property
    def noise(self) -> float:
        """Variance of the noise of one sensor."""
        return self.measurement.noise if self._sources is None else float(self._sources.r[0])

    @property
    def power(self) -> Float:
        """Long-term powers of the sources, (n_sources,)."""
        return self.motion.power if self._sources is None else self._sources.power[0]

    def run(self, measurements: Iterable[ArrayLike | None], dt: float = 1.0) -> Run:
        """Take snapshots, (n_steps, n_sensors), from the present state, interval by interval.

        Numbers are those of `predict` and `update` for each snapshot. `run.signals` (n_steps,
        n_sources) are the sources' samples; those after the last full interval are provisional:
        they belong to the present directions and models.
        """
        positive("dt", dt)
        started = time.perf_counter()
        z = np.concatenate(
            [self._pending(), frames(measurements, self.measurement.array.n_sensors)]
        )
        history = self._moved(z, open_end=True)
        history.signals.append(self._program.provisional(self._sources, self._pending()[None]))
        return history.run(0, dt, time.perf_counter() - started)

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences at once, as one array program over the leading axis.

        The tracker itself stays as it is.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, n_sensors)
            Sequences of different lengths are run one by one; so are those of which one holds
            nothing to find the first directions in.
        dt : float
            Time between snapshots.
        """
        positive("dt", dt)
        sequences = [frames(each, self.measurement.array.n_sensors) for each in measurements]
        if len({len(z) for z in sequences}) != 1:
            return super().run_batch(sequences, dt)
        started = time.perf_counter()
        z = np.array([np.concatenate([self._pending(), sequence]) for sequence in sequences])
        program, s = self._program, self._now()
        first = measured(z[:, : len(self.frames)], self.manifold, self.motion.n_parts)
        if s is None and program.telling(first) is None:
            return super().run_batch(sequences, dt)
        s = None if s is None else repeated(s, len(z))
        s, done, history = program.history(s, z, self.n_pending)
        history.signals.append(program.provisional(s, z[:, done:]))
        elapsed = (time.perf_counter() - started) / len(z)
        return [history.run(n, dt, elapsed) for n in range(len(z))]

    def set_params(self, **params: Any) -> Self:
        """Change parameters by name; keep the belief where it still fits, else start again."""
        before = self._layout()
        super().set_params(**params)
        if self._layout() != before:
            self.restart()
        return self

    # -- snapshots ---------------------------------------------------------------------------------

    def _pending(self) -> Complex:
        return self.frames[len(self.frames) - self.n_pending :]

    def _layout(self) -> tuple[Any, ...]:
        """Return what the shapes of the belief depend on."""
        motion = self.motion
        return motion.orders, motion.real_valued, self.measurement.array.n_sensors, self.interval

    # -- intervals ---------------------------------------------------------------------------------

    def _full(self) -> bool:
        return self.n_pending == wanted(self._sources, self.interval)

    def _close_if_full(self) -> None:
        if self._full():
            self._moved(self._pending())

    def _moved(self, z: Complex, open_end: bool = False) -> History:
        """Work off snapshots, (n_snapshots, n_sensors), pending ones in front; keep the rest."""
        s, done, history = self._program.history(self._now(), z[None], self.n_pending, open_end)
        if s is not None and history.moved:
            self._sources = s
            self.x = outside(s.x[0], self.motion)
            self.P = covariance_outside(s.P[0], self.motion)
            self._known_x, self._known_P = self.x, self.P
            self.signals = history.signals[-1][0]
        self.n_pending = len(z) - done
        gone = len(self.frames) - self.n_pending
        self.frames = np.concatenate([np.full((gone, z.shape[1]), NOTHING), z[done:]])
        return history

    def _now(self) -> SourceBelief | None:
        """Return the present belief, with `x` and `P` if they were assigned."""
        if self._sources is None or (self.x is self._known_x and self.P is self._known_P):
            return self._sources
        n = self.motion.dim_x
        x, P = inside(shaped("x", self.x, n), covariance("P", self.P, n), self.motion)
        return replace(self._sources, x=x[None], P=P[None])

    @property
    def manifold(self) -> ArrayManifold:
        """The real response of the array."""
        return _manifold(self.measurement)

    @property
    def _program(self) -> BlockProcessor:
        doa = None if self.doa is None else real("doa", self.doa)
        options = Settings(
            self.forgetting, self.ar_forgetting, self.ridge, self.ar_ridge, self.gate, self.inner,
            self.correction, self.adapt_drive, self.adapt_noise, self.r_start, self.tau,
            self.memory,
        )  # fmt: skip
        return BlockProcessor(
            self.motion, self.manifold, self.interval, doa, options, self.x, self.P
        )


@lru_cache(maxsize=64)
def _manifold(model: ArraySnapshot) -> ArrayManifold:
    return ArrayManifold(model.array, model.plain_wavelength("ar_kalman_qrd_rls"), model.noise)


def _check_directions(doa: ArrayLike, n_sources: int) -> None:
    values = shaped("doa", doa, n_sources)
    if not (np.abs(values) <= np.pi / 2).all():
        raise ValueError(f"doa must lie within ±π/2 rad; got {values.tolist()}")
    gaps = np.diff(np.sort(values))
    if len(gaps) and gaps.min() < SEPARATE:
        raise ValueError(
            f"two initial directions must be at least {SEPARATE:g} rad apart, or their sources "
            f"cannot be told from each other; got {values.tolist()}"
        )
