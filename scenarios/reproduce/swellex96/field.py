"""Facts of the simulated SWellEx-96 sound field, by which the paper's statements are decided."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.scenarios.ocean_acoustics.eigenrays import eigenrays
from arrivals.scenarios.simulations.swellex96 import TowPastLine, environment, line
from arrivals.trackers.beamforming.spectrum import bartlett_power, scan_directions
from arrivals.typing import Complex, Float, Int

CRITICAL = np.arccos(1488 / 1600)  # rad, the paper's critical angle of the bottom
Span = tuple[float, float]


def beam(scenario: TowPastLine, snapshots: Complex) -> tuple[Float, Float]:
    """Return scan directions (361,), rad, and the conventional beam power (n_steps, 361).

    Examples
    --------
    >>> scenario = TowPastLine(ranges=(2000.0,))
    >>> doa, power = beam(scenario, scenario.field())
    >>> doa.shape, power.shape
    ((361,), (1, 361))
    """
    model = scenario.measurement
    doa = scan_directions(model.array, 361)
    return doa, bartlett_power(model.array.steering_vector(doa, model.wavelength), snapshots)


class FieldFacts(NamedTuple):
    """Angles, degrees, levels, dB, and shares of steps in the simulated field.

    Attributes
    ----------
    beyond_critical, beyond_far : float
        Median share of the power that comes from beyond the critical angle: in all steps, and in
        steps 1 to 200.
    growing : float
        Share of the steps up to the closest one in which the angle of a path grows.
    bottom : float
        Share of steps 250 to 350 in which the path B is the strongest.
    bottom_span : tuple of two float
        Its angles of smallest and largest magnitude in those steps.
    weaker_rays, weaker_modes : float
        Median level of B over the direct path there, and the same of beam peaks of the modes.
    late_bounces : float
        Share of steps 220 to 250 in which BS or BSB is the strongest.
    late_spans : tuple of four float
        Angles of BS and of BSB there.
    nearest_step : int
        Step at which they are nearest to 15 and -17 degrees.
    many_bounces : float
        Share of steps 1 to 200 in which BSBS or a longer path is the strongest.
    succession : tuple of str
        Paths that are the strongest most often in steps 1-50, 51-100, 101-150 and 151-200.
    pair_gap : tuple of three float
        Angle between a path and that with a bounce above the source: median, 95 % and largest.
    correlation, level, level_std : float
        Beam powers of rays and modes: median correlation; mean level of the rays, and its std.
    peak_to_path : tuple of three float
        Highest beam peak to a path: medians from above and from below, and 90 % of both.
    """

    beyond_critical: float
    beyond_far: float
    growing: float
    bottom: float
    bottom_span: tuple[float, float]
    weaker_rays: float
    weaker_modes: float
    late_bounces: float
    late_spans: tuple[float, float, float, float]
    nearest_step: int
    many_bounces: float
    succession: tuple[str, ...]
    pair_gap: tuple[float, float, float]
    correlation: float
    level: float
    level_std: float
    peak_to_path: tuple[float, float, float]


def field_facts(scenario: TowPastLine, step: Int) -> FieldFacts:
    """Return the facts of the field.

    Parameters
    ----------
    scenario : TowPastLine
        The ship's track or a part of it.
    step : ndarray of int, shape (n_steps,)
        Numbers of its steps in the experiment, from 1.

    Returns
    -------
    FieldFacts

    Examples
    --------
    >>> from arrivals.scenarios.simulations.swellex96 import track
    >>> step = np.arange(1, 351, 10)
    >>> facts = field_facts(TowPastLine(ranges=tuple(track()["range_m"][step - 1])), step)
    >>> facts.many_bounces > 0.5
    True
    """
    beyond, beyond_far, growing = _angles(scenario, step)
    bottom, span, rays, modes, late, spans, nearest = _strongest(scenario, step)
    many, succession = _many_bounces(scenario, step)
    correlation, level, level_std, peaks = _models_agree(scenario)
    return FieldFacts(
        beyond, beyond_far, growing, bottom, span, rays, modes, late, spans, nearest, many,
        succession, _pair_gap(scenario), correlation, level, level_std, peaks,
    )  # fmt: skip


def _angles(scenario: TowPastLine, step: Int) -> tuple[float, float, float]:
    """Return the power from beyond the critical angle, in all and far steps, and the growth."""
    _, doa, level_db = scenario.paths()
    power = np.nan_to_num(10 ** (level_db / 10))
    beyond = np.where(np.abs(doa) > CRITICAL, power, 0).sum(axis=1) / power.sum(axis=1)
    medians = float(np.median(beyond)), float(np.median(beyond[step <= 200]))
    nearing = np.diff(np.abs(np.where(level_db > -np.inf, doa, np.nan)[step <= 294]), axis=0)
    return *medians, float((nearing[~np.isnan(nearing)] > 0).mean())


def _strongest(
    scenario: TowPastLine, step: Int
) -> tuple[float, Span, float, float, float, tuple[float, float, float, float], int]:
    """Return the facts of the paths that dominate from step 220 on."""
    names, doa, level_db = scenario.paths()
    late, middle = (step >= 250) & (step <= 350), (step >= 220) & (step <= 250)
    B, D, BS, BSB = (names.index(name) for name in ("B", "D", "BS", "BSB"))
    top = np.nanargmax(level_db, axis=1)
    weaker = float(np.nanmedian((level_db[:, B] - level_db[:, D])[late]))
    grid, power = beam(scenario, scenario.field())
    steep = _highest(grid, power, -22, -10) - _highest(grid, power, 9, 15)
    at = step[np.nanargmin(np.hypot(doa[:, BS] - np.deg2rad(15), doa[:, BSB] + np.deg2rad(17)))]
    return (
        float((top[late] == B).mean()),
        _span(doa[late, B]),
        weaker,
        float(np.median(steep[late])),
        float(np.isin(top[middle], [BS, BSB]).mean()),
        (*_span(doa[middle, BS]), *_span(doa[middle, BSB])),
        int(at),
    )


def _many_bounces(scenario: TowPastLine, step: Int) -> tuple[float, tuple[str, ...]]:
    """Return how often paths of four bounces and more are the strongest, and which."""
    names, _, level_db = scenario.paths()
    top = np.array(names)[np.nanargmax(level_db, axis=1)]
    many = np.char.str_len(top) >= len("BSBS")
    often = []
    for first in (1, 51, 101, 151):
        found, n = np.unique(top[(step >= first) & (step < first + 50)], return_counts=True)
        often.append(str(found[n.argmax()]))
    return float(many[step <= 200].mean()), tuple(often)


def _pair_gap(scenario: TowPastLine) -> tuple[float, float, float]:
    """Return angles between paths with and without a bounce above the source, at the centre."""
    centre = -float(line(missing=()).positions.mean())
    rays = eigenrays(
        environment(), scenario.frequency, scenario.source_depth, centre, scenario.distances
    )
    strongest: dict[tuple[int, str], tuple[float, float]] = {}
    size = np.abs(rays.pressure)
    for step, path, level, doa in zip(rays.step, rays.path, size, rays.doa, strict=True):
        key = int(step), str(path)
        strongest[key] = max(strongest.get(key, (0.0, 0.0)), (float(level), float(doa)))
    gaps = [
        abs(doa - strongest[step, bounced][1])
        for (step, path), (_, doa) in strongest.items()
        if (step, bounced := "S" if path == "D" else f"S{path}") in strongest
    ]
    median, most, largest = np.rad2deg(np.percentile(gaps, [50, 95, 100])).tolist()
    return median, most, largest


def _models_agree(
    scenario: TowPastLine,
) -> tuple[float, float, float, tuple[float, float, float]]:
    """Compare rays with modes, and beam peaks with rays."""
    modes, rays = scenario.field(), scenario.replace(model="rays").field()
    grid, modal_power = beam(scenario, modes)
    _, ray_power = beam(scenario, rays)
    level = 10 * np.log10((np.abs(rays) ** 2).mean(axis=1) / (np.abs(modes) ** 2).mean(axis=1))
    above, below = (peak_to_path(scenario, grid, modal_power, side) for side in (1, -1))
    most = float(np.percentile(np.concatenate([above, below]), 90))
    return (
        float(np.median(_correlation(modal_power, ray_power))),
        float(level.mean()),
        float(level.std()),
        (float(np.median(above)), float(np.median(below)), most),
    )


def peak_to_path(scenario: TowPastLine, grid: Float, power: Float, side: int) -> Float:
    """Return the distance of the highest peak on one side to the nearest of six paths, degrees.

    Parameters
    ----------
    scenario : TowPastLine
    grid, power : ndarray, shapes (n,), (n_steps, n)
        As `beam` returns them.
    side : int
        1 for above, -1 for below; the six strongest paths of that side are used.

    Examples
    --------
    >>> scenario = TowPastLine(ranges=(2000.0, 3000.0))
    >>> peak_to_path(scenario, *beam(scenario, scenario.field()), side=1).shape
    (2,)
    """
    _, doa, level_db = scenario.paths()
    level_db = np.where(np.nan_to_num(doa) * side > 0, level_db, -np.inf)
    level_db = np.where(np.isnan(level_db), -np.inf, level_db)
    sixth = np.sort(level_db, axis=1)[:, -min(6, level_db.shape[1])][:, None]
    rays = np.where((level_db >= sixth) & (level_db > -np.inf), doa, np.inf)
    peak = grid[np.argmax(np.where(grid * side > 0, power, 0), axis=1)]
    return np.asarray(np.rad2deg(np.abs(rays - peak[:, None]).min(axis=1)))


def _highest(grid: Float, power: Float, low: float, high: float) -> Float:
    """Return the highest beam power, dB, between two angles, degrees."""
    inside = (grid > np.deg2rad(low)) & (grid < np.deg2rad(high))
    return np.asarray(10 * np.log10(power[:, inside].max(axis=1)))


def _correlation(a: Float, b: Float) -> Float:
    """Return the correlation coefficients of the rows of two matrices."""
    a, b = a - a.mean(axis=1, keepdims=True), b - b.mean(axis=1, keepdims=True)
    return np.asarray((a * b).sum(axis=1) / np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1)))


def _span(doa: Float) -> Span:
    """Return the angles of smallest and largest magnitude, degrees.

    Examples
    --------
    >>> near, far = _span(np.deg2rad([-17.0, -12.0]))
    >>> round(near), round(far)
    (-12, -17)
    """
    degrees = np.rad2deg(doa[~np.isnan(doa)])
    near, far = degrees[np.argmin(np.abs(degrees))], degrees[np.argmax(np.abs(degrees))]
    return float(near), float(far)
