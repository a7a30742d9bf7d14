"""One source and a line array of real samples: the simulations of the interpolation paper.

Delays are exact: phase shifts of the sinusoids of which the source consists.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from arrivals.measurement_models import ArraySamples, FlatBand, SensorArray, Tones
from arrivals.measurement_models.arrays.sensor_array import direction
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation
from arrivals.motion_models import DelayWalk
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.typing import Complex, Float
from arrivals.validation import count, number, one_of


@dataclass(frozen=True)
class InterpolationScenario(Scenario):
    """One source of power 1, static or moving at a constant angular rate.

    Parameters
    ----------
    doa_deg : float
        Direction at the first snapshot, degrees.
    end_deg : float, optional
        Direction at the last snapshot; static if None.
    snr_db : float
        Power of the source over that of the noise, one sensor and one sample, dB.
    n_sensors, n_steps : int
        Numbers of sensors and snapshots.
    reference : {"first", "centre"}
        Position at which the waveform is defined: the sensor that a positive angle reaches first,
        as in the paper's (1) and (2), or the array's centre. The waveform of a moving source is
        free of Doppler shift only there.

    Notes
    -----
    Rate and wave speed are 1: times are in samples, and the spacing is the delay between
    neighbours at endfire, half a wavelength of the highest frequency.
    """

    doa_deg: float = 60.0
    end_deg: float | None = None
    snr_db: float = 5.0
    n_sensors: int = 10
    n_steps: int = 100
    reference: Literal["first", "centre"] = "first"

    def __post_init__(self) -> None:
        for name in ("doa_deg", "end_deg"):
            value = getattr(self, name)
            if value is not None and not abs(number(name, value)) <= 90:
                raise ValueError(f"{name} must lie within ±90 degrees; got {value}")
        number("snr_db", self.snr_db)
        count("n_sensors", self.n_sensors, minimum=2)
        count("n_steps", self.n_steps)
        one_of("reference", self.reference, ("first", "centre"))

    @property
    @abstractmethod
    def correlation(self) -> SourceCorrelation:
        """Correlation of the source's waveform."""

    @abstractmethod
    def sinusoids(self, rng: np.random.Generator) -> tuple[Float, Complex]:
        """Draw frequencies, cycles per sample, and complex amplitudes of the source."""

    @property
    def measurement(self) -> ArraySamples:
        """The array, with a spacing of half a wavelength of the highest frequency."""
        spacing = 0.5 / self.correlation.highest
        array = SensorArray.ula(self.n_sensors, spacing, speed=1.0)
        return ArraySamples(array, 1.0, self.correlation, self.snr_db, power=1.0)

    def truth(self) -> Float:
        """Return the direction, rad, (n_steps, 1)."""
        end = self.doa_deg if self.end_deg is None else self.end_deg
        return np.deg2rad(np.linspace(self.doa_deg, end, self.n_steps))[:, None]

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial."""
        model, truth = self.measurement, self.truth()
        doa = truth[:1, 0] if self.end_deg is None else truth[:, 0]  # static: one row
        positions = model.array.positions
        if self.reference == "first":
            positions = positions - positions.max()
        lead = direction(doa, 1) @ positions.T
        waveforms = received_waveforms(*self.sinusoids(rng), lead, self.n_steps)
        noise = rng.standard_normal(waveforms.shape) * np.sqrt(model.noise_ratio)
        return Trial(waveforms + noise, truth, model, DelayWalk())


def received_waveforms(frequencies: Float, amplitudes: Complex, lead: Float, n_steps: int) -> Float:
    """Return a sum of sinusoids Re Σ a exp(j2πf (k + lead)) at sensors, (n_steps, n_sensors).

    Parameters
    ----------
    frequencies, amplitudes : ndarray, shape (n,)
        Cycles per sample, and complex amplitudes.
    lead : ndarray, shape (n_steps, n_sensors) or (1, n_sensors)
        Time of arrival at the origin minus that at each sensor, samples.
    n_steps : int
        Number of samples.

    Examples
    --------
    >>> lead = np.array([[0.0, 1.0]])
    >>> received_waveforms(np.array([0.25]), np.array([1.0]), lead, 2).round(6) + 0.0
    array([[ 1.,  0.],
           [ 0., -1.]])
    """
    k = np.arange(n_steps)
    carriers = np.exp(2j * np.pi * np.multiply.outer(k, frequencies)) * amplitudes
    shifts = np.exp(2j * np.pi * np.multiply.outer(lead, frequencies))
    return np.asarray((shifts @ carriers[..., None])[..., 0].real)


@register("interpolation_tone")
@dataclass(frozen=True)
class InterpolationTone(InterpolationScenario):
    """A tone of random phase.

    Parameters
    ----------
    doa_deg, snr_db : float
        As in `InterpolationScenario`.
    end_deg : float, optional
        As in `InterpolationScenario`.
    n_sensors, n_steps : int
        As in `InterpolationScenario`.
    reference : {"first", "centre"}
        As in `InterpolationScenario`.
    frequency : float
        Cycles per sample.

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, section 4, in one reading: the paper omits its
    frequencies and its numbers of sensors and snapshots.

    Examples
    --------
    >>> trial = InterpolationTone(doa_deg=60.0).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.measurement.kappa
    ((100, 10), 2.0)
    """

    frequency: float = 0.25

    @property
    def correlation(self) -> Tones:
        """Correlation of the tone."""
        return Tones(self.frequency)

    def sinusoids(self, rng: np.random.Generator) -> tuple[Float, Complex]:
        """Draw the phase."""
        phase = np.exp(2j * np.pi * rng.random(1))
        return np.array([self.frequency]), np.sqrt(2) * phase


@register("interpolation_band")
@dataclass(frozen=True)
class InterpolationBand(InterpolationScenario):
    """Gaussian noise with a flat spectrum between two frequencies.

    Parameters
    ----------
    doa_deg, snr_db : float
        As in `InterpolationScenario`.
    end_deg : float, optional
        As in `InterpolationScenario`.
    n_sensors, n_steps : int
        As in `InterpolationScenario`.
    reference : {"first", "centre"}
        As in `InterpolationScenario`.
    low, high : float
        Edges of the band, cycles per sample.

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, section 2, text under (4).

    Examples
    --------
    >>> trial = InterpolationBand(n_steps=20).sample(np.random.default_rng(0))
    >>> trial.measurements.shape
    (20, 10)
    """

    low: float = 0.15
    high: float = 0.35

    @property
    def correlation(self) -> FlatBand:
        """Correlation of the band."""
        return FlatBand(self.low, self.high)

    def sinusoids(self, rng: np.random.Generator) -> tuple[Float, Complex]:
        """Draw one sinusoid in each of many narrow cells: no period within the record."""
        n = max(400, 2 * self.n_steps)
        frequencies = self.low + (self.high - self.low) * (np.arange(n) + rng.random(n)) / n
        re, im = rng.standard_normal((2, n)) / np.sqrt(n)
        return frequencies, re + 1j * im


@register("interpolation_qpc")
@dataclass(frozen=True)
class InterpolationCoupled(InterpolationScenario):
    """Three equal tones, the third with the sums of the others' frequencies and phases.

    Parameters
    ----------
    doa_deg, snr_db : float
        As in `InterpolationScenario`.
    end_deg : float, optional
        As in `InterpolationScenario`.
    n_sensors, n_steps : int
        As in `InterpolationScenario`.
    reference : {"first", "centre"}
        As in `InterpolationScenario`.
    first, second : float
        Frequencies of two tones, cycles per sample.

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, section 4: "quadratic coupled signals".

    Examples
    --------
    >>> InterpolationCoupled().correlation.frequencies
    (0.1, 0.15, 0.25)
    """

    first: float = 0.1
    second: float = 0.15

    @property
    def correlation(self) -> Tones:
        """Correlation of three tones; second-order statistics do not show the coupling."""
        return Tones((self.first, self.second, self.first + self.second))

    def sinusoids(self, rng: np.random.Generator) -> tuple[Float, Complex]:
        """Draw two phases; the third is their sum."""
        phases = 2 * np.pi * rng.random(2)
        amplitudes = np.sqrt(2 / 3) * np.exp(1j * np.append(phases, phases.sum()))
        return np.asarray(self.correlation.frequencies), amplitudes
