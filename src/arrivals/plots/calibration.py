"""Plots of honesty: stated against observed existence, and coverage of the stated intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.plots.bearing_time import NEUTRAL, PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_reliability(table: Any, *, label: str | None = None, ax: Axes | None = None) -> Axes:
    """Draw the observed share over the stated probability of existence, with 95 % intervals.

    Parameters
    ----------
    table : ReliabilityTable
        With `count`, `stated` and `observed`, as `reliability` returns it.
    label : str, optional
        Entry of the legend.
    ax : matplotlib Axes, optional
        Axes of a new figure if None.

    Returns
    -------
    matplotlib Axes

    Examples
    --------
    >>> from arrivals.scenarios import reliability
    >>> ax = plot_reliability(reliability([0.9, 0.9, 0.2], [True, True, False]).table)
    >>> ax.get_xlabel()
    'stated existence'
    """
    from scipy.stats import binomtest

    from arrivals.plots.bearing_time import new_axes

    if ax is None:
        ax = new_axes((4.8, 4.4))
    if not ax.lines:
        ax.plot([0, 1], [0, 1], color=NEUTRAL, linewidth=1.0)
    hits = np.rint(np.asarray(table.observed) * table.count).astype(int)
    ends = [
        binomtest(int(k), int(n)).proportion_ci(method="wilson")
        for k, n in zip(hits, table.count, strict=True)
    ]
    low, high = (np.array([getattr(end, side) for end in ends]) for side in ("low", "high"))
    spread = np.abs([table.observed - low, high - table.observed])
    colour = PALETTE[len(ax.containers) % len(PALETTE)]
    style: dict[str, Any] = {"marker": "o", "markersize": 4, "linewidth": 1.2, "capsize": 2}
    ax.errorbar(table.stated, table.observed, yerr=spread, color=colour, label=label, **style)
    ax.set(xlabel="stated existence", ylabel="share of sources", xlim=(0, 1), ylim=(0, 1))
    ax.grid(color="0.92")
    ax.set_axisbelow(True)
    if label is not None:
        ax.legend(fontsize=8)
    return ax


def plot_coverage(
    covered: Mapping[str, Sequence[float]],
    levels: ArrayLike,
    *,
    errors: Mapping[str, Sequence[float]] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the share of errors within the stated intervals, one row for each scene.

    Parameters
    ----------
    covered : mapping of str to sequence of float
        Shares by scene, in the order of `levels`.
    levels : array_like, shape (n_levels,)
        Nominal coverage, in (0, 1).
    errors : mapping of str to sequence of float, optional
        Standard errors of the shares, drawn as bars of two of them.
    ax : matplotlib Axes, optional
        Axes of a new figure if None.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If a scene does not have one share for each level.

    Examples
    --------
    >>> ax = plot_coverage({"walk": [0.67, 0.95]}, [0.68, 0.95])
    >>> [label.get_text() for label in ax.get_yticklabels()]
    ['walk']
    """
    from arrivals.plots.bearing_time import new_axes

    nominal = np.asarray(levels, dtype=np.float64)
    shares = np.array([np.asarray(row, dtype=np.float64) for row in covered.values()])
    if shares.shape != (len(covered), nominal.size):
        raise ValueError(
            f"covered must have one share for each of {nominal.size} levels; got {shares.shape}"
        )
    if ax is None:
        ax = new_axes((6.4, 1.2 + 0.28 * len(covered)))
    rows = np.arange(len(covered))
    for n, level in enumerate(nominal):
        colour = PALETTE[n % len(PALETTE)]
        ax.axvline(100 * level, color=colour, linewidth=0.8, linestyle="--")
        half = None if errors is None else [200 * errors[scene][n] for scene in covered]
        ax.errorbar(100 * shares[:, n], rows, xerr=half, fmt="o", color=colour, markersize=4,
                    elinewidth=0.8, label=f"{100 * level:g} %")  # fmt: skip
    ax.set_yticks(rows, list(covered))
    ax.invert_yaxis()
    ax.set(xlabel="errors within the stated interval, %", xlim=(0, 100))
    ax.grid(color="0.92", axis="x")
    ax.set_axisbelow(True)
    bars = "" if errors is None else "\nbars: two standard errors"
    ax.legend(fontsize=8, title=f"stated interval, dashed{bars}", title_fontsize=8,
              loc="best")  # fmt: skip
    return ax
