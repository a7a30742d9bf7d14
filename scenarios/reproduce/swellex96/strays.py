"""Directions far from every path of the tow, and the part of the sea floor that they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arrivals.scenarios.ocean_acoustics.normal_modes import mode_field, modes
from arrivals.scenarios.reproduce.swellex96.field import beam
from arrivals.scenarios.simulations.swellex96 import WITHIN_DB, TowPastLine, environment
from arrivals.typing import Bool, Complex, Float

FAR, AT_PEAK = 3.0, 1.5  # distances from every path, and from a beam peak, degrees


class StrayFacts(NamedTuple):
    """Directions farther than `FAR` degrees from every path, a step.

    Attributes
    ----------
    peaks : float
        Peaks of the beam power without noise, within 10 dB of the highest.
    without_mudstone : float
        The same over a sea floor without the mudstone below the sediment.
    estimates : mapping of str to tuple of two float
        Directions of each method, and the share of them at one of `peaks`.
    """

    peaks: float
    without_mudstone: float
    estimates: Mapping[str, tuple[float, float]]


def stray_facts(scenario: TowPastLine, doa: Mapping[str, Sequence[Float]]) -> StrayFacts:
    """Return the facts of the directions far from every path.

    Parameters
    ----------
    scenario : TowPastLine
        Some steps of the ship's track.
    doa : mapping of str to sequence of ndarray, shape (n_steps, n)
        Directions of each draw by method, degrees, NaN for none.

    Returns
    -------
    StrayFacts

    Examples
    --------
    >>> scenario = TowPastLine(ranges=(939.0, 950.0))
    >>> facts = stray_facts(scenario, {"broadside": [np.zeros((2, 1))]})
    >>> facts.peaks > facts.without_mudstone, facts.estimates
    (True, {'broadside': (1.0, 0.0)})
    """
    paths = np.rad2deg(scenario.truth())
    peaks = beam_peaks(scenario, scenario.field())
    simpler = beam_peaks(scenario, _field_without_mudstone(scenario))
    estimates = {}
    for name, draws in doa.items():
        far = [_far(draw, paths) for draw in draws]
        at_peak = [
            stray & _near(draw, peaks, AT_PEAK) for stray, draw in zip(far, draws, strict=True)
        ]
        n_far = sum(int(stray.sum()) for stray in far)
        n_steps = sum(len(draw) for draw in draws)
        share = sum(int(found.sum()) for found in at_peak) / max(1, n_far)
        estimates[name] = (n_far / n_steps, share)
    with_mudstone, without = (
        float(_far(found, paths).sum(axis=1).mean()) for found in (peaks, simpler)
    )
    return StrayFacts(with_mudstone, without, estimates)


def beam_peaks(scenario: TowPastLine, snapshots: Complex) -> Float:
    """Return directions of the beam peaks within 10 dB of the highest, degrees, else NaN.

    Examples
    --------
    >>> scenario = TowPastLine(ranges=(2000.0,))
    >>> one = scenario.measurement.steering_vector([0.2])
    >>> peaks = beam_peaks(scenario, one)
    >>> peaks[~np.isnan(peaks)].round(), np.rad2deg(0.2).round()
    (array([11.]), np.float64(11.0))
    """
    grid, power = beam(scenario, snapshots)
    inner = power[:, 1:-1]
    peak = (inner > power[:, :-2]) & (inner >= power[:, 2:])
    strong = inner >= power.max(axis=1, keepdims=True) * 10 ** (-WITHIN_DB / 10)
    return np.where(peak & strong, np.rad2deg(grid[1:-1]), np.nan)


def _field_without_mudstone(scenario: TowPastLine) -> Complex:
    """Return the field by modes over a sea floor of sediment alone, as the array receives it."""
    guide = environment()
    sediment = guide.layers[0]
    deep = sediment.replace(bottom=guide.depth, speed_bottom=sediment.speed_bottom)
    depths = -scenario.measurement.array.positions[:, 0]
    found = modes(guide.replace(layers=(deep,)), scenario.frequency)
    return mode_field(found, scenario.source_depth, depths, tuple(scenario.distances.tolist()))


def _near(doa: Float, others: Float, distance: float) -> Bool:
    """Return which directions (n_steps, n) are near one of others (n_steps, m), degrees."""
    return np.asarray((np.abs(doa[:, :, None] - others[:, None, :]) < distance).any(axis=2))


def _far(doa: Float, paths: Float) -> Bool:
    return ~np.isnan(doa) & ~_near(doa, paths, FAR)
