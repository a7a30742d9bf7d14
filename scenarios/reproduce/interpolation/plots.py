"""Names, colours and axes of the figures of the studies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.measurement_models import ArraySamples
from arrivals.plots import plot_array
from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_below
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMES = {
    "literal": "loop as printed (literal)",
    "frozen": "the paper's loop (frozen)",
    "B": "two taps (B)",
    "C": "eight taps, default (C)",
    "D": "four baselines (D)",
    "E": "joint filter (E)",
    "E2": "joint filter (E2)",
    "conventional": "conventional",
    "mvdr": "MVDR",
}
LEAVES = "a bar that leaves the logarithmic axis reaches 0"  # for captions
ORDER = (9, 4, 1, 3, 7, 2, 2, 0, 5)  # of the colours
COLOURS = {name: PALETTE[n] for name, n in zip(NAMES, ORDER, strict=True)}


def make_figure(
    n_rows: int, n_columns: int, size: tuple[float, float], **shared: Any
) -> tuple[Figure, list[Axes]]:
    """Return a figure and its axes, row by row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(n_rows, n_columns, squeeze=False, **shared)
    return figure, list(axes.ravel())


def style(method: str) -> dict[str, Any]:
    """Return the style of a method's curve with marks."""
    return {"color": COLOURS[method], "label": NAMES[method], "marker": "o", "markersize": 4}


def draw_band(ax: Axes, x: Any, paths: Float, method: str, **other: Any) -> None:
    """Draw the median of the trials, (runs, n), and the band from their 10 to 90 %."""
    low, middle, high = np.percentile(paths, [10, 50, 90], axis=0)
    ax.fill_between(x, low, high, color=COLOURS[method], alpha=0.15, linewidth=0)
    ax.plot(x, middle, **{"color": COLOURS[method], "label": NAMES[method]} | other)


def draw_rmse(ax: Axes, x: Any, errors: Float, method: str) -> None:
    """Draw the RMSE of the trials, (runs, n), with two standard errors of the mean square.

    A bar that reaches zero leaves a logarithmic axis.
    """
    squares = np.square(errors)
    mean = squares.mean(axis=0)
    error = 2 * squares.std(axis=0, ddof=1) / np.sqrt(len(squares))
    low, high = np.sqrt(np.maximum(mean - error, 0.0)), np.sqrt(mean + error)
    rmse = np.sqrt(mean)
    ax.errorbar(x, rmse, (rmse - low, high - rmse), capsize=2, **style(method))


def draw_geometry(ax: Axes, model: ArraySamples, doa_deg: float) -> None:
    """Draw the sensors of a line, the fronts of a wave, and the delay of each sensor."""
    doa = np.deg2rad(doa_deg)
    plot_array(model.array, first=0, directions=False, ax=ax)
    for number in list(ax.texts):
        number.remove()  # the paper's sensors are numbered in the order of the wave
    positions, delay = model.array.positions[:, 0], float(model.delay(doa))
    towards = np.array([np.sin(doa), np.cos(doa)])  # to the source
    along = np.array([towards[1], -towards[0]])
    size = float(np.ptp(positions))
    for j, position in zip(model.grid_index, positions, strict=True):
        # the front reaches the largest coordinate first; the path that is left takes j delays
        path = np.array([positions.max() - position, 0.0]) @ towards
        ends = np.array([[position, 0.0], np.array([position, 0.0]) + path * towards])
        ax.plot(*ends.T, color=PALETTE[1], linewidth=1, zorder=2)
        ax.annotate(f"{j}Δ" if j > 1 else "Δ" if j else "", ends.mean(axis=0), (4, 2),
                    textcoords="offset points", fontsize=8, color=PALETTE[1])  # fmt: skip
        ax.annotate(f"{j + 1}", (position, 0), (0, -13), textcoords="offset points", fontsize=8)
    first = np.array([positions.max(), 0.0])
    for n in range(3):
        front = first + n * 0.25 * size * towards
        ends = front + np.array([[-0.95], [0.15]]) * size * along
        ax.plot(*ends.T, color=PALETTE[0], linewidth=1.2 if n == 0 else 0.8,
                label="wave fronts" if n == 0 else None)  # fmt: skip
    start, end = (tuple(first + share * size * towards) for share in (0.95, 0.6))
    ax.annotate("", end, start, arrowprops={"arrowstyle": "->"})
    ax.annotate("source", start, fontsize=9)
    ax.plot([first[0]] * 2, [0, 0.8 * size], color="0.6", linewidth=0.8, linestyle=":")
    ax.annotate(f"θ = {doa_deg:g}°", (first[0] + 0.02 * size, 0.6 * size), fontsize=9)
    ax.plot([], [], color=PALETTE[1], label=f"path left, samples; Δ = κ sin θ = {delay:g}")
    ax.set(aspect="equal", ylim=(-0.2 * size, 1.3 * size), xlim=(positions.min() - 0.1 * size,
           positions.max() + 0.8 * size), xlabel="position, samples of delay")  # fmt: skip
    legend_below(ax, 2)
