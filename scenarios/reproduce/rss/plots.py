"""Fig. 4 of the paper on signal strength: starts, estimates and histograms of the powers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from arrivals.measurement_models import neper_to_db
from arrivals.plots.colours import PALETTE
from arrivals.scenarios.metrics.position_errors import assign
from arrivals.scenarios.reproduce.rss.trials import Draws, TrialEstimates
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_TRIALS = 300  # drawn
POWERS_DB = 15  # from the mean of the prior: edge of the histograms
VB, ML, OURS, TRUTH = PALETTE[0], PALETTE[3], PALETTE[2], PALETTE[1]


def draw_figure_4(
    cases: Sequence[tuple[str, float, Draws, Mapping[str, TrialEstimates]]],
) -> Figure:
    """Draw starts, estimates by Algorithm 1 and ML, powers, and our estimates beside them.

    Parameters
    ----------
    cases : sequence of tuple
        Name, radius of the disc of sensors, m, trials, and estimates by method.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 6.4), layout="constrained")
    axes = figure.subplots(len(cases), 5, squeeze=False)
    letters = iter("abcdefgh")
    for row, (case, disc, drawn, found) in zip(axes, cases, strict=True):
        positions = {
            "start": (drawn.problem.prior.theta, "0.45"),
            "VB, Algorithm 1": (found["vb_literal"].theta, VB),
            "ML": (found["lm"].theta, ML),
            "ours: VB, prior fixed": (found["vb"].theta, OURS),
        }
        for ax, (title, (theta, colour)) in zip(row[[0, 1, 2, 4]], positions.items(), strict=True):
            letter = "" if title.startswith("ours") else f"({next(letters)}) "
            _draw_positions(ax, theta[:MAX_TRIALS], drawn.theta[0], disc, colour)
            ax.set_title(f"{letter}{case}: {title}", fontsize=9)
            if title == "ML":
                _draw_powers(row[3], drawn, found)
                row[3].set_title(f"({next(letters)}) {case}: powers", fontsize=9)
        row[0].set_ylabel("y, m")
    edge, dots, truth = axes[0, 0].get_lines()
    handles = [edge, dots, truth, *axes[0, 3].patches, *axes[0, 3].get_lines()]
    names = ["edge of the sensors", "start or estimate of a trial", "true position",
             "powers: truth", "powers: start, all trials", "VB, Algorithm 1", "ML",
             "ours: VB, prior fixed"]  # fmt: skip
    figure.legend(handles, names, fontsize=8, loc="outside upper center", ncols=8, frameon=False)
    return figure


def _draw_positions(ax: Axes, theta: Float, truth: Float, disc: float, colour: str) -> None:
    flat = theta.reshape(-1, 2)
    shown = flat[np.isfinite(flat).all(axis=1)]
    phi = np.linspace(0, 2 * np.pi, 200)
    ax.plot(disc * np.cos(phi), disc * np.sin(phi), color="0.5", linestyle="--", linewidth=0.8)
    ax.plot(shown[:, 0], shown[:, 1], ".", color=colour, markersize=1.5)
    ax.plot(truth[:, 0], truth[:, 1], "o", color=TRUTH, fillstyle="none", markersize=9,
            markeredgewidth=1.6)  # fmt: skip
    edge = 1.3 * disc
    beyond = len(flat) - int((np.abs(shown) <= edge).all(axis=1).sum())
    ax.set(xlim=(-edge, edge), ylim=(-edge, edge),
           xlabel=f"x, m ({beyond} of {len(flat)} beyond the frame)")  # fmt: skip
    ax.xaxis.label.set_fontsize(8)
    ax.set_aspect("equal")


def _draw_powers(ax: Axes, drawn: Draws, found: Mapping[str, TrialEstimates]) -> None:
    """Draw histograms of the powers within 15 dB of the prior's mean; the others are counted."""
    mean = float(neper_to_db(drawn.problem.prior.mu[0, 0]))
    edges = np.linspace(mean - POWERS_DB, mean + POWERS_DB, 41)
    truth = neper_to_db(drawn.u)
    ax.stairs(_density(truth, edges), edges, fill=True, color="0.85")
    ax.axvline(mean, color="0.3", linestyle=":", linewidth=1.4)
    levels = {
        (VB, "-"): estimated_powers(found["vb_literal"], drawn),
        (ML, "--"): estimated_powers(found["lm"], drawn),
        (OURS, "-."): estimated_powers(found["vb"], drawn),
    }
    beyond = []
    for (colour, style), level in levels.items():
        ax.step(edges[:-1], _density(level, edges), style, where="post", color=colour,
                linewidth=1.2)  # fmt: skip
        beyond.append(level.size - int((np.abs(level - mean) <= POWERS_DB).sum()))
    vb, ml, ours = beyond
    outside = f"VB {vb}, ML {ml}, ours {ours} of {truth.size} beyond"
    ax.set(xlabel=f"power, dB ({outside})", ylabel="density, 1/dB")
    ax.xaxis.label.set_fontsize(8)


def _density(level: Float, edges: Float) -> Float:
    """Return the density of powers, 1/dB, with those beyond the edges counted in its unit."""
    return np.asarray(np.histogram(level, edges)[0] / (level.size * np.diff(edges)))


def estimated_powers(got: TrialEstimates, drawn: Draws) -> Float:
    """Return the estimated power of each true source, dB."""
    which = np.array([assign(t, s) for t, s in zip(got.theta, drawn.theta, strict=False)])
    return np.asarray(neper_to_db(np.take_along_axis(got.u, which, axis=1)))
