"""Figures of the studies of SVALSE's paper: tracks over the beam power, and bars of GOSPA."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from arrivals.plots.bearing_time import NEUTRAL, PALETTE, plot_bearing_time
from arrivals.scenarios.base import Scenario
from arrivals.scenarios.experiments.methods import Method, tracker_name
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.metrics.registry import METRICS
from arrivals.scenarios.reproduce.svalse.published_values import PAPER, REBUILT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PARTS = {"distance": "#9aa5b1", "missed": "#1f77b4", "false": "#d62728"}
TRUTH = "#00b050"


def draw_runs(
    scenario: Scenario, seed: int, shown: Sequence[Method], paper: Sequence[float]
) -> Figure:
    """Draw run 0 of a study by several methods over the beam power, the truth in green.

    Parameters
    ----------
    scenario : Scenario
        Scenario of the study.
    seed : int
        Seed of the study.
    shown : sequence of Method
        Methods, one panel each.
    paper : sequence of float
        The paper's GOSPA of each; NaN if it has none.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> figure = draw_runs(create("svalse_fig6", n_steps=2), 0, [Method("cbf")], [np.nan])
    >>> figure.axes[0].get_title()
    'cbf: GOSPA 12.6°, RMSE 5.7°'
    """
    seed_sequence = np.random.SeedSequence(seed, spawn_key=(0,))
    trial = scenario.sample(np.random.default_rng(seed_sequence))
    n_rows = -(-len(shown) // 2)
    figure, axes = panels(n_rows, 2, (12.0, 2.9 * n_rows + 0.5))
    for ax, method, value in zip(axes, shown, paper, strict=False):
        run = method.make(trial, seed_sequence).run(trial.measurements)
        plot_bearing_time(
            run, snapshots=trial.measurements, measurement=trial.measurement,  # type: ignore[arg-type]  # complex
            ax=ax,
        )  # fmt: skip
        steps = np.broadcast_to(np.arange(len(trial.truth))[:, None], trial.truth.shape)
        ax.plot(steps, np.rad2deg(trial.truth), ".", color=TRUTH, markersize=2, zorder=4)
        published = "" if np.isnan(value) else f" (paper {value:g}°)"
        gospa, rmse = (METRICS[metric](trial, run) for metric in ("gospa", "rmse"))
        title = f"{method.label}: GOSPA {gospa:.1f}°{published}, RMSE {rmse:.1f}°"
        ax.set_title(title, fontsize=10)
        ax.label_outer()
    for ax in axes[len(shown):]:  # fmt: skip
        ax.set_axis_off()
    _one_bar(figure, axes[: len(shown)])
    _name_marks(figure)
    return figure


def _one_bar(figure: Figure, axes: Sequence[Axes]) -> None:
    """Replace the colour bars of the panels by one: they show the same beam power."""
    beams = [image for ax in axes for image in ax.collections if image.colorbar]
    for image in beams:
        if image.colorbar:
            image.colorbar.remove()
    if beams:
        bar = figure.colorbar(beams[0], ax=list(axes), shrink=0.6, aspect=40, extend="min")
        bar.set_label("beam power, dB re maximum")


def _name_marks(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    marks = [
        Line2D([], [], marker=".", linestyle="", color=TRUTH, label="truth"),
        Line2D([], [], marker="o", markersize=4, linestyle="", color=NEUTRAL, label="estimates"),
        Line2D([], [], linewidth=2, color=PALETTE[0], label="estimates, one colour a label"),
    ]
    figure.legend(handles=marks, loc="outside upper center", ncols=3, fontsize=9, frameon=False)


def draw_parts(study: Study, name: str) -> Figure:
    """Draw GOSPA as one bar of three parts a method, with its confidence interval.

    Parameters
    ----------
    study : Study
        Study of one scenario.
    name : str
        Name of the scenario in `REBUILT`.
    """
    figure, (ax,) = panels(1, 1, (9.0, 3.8))
    labels = study.methods
    at, base = np.arange(len(labels)), np.zeros(len(labels))
    for part, colour in PARTS.items():
        heights = np.array([study.mean(part, method) for method in labels])
        ax.bar(at, heights, bottom=base, color=colour, width=0.6, label=part)
        base += heights
    ends = np.array([study.interval("gospa", method) for method in labels]).T
    ax.errorbar(at, base, yerr=np.abs(ends - base), color="black", fmt="none", capsize=3,
                label="95 % of the mean")  # fmt: skip
    rebuilt = {method: values.gospa for method, values in REBUILT[name].items()}
    for values, marker, origin in ((rebuilt, "D", "rebuilt"), (PAPER[name], "*", "paper, one run")):
        index = [n for n, method in enumerate(labels) if tracker_name(method) in values]
        ax.plot(np.array(index) + 0.2, [values[tracker_name(labels[n])] for n in index], marker,
                color="black", markerfacecolor="white", label=origin)  # fmt: skip
    ax.set_xticks(at, [label.replace(" ", "\n", 1) for label in labels])
    ax.set(ylabel="GOSPA, degrees")
    ax.legend(fontsize=8)
    return figure


def panels(n_rows: int, n_columns: int, size: tuple[float, float]) -> tuple[Figure, list[Axes]]:
    """Return a figure without a window, and its axes, row by row.

    Examples
    --------
    >>> len(panels(2, 3, (9.0, 6.0))[1])
    6
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, list(figure.subplots(n_rows, n_columns, squeeze=False).ravel())
