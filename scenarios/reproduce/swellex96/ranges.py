"""Ranges of the SWellEx-96 tow from the curvature of the wavefronts, against the ship's track."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_beside
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decision
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.swellex96.decisions import WITH_RANGE
from arrivals.scenarios.reproduce.swellex96.figures_11_12 import (
    step_numbers,
    strong_directions,
    tracker_of,
)
from arrivals.scenarios.simulations.swellex96 import WITHIN_DB, TowPastLine, track
from arrivals.typing import Float, Int

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from arrivals.scenarios.base import Trial
    from arrivals.trackers import Run

MODELS = ("rays", "modes")
BLOCKS = ((101, 200), (201, 250), (251, 350))  # steps, from 1
LATE = BLOCKS[-1]
NEAR = 1.0  # distance from a path, degrees
COLUMNS = ("field", "steps", "paths with a range", "median ratio", "16 %", "84 %",
           "median error, %", "NEES", "of all estimates at a path, %")  # fmt: skip


class PathRanges(NamedTuple):
    """Horizontal ranges of the estimates at a path, of one draw.

    Attributes
    ----------
    step : ndarray of int, shape (n,)
        Steps of the experiment, from 1.
    ratio : ndarray, shape (n,)
        Horizontal range over that of the ship; NaN without a range.
    error : ndarray, shape (n,)
        Error of 1/R over its stated deviation.
    """

    step: Int
    ratio: Float
    error: Float


class RangeScores(NamedTuple):
    """Scores of the ranges in a block of steps.

    Attributes
    ----------
    found : float
        Paths with a range, mean over draws.
    ratio, low, high : float
        Median, 16 and 84 % of the ratios of the horizontal range to that of the ship.
    error : float
        Median of the absolute relative errors, %.
    nees : float
        Mean square of the errors of 1/R over their stated deviations.
    share : float
        Of the estimates at a path those with a range, %.
    """

    found: float
    ratio: float
    low: float
    high: float
    error: float
    nees: float
    share: float


RangeResults = Mapping[tuple[str, tuple[int, int]], RangeScores]


def ranges(runs: int, seed: int) -> Report:
    """Track the tow by SVALSE with a range a path, in two models of the field.

    A single run uses every second step only, as a quick check.
    """
    step = step_numbers(runs)
    cases = [(model, seed, k, step) for model in MODELS for k in range(runs)]
    found = parallel_map(ranges_of_draw, cases)
    drawn = {model: found[n * runs : (n + 1) * runs] for n, model in enumerate(MODELS)}
    results = {(model, block): scores(drawn[model], block) for model in MODELS for block in BLOCKS}
    rows = [(model, f"{first}-{last}", *of) for (model, (first, last)), of in results.items()]
    draws = f"{runs} draws of the noise" if runs > 1 else "one draw, every second step"
    title = f"Ranges of the SWellEx-96 tow by the curvature of the wavefronts, 10 dB, {draws}"
    figures = {"track": _draw({model: draws[0] for model, draws in drawn.items()})}
    return Report(title, COLUMNS, rows, REMARKS, figures, COLUMNS[:-1], results, CAPTIONS)


REMARKS = (
    f"SVALSE has 63 elements, and the solver takes at least 15 dB below the field as noise. An "
    f"estimate counts where it is within {WITHIN_DB:g} dB of the strongest of its step and within "
    f"{NEAR:g} degree of a path that is, and has a range where 1/R is above three of its standard "
    "deviations. Its range times the cosine of its elevation is compared with the horizontal "
    "range of the ship. NEES is the mean square of the error of 1/R over its standard deviation: "
    "1 where the deviations are right, more where they are too small.",
    "Rays are reflected at the sea floor. In the field of modes reflections from the mudstone "
    "below the sediment overlap with these paths, and ranges scatter more.",
)
CAPTIONS = {"track": "horizontal ranges of the paths, first draw of the noise"}


def ranges_of_draw(model: str, seed: int, draw: int, step: Int) -> PathRanges:
    """Track one draw of the noise, the same for both models, and match the estimates to paths.

    Examples
    --------
    >>> found = ranges_of_draw("rays", 0, 0, np.arange(281, 287))
    >>> bool(np.nanmedian(np.abs(found.ratio - 1)) < 0.3)
    True
    """
    distances = track()["range_m"][step - 1]
    scenario = TowPastLine(ranges=tuple(distances.tolist()), model=model)  # type: ignore[arg-type]  # one of MODELS
    trial = scenario.sample(np.random.default_rng([seed, draw]))
    return path_ranges(tracker_of(trial, WITH_RANGE).run(trial.measurements), trial, step)


def path_ranges(run: Run, trial: Trial, step: Int) -> PathRanges:
    """Match the estimates of some steps of the tow to its paths.

    Parameters
    ----------
    run : Run
        Run of a tracker of direction and range.
    trial : Trial
    step : ndarray of int, shape (n_steps,)
        Numbers of its steps in the experiment, from 1.
    """
    doa, distances = strong_directions(run), track()["range_m"][step - 1]
    near = np.abs(doa[:, :, None] - np.rad2deg(trial.truth)[:, None, :]) <= NEAR
    row, slot = np.nonzero(near.any(axis=2))
    R, cosine = run.range[row, slot], np.cos(run.doa[row, slot])
    finite = np.isfinite(R)
    ratio = np.where(finite, R * cosine / distances[row], np.nan)
    # 1/R has the deviation std(R)/R²
    error = (1 / R - cosine / distances[row]) * R**2 / run.range_std[row, slot]
    return PathRanges(step[row], ratio, np.where(finite, error, np.nan))


def scores(draws: Sequence[PathRanges], block: tuple[int, int]) -> RangeScores:
    """Return the scores of a block of steps, over all draws.

    Examples
    --------
    >>> one = PathRanges(np.array([1, 2, 3]), np.array([0.9, 1.0, np.nan]), np.array([1, 1, 9.0]))
    >>> found = scores([one], (1, 3))
    >>> found.found, found.ratio, round(found.error), round(found.share)
    (2.0, 0.95, 5, 67)
    """
    step, ratio, error = (np.concatenate(each) for each in zip(*draws, strict=True))
    here = (step >= block[0]) & (step <= block[1])
    with_range = here & ~np.isnan(ratio)
    if not with_range.any():
        return RangeScores(0.0, np.nan, np.nan, np.nan, np.nan, np.nan, 0.0)
    low, median, high = np.percentile(ratio[with_range], [16, 50, 84]).tolist()
    return RangeScores(
        float(with_range.sum()) / len(draws),
        median,
        low,
        high,
        100 * float(np.median(np.abs(ratio[with_range] - 1))),
        float(np.mean(error[with_range] ** 2)),
        100 * float(with_range.sum() / here.sum()),
    )


def _draw(drawn: Mapping[str, PathRanges]) -> Figure:
    """Draw the horizontal ranges of each model over the steps, and those of the ship."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    axes, ship = figure.subplots(len(drawn), sharex=True), track()
    for ax, (model, found) in zip(axes, drawn.items(), strict=True):
        ax.plot(ship["step"], ship["range_m"], color="black", linewidth=1, label="ship")
        ax.plot(found.step, found.ratio * ship["range_m"][found.step - 1], ".",
                color=PALETTE[0], label="paths")  # fmt: skip
        ax.set(xlim=(150, 350), ylim=(0, 4000), ylabel="range, m")
        ax.set_title(f"field by {model}", fontsize=11)
    legend_beside(axes[0])
    axes[-1].set_xlabel("step")
    return figure


def _error_within(model: str, limit: float, results: RangeResults) -> Decision:
    error = results[model, LATE].error
    return Decision(error <= limit, f"{error:.1f} %, {limit:g} % allowed")


def _unbiased(model: str, low: float, high: float, results: RangeResults) -> Decision:
    ratio = results[model, LATE].ratio
    return Decision(low <= ratio <= high, f"{ratio:.2f}, {low:g} to {high:g} allowed")


def _none_far(model: str, results: RangeResults) -> Decision:
    """Decide that few paths have a range beyond 2.5 km."""
    far, late = (results[model, block].share for block in (BLOCKS[0], LATE))
    numbers = f"{far:.0f} % of the estimates at a path in steps 101 to 200, {late:.0f} % in steps"
    return Decision(far < late / 2, f"{numbers} 251 to 350")


CLAIMS: tuple[Claim, ...] = tuple(
    Claim("swellex96-range", "", text, by_ours=decide, source="check")
    for text, decide in (
        ("the median error of the ranges is within its limit: rays, steps 251 to 350",
         partial(_error_within, "rays", 12.0)),
        ("the median ratio of the ranges to the ship's is near 1: rays, steps 251 to 350",
         partial(_unbiased, "rays", 0.9, 1.1)),
        ("beyond 2.5 km less than half as many paths have a range: modes",
         partial(_none_far, "modes")),
    )
)  # fmt: skip
