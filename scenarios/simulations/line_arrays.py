"""Moving sources and a half-wavelength line array: the simulations of SVALSE's paper.

Amplitudes are redrawn at every step, and the noise of a step is proportional to the sources' power
in that step, so that the signal-to-noise ratio is the same in every snapshot.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, number, real


@dataclass(frozen=True)
class LineScenario(Scenario):
    """Sources and a half-wavelength line array.

    Parameters
    ----------
    snr_db : float
        Summed power of the sources over that of the noise, at one sensor, dB: the paper's (69)
        for sources at different directions, held in every snapshot. Beamforming towards one source
        gains 10 lg `n_sensors` more.
    n_sensors, n_steps : int
        Numbers of sensors and time steps.
    """

    snr_db: float = 20.0
    n_sensors: int = 15
    n_steps: int = 50

    def __post_init__(self) -> None:
        number("snr_db", self.snr_db)
        count("n_sensors", self.n_sensors, minimum=2)
        count("n_steps", self.n_steps)

    @property
    def measurement(self) -> ArraySnapshot:
        """The array at a wavelength of 1 m."""
        return ArraySnapshot(SensorArray.ula(self.n_sensors, spacing=0.5), wavelength=1.0)

    @abstractmethod
    def doa_deg(self) -> Float:
        """Return the directions, degrees, (n_steps, n_sources), active or not."""

    def active(self, rng: np.random.Generator) -> Bool:
        """Draw the active sources, (n_steps, n_sources); all by default."""
        return np.ones(self.doa_deg().shape, dtype=np.bool_)

    def amplitudes(self, rng: np.random.Generator) -> Complex:
        """Draw complex amplitudes α ~ CN(0, 1), (n_steps, n_sources), for unit-norm steering."""
        return complex_normal(rng, self.doa_deg().shape)

    def signals(self, rng: np.random.Generator) -> tuple[Float, Complex, Float]:
        """Draw directions, amplitudes at a sensor, and noise variances."""
        active = self.active(rng)
        alpha = np.where(active, self.amplitudes(rng), 0)
        truth = np.where(active, np.deg2rad(self.doa_deg()), np.nan)
        power = (np.abs(alpha) ** 2).sum(axis=1) / self.n_sensors
        noise = 10 ** (-self.snr_db / 10) * power
        return truth, alpha / np.sqrt(self.n_sensors), noise

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial."""
        truth, amplitude, noise = self.signals(rng)
        model = self.measurement
        waves = model.wave(truth, amplitude)
        u = np.sqrt(noise)[:, None] * complex_normal(rng, waves.shape)
        motion = BernoulliVonMises(sigma_doa=np.deg2rad(1.5), still=0.1)
        return Trial(waves + u, truth, model, motion)


def complex_normal(rng: np.random.Generator, shape: tuple[int, ...]) -> Complex:
    """Draw circular complex normal numbers of variance 1.

    Examples
    --------
    >>> complex_normal(np.random.default_rng(0), (2, 3)).shape
    (2, 3)
    """
    re, im = rng.standard_normal((2, *shape)) / np.sqrt(2)
    return np.asarray(re + 1j * im)


@register("static")
@dataclass(frozen=True)
class StaticSources(LineScenario):
    """Static sources at chosen directions.

    Parameters
    ----------
    doas : sequence of float
        Directions, degrees from broadside.

    Examples
    --------
    >>> trial = StaticSources(doas=(-10.0, 20.0), n_steps=3).sample(np.random.default_rng(0))
    >>> np.rad2deg(trial.truth[-1]).round(6)
    array([-10.,  20.])
    """

    doas: Sequence[float] = (20.0,)

    def __post_init__(self) -> None:
        super().__post_init__()
        doas = np.asarray(real("doas", self.doas))
        if doas.ndim != 1 or not doas.size or not (np.abs(doas) <= 90).all():
            raise ValueError(f"doas must be directions in [-90, 90] degrees; got {self.doas}")

    def doa_deg(self) -> Float:
        """Return the directions, degrees."""
        return np.tile(np.asarray(self.doas, dtype=np.float64), (self.n_steps, 1))


@register("svalse_scenario2")
@dataclass(frozen=True)
class SixStatic(LineScenario):
    """Six static sources at -70, -55, -40, 35, 50 and 65 degrees.

    Parameters
    ----------
    offset_deg : float
        Added to all directions, degrees; 0.25 is halfway between the directions of `SBL`.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, Figs 9 and 10 (scenario 2).
    """

    offset_deg: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        number("offset_deg", self.offset_deg)

    def doa_deg(self) -> Float:
        """Return the directions, degrees."""
        doa = np.array([-70.0, -55.0, -40.0, 35.0, 50.0, 65.0]) + self.offset_deg
        return np.tile(doa, (self.n_steps, 1))


@register("svalse_scenario1")
@dataclass(frozen=True)
class ThreeStatic(LineScenario):
    """Three static sources at -3, 2 and 60 degrees, of amplitude 10 and random phases.

    Parameters
    ----------
    offset_deg : float
        Added to all directions, degrees; 0.25 is halfway between the directions of `SBL`.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, Figs 8 and 10 (scenario 1).
    """

    offset_deg: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        number("offset_deg", self.offset_deg)

    def doa_deg(self) -> Float:
        """Return the directions, degrees."""
        return np.tile(np.array([-3.0, 2.0, 60.0]) + self.offset_deg, (self.n_steps, 1))

    def amplitudes(self, rng: np.random.Generator) -> Complex:
        """Draw 10 exp(jφ), φ uniform."""
        return np.asarray(10 * np.exp(2j * np.pi * rng.random(self.doa_deg().shape)))


@register("svalse_fig4")
@dataclass(frozen=True)
class SixSources(SixStatic):
    """Six sources, of which the third and the fourth move and cross.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, Fig. 4.

    Examples
    --------
    >>> trial = SixSources(snr_db=20.0).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, np.rad2deg(trial.truth[0]).round(1)
    ((50, 15), array([-70. , -55. , -33.9,  35. ,  50. ,  65. ]))
    """

    def doa_deg(self) -> Float:
        """Return the directions, degrees: -40 + 80/(1 + exp(-0.1 (n - 25))) and 35 - n move."""
        n = np.arange(self.n_steps)
        doa = super().doa_deg()
        doa[:, 2] += 80 / (1 + np.exp(-0.1 * (n - 25)))
        doa[:, 3] -= n
        return doa


@register("svalse_fig5")
@dataclass(frozen=True)
class RandomPairsOff(SixSources):
    """The six sources, of which a random pair is inactive, redrawn at every step but the first.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, Fig. 5, in one reading of its caption.
    """

    def active(self, rng: np.random.Generator) -> Bool:
        """Draw two inactive sources for each step."""
        active = super().active(rng)
        off = np.argsort(rng.random(active.shape), axis=1)[:, :2]
        np.put_along_axis(active, off, values=False, axis=1)
        active[0] = True
        return active


@register("svalse_fig5b")
@dataclass(frozen=True)
class OnePairOff(SixSources):
    """The six sources, of which one random pair is inactive from the second step on.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, Fig. 5, in the other reading of its caption.
    """

    def active(self, rng: np.random.Generator) -> Bool:
        """Draw two sources that are inactive after the first step."""
        active = super().active(rng)
        active[1:, rng.permutation(6)[:2]] = False
        return active


@register("svalse_fig6")
@dataclass(frozen=True)
class PairsInTurn(SixSources):
    """The six sources, of which neighbouring pairs are inactive in steps 1-15, 16-30 and 31-50.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, Fig. 6.
    """

    def active(self, rng: np.random.Generator) -> Bool:
        """Return all sources without 50 and 65°, then the moving ones, then -70 and -55°."""
        active = super().active(rng)
        active[:15, 4:] = False
        active[15:30, 2:4] = False
        active[30:, :2] = False
        return active
