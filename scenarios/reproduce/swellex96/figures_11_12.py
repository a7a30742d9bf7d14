"""Figs 11 and 12 of SVALSE's paper: simulated tow past the SWellEx-96 array."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.gospa import mean_gospa, mean_rmse
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.forms import FORMS_SEEN, PAPER_FORM, quadrature
from arrivals.scenarios.reproduce.swellex96.decisions import WITH_RANGE, SeaResults
from arrivals.scenarios.reproduce.swellex96.field import field_facts
from arrivals.scenarios.reproduce.swellex96.plots import environment_figure, field_figure
from arrivals.scenarios.reproduce.swellex96.strays import StrayFacts, stray_facts
from arrivals.scenarios.simulations.swellex96 import WITHIN_DB, TowPastLine, track
from arrivals.trackers import NewtonSolver
from arrivals.typing import Float, Int

if TYPE_CHECKING:
    from arrivals.scenarios.base import Trial
    from arrivals.trackers import Run, Tracker

RANGE_SNR_DB = 15.0  # the water is not homogeneous: waves deviate from curved ones
METHODS: dict[str, dict[str, Any]] = {
    "cbf": {},
    "peaks_gnn": {},
    "sbl": {"n_directions": 181},  # a step of 1 degree: the beam width is 1.8 degrees
    "ssbl": {"n_directions": 181},
    "valse": {},
    "svalse": {},
    WITH_RANGE: {},
}
CLOSE = (1, 100)  # steps with many close paths
BLOCKS = ((1, 350), (1, 100), (101, 200), (201, 250), (251, 350))  # steps, from 1
NEAR, AUDIBLE_DB = 1.5, 30.0  # distance from a path, degrees, and range of its level, dB


def swellex96(runs: int, seed: int, quick: bool = False) -> Report:
    """Track the tow by seven methods, with and without element 43; `runs` draws of the noise.

    A single run uses every second step only, as a quick check. The paper's form of VALSE and
    SVALSE tracks steps 1 to 100 by 63 elements, and is left out of a quick study.
    """
    step = step_numbers(runs)
    scenario = TowPastLine(ranges=tuple(track()["range_m"][step - 1].tolist()))
    arrays = {63: scenario, 64: scenario.replace(missing=())}
    pairs = [(n, name) for n in arrays for name in METHODS]
    pairs += [] if quick else [(63, label) for label in PAPER_FORM.values()]
    cases = [(arrays[n], name, seed, k, step) for n, name in pairs for k in range(runs)]
    tracked, cpu = zip(*parallel_map(track_draw, cases), strict=True)
    rows: list[tuple[Any, ...]] = []
    drawn = {pair: slice(k * runs, (k + 1) * runs) for k, pair in enumerate(pairs)}
    doa = {pair: [strong_directions(run) for run in tracked[drawn[pair]]] for pair in pairs}
    for n, name in pairs:
        ms = float(np.mean(cpu[drawn[n, name]]))
        rows += [(n, name, *_row(scenario, doa[n, name], step, block), ms)
                 for block in blocks_of(n, name)]  # fmt: skip
    first = dict(zip(pairs, tracked[::runs], strict=True))
    figures = {"fig11": environment_figure()} | {
        name: field_figure(arrays[n], first[n, "valse"], first[n, "svalse"], step, seed)
        for name, n in FIELD_FIGURES.items()
    }
    columns = ("elements", "method", "steps", "GOSPA", "std", "distance", "missed", "false", "RMSE",
               "found", "paths", "near a path, %", "CPU ms a step")  # fmt: skip
    shown = ("elements", "method", "steps", "GOSPA", "missed", "false", "RMSE", "near a path, %")
    decimation = ", every second step" if runs == 1 else ""
    draws = f"{runs} draws of the noise" if runs > 1 else "one draw of the noise"
    title = f"Figs 11 and 12: the SWellEx-96 tow, simulated, 10 dB, {draws}{decimation}"
    scores = {name: _scores(scenario, doa[n, name], step, CLOSE) for n, name in pairs if n == 63}
    blocks = {name: np.stack([_scores(scenario, doa[63, name], step, block)[:, 0]
                              for block in BLOCKS[1:]], axis=1) for name in METHODS}  # fmt: skip
    results = SeaResults(scores, field_facts(scenario, step), blocks,
                         _strays(step, doa))  # fmt: skip
    return Report(title, columns, rows, (*REMARKS, CURVED, FORMS_SEEN), figures, shown, results,
                  CAPTIONS)  # fmt: skip


def blocks_of(n_elements: int, method: str) -> tuple[tuple[int, int], ...]:
    """Return the blocks of steps in the table.

    Examples
    --------
    >>> len(blocks_of(63, "cbf")), blocks_of(64, "cbf")
    (5, ((1, 350),))
    """
    if method in PAPER_FORM.values():
        return (CLOSE,)
    return BLOCKS if n_elements == 63 else BLOCKS[:1]


def step_numbers(runs: int) -> Int:
    """Return the numbers of the steps, from 1: every second one for a single run.

    Examples
    --------
    >>> step_numbers(1)[:3], step_numbers(4)[:3]
    (array([1, 3, 5]), array([1, 2, 3]))
    """
    return np.arange(1, 351, 2 if runs == 1 else 1)


FIELD_FIGURES = {"fig12": 63, "fig12-64": 64}
CAPTIONS = {"fig11": "Fig. 11: sketch of the experiment by its tables and rays, without noise"} | {
    name: f"Fig. 12: the tow, simulated, {n} elements, first draw of the noise"
    for name, n in FIELD_FIGURES.items()
}
REMARKS = (
    "The recordings are too large to ship: the field is a sum of normal modes in the experiment's "
    "water, over its sea floor, at the ship's ranges, with white noise. Element 43 was defective "
    "in the experiment: 63 elements as there, or the whole array of 64, with the same noise.",
    f"Directions and paths more than {WITHIN_DB:g} dB below the strongest of their step are "
    "excluded on both sides. GOSPA (cut-off 10 degrees), its parts and RMSE are degrees, `std` is "
    f"that of GOSPA over draws; 'near a path' counts the estimates within {NEAR} degrees of a "
    f"path that is at most {AUDIBLE_DB:g} dB below the strongest.",
    "Paths are named by their bounces in order of travel, B at the bottom and S at the surface: "
    "D, B, BS and BSB are the paper's DP, BR, BSR and BSBR. As there, a path stands also for that "
    "with one more bounce at the surface just above the source. The statements of Sec. VIII on the "
    "field are decided by the simulated field, without noise, on the paper's own steps.",
    "sbl and ssbl have a grid of 1 degree; the beam width of 64 elements is 1.8 degrees.",
)
CURVED = (
    "Near the closest approach (steps 251 to 350) the wavefronts at the array, 118 m long, are "
    "curved, and the sound speed changes along it: a path is not a plane wave, and at 20 dB a "
    "gridless method estimates two or three components for it. The paper has no figures on this. "
    f"{WITH_RANGE!r} has a curvature for each path, plane unless the data support one, and counts "
    f"what is more than {RANGE_SNR_DB:g} dB below the field as noise."
)


def track_draw(
    scenario: TowPastLine, name: str, seed: int, draw: int, step: Int
) -> tuple[Run, float]:
    """Track one draw of the noise, the same for all methods and arrays; return CPU ms a step.

    The paper's forms have directions up to step 100 only.
    """
    trial = scenario.sample(np.random.default_rng([seed, draw]))
    measurements = np.asarray(trial.measurements)
    if name in PAPER_FORM.values():
        measurements = measurements[step <= CLOSE[1]]
    started = time.process_time()
    run = tracker_of(trial, name).run(measurements)
    return run, 1e3 * (time.process_time() - started) / len(run)


def tracker_of(trial: Trial, name: str) -> Tracker:
    """Return a tracker of the table by its label."""
    if name == PAPER_FORM["valse"]:
        return trial.tracker("valse", **quadrature(2000))
    if name == PAPER_FORM["svalse"]:
        return trial.tracker("svalse", motion=BernoulliVonMises(), **quadrature(1000))
    if name == WITH_RANGE:
        curved = trial.measurement.replace(unknowns="range")
        solver = NewtonSolver(max_snr_db=RANGE_SNR_DB)
        return trial.tracker("svalse", measurement=curved, solver=solver)
    return trial.tracker(name, **METHODS[name])


def strong_directions(run: Run) -> Float:
    """Return the directions within 10 dB of the strongest of their step, degrees, else NaN."""
    size = np.nan_to_num(np.abs(run.amplitude))
    floor = size.max(axis=1, keepdims=True, initial=0.0) * 10 ** (-WITHIN_DB / 20)
    return np.where((size >= floor) & (size > 0), np.rad2deg(run.doa), np.nan)


def _strays(step: Int, doa: Mapping[tuple[int, str], Sequence[Float]]) -> StrayFacts:
    """Return the facts of the directions of the last block that are far from every path."""
    late = step >= BLOCKS[-1][0]
    scenario = TowPastLine(ranges=tuple(track()["range_m"][step[late] - 1].tolist()))
    draws = {name: [draw[late] for draw in doa[63, name]] for name in ("cbf", "svalse", WITH_RANGE)}
    return stray_facts(scenario, draws)


def _row(
    scenario: TowPastLine, draws: Sequence[Float], step: Int, block: tuple[int, int]
) -> tuple[Any, ...]:
    """Return the mean scores of a block of steps over the draws."""
    scores = _scores(scenario, draws, step, block)
    gospa, *rest = scores.mean(axis=0).tolist()
    std = float(scores[:, 0].std(ddof=1)) if len(scores) > 1 else np.nan
    return f"{block[0]}-{block[1]}", gospa, std, *rest


def _scores(
    scenario: TowPastLine, draws: Sequence[Float], step: Int, block: tuple[int, int]
) -> Float:
    """Return GOSPA, parts, RMSE, numbers of estimates and paths, % near a path: (n_draws, 8)."""
    here = (step >= block[0]) & (step <= block[1])
    truth = np.rad2deg(scenario.truth())[here]
    audible = np.rad2deg(scenario.truth(AUDIBLE_DB))[here]
    n_paths = float((~np.isnan(truth)).sum(axis=1).mean())
    scores = []
    for doa in (draw[here[: len(draw)]] for draw in draws):
        g = mean_gospa(truth, doa, c=10.0)
        n_found = (~np.isnan(doa)).sum(axis=1).mean()
        scores.append([g.total, g.distance, g.missed, g.false, mean_rmse(truth, doa, c=10.0),
                       n_found, n_paths, 100 * share_near(doa, audible)])  # fmt: skip
    return np.array(scores)


def share_near(doa: Float, paths: Float) -> float:
    """Return the fraction of directions (n_steps, n) near one of the paths (n_steps, m).

    Examples
    --------
    >>> share_near(np.array([[1.0, 5.0, np.nan]]), np.array([[0.0, np.nan]]))
    0.5
    """
    distance = np.abs(doa[:, :, None] - paths[:, None, :])
    near = (distance < NEAR).any(axis=2)
    return float(near.sum() / max(1, (~np.isnan(doa)).sum()))
