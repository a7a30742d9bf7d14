"""Figures of the report on joint tracking: directions, AR coefficients, array, PACF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_above
from arrivals.scenarios.reproduce.ar_kalman.experiments import Experiment
from arrivals.scenarios.reproduce.ar_kalman.scores import Lines, Results
from arrivals.scenarios.simulations.autoregressive_sources import AutoregressiveField, SourceField
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = PALETTE[:3]
TRUTH: dict[str, Any] = {"color": "black", "linewidth": 1.4, "linestyle": (0, (4, 3)), "zorder": 5}
REPORTED: dict[str, Any] = {"linewidth": 1.0, "linestyle": ":"}
BAND: dict[str, Any] = {"alpha": 0.25, "linewidth": 0}


def draw_figure(number: int, parts: Sequence[tuple[Experiment, Lines]]) -> Figure:
    """Draw a figure of the report: (a) AR coefficients and (b) directions over intervals.

    Parameters
    ----------
    number : int
        Figs 1 to 4 have one of the two.
    parts : sequence of (Experiment, Lines)
        One column each.
    """
    from matplotlib.figure import Figure

    both = (_draw_coefficients, _draw_directions)
    draws = both if number > 4 else both[:1] if number == 1 else both[1:]
    figure = Figure(figsize=(4.0 * len(parts) + 1.5, 3.0 * len(draws) + 0.6), layout="constrained")
    axes = figure.subplots(len(draws), len(parts), squeeze=False, sharey="row")
    for (case, lines), column in zip(parts, axes.T, strict=True):
        for letter, ax, draw in zip("ab", column, draws, strict=False):
            draw(ax, case, lines)
            panel = f"({letter})" if len(draws) > 1 else ""
            ax.set_title(f"Fig. {number}{panel}: {case.name}", fontsize=10)
        column[-1].set_xlabel("interval")
    for ax, draw in zip(axes[:, 0], draws, strict=True):
        ax.set_ylabel("AR coefficients" if draw is _draw_coefficients else "direction, degrees")
    _name_lines(figure, parts[0][1].truth.shape[1], _draw_directions in draws)
    return figure


def _draw_directions(ax: Axes, case: Experiment, lines: Lines) -> None:
    at = np.arange(len(lines.truth))
    for k, colour in zip(range(lines.truth.shape[1]), COLOURS, strict=False):
        ax.fill_between(at, lines.low[:, k], lines.high[:, k], color=colour, **BAND)
        ax.plot(lines.ours[:, k], color=colour, linewidth=1.2)
        ax.plot(lines.report[:, k], color=colour, **REPORTED)
    ax.plot(lines.truth, **TRUTH)
    ax.set_ylim(lines.truth.min() - 25, lines.truth.max() + 25)


def _draw_coefficients(ax: Axes, case: Experiment, lines: Lines) -> None:
    at = np.arange(len(lines.coefficients))
    for k, colour in zip(range(lines.coefficients.shape[1]), COLOURS, strict=False):
        for i in range(lines.coefficients.shape[2]):
            low, high = lines.low_a[:, k, i], lines.high_a[:, k, i]
            ax.fill_between(at, low, high, color=colour, **BAND)
            ax.plot(lines.coefficients[:, k, i], color=colour, linewidth=1.2)
        if isinstance(case.scene, AutoregressiveField):
            for known in case.scene.coefficients[k]:
                ax.plot(at[[0, -1]], [known, known], **TRUTH)


def _name_lines(figure: Figure, n_sources: int, has_report: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    grey = "0.4"
    marks: list[Any] = [Line2D([], [], **TRUTH, label="truth")]
    marks += [Line2D([], [], color=colour, linewidth=1.2, label=f"source {k + 1}, ours, run 0")
              for k, colour in enumerate(COLOURS[:n_sources])]  # fmt: skip
    if has_report:
        marks.append(Line2D([], [], color=grey, **REPORTED, label="report's form, run 0 only"))
    marks.append(Patch(color=grey, **BAND, label="ours, 10 to 90 % of the runs"))
    figure.legend(
        handles=marks,
        loc="outside upper center",
        ncols=3 if figure.get_figwidth() < 7 else 6,
        fontsize=8,
        frameon=False,
    )


def draw_array(centred: SourceField, wide: SourceField) -> Figure:
    """Draw sensors and pairs of two arrays: M pairs and the centre are 2M + 1 sensors."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    for ax, scene in zip(figure.subplots(1, 2), (centred, wide), strict=True):
        model = scene.measurement
        wavelength = model.plain_wavelength("the sketch")
        manifold = ArrayManifold(model.array, wavelength)
        x = model.array.positions[:, 0] / wavelength
        for m, d in enumerate(manifold.distances):
            height = 0.25 + 0.3 * m
            for side in (-1, 1):
                ax.annotate("", (side * d, -height), (0.0, -height),
                            arrowprops={"arrowstyle": "<->", "color": COLOURS[m % 3]})  # fmt: skip
                ax.plot([side * d] * 2, [0.0, -height], color=COLOURS[m % 3], linewidth=0.7)
            ax.text(1.06 * x.max(), -height, f"$d_{m + 1}$ = {d:.3g} λ", va="center",
                    fontsize=9, color=COLOURS[m % 3])  # fmt: skip
        ax.plot([0.0, 0.0], [-0.4 - 0.3 * manifold.n_pairs, 0.0], color="0.6", linewidth=0.7)
        ax.plot(x, np.zeros_like(x), "o", color="black", markersize=9, zorder=4)
        _draw_wave(ax, float(manifold.distances[-1]))
        ax.set_title(f"M = {manifold.n_pairs}: {manifold.n_pairs} pair"
                     f"{'s' * (manifold.n_pairs > 1)} and the centre, "
                     f"{model.array.n_sensors} sensors", fontsize=10)  # fmt: skip
        ax.set(xlim=(-1.2 * x.max(), 1.6 * x.max()), ylim=(-1.4, 1.1), yticks=[],
               xlabel="position, wavelengths")  # fmt: skip
    return figure


def _draw_wave(ax: Axes, scale: float) -> None:
    """Draw broadside and a direction θ to the right of it."""
    ax.plot([0.0, 0.0], [0.0, 1.0], color="0.6", linestyle="--", linewidth=0.8)
    ax.annotate("", (0.06 * scale, 0.12), (0.55 * scale, 0.95), arrowprops={"arrowstyle": "->"})
    ax.text(0.14 * scale, 0.62, "θ", fontsize=12)
    ax.text(0.58 * scale, 0.92, "wave", fontsize=9)


def draw_pacf(results: Results) -> Figure:
    """Draw the partial autocorrelation of the voices with the band of 95 %, and short intervals."""
    from matplotlib.figure import Figure

    labels = [form for metric, form, _ in results if metric == "pacf"]
    figure = Figure(figsize=(9.5, 3.4), layout="constrained")
    axes = figure.subplots(1, 2, width_ratios=[2, 1])
    for n, label in enumerate(labels):
        kappa, order = results["pacf", label, ""], int(results["order", label, ""][0])
        _draw_stems(axes[0], kappa, 0.2 * n - 0.1, COLOURS[n], f"{label}: order {order}")
        share = results["share", label, ""]
        axes[1].bar(np.arange(1, len(share) + 1) + 0.4 * n - 0.2, 100 * share, 0.38,
                    color=COLOURS[n])  # fmt: skip
    band = float(results["band", labels[0], ""][0])
    axes[0].axhspan(-band, band, color="0.7", zorder=0, label=f"95 % band, ±{band:.3f}")
    axes[0].set_title("whole recordings", fontsize=10, pad=22)
    axes[0].set(xlabel="lag", ylabel="partial autocorrelation", xticks=range(1, 21, 2))
    axes[1].set_title("intervals of 30 samples with power", fontsize=10, pad=22)
    axes[1].axhline(5, color="black", linestyle=":", linewidth=1, label="white noise, 5 %")
    axes[1].set(xlabel="lag", ylabel="beyond their band, %", xticks=range(1, 5))
    legend_above(axes[0], 3)
    legend_above(axes[1], 1)
    return figure


def _draw_stems(ax: Axes, values: Float, shift: float, colour: str, label: str) -> None:
    at = np.arange(1, len(values) + 1) + shift
    ax.vlines(at, 0.0, values, color=colour, linewidth=1.2)
    ax.plot(at, values, "o", color=colour, markersize=4, label=label)
