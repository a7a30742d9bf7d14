"""Sources at any distance from a line of microphones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.typing import Float
from arrivals.validation import count, number, positive, real

SPEED = 343.0  # m/s
FREQUENCY_HZ = 2000.0


@register("near_field")
@dataclass(frozen=True)
class NearField(Scenario):
    """Standing sources near 16 microphones 8 cm apart, at 2 kHz.

    Waves are spherical and decay as 1/r. Each source has a constant power, received by the mean
    microphone, and random phases. The Fraunhofer distance is 16.8 m.

    Parameters
    ----------
    doa_deg : sequence of float
        Directions from broadside, degrees.
    range_m : sequence of float
        Distances from the centre of the line, m.
    snr_db : float
        Received power of one source over the noise power of one microphone, dB.
    n_snapshots : int
        Snapshots in one step.
    n_steps : int
        Number of time steps.
    nearest : float
        Distance of the nearest source that the measurement model expects, m.

    References
    ----------
    The specification of SVALSE with two unknowns, section 7.

    Examples
    --------
    >>> trial = NearField((10.0, 10.0), (0.5, 2.0), n_steps=3).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, trial.range[0]
    ((3, 16), array([0.5, 2. ]))
    """

    doa_deg: Sequence[float] = (20.0,)
    range_m: Sequence[float] = (0.5,)
    snr_db: float = 20.0
    n_snapshots: int = 1
    n_steps: int = 100
    nearest: float = 0.3

    def __post_init__(self) -> None:
        for name in ("doa_deg", "range_m"):
            values = real(name, getattr(self, name))
            if values.ndim != 1 or not np.isfinite(values).all():
                raise ValueError(f"{name} must be a list of finite numbers; got {values}")
            object.__setattr__(self, name, tuple(values.tolist()))
        if len(self.doa_deg) != len(self.range_m):
            n = f"{len(self.doa_deg)} and {len(self.range_m)}"
            raise ValueError(f"doa_deg and range_m must be of equal length; got {n}")
        for each in self.range_m:
            positive("range_m", each)
        number("snr_db", self.snr_db)
        for name in ("n_snapshots", "n_steps"):
            count(name, getattr(self, name))
        self.measurement  # noqa: B018  (checks nearest)

    @property
    def measurement(self) -> ArraySnapshot:
        """The line of microphones."""
        array = SensorArray.ula(16, 0.08, speed=SPEED)
        return ArraySnapshot(
            array,
            SPEED / FREQUENCY_HZ,
            n_snapshots=self.n_snapshots,
            unknowns="range",
            nearest=self.nearest,
        )

    def amplitudes(self) -> Float:
        """Return sizes at the centre of the line for a mean received power of 1: (n_sources,)."""
        a = self.measurement.steering_vector(
            np.deg2rad(self.doa_deg), distance=np.asarray(self.range_m)
        )
        return np.asarray(1 / np.sqrt((np.abs(a) ** 2).mean(axis=-1)))

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial; the motion model has 0.5° a step."""
        model, n = self.measurement, len(self.doa_deg)
        phase = rng.uniform(0, 2 * np.pi, (self.n_steps, *model.shape[:-1], n))
        doa = np.tile(np.deg2rad(self.doa_deg), (self.n_steps, 1))
        distance = np.tile(self.range_m, (self.n_steps, 1))
        w = self.amplitudes() * np.exp(1j * phase)
        z = model.replace(noise=10 ** (-self.snr_db / 10)).simulate(doa, w, rng, distance=distance)
        motion = BernoulliVonMises(sigma_doa=np.deg2rad(0.5))
        return Trial(z, doa, model, motion, range=distance)
