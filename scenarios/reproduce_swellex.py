"""Figs 11 and 12 of SVALSE's paper: a tow past the SWellEx-96 array, its field simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.scenarios.metrics import mean_gospa, mean_rmse
from arrivals.scenarios.reproduce import Report
from arrivals.scenarios.swellex96 import WITHIN_DB, TowPastLine, track
from arrivals.scenarios.swellex_claims import Claim, claims
from arrivals.scenarios.swellex_figures import environment_figure, field_figure
from arrivals.scenarios.workers import spread
from arrivals.typing import Float, Int

if TYPE_CHECKING:
    from arrivals.trackers import Run

METHODS = ("cbf", "valse", "svalse")
BLOCKS = ((1, 350), (1, 100), (101, 200), (201, 250), (251, 350))  # steps, from 1
NEAR, AUDIBLE_DB = 1.5, 30.0  # degrees from a path, among those within so many dB


def swellex96(runs: int, seed: int) -> Report:
    """Track the tow by three methods, with and without element 43; `runs` draws of the noise.

    With a single run every second step is left out: a quick look.
    """
    step = steps(runs)
    scenario = TowPastLine(ranges=tuple(track()["range_m"][step - 1].tolist()))
    arrays = {63: scenario, 64: scenario.replace(missing=())}
    cases = [(arrays[n], name, seed, k) for n in arrays for name in METHODS for k in range(runs)]
    tracked = spread(found, cases)
    rows: list[tuple[Any, ...]] = []
    for place, (n, name) in enumerate((n, name) for n in arrays for name in METHODS):
        mine = [strong(run) for run in tracked[place * runs : (place + 1) * runs]]
        rows += [(n, name, *_row(scenario, mine, step, block)) for block in BLOCKS]
    first = dict(zip(((n, name) for n in arrays for name in METHODS), tracked[::runs], strict=True))
    figures = {
        "fig11": environment_figure(),
        "fig12": field_figure(arrays[63], first[63, "valse"], first[63, "svalse"], step, seed),
        "fig12-64": field_figure(arrays[64], first[64, "valse"], first[64, "svalse"], step, seed),
    }
    columns = ("elements", "method", "steps", "GOSPA", "std", "distance", "missed", "false", "RMSE",
               "found", "paths", "near a path, %")  # fmt: skip
    thinned = ", every second step" if runs == 1 else ""
    draws = f"{runs} draws of the noise" if runs > 1 else "one draw of the noise"
    title = f"Figs 11 and 12: the SWellEx-96 tow, simulated, 10 dB, {draws}{thinned}"
    remarks = (*REMARKS, _table(claims(scenario, step)))
    return Report(title, columns, rows, remarks, figures)


def steps(runs: int) -> Int:
    """Return the steps that are looked at, from 1: every second one in a quick look.

    Examples
    --------
    >>> steps(1)[:3], steps(4)[:3]
    (array([1, 3, 5]), array([1, 2, 3]))
    """
    return np.arange(1, 351, 2 if runs == 1 else 1)


REMARKS = (
    "The recordings are too large to ship: the field is a sum of normal modes in the experiment's "
    "water, over its sea floor, at the ship's ranges, with white noise. Element 43 was bad in the "
    "experiment: 63 elements are as there, 64 are the whole array, with the same noise.",
    f"Directions and paths more than {WITHIN_DB:g} dB below the strongest of their step are left "
    "out on both sides. GOSPA (cut-off 10 degrees), its parts and RMSE are degrees, `std` is that "
    f"of GOSPA over draws; the last column counts the directions found within {NEAR} degrees of a "
    f"path that is at most {AUDIBLE_DB:g} dB below the strongest.",
    "Holds: in steps 1 to 100, where many paths lie near each other, VALSE and SVALSE tell more "
    "of them apart than the conventional beamformer does. Does not show: that SVALSE is the better "
    "of the two there. It misses fewer paths and adds as many false ones; their GOSPA is the same "
    "within the spread of the draws.",
    "Near the closest approach (steps 251 to 350) they report more directions than there are "
    "paths: the array is 118 m long, its wavefronts are curved and the sound speed changes along "
    "it, so that one path is no plane wave, and at 20 dB a gridless method makes two or three "
    "of it. The paper has no figures to hold this against.",
    "The paper's statements on the field, and the simulated one:",
)


def found(scenario: TowPastLine, name: str, seed: int, draw: int) -> Run:
    """Track one draw of the noise; it is the same for all methods and arrays."""
    trial = scenario.sample(np.random.default_rng([seed, draw]))
    return trial.tracker(name).run(trial.measurements)


def strong(run: Run) -> Float:
    """Return the directions within 10 dB of the strongest of their step, degrees, else NaN."""
    size = np.nan_to_num(np.abs(run.amplitude))
    floor = size.max(axis=1, keepdims=True, initial=0.0) * 10 ** (-WITHIN_DB / 20)
    return np.where((size >= floor) & (size > 0), np.rad2deg(run.doa), np.nan)


def _row(
    scenario: TowPastLine, draws: list[Float], step: Int, block: tuple[int, int]
) -> tuple[Any, ...]:
    """Return the scores of a block of steps, means over the draws."""
    here = (step >= block[0]) & (step <= block[1])
    truth = np.rad2deg(scenario.truth())[here]
    audible = np.rad2deg(scenario.truth(AUDIBLE_DB))[here]
    scores = []
    for doa in (draw[here] for draw in draws):
        g = mean_gospa(truth, doa, c=10.0)
        n_found = (~np.isnan(doa)).sum(axis=1).mean()
        scores.append([g.total, g.distance, g.missed, g.false, mean_rmse(truth, doa, c=10.0),
                       n_found, 100 * share_near(doa, audible)])  # fmt: skip
    gospa, *parts, n_found, near = np.mean(scores, axis=0).tolist()
    std = float(np.std([s[0] for s in scores], ddof=1)) if len(scores) > 1 else np.nan
    n_paths = float((~np.isnan(truth)).sum(axis=1).mean())
    return (f"{block[0]}-{block[1]}", gospa, std, *parts, n_found, n_paths, near)


def share_near(doa: Float, paths: Float) -> float:
    """Return the share of directions (n_steps, n) that lie near one of the paths (n_steps, m).

    Examples
    --------
    >>> share_near(np.array([[1.0, 5.0, np.nan]]), np.array([[0.0, np.nan]]))
    0.5
    """
    distance = np.abs(doa[:, :, None] - paths[:, None, :])
    near = (distance < NEAR).any(axis=2)
    return float(near.sum() / max(1, (~np.isnan(doa)).sum()))


def _table(rows: list[Claim]) -> str:
    lines = ["| statement | paper | here |", "| --- | --- | --- |"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])
