"""Figures of the studies of SVALSE's paper: tracks over the beam power, and bars of GOSPA."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from arrivals.plots.bearing_time import plot_bearing_time
from arrivals.plots.colours import METHOD_COLOURS, NEUTRAL, PALETTE
from arrivals.plots.labels import legend_below
from arrivals.scenarios.base import Trial
from arrivals.scenarios.experiments.methods import tracker_name
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.metrics.registry import METRICS
from arrivals.scenarios.reproduce.svalse.decisions import paper_form
from arrivals.scenarios.reproduce.svalse.forms import AS_PRINTED
from arrivals.scenarios.reproduce.svalse.published_values import PAPER, REBUILT
from arrivals.scenarios.reproduce.svalse.step_metrics import gospa_steps
from arrivals.trackers.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PARTS = {"distance": "#9aa5b1", "missed": PALETTE[0], "false": PALETTE[1]}
TRUTH = PALETTE[2]
LABELLED = PALETTE[7]  # colour of all labels: not that of the truth, VALSE or SVALSE
TRUTH_MARKS: dict[str, Any] = {
    "color": TRUTH, "marker": "o", "markersize": 4.5, "markerfacecolor": "none",
    "markeredgewidth": 0.8, "linestyle": "",
}  # fmt: skip


class DrawnRun(NamedTuple):
    """A run of a method, and the trial with its truth.

    Parameters
    ----------
    method : str
        Label.
    trial : Trial
    run : Run
    """

    method: str
    trial: Trial
    run: Run


def draw_scene(drawn: Sequence[DrawnRun], paper: Mapping[str, float]) -> Figure:
    """Draw Figs 4 to 6: beam and truth, tracks, GOSPA over the steps; and the number of sources.

    Parameters
    ----------
    drawn : sequence of DrawnRun
        The same trial by VALSE and SVALSE, as printed in panels (b) and (c) and then by ours; by
        ours only in a quick study.
    paper : mapping of str to float
        The paper's GOSPA by tracker.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 10.0), layout="constrained")
    rows = [["a", "b"], ["c", "d"], ["e", "number"] if len(drawn) > 2 else ["number", "number"]]
    axes = list(figure.subplot_mosaic(rows).values())  # type: ignore[arg-type]  # names
    trial = drawn[0].trial
    _draw_beam_and_truth(axes[0], trial)
    axes[0].set_title("(a) truth, over the beam power", fontsize=10)
    ours = drawn[-1]
    for ax, letter, one in zip(axes[1:3], "bc", drawn, strict=False):
        _draw_run(ax, one)
        ax.set_title(f"({letter}) {_named(one.method)}", fontsize=10)
    _draw_gospa(axes[3], drawn, paper)
    if len(drawn) > 2:
        _draw_run(axes[4], ours)
        axes[4].set_title(f"(e) {_named(ours.method)}", fontsize=10)
    _draw_number(axes[-1], drawn)
    _one_bar(figure, axes[:2], [ax for ax in axes if ax.collections])
    _name_marks(figure)
    return figure


def draw_activation(drawn: Sequence[DrawnRun], paper: Sequence[float]) -> Figure:
    """Draw Fig. 7: tracks by extreme probabilities.

    Parameters
    ----------
    drawn : sequence of DrawnRun
    paper : sequence of float
        The paper's GOSPA of each.
    """
    n_rows = -(-len(drawn) // 2)
    figure, axes = panels(n_rows, 2, (12.0, 2.9 * n_rows + 0.5))
    for ax, letter, one, value in zip(axes, ascii_lowercase, drawn, paper, strict=False):
        _draw_run(ax, one)
        gospa = METRICS["gospa"](one.trial, one.run)
        title = f"({letter}) {one.method}: GOSPA {gospa:.1f}° (paper {value:g}°)"
        ax.set_title(title, fontsize=10)
    for ax in axes[len(drawn) :]:
        ax.set_axis_off()
    _one_bar(figure, axes, axes)
    _name_marks(figure)
    return figure


def _draw_run(ax: Axes, one: DrawnRun) -> None:
    trial = one.trial
    plot_bearing_time(
        one.run, snapshots=trial.measurements, measurement=trial.measurement,  # type: ignore[arg-type]  # complex
        colour=LABELLED, ax=ax,
    )  # fmt: skip
    _draw_truth(ax, trial)


def _named(method: str) -> str:
    return method if method in AS_PRINTED.values() else f"{method}, ours"


def _draw_beam_and_truth(ax: Axes, trial: Trial) -> None:
    empty = trial.tracker("valse").run(np.full_like(trial.measurements, np.nan))
    _draw_run(ax, DrawnRun("", trial, empty))


def _draw_truth(ax: Axes, trial: Trial) -> None:
    steps = np.broadcast_to(np.arange(len(trial.truth))[:, None], trial.truth.shape)
    ax.plot(steps, np.rad2deg(trial.truth), **TRUTH_MARKS, zorder=4)


def _draw_gospa(ax: Axes, drawn: Sequence[DrawnRun], paper: Mapping[str, float]) -> None:
    """Draw panel (d): GOSPA of every step."""
    for one in drawn:
        gospa, name = gospa_steps(one.trial, one.run), tracker_name(one.method)
        printed = one.method in AS_PRINTED.values()
        published = f" (paper {paper[name]:g}°)" if printed and name in paper else ""
        label = f"{_named(one.method)}: mean {gospa.mean():.2f}°{published}"
        ax.plot(gospa, marker="o" if printed else "", markersize=3, color=METHOD_COLOURS[name],
                linestyle="--" if printed else "-", linewidth=1.0, label=label)  # fmt: skip
    ax.set_title("(d) GOSPA of every step", fontsize=10)
    ax.set(xlabel="step", ylabel="GOSPA, degrees", ylim=(0, None))
    legend_below(ax, 2)


def _draw_number(ax: Axes, drawn: Sequence[DrawnRun]) -> None:
    """Draw the number of estimates over the steps."""
    there = (~np.isnan(drawn[0].trial.truth)).sum(axis=1)
    ax.step(np.arange(len(there)), there, where="mid", color=TRUTH, linewidth=4, alpha=0.5,
            label="sources")  # fmt: skip
    for one in drawn:
        printed = one.method in AS_PRINTED.values()
        ax.step(np.arange(len(there)), one.run.n_found, where="mid", linewidth=1.0,
                color=METHOD_COLOURS[tracker_name(one.method)], linestyle="--" if printed else "-",
                label=_named(one.method))  # fmt: skip
    ax.set_title("number of sources, and of estimates (not in the paper)", fontsize=10)
    top = max(there.max(), *(one.run.n_found.max() for one in drawn))
    ax.set(xlabel="step", ylabel="number", ylim=(0, top + 0.5))
    legend_below(ax, 3)


def _one_bar(figure: Figure, beside: Sequence[Axes], axes: Sequence[Axes]) -> None:
    """Replace the colour bars of the panels by one: they show the same beam power."""
    beams = [image for ax in axes for image in ax.collections if image.colorbar]
    for image in beams:
        if image.colorbar:
            image.colorbar.remove()
    if beams:
        bar = figure.colorbar(beams[0], ax=list(beside), shrink=0.9, aspect=25, extend="min")
        bar.set_label("beam power, dB re maximum")


def _name_marks(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    marks = [
        Line2D([], [], **TRUTH_MARKS, label="truth"),
        Line2D(
            [],
            [],
            marker="o",
            markersize=4,
            linestyle="",
            color=NEUTRAL,
            label="estimates without a label",
        ),
        Line2D([], [], linewidth=2, color=LABELLED, label="estimates, one line a label"),
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
                label="95 % interval of the mean")  # fmt: skip
    rebuilt = {method: values.gospa for method, values in REBUILT[name].items()}
    for values, marker, origin in ((rebuilt, "D", "rebuilt"), (PAPER[name], "*", "paper, one run")):
        known = {paper_form(method): value for method, value in values.items()}
        beside = {label: known[label] for label in known if label in labels}
        if not beside:  # a quick study, without the paper's form
            continue
        index = [labels.index(label) for label in beside]
        ax.plot(np.array(index) + 0.2, list(beside.values()), marker, color="black",
                markerfacecolor="white", label=origin)  # fmt: skip
    ax.set_xticks(at, [fill(label, 10) for label in labels])
    ax.set(ylabel="GOSPA, degrees")
    figure.legend(fontsize=8, loc="outside upper center", ncols=6, frameon=False)
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
