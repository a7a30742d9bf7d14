"""Simulated tow of a source past a vertical line array: the SWellEx-96 experiment."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Literal

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.description import from_description
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.ocean_acoustics.eigenrays import eigenrays
from arrivals.scenarios.ocean_acoustics.normal_modes import mode_field, modes
from arrivals.scenarios.ocean_acoustics.waveguide import BottomLayer, Waveguide
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.line_arrays import complex_normal
from arrivals.typing import Complex, Float, Int
from arrivals.validation import count, number, one_of, positive

WITHIN_DB = 10.0  # of the strongest path: range of the paths in the truth
NUMBERS = ("top_m", "bottom_m", "speed_top_m_s", "speed_bottom_m_s", "density_g_cm3",
           "attenuation_db_m_khz")  # fmt: skip


def _table(name: str) -> list[dict[str, str]]:
    text = (files("arrivals.scenarios") / "data" / f"swellex96_{name}.csv").read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))


@lru_cache(maxsize=1)
def environment() -> Waveguide:
    """Return the waveguide of the experiment: water and sea floor.

    Examples
    --------
    >>> guide = environment()
    >>> guide.water_depth, guide.depth, guide.speed([9.0, 153.1875]).round(1)
    (216.5, 1040.0, array([1519.4, 1488.9]))
    """
    water = _table("ssp")
    depths, speeds = ([float(row[key]) for row in water] for key in ("depth_m", "speed_m_s"))
    layers = [BottomLayer(*(float(row[key]) for key in NUMBERS)) for row in _table("bottom")]
    return Waveguide(np.array(depths), np.array(speeds), layers)


def track() -> dict[str, Float]:
    """Return the ship's track, (350,) each: step, time_s, east_m, north_m and range_m.

    Examples
    --------
    >>> ship = track()
    >>> float(ship["range_m"].min()), int(ship["step"][np.argmin(ship["range_m"])])
    (900.6, 294)
    """
    rows = _table("track")
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def line(missing: Sequence[int] = (43,)) -> SensorArray:
    """Return the array: heights above the surface, m, the shallowest element first.

    Parameters
    ----------
    missing : sequence of int
        Elements to leave out, counted from 1.

    Examples
    --------
    >>> line().n_sensors, line(missing=()).positions[[0, -1], 0]
    (63, array([ -94.125, -212.25 ]))
    """
    file = files("arrivals.scenarios") / "data" / "swellex96.toml"
    description = tomllib.loads(file.read_text("utf-8"))
    return from_description(description | {"missing": list(missing)})


@register("swellex96")
@dataclass(frozen=True)
class TowPastLine(Scenario):
    """Simulated field of a tone towed past the vertical array of the SWellEx-96 experiment.

    Each path over surface and bottom has its own elevation; paths appear, move and disappear.

    Parameters
    ----------
    snr_db : float
        Mean power of the field over the array's elements at the median step, over the noise power,
        dB; the noise power is the same in all steps.
    frequency : float
        Frequency, Hz.
    source_depth : float
        Depth of the source, m.
    ranges : sequence of float, optional
        Horizontal distance of the source in each step, m; by default that of the ship in the
        experiment, 350 steps of 10.92 s.
    n_steps : int, optional
        Number of steps, from the first; all if None.
    model : {"modes", "rays"}
        Model of the field.
    missing : sequence of int
        Missing elements, counted from 1; number 43 was defective in the experiment.

    Notes
    -----
    The truth has the angles at the centre of the array of the paths within 10 dB of the strongest
    of the step, from the ray model. The two rays with and without the bounce off the surface just
    above the source differ by less than 1° and are one path.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, section VIII.

    Examples
    --------
    >>> trial = TowPastLine(ranges=(2000.0, 1990.0)).sample(np.random.default_rng(0))
    >>> trial.measurements.shape
    (2, 63)
    >>> np.sort(np.rad2deg(trial.truth[0][~np.isnan(trial.truth[0])])).round(1)
    array([-20. ,  16.9,  36.2])
    """

    snr_db: float = 10.0
    frequency: float = 198.0
    source_depth: float = 9.0
    ranges: Sequence[float] | None = None
    n_steps: int | None = None
    model: Literal["modes", "rays"] = "modes"
    missing: Sequence[int] = (43,)

    def __post_init__(self) -> None:
        if not np.isfinite(number("snr_db", self.snr_db)):
            raise ValueError(f"snr_db must be finite; got {self.snr_db} (field() has no noise)")
        positive("frequency", self.frequency)
        environment().in_water("source_depth", positive("source_depth", self.source_depth))
        one_of("model", self.model, ("modes", "rays"))
        if self.ranges is not None:
            ranges = tuple(positive("ranges", r) for r in self.ranges)
            count("the number of ranges", len(ranges))
            object.__setattr__(self, "ranges", ranges)
        if self.n_steps is not None:
            count("n_steps", self.n_steps)
        object.__setattr__(self, "missing", tuple(self.missing))
        line(self.missing)  # rejects numbers of other elements

    @property
    def distances(self) -> Float:
        """Horizontal distances, m, (n_steps,)."""
        ranges = track()["range_m"] if self.ranges is None else np.array(self.ranges)
        return np.asarray(ranges[: self.n_steps])

    @property
    def measurement(self) -> ArraySnapshot:
        """The array at the wavelength for its mean sound speed."""
        array = line(self.missing)
        return ArraySnapshot(array, array.wavelength(self.frequency), self.noise)

    @property
    def noise(self) -> float:
        """Variance of the noise of one element: `snr_db` below the field at the median step."""
        power = np.median((np.abs(self._whole()) ** 2).mean(axis=1))
        return float(power / 10 ** (self.snr_db / 10))

    def field(self) -> Complex:
        """Return the noise-free field, (n_steps, n_sensors); free space has 1/(4π) at 1 m."""
        return self._whole()[:, self._used()]

    def paths(self) -> tuple[list[str], Float, Float]:
        """Return names, angles and levels of the paths to the centre of the array.

        Returns
        -------
        names : list of str, length n_paths
            Bounces in order of travel, B bottom and S surface, D for none; without the one just
            above the source.
        doa : ndarray, shape (n_steps, n_paths)
            Elevation, rad, positive from above; NaN for absent paths.
        level_db : ndarray, shape (n_steps, n_paths)
            Level re 1 in the unit of `field`, dB; NaN for absent paths.
        """
        names, doa, level_db = _paths(self.frequency, self.source_depth, self._distances())
        return names.copy(), doa.copy(), level_db.copy()

    def truth(self, within_db: float = WITHIN_DB) -> Float:
        """Return angles of the paths within `within_db` of the strongest, (n_steps, n_paths)."""
        _, doa, level = self.paths()
        strongest = np.nanmax(level, axis=1, keepdims=True, initial=-np.inf)
        return np.where(level >= strongest - within_db, doa, np.nan)

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw the noise of one trial, for all 64 elements, missing ones included."""
        whole, model = self._whole(), self.measurement
        u = np.sqrt(self.noise) * complex_normal(rng, whole.shape)
        return Trial((whole + u)[:, self._used()], self.truth(), model, BernoulliVonMises())

    def _whole(self) -> Complex:
        return _field(self.model, self.frequency, self.source_depth, self._distances())

    def _used(self) -> Int:
        return np.setdiff1d(np.arange(64), np.array(self.missing, dtype=np.int64) - 1)

    def _distances(self) -> tuple[float, ...]:
        return tuple(self.distances.tolist())


@lru_cache(maxsize=8)
def _field(model: str, frequency: float, source_depth: float, ranges: tuple[float, ...]) -> Complex:
    """Return the field at all 64 elements, (n_steps, 64), read-only."""
    guide, depths = environment(), -line(missing=()).positions[:, 0]
    if model == "modes":
        step = min(0.125, guide.speeds.min() / frequency / 60)
        p = mode_field(modes(guide, frequency, step), source_depth, depths, ranges)
    else:
        rays = eigenrays(guide, frequency, source_depth, depths, ranges)
        p = rays.field(len(ranges), len(depths))
    p.setflags(write=False)
    return p


@lru_cache(maxsize=8)
def _paths(
    frequency: float, source_depth: float, ranges: tuple[float, ...]
) -> tuple[list[str], Float, Float]:
    """Return names, angles and levels of the paths to the centre of the array, cached."""
    centre = -float(line(missing=()).positions.mean())
    rays = eigenrays(environment(), frequency, source_depth, centre, ranges)
    merged = np.array([_without_first(name) for name in rays.path.tolist()], dtype=np.str_)
    names, column = np.unique(merged, return_inverse=True)
    shape, index = (len(ranges), len(names)), rays.step * len(names) + column
    size, p = np.abs(rays.pressure), rays.pressure
    weight, moment, re, im = (
        np.bincount(index, part, shape[0] * shape[1]).reshape(shape)
        for part in (size, size * rays.doa, p.real, p.imag)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        doa, level_db = moment / weight, 20 * np.log10(np.hypot(re, im))
    return names.tolist(), doa, np.where(weight > 0, level_db, np.nan)


def _without_first(path: str) -> str:
    """Return the name of a path without the bounce off the surface above the source.

    Examples
    --------
    >>> _without_first("SBS"), _without_first("BS"), _without_first("S")
    ('BS', 'BS', 'D')
    """
    return path.removeprefix("S") or "D"
