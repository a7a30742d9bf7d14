"""Statements of SVALSE's paper on the SWellEx-96 sound field, compared with the simulated field."""

from __future__ import annotations

import numpy as np

from arrivals.scenarios.simulations.swellex96 import TowPastLine
from arrivals.trackers.beamforming.spectrum import bartlett_power, scan_directions
from arrivals.typing import Complex, Float, Int

CRITICAL = np.arccos(1488 / 1600)  # rad, the paper's critical angle of the bottom
Claim = tuple[str, str, str]  # statement, the paper's value, ours


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


def claims(scenario: TowPastLine, step: Int) -> list[Claim]:
    """Return one row for each quantitative statement.

    Parameters
    ----------
    scenario : TowPastLine
        The ship's track or a part of it.
    step : ndarray of int, shape (n_steps,)
        Numbers of its steps in the experiment, from 1.

    Returns
    -------
    list of Claim
        Statement, the paper's value, ours.

    Examples
    --------
    >>> from arrivals.scenarios.simulations.swellex96 import track
    >>> step = np.arange(1, 351, 10)
    >>> rows = claims(TowPastLine(ranges=tuple(track()["range_m"][step - 1])), step)
    >>> rows[0][:2]
    ('path power from beyond the critical angle, steps 1-200', 'none')
    """
    return [
        *_angles(scenario, step),
        *_strongest(scenario, step),
        *_models_agree(scenario),
    ]


def _angles(scenario: TowPastLine, step: Int) -> list[Claim]:
    """Compare the critical angle, and the growth of the angles at decreasing range."""
    _, doa, level_db = scenario.paths()
    power = np.nan_to_num(10 ** (level_db / 10))
    far = step <= 200
    beyond = np.where(np.abs(doa) > CRITICAL, power, 0)[far].sum(axis=1) / power[far].sum(axis=1)
    nearing = np.diff(np.abs(np.where(level_db > -np.inf, doa, np.nan)[step <= 294]), axis=0)
    grows = (nearing[~np.isnan(nearing)] > 0).mean()
    return [
        (
            "path power from beyond the critical angle, steps 1-200",
            "none",
            f"{100 * np.median(beyond):.1f} % (median of the steps)",
        ),
        (
            "absolute angles increase as the range decreases",
            "yes",
            f"in {100 * grows:.0f} % of the steps of all paths up to the closest one",
        ),
    ]


def _strongest(scenario: TowPastLine, step: Int) -> list[Claim]:
    """Compare the paths that dominate from step 220 on."""
    names, doa, level_db = scenario.paths()
    late, middle = (step >= 250) & (step < 340), (step >= 220) & (step < 250)
    B, D, BS, BSB = (names.index(name) for name in ("B", "D", "BS", "BSB"))
    top = np.nanargmax(level_db, axis=1)
    weaker = (level_db[:, B] - level_db[:, D])[late]
    grid, power = beam(scenario, scenario.field())
    steep = _highest(grid, power, -22, -10) - _highest(grid, power, 9, 15)
    at = step[np.nanargmin(np.hypot(doa[:, BS] - np.deg2rad(15), doa[:, BSB] + np.deg2rad(17)))]
    return [
        (
            "steps 250-339: one bottom bounce (B) is the strongest",
            "-15°",
            f"in {100 * (top[late] == B).mean():.0f} % of the steps, {_span(doa[late, B])}",
        ),
        (
            "steps 250-339: the direct path (D, 12°) is weaker",
            "weaker",
            f"by {np.nanmedian(weaker):.0f} dB (rays), {np.median(steep[late]):.0f} dB (modes, "
            "beam power); medians",
        ),
        (
            "steps 220-249: BS and BSB dominate",
            "15° and -17°",
            f"{_span(doa[middle, BS])} and {_span(doa[middle, BSB])}, the strongest in "
            f"{100 * np.isin(top[middle], [BS, BSB]).mean():.0f} %; nearest to the paper's "
            f"angles at step {at}",
        ),
    ]


def _models_agree(scenario: TowPastLine) -> list[Claim]:
    """Compare rays with modes, and beam peaks with rays."""
    modes, rays = scenario.field(), scenario.replace(model="rays").field()
    grid, modal_power = beam(scenario, modes)
    _, ray_power = beam(scenario, rays)
    level = 10 * np.log10((np.abs(rays) ** 2).mean(axis=1) / (np.abs(modes) ** 2).mean(axis=1))
    above, below = (peak_to_path(scenario, grid, modal_power, side) for side in (1, -1))
    both = np.concatenate([above, below])
    return [
        (
            "modes (b) and rays (d) agree",
            "visually well",
            f"correlation of the beam powers "
            f"{np.median(_correlation(modal_power, ray_power)):.2f} (median of the steps), "
            f"level of the rays {level.mean():+.1f} dB, std {level.std():.1f} dB",
        ),
        (
            "the beam's highest peak on either side is one of its six strongest paths",
            "yes",
            f"{np.median(above):.1f}° from above, {np.median(below):.1f}° from below (medians), "
            f"90 % within {np.percentile(both, 90):.1f}°",
        ),
    ]


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


def _span(doa: Float) -> str:
    """Return the angles of smallest and largest magnitude as text.

    Examples
    --------
    >>> _span(np.deg2rad([-17.0, -12.0]))
    '-12° to -17°'
    """
    degrees = np.rad2deg(doa[~np.isnan(doa)])
    near, far = degrees[np.argmin(np.abs(degrees))], degrees[np.argmax(np.abs(degrees))]
    return f"{near:.0f}° to {far:.0f}°"
