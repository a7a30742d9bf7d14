"""Sources in azimuth and elevation, on arrays in a plane and in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.line_arrays import complex_normal
from arrivals.scenarios.simulations.planar_arrays import bins
from arrivals.typing import Complex, Float
from arrivals.validation import count, number, one_of

ArrayName = Literal["ura4", "ura8", "uca8", "uca6", "tetra4", "sph12"]
N_SOURCES: dict[str, int] = {"uca6": 3, "tetra4": 2}  # as many as the arrays resolve; else 4


def array_of(name: ArrayName) -> SensorArray:
    """Return an array for waves of 1 m.

    Examples
    --------
    >>> [array_of(name).n_sensors for name in ("ura4", "uca6", "tetra4", "sph12")]
    [16, 6, 4, 12]
    """
    if name in ("ura4", "ura8"):
        line = 0.5 * np.arange(int(name[-1]))
        grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        return SensorArray(grid - grid.mean(axis=0))
    if name == "uca8":
        return SensorArray.uca(8, 0.65)
    if name == "uca6":
        return SensorArray.uca(6, 0.5)
    if name == "sph12":
        return SensorArray(0.5 * fibonacci_sphere(12))
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return SensorArray(0.5 / np.sqrt(8) * corners)  # edges of 0.5 m


@register("sphere")
@dataclass(frozen=True)
class SourcesOnSphere(Scenario):
    """Two sources that cross in azimuth, one over the zenith, and one at the horizon.

    At elevations of 25° and 55° the first two go around by 120°, one against the other. The third
    passes the zenith by 1° a step and is active from step 10, the fourth is at 3° until step 35.
    The circle of 6 has the first three, the tetrahedron the first two.

    Parameters
    ----------
    array : {"ura4", "ura8", "uca8", "uca6", "tetra4", "sph12"}
        4 x 4 or 8 x 8 sensors half a wavelength apart, circles of 8 and 6 of radius 0.65 and 0.5,
        a tetrahedron with edges of 0.5, 12 sensors on a sphere of radius 0.5, in the shortest
        wavelength, which is 1 m.
    snr_db : float
        Mean power of all sources of the scene over the noise power of one sensor, dB.
    n_bins, n_snapshots : int
        Numbers of frequencies, from 0.6 to 1 of the highest, and of snapshots in one step.
    n_steps : int
        Number of time steps.

    References
    ----------
    The specification of SVALSE with two unknowns, section 9.

    Examples
    --------
    >>> trial = SourcesOnSphere().sample(np.random.default_rng(0))
    >>> trial.measurements.shape, np.rad2deg(trial.elevation[20]).round(1)
    ((50, 10, 16), array([25., 55., 85.,  3.]))
    """

    array: ArrayName = "ura4"
    snr_db: float = 20.0
    n_bins: int = 1
    n_snapshots: int = 10
    n_steps: int = 50

    def __post_init__(self) -> None:
        one_of("array", self.array, get_args(ArrayName))
        number("snr_db", self.snr_db)
        for name in ("n_bins", "n_snapshots", "n_steps"):
            count(name, getattr(self, name))

    @property
    def measurement(self) -> ArraySnapshot:
        """The array at its frequencies."""
        array, wavelengths = array_of(self.array), bins(self.n_bins)
        return ArraySnapshot(array, wavelengths, n_snapshots=self.n_snapshots, unknowns="sphere")

    def directions_deg(self) -> tuple[Float, Float]:
        """Return azimuths and elevations, degrees, (n_steps, n_sources); NaN while inactive."""
        t = np.arange(self.n_steps, dtype=np.float64)
        swept, middle, level = 120 * t / max(self.n_steps - 1, 1), self.n_steps / 2, np.ones_like(t)
        azimuth = [swept - 60, 60 - swept, np.where(t < middle, -180.0, 0.0), 150 + t]
        elevation = [25 * level, 55 * level, 90 - np.abs(t - middle), 3 * level]
        active = [level > 0, level > 0, t >= 10, t < 35]
        n = N_SOURCES.get(self.array, 4)
        on = np.stack(active[:n], axis=1)
        both = np.stack([np.stack(each[:n], axis=1) for each in (azimuth, elevation)])
        azimuth_deg, elevation_deg = np.where(on, both, np.nan)
        return (azimuth_deg + 180) % 360 - 180, elevation_deg

    @property
    def noise(self) -> float:
        """Variance of the noise of one sensor."""
        return float(N_SOURCES.get(self.array, 4) * 10 ** (-self.snr_db / 10))

    def amplitudes(self, rng: np.random.Generator) -> Complex:
        """Draw amplitudes w ~ CN(0, 1) of each bin and snapshot, the first draw of `sample`."""
        n = N_SOURCES.get(self.array, 4)
        return complex_normal(rng, (self.n_steps, *self.measurement.shape[:-1], n))

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial; the motion model has 3° a step."""
        azimuth, elevation = map(np.deg2rad, self.directions_deg())
        model = self.measurement
        w = self.amplitudes(rng)
        z = model.replace(noise=self.noise).simulate(azimuth, w, rng, elevation)
        motion = BernoulliVonMises(sigma_doa=np.deg2rad(3.0))
        return Trial(z, azimuth, model, motion, elevation=elevation)
