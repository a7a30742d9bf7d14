"""The paper's future work: a subset of the sensors, and cells that exchange posteriors only."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_beside
from arrivals.scenarios import create
from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decide, Decision, negative
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.signal_strength.graphs import draw_graph
from arrivals.scenarios.simulations.signal_strength import RSSTrial
from arrivals.trackers import VariationalSolver
from arrivals.trackers.rss.sensor_subset import update_by_cells
from arrivals.typing import Float, Int

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ALL, INFORMATION, NEAREST, CELLS = "all sensors", "information", "nearest", "cells"
COUNTS, CELL_COUNTS = (6, 10, 20, 40), (2, 4, 8)
NUMBERS = 7  # in a posterior: u and its variance, two coordinates, three entries of Σ
SETTLED = 5  # steps after which errors count
LOST = 20.0  # m
LEGEND = "number beside a mark: sensors or cells\nbars: two standard errors of the mean of logs"
COLOURS = {ALL: "k", INFORMATION: PALETTE[0], NEAREST: PALETTE[3], CELLS: PALETTE[2]}
REMARKS = (
    "Three crossing sources at 2 to 2.5 m/s, 100 sensors in a disc of 100 m (`rss_crossing`). "
    "Numbers sent: the readings that reach the centre in a step, and for a subset the positions "
    "and powers, 9 numbers, by which its sensors are chosen; for cells, the posteriors that one "
    "passes to the next, 7 numbers a source, while readings stay within a cell. Errors after 5 "
    "steps, median and 90 % quantile of all steps and sources, labels kept; lost: more than 20 m "
    "off. NEES, the normalised estimation error squared, is 2 if the stated covariances are true; "
    "p90: 90 % quantile.",
    "`VariationalSolver(sensors_used=n)` chooses the sensors with the largest expected decrease of "
    "the entropy, `sensor_choice=\"nearest\"` those nearest to a source; `update_by_cells` of "
    "`arrivals.trackers.rss.sensor_subset` updates by one cell after the other. Cells are sectors.",
    "First picture, left, after Fig. 1 of the paper: a source, its wavefronts and its velocity; "
    "right, Fig. 3.",
)  # fmt: skip


class NetworkErrors(NamedTuple):
    """Errors of a form in each run: medians, 90 % quantiles, shares lost, means of NEES."""

    median: Float
    p90: Float
    lost: Float
    nees: Float


Results = Mapping[tuple[str, int], NetworkErrors]


def forms() -> list[tuple[str, int]]:
    """Return the forms, with their numbers of sensors or cells."""
    subsets = [(choice, n) for choice in (INFORMATION, NEAREST) for n in COUNTS]
    return [(ALL, 100), *subsets, *((CELLS, n) for n in CELL_COUNTS)]


def numbers_sent(form: str, n: int, n_sources: int) -> int:
    """Return the numbers that are sent in a step.

    Examples
    --------
    >>> [numbers_sent(*form, n_sources=3) for form in ((ALL, 100), (NEAREST, 10), (CELLS, 4))]
    [100, 19, 63]
    """
    if form == CELLS:
        return (n - 1) * NUMBERS * n_sources
    return n if form == ALL else n + 3 * n_sources


def network(runs: int, seed: int) -> Report:
    """Accuracy against numbers sent: subsets of the sensors, and cells; the graph of the model."""
    scenario = create("rss_crossing")
    each: dict[tuple[str, int], list[tuple[float, float, float, float]]] = {}
    for run in range(runs):
        trial: Any = scenario.sample(np.random.default_rng([seed, run]))
        for key in forms():
            each.setdefault(key, []).append(_run(trial, *key))
    results = {key: NetworkErrors(*np.array(rows).T) for key, rows in each.items()}
    table: list[tuple[Any, ...]] = []
    for (form, n), one in results.items():
        error = standard_error(one.median)
        table.append(
            (form, n, numbers_sent(form, n, 3), *(float(part.mean()) for part in one), error)
        )
    columns = ("form", "sensors or cells", "numbers sent", "median m", "p90 m", "share lost",
               "NEES", "± of the median")  # fmt: skip
    first: Any = create("rss_table1_k3").sample(np.random.default_rng(seed))
    figures = {"graph": draw_graph(first), "messages": _draw(results)}
    title = f"Fewer messages, Sec. 5: {runs} runs"
    captions = {
        "graph": "Figs 1 and 3: sketch of one trial of rss_table1_k3, and graph of the model"
    }
    return Report(title, columns, table, REMARKS, figures, columns, results, captions)


def _run(trial: RSSTrial, form: str, n: int) -> tuple[float, float, float, float]:
    solver = VariationalSolver()
    if form in (INFORMATION, NEAREST):
        solver = VariationalSolver(sensors_used=n, sensor_choice=form)  # type: ignore[arg-type]
    tracker: Any = trial.tracker("rss_vb", solver=solver)
    groups = sectors(trial.measurement.sensors, n) if form == CELLS else []
    errors, squares = [], []
    for step, z in enumerate(trial.measurements):
        if step:
            tracker.predict()
        if groups:
            update_by_cells(tracker, z, groups)
        else:
            tracker.update(z)
        if step >= SETTLED:
            miss = tracker.estimate.position - trial.truth[step]
            errors.append(np.linalg.norm(miss, axis=1))
            solved = np.linalg.solve(tracker.estimate.covariance, miss[..., None])[..., 0]
            squares.append((miss * solved).sum(axis=1))
    error = np.array(errors)
    near = np.array(squares)[error < LOST]
    return (
        float(np.median(error)), float(np.quantile(error, 0.9)), float(np.mean(error >= LOST)),
        float(near.mean()) if near.size else np.nan,
    )  # fmt: skip


def sectors(sensors: Float, n: int) -> list[Int]:
    """Return the sensors of n sectors about their centre.

    Examples
    --------
    >>> sectors(np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]), 2)
    [array([3, 0]), array([1, 2])]
    """
    phi = np.arctan2(*(sensors - sensors.mean(axis=0)).T[::-1])
    return [np.asarray(part) for part in np.array_split(np.argsort(phi), n)]


def _draw(results: Results) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    ax = figure.subplots()
    for form, colour in COLOURS.items():
        points = [(numbers_sent(*key, 3), one.median) for key, one in results.items()
                  if key[0] == form]  # fmt: skip
        level = np.array([float(np.log(m).mean()) for _, m in points])
        half = np.array([2 * standard_error(np.log(m)) for _, m in points])
        bars = np.exp(level) * np.stack([1 - np.exp(-half), np.exp(half) - 1])
        ax.errorbar([x for x, _ in points], np.exp(level), bars, color=colour, marker="o",
                    capsize=3, label=form)  # fmt: skip
    for (form, n), one in results.items():
        if form != ALL:
            place = numbers_sent(form, n, 3), float(np.exp(np.log(one.median).mean()))
            offset = 4, -12 if form == INFORMATION else 6
            ax.annotate(f"{n}", place, offset, textcoords="offset points", fontsize=8,
                        color=COLOURS[form])  # fmt: skip
    ax.set(xlabel="numbers sent in a step", yscale="log",
           ylabel="median error, m (geometric mean of the runs)")  # fmt: skip
    legend_beside(ax, title=LEGEND, title_fontsize=8)
    ax.grid(alpha=0.3)
    return figure


# -- claims -------------------------------------------------------------------------------------


def within(first: tuple[str, int], second: tuple[str, int], factor: float) -> Decide:
    """Decide that the median error of one form is at most a factor times that of another.

    By the paired logarithms of the runs' medians, as the picture has them.
    """
    return partial(_within, first, second, factor)


def _within(
    first: tuple[str, int], second: tuple[str, int], factor: float, results: Results
) -> Decision:
    here, there = (np.log(results[form].median) for form in (first, second))
    d = here - there
    error = standard_error(d)
    means = [f"{_name(*form)} {np.exp(log.mean()):.2f} m with {numbers_sent(*form, 3)} numbers"
             for form, log in ((first, here), (second, there))]  # fmt: skip
    ratio = float(np.exp(d.mean()))
    numbers = f"{means[0]} a step, {means[1]}; {ratio:.2f} ± {ratio * error:.2f} times"
    return Decision(negative(float(d.mean() - np.log(factor)), error), numbers)


def _name(form: str, n: int) -> str:
    if form == CELLS:
        return f"{n} cells"
    return form if form == ALL else f"{n} by information" if form == INFORMATION else f"{n} nearest"


CLAIMS: tuple[Claim, ...] = (
    Claim("rss-network", "", "a fifth of the sensors, chosen by information, has an error of at "
          "most 1.5 times that of all", None, within((INFORMATION, 20), (ALL, 100), 1.5), "ours"),
    *(Claim("rss-network", "", f"{n} sensors chosen by information have a smaller error than the "
            f"{n} nearest", None, within((INFORMATION, n), (NEAREST, n), 1.0), "ours")
      for n in (10, 20)),
    Claim("rss-network", "", "four cells that exchange posteriors only have an error of at most "
          "1.1 times that of all sensors together", None, within((CELLS, 4), (ALL, 100), 1.1),
          "ours"),
)  # fmt: skip
