"""Plots of honesty: stated against observed existence, and coverage of the stated intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.plots.colours import NEUTRAL, PALETTE
from arrivals.plots.labels import legend_beside
from arrivals.typing import Float, Int
from arrivals.validation import real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEVELS = np.linspace(0.05, 0.95, 19)  # stated shares of errors


def plot_reliability(
    stated: Any,
    errors: ArrayLike | None = None,
    *,
    label: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw observed over stated shares, with 95 % binomial intervals.

    Of probabilities of existence: the share of sources that are there. Of standard deviations: the
    share of errors within the central interval of a Gaussian that holds a stated share of them.
    A curve on the diagonal is honest; below it, the tracker is too sure.

    Parameters
    ----------
    stated : ReliabilityTable, or array_like of shape (n,)
        Table of `reliability(...)`, with `count`, `stated` and `observed`; or, with `errors`,
        stated standard deviations.
    errors : array_like, shape (n,), optional
        Errors of the estimates, in the unit of the deviations. Estimates whose error or deviation
        is NaN are left out.
    label : str, optional
        Entry of the legend, beside the axes.
    ax : matplotlib Axes, optional
        Axes of a new figure if None; further curves have further colours.
        A figure of yours has room for the legend by `layout="constrained"`.

    Returns
    -------
    matplotlib Axes
        Observed share upwards, stated share to the right, both from 0 to 1.

    Raises
    ------
    TypeError
        If `stated` is not a table and there are no errors.
    ValueError
        If shapes differ, a deviation is not positive, or nothing is left to compare.

    Examples
    --------
    >>> from arrivals.scenarios import reliability
    >>> ax = plot_reliability(reliability([0.9, 0.9, 0.2], [True, True, False]).table)
    >>> ax.get_xlabel()
    'stated existence'
    >>> plot_reliability([1.0, 2.0], [0.5, -3.0]).get_xlabel()
    'stated share of errors'
    """
    from arrivals.plots.bearing_time import new_axes

    if errors is not None:
        shares, hits, counts = _within(stated, errors)
        names = ("stated share of errors", "observed share of errors")
    elif all(hasattr(stated, name) for name in ("count", "stated", "observed")):
        shares, counts = np.asarray(stated.stated), np.asarray(stated.count)
        hits = np.rint(np.asarray(stated.observed) * counts).astype(int)
        names = ("stated existence", "share of sources")
    else:
        raise TypeError(
            f"stated must be a table of reliability, or have errors; got {shown(stated)}"
        )
    ax = new_axes((5.6, 4.4)) if ax is None else ax
    if not ax.lines:
        ax.plot([0, 1], [0, 1], color=NEUTRAL, linewidth=1.0)
    observed = hits / counts
    spread = np.abs(_intervals(hits, counts) - observed)
    colour = PALETTE[len(ax.containers) % len(PALETTE)]
    style: dict[str, Any] = {"marker": "o", "markersize": 4, "linewidth": 1.2, "capsize": 2}
    ax.errorbar(shares, observed, yerr=spread, color=colour, label=label, **style)
    ax.set(xlabel=names[0], ylabel=names[1], xlim=(0, 1), ylim=(0, 1))
    ax.grid(color="0.92")
    ax.set_axisbelow(True)
    legend_beside(ax)
    return ax


def _within(std: Any, errors: ArrayLike) -> tuple[Float, Int, Int]:
    """Return stated shares, and errors within the interval of each, of how many."""
    from scipy.special import ndtri

    deviation, error = real("stated", std), real("errors", errors)
    if deviation.shape != error.shape or error.ndim != 1:
        raise ValueError(f"errors must have shape {deviation.shape}; got {error.shape}")
    known = ~(np.isnan(deviation) | np.isnan(error))
    if not known.any() or not (deviation[known] > 0).all():
        raise ValueError(f"stated must be positive deviations; got {shown(deviation)}")
    size = np.abs(error[known]) / deviation[known]
    widths = ndtri((1 + LEVELS) / 2)  # of a Gaussian, in standard deviations
    hits = (size[:, None] <= widths).sum(axis=0)
    return LEVELS, hits, np.full(len(LEVELS), known.sum())


def _intervals(hits: Int, counts: Int) -> Float:
    """Return the ends of 95 % intervals of shares, (2, n), by Wilson's formula."""
    from scipy.stats import binomtest

    tests = [binomtest(int(k), int(n)) for k, n in zip(hits, counts, strict=True)]
    return np.array([test.proportion_ci(method="wilson") for test in tests]).reshape(-1, 2).T


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
    legend_beside(ax, title=f"stated interval, dashed{bars}", title_fontsize=8)
    return ax
