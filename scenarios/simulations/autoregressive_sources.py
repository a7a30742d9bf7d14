"""Autoregressive sources and a symmetric line: the scenes of the report on joint tracking."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import AutoregressiveSources
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.ar_signals import ar_signals
from arrivals.typing import Complex, Float
from arrivals.validation import count, instance, number

BROAD = ((0.772, -0.45), (0.96, -0.77), (-1.2, -0.72), (-0.6, -0.5))


def resonance(frequency: float, radius: float) -> tuple[float, float]:
    """Return the coefficients of an AR(2) process with poles radius · exp(±j2π frequency).

    Examples
    --------
    >>> np.round(resonance(0.25, 0.9), 6) + 0.0
    array([ 0.  , -0.81])
    """
    return (2 * radius * float(np.cos(2 * np.pi * frequency)), -(radius**2))


@dataclass(frozen=True)
class SourceField(Scenario):
    """Sources that move at constant angular rates, and a symmetric line.

    Parameters
    ----------
    doa_deg : sequence of float
        Directions at the first snapshot, degrees.
    end_deg : sequence of float, optional
        Directions at the last snapshot; static if None.
    distances : sequence of float
        Distances of the sensors on either side from the centre, wavelengths.
    snr_db : float
        Power of each source over that of the noise, one sensor, dB.
    centre : bool
        With a sensor in the centre: M distances are 2M + 1 sensors, or 2M without it.
    """

    doa_deg: Sequence[float] = (-20.0, 30.0)
    end_deg: Sequence[float] | None = None
    distances: Sequence[float] = (0.25,)
    snr_db: float = 30.0
    centre: bool = True

    def __post_init__(self) -> None:
        instance("centre", self.centre, bool)
        for name in ("doa_deg", "end_deg", "distances"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, tuple(number(name, v) for v in value))
        for name in ("doa_deg", "end_deg"):
            if any(abs(v) > 90 for v in getattr(self, name) or ()):
                raise ValueError(f"{name} must lie within ±90 degrees; got {getattr(self, name)}")
        if self.end_deg is not None and len(self.end_deg) != len(self.doa_deg):
            raise ValueError(
                f"end_deg must have one direction for each of {len(self.doa_deg)} sources; "
                f"got {self.end_deg}"
            )
        number("snr_db", self.snr_db)
        _ = self.measurement

    @property
    def n_sources(self) -> int:
        """Number of sources."""
        return len(self.doa_deg)

    @property
    def measurement(self) -> ArraySnapshot:
        """The line, and the noise; the wavelength is 1 m."""
        distinct = 1 + 1e-9 * np.arange(len(self.distances))  # the report has two sensors at one
        array = SensorArray.symmetric(np.array(self.distances) * distinct)
        if not self.centre:
            array = SensorArray(array.positions[array.positions[:, 0] != 0])
        return ArraySnapshot(array, wavelength=1.0, noise=10 ** (-self.snr_db / 10))

    def truth(self, n_steps: int) -> Float:
        """Return the directions, rad, (n_steps, n_sources)."""
        end = self.doa_deg if self.end_deg is None else self.end_deg
        return np.deg2rad(np.linspace(self.doa_deg, end, n_steps))

    def make_trial(
        self, signals: Complex | Float, motion: AutoregressiveSources, rng: np.random.Generator
    ) -> Trial:
        """Return a trial of given source signals, (n_steps, n_sources), of power 1."""
        model, truth = self.measurement, self.truth(len(signals))
        return Trial(model.simulate(truth, signals, rng), truth, model, motion, signals=signals)


@register("ar_fig1")
@dataclass(frozen=True)
class AutoregressiveField(SourceField):
    """Two static complex AR(2) sources, three sensors, 30 dB: Figs 1 and 2 of the report.

    Parameters
    ----------
    doa_deg, distances : sequence of float
        As in `SourceField`.
    end_deg : sequence of float, optional
        As in `SourceField`.
    snr_db : float
        As in `SourceField`.
    centre : bool
        As in `SourceField`.
    coefficients : sequence of sequences of float
        AR coefficients of each source, whose power is 1.
    n_intervals, interval : int
        Number of intervals, and of snapshots in each.
    real_valued : bool
        Real sources in place of complex ones.

    References
    ----------
    Magakian, report of 25 April 2024 on Gu, Chan, Zhu and Swamy, IEEE TCAS-II 60(1), 2013.

    Examples
    --------
    >>> trial = AutoregressiveField(n_intervals=10).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.signals.shape, trial.motion.orders
    ((300, 3), (300, 2), (2, 2))
    """

    coefficients: Sequence[Sequence[float]] = BROAD[:2]
    n_intervals: int = 200
    interval: int = 30
    real_valued: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        rows = tuple(tuple(float(a) for a in row) for row in self.coefficients)
        object.__setattr__(self, "coefficients", rows)
        if len(rows) != self.n_sources:
            raise ValueError(
                f"coefficients must be one list for each of {self.n_sources} sources; "
                f"got {len(rows)}"
            )
        count("n_intervals", self.n_intervals)
        count("interval", self.interval)
        _ = self.motion

    @property
    def motion(self) -> AutoregressiveSources:
        """The sources' processes, of power 1."""
        return AutoregressiveSources(self.coefficients, 1.0, self.real_valued).scaled(1.0)

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial."""
        motion = self.motion
        signals = ar_signals(
            list(motion.coefficients), motion.noise, self.n_intervals * self.interval, rng,
            complex_valued=not self.real_valued,
        )  # fmt: skip
        return self.make_trial(signals, motion, rng)


@register("ar_fig3")
@dataclass(frozen=True)
class FastSource(AutoregressiveField):
    """One source moving from 40 to 0 degrees, intervals of 3 snapshots, 10 dB: Fig. 3.

    The report's distances, `distances=(0.5, 0.5)`, are two sensors at one position.

    References
    ----------
    As in `AutoregressiveField`.

    Examples
    --------
    >>> trial = FastSource().sample(np.random.default_rng(0))
    >>> np.rad2deg(trial.truth[[0, -1]]).round(1)
    array([[ 40., -20.],
           [  0., -20.]])
    """

    doa_deg: Sequence[float] = (40.0, -20.0)
    end_deg: Sequence[float] | None = (0.0, -20.0)
    distances: Sequence[float] = (0.5, 1.0)
    snr_db: float = 10.0
    interval: int = 3


@register("ar_fig4")
@dataclass(frozen=True)
class MovingSource(FastSource):
    """The same with intervals of 30 snapshots, 30 dB: Fig. 4.

    References
    ----------
    As in `AutoregressiveField`.

    Examples
    --------
    >>> MovingSource(n_intervals=5).sample(np.random.default_rng(0)).measurements.shape
    (150, 5)
    """

    snr_db: float = 30.0
    interval: int = 30


@register("ar_fig5")
@dataclass(frozen=True)
class NoisySources(AutoregressiveField):
    """Two static sources, three sensors, 10 dB (and 5 and 1): Fig. 5.

    References
    ----------
    As in `AutoregressiveField`.

    Examples
    --------
    >>> NoisySources().replace(snr_db=5.0).measurement.noise
    0.31622776601683794
    """

    snr_db: float = 10.0


@register("ar_fig6")
@dataclass(frozen=True)
class MoreSensors(AutoregressiveField):
    """Two static sources, M = 2 (and 3 and 4) sensors on either side, 10 dB: Fig. 6.

    References
    ----------
    As in `AutoregressiveField`.

    Examples
    --------
    >>> MoreSensors(distances=(0.25, 0.5, 0.75)).measurement.array.n_sensors
    7
    """

    distances: Sequence[float] = (0.25, 0.5)
    snr_db: float = 10.0


@register("ar_fig7")
@dataclass(frozen=True)
class ThirdOrder(AutoregressiveField):
    """Two static AR(3) sources: Fig. 7. The report omits their coefficients.

    References
    ----------
    As in `AutoregressiveField`.

    Examples
    --------
    >>> ThirdOrder().motion.orders
    (3, 3)
    """

    coefficients: Sequence[Sequence[float]] = ((0.772, -0.45, 0.2), (0.96, -0.77, 0.2))


@register("ar_three_on_three")
@dataclass(frozen=True)
class ThreeOnThree(AutoregressiveField):
    """Three sources and three sensors, more than subspace methods resolve.

    Examples
    --------
    >>> scene = ThreeOnThree()
    >>> scene.n_sources, scene.measurement.array.n_sensors
    (3, 3)
    """

    doa_deg: Sequence[float] = (-35.0, 5.0, 40.0)
    distances: Sequence[float] = (0.5,)
    snr_db: float = 10.0
    coefficients: Sequence[Sequence[float]] = BROAD[:3]


@register("ar_four_on_three")
@dataclass(frozen=True)
class FourOnThree(AutoregressiveField):
    """Four narrow-band sources and three sensors.

    Examples
    --------
    >>> scene = FourOnThree()
    >>> scene.n_sources, scene.measurement.array.n_sensors
    (4, 3)
    """

    doa_deg: Sequence[float] = (-45.0, -10.0, 20.0, 55.0)
    snr_db: float = 10.0
    coefficients: Sequence[Sequence[float]] = tuple(
        resonance(f, 0.97) for f in (0.05, 0.15, 0.28, 0.40)
    )
