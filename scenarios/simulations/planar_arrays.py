"""Sources and circular, directional and sparse arrays, with one or several snapshots a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.line_arrays import complex_normal
from arrivals.typing import Complex, Float
from arrivals.validation import count, number, one_of, positive

LOWEST_FREQUENCY = 0.6  # of several bins, relative to the highest


def bins(n_bins: int) -> list[float]:
    """Return wavelengths, m, of frequencies from 0.6 to 1 relative to a wavelength of 1 m.

    Examples
    --------
    >>> bins(1), [round(wavelength, 2) for wavelength in bins(3)]
    ([1.0], [1.67, 1.25, 1.0])
    """
    if n_bins == 1:
        return [1.0]
    return [1 / f for f in np.linspace(LOWEST_FREQUENCY, 1.0, count("n_bins", n_bins)).tolist()]


def simulate_snapshots(
    model: ArraySnapshot,
    truth: Float,
    snr_db: float,
    rng: np.random.Generator,
    *,
    received: bool = False,
) -> Complex:
    """Draw amplitudes ~ CN(0, 1) for every snapshot, and noise relative to their power in it.

    Parameters
    ----------
    model : ArraySnapshot
        Array, wavelengths and numbers of bins and snapshots.
    truth : ndarray, shape (n_steps, n_sources)
        Directions, rad; NaN while a source is inactive.
    snr_db : float
        Summed power of the sources over the noise power of one sensor, dB.
    rng : numpy.random.Generator
        Source of random numbers.
    received : bool
        Use the mean power received by the sensors in place of the sources' power.

    Returns
    -------
    ndarray, shape (n_steps, *model.shape)
        Snapshots.
    """
    snapshots = model.shape[:-1]
    alpha = complex_normal(rng, (len(truth), *snapshots, truth.shape[1]))
    active = np.expand_dims(~np.isnan(truth), tuple(range(1, 1 + len(snapshots))))
    noise = 10 ** (-snr_db / 10) * (np.abs(alpha) ** 2 * active).sum(axis=-1, keepdims=True)
    wave = model.wave(truth, alpha)
    if received:
        noise = 10 ** (-snr_db / 10) * (np.abs(wave) ** 2).mean(axis=-1, keepdims=True)
    return np.asarray(wave + np.sqrt(noise) * complex_normal(rng, wave.shape))


@register("circle")
@dataclass(frozen=True)
class Circle(Scenario):
    """Four sources around a circle of 8 sensors; two cross ±180°, and each other.

    Parameters
    ----------
    snr_db : float
        Summed power of the sources over the noise power of one sensor, dB.
    n_bins, n_snapshots : int
        Numbers of frequencies, from 0.6 to 1 of the highest, and of snapshots in one step.
    n_steps : int
        Number of time steps.

    References
    ----------
    The specification of SVALSE on any array, section 11.

    Examples
    --------
    >>> trial = Circle(n_bins=5, n_snapshots=2).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, np.rad2deg(trial.truth[20]).round(1)
    ((50, 5, 2, 8), array([-180. , -136. ,   34.7,  -40. ]))
    """

    snr_db: float = 20.0
    n_bins: int = 1
    n_snapshots: int = 1
    n_steps: int = 50

    def __post_init__(self) -> None:
        number("snr_db", self.snr_db)
        for name in ("n_bins", "n_snapshots", "n_steps"):
            count(name, getattr(self, name))

    @property
    def measurement(self) -> ArraySnapshot:
        """The circle, with a spacing of half of the shortest wavelength, 1 m."""
        array = SensorArray.uca(8, radius=0.25 / np.sin(np.pi / 8))
        return ArraySnapshot(array, bins(self.n_bins), n_snapshots=self.n_snapshots)

    def doa_deg(self) -> Float:
        """Return the azimuths, degrees, (n_steps, 4); NaN while a source is inactive."""
        t = np.arange(self.n_steps, dtype=np.float64)
        second = np.where(t < 10, np.nan, -100 - 1.8 * t)
        fourth = np.where(t < 25, -40.0, np.nan)
        doa = np.stack([150 + 1.5 * t, second, 30 + 8 * np.sin(2 * np.pi * t / 50), fourth], axis=1)
        return np.asarray((doa + 180) % 360 - 180)

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial; the motion model has 3° a step."""
        truth, model = np.deg2rad(self.doa_deg()), self.measurement
        z = simulate_snapshots(model, truth, self.snr_db, rng)
        return Trial(z, truth, model, BernoulliVonMises(sigma_doa=np.deg2rad(3.0), still=0.1))


@register("cardioids")
@dataclass(frozen=True)
class Cardioids(Scenario):
    """Two sources at least 40° apart, redrawn at every step; 8 cardioids facing outwards.

    Parameters
    ----------
    snr_db : float
        Received power over the noise power, mean of the sensors, dB.
    elements : {"cardioid", "mixed"}
        Cardioids for all elements, or for every second one, the others being isotropic.
    known : bool
        Whether the measurement model of a trial has the true elements, or isotropic ones.
    n_steps : int
        Number of time steps.

    Examples
    --------
    >>> Cardioids(n_steps=2).sample(np.random.default_rng(0)).measurements.shape
    (2, 8)
    """

    snr_db: float = 20.0
    elements: Literal["cardioid", "mixed"] = "cardioid"
    known: bool = True
    n_steps: int = 100

    def __post_init__(self) -> None:
        number("snr_db", self.snr_db)
        one_of("elements", self.elements, ("cardioid", "mixed"))
        count("n_steps", self.n_steps)

    @property
    def measurement(self) -> ArraySnapshot:
        """The array with its true elements."""
        array = SensorArray.uca(8, radius=0.25 / np.sin(np.pi / 8))
        facing = 2 * np.pi * np.arange(8) / 8
        omni = np.where((np.arange(8) % 2 == 1) & (self.elements == "mixed"), 1.0, 0.5)
        return ArraySnapshot(array, 1.0, response=ElementResponse.first_order(facing, omni))

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial."""
        first = rng.uniform(-np.pi, np.pi, self.n_steps)
        separation = np.deg2rad(rng.uniform(40, 320, self.n_steps))
        truth = (np.stack([first, first + separation], axis=1) + np.pi) % (2 * np.pi) - np.pi
        model = self.measurement
        z = simulate_snapshots(model, truth, self.snr_db, rng, received=True)
        assumed = model if self.known else model.replace(response=None)
        return Trial(z, truth, assumed, BernoulliVonMises(sigma_doa=np.deg2rad(3.0), still=0.1))


@register("grating")
@dataclass(frozen=True)
class Grating(Scenario):
    """One or two sources and a sparse line, on which every direction has grating lobes.

    Parameters
    ----------
    n_sources : {1, 2}
        One at -20 + t degrees, or two at -50 + 0.5 t and 10 + 0.8 t.
    n_bins : int
        Number of frequencies, from 0.6 to 1 of the highest.
    hopping : bool
        Whether only one random bin of each step has data.
    snr_db, spacing : float
        As in `Circle`; spacing in the shortest wavelength, which is 1 m.
    n_steps : int
        Number of time steps.

    Examples
    --------
    >>> trial = Grating(n_bins=10, hopping=True).sample(np.random.default_rng(0))
    >>> np.isfinite(trial.measurements).all(axis=2).sum(axis=1)[:3]
    array([1, 1, 1])
    """

    n_sources: int = 1
    n_bins: int = 1
    hopping: bool = False
    snr_db: float = 15.0
    spacing: float = 2.0
    n_steps: int = 40

    def __post_init__(self) -> None:
        one_of("n_sources", self.n_sources, (1, 2))
        for name in ("n_bins", "n_steps"):
            count(name, getattr(self, name))
        number("snr_db", self.snr_db)
        positive("spacing", self.spacing)

    @property
    def measurement(self) -> ArraySnapshot:
        """Eight sensors in a line."""
        return ArraySnapshot(SensorArray.ula(8, self.spacing), bins(self.n_bins), angle="doa")

    def doa_deg(self) -> Float:
        """Return the directions, degrees, (n_steps, n_sources)."""
        t = np.arange(self.n_steps, dtype=np.float64)[:, None]
        if self.n_sources == 1:
            return -20 + t
        return np.asarray([-50.0, 10.0] + t * [0.5, 0.8])

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial; the motion model has 2° a step."""
        truth, model = np.deg2rad(self.doa_deg()), self.measurement
        z = simulate_snapshots(model, truth, self.snr_db, rng)
        if self.hopping and self.n_bins > 1:
            valid = rng.integers(self.n_bins, size=self.n_steps)
            z[np.arange(self.n_bins) != valid[:, None]] = complex(np.nan, np.nan)
        return Trial(z, truth, model, BernoulliVonMises(sigma_doa=np.deg2rad(2.0), still=0.1))
