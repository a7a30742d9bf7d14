"""Figures of the report on joint tracking: directions and AR coefficients over intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from arrivals.scenarios.simulations.autoregressive_sources import AutoregressiveField
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from arrivals.scenarios.reproduce.ar_kalman import Experiment

COLOURS = ("#1f77b4", "#d62728", "#2ca02c")


def draw_figure(number: int, parts: list[tuple[Experiment, Float]]) -> Figure:
    """Draw a figure of the report: directions over intervals, and AR coefficients below."""
    from matplotlib.figure import Figure

    n_rows = 1 if number in (2, 3, 4) else 2
    figure = Figure(figsize=(4.2 * len(parts) + 1, 3.2 * n_rows), layout="constrained")
    axes = figure.subplots(n_rows, len(parts), squeeze=False, sharey="row")
    for (case, lines), column in zip(parts, axes.T, strict=True):
        _draw_directions(column[0], lines)
        column[0].set_title(f"Fig. {number}: {case.name}")
        if n_rows == 2:
            _draw_coefficients(column[1], lines, case)
        column[-1].set_xlabel("interval")
    axes[0, 0].set_ylabel("direction, degrees")
    if n_rows == 2:
        axes[1, 0].set_ylabel("AR coefficients")
    return figure


def _draw_directions(ax: Axes, lines: Float) -> None:
    truth, estimates, plain = lines[:3]
    ax.plot(truth, color="black", linewidth=0.8, linestyle="--")
    for k, colour in zip(range(truth.shape[1]), COLOURS, strict=False):
        ax.plot(plain[:, k], color=colour, linewidth=0.8, alpha=0.4)
        ax.plot(estimates[:, k], color=colour, linewidth=1.2)
    labels = ("truth", "plain regression, as reported", "with the covariance rows")
    n = truth.shape[1]
    ax.legend([ax.lines[0], ax.lines[n], ax.lines[n + 1]], labels, fontsize=7)
    ax.set_ylim(truth.min() - 25, truth.max() + 25)


def _draw_coefficients(ax: Axes, lines: Float, case: Experiment) -> None:
    for k, colour in zip(range(lines.shape[2]), COLOURS, strict=False):
        for a in lines[3:]:
            ax.plot(a[:, k], color=colour, linewidth=1.0)
        if isinstance(case.scene, AutoregressiveField):
            for known in case.scene.coefficients[k]:
                ax.axhline(known, color="black", linewidth=0.8, linestyle="--")
