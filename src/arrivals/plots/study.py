"""Plots of metrics: over a parameter of the scenario, or over the steps of many runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import nearest, shown
from arrivals.plots.colours import METHOD_COLOURS, NEUTRAL, PALETTE
from arrivals.plots.labels import legend_beside, metric_label, parameter_label
from arrivals.typing import Float
from arrivals.validation import real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from arrivals.scenarios.experiments.study import Study

SPREAD = (10, 90)  # percent of the runs, of a band over steps


def plot_metric(
    study: Study | Mapping[str, ArrayLike],
    metric: str,
    *,
    x: str | None = None,
    methods: Sequence[str] | None = None,
    bound: Mapping[str, float] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw means over runs with bootstrap intervals, or with bands over the steps.

    Parameters
    ----------
    study : Study, or mapping of str to array_like of shape (n_runs, n_steps)
        Results of a study; or the metric of every run and step by method, NaN where it is not
        defined. The band of a method then holds 80 % of its runs, from 10 to 90 %.
    metric : str
        Name of the metric.
    x : str, optional
        Parameter of the scenarios that differs from case to case, such as "snr_db"; the axis
        shows the names of the cases if None. Only of a study.
    methods : sequence of str, optional
        Labels, in order; all of them if None. A listed method without the metric is an error,
        others are left out.
    bound : mapping of str to float, optional
        A lower bound by case, drawn in black; only of a study.
    ax : matplotlib Axes, optional
        Axes of a new figure if None.
        A figure of yours has room for the legend by `layout="constrained"`.

    Returns
    -------
    matplotlib Axes
        Axes with one curve per method, the legend beside them.

    Raises
    ------
    ValueError
        If a case lacks the parameter, the metric or a method is unknown, or a shape does not fit.

    Examples
    --------
    >>> from arrivals.scenarios import create, monte_carlo
    >>> cases = [create("svalse_fig6", n_steps=5, snr_db=snr) for snr in (10.0, 20.0)]
    >>> ax = plot_metric(monte_carlo(cases, ["cbf"], runs=2), "gospa", x="snr_db")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('SNR, dB', 'GOSPA, degrees')
    >>> ax = plot_metric({"svalse": [[3.0, 1.0], [2.0, 1.0]]}, "gospa")
    >>> ax.lines[0].get_ydata()
    array([2.5, 1. ])
    """
    from arrivals.plots.bearing_time import new_axes

    if isinstance(study, Mapping):
        for name, value in (("x", x), ("bound", bound)):
            if value is not None:
                raise ValueError(f"{name} must be None for metrics over steps; got {shown(value)}")
        chosen = _over_steps(study, methods)
        ax = new_axes((7.6, 4.4)) if ax is None else ax
        for n, (label, values) in enumerate(chosen.items()):
            _draw_steps(ax, values, label, _colour(label, n))
        ax.set(xlabel="step", ylabel=metric_label(metric))
        return _finish(ax)
    ax = new_axes((7.6, 4.4)) if ax is None else ax
    positions = _positions(study, x)
    labels = study.methods if methods is None else list(methods)
    for n, label in enumerate(labels):
        try:
            _draw(ax, study, metric, label, positions, n)
        except ValueError:
            if methods is not None or len(labels) == 1:
                raise
    if bound:
        cases = [case for case in study.cases if case in bound]
        at = [positions[case] for case in cases]
        ax.plot(at, [bound[case] for case in cases], color="black", linewidth=1.2,
                linestyle="-" if len(at) > 1 else "", marker="" if len(at) > 1 else "_",
                markersize=18, label="bound")  # fmt: skip
    if x is None:
        ax.set_xticks(list(positions.values()), list(positions))
    ax.set(xlabel="" if x is None else parameter_label(x), ylabel=metric_label(metric, study.unit))
    return _finish(ax)


def _finish(ax: Axes) -> Axes:
    ax.grid(color="0.92")
    ax.set_axisbelow(True)
    legend_beside(ax)
    return ax


def _colour(label: str, n: int) -> str:
    """Return the colour of a method, of its tracker if that has one, else the n-th."""
    others = [each for each in (*PALETTE, NEUTRAL) if each not in METHOD_COLOURS.values()]
    return METHOD_COLOURS.get(label.partition(" ")[0], others[n % len(others)])


def _over_steps(values: Mapping[str, ArrayLike], methods: Sequence[str] | None) -> dict[str, Float]:
    """Return the metrics of the methods that are drawn, (n_runs, n_steps)."""
    labels = list(values) if methods is None else list(methods)
    for label in labels:
        if label not in values:
            hint = nearest(label, set(values))
            raise ValueError(f"methods must be in {sorted(values)}; got {label!r}: {hint}")
    chosen = {label: real(label, values[label]) for label in labels}
    for label, each in chosen.items():
        if each.ndim != 2 or each.size == 0:
            raise ValueError(f"{label} must have shape (n_runs, n_steps); got {each.shape}")
        if np.isinf(each).any() or np.isnan(each).all():
            raise ValueError(f"{label} must have finite values, or NaN in part; got {shown(each)}")
    return chosen


def _draw_steps(ax: Axes, values: Float, label: str, colour: str) -> None:
    """Draw the mean of the runs and the band of most of them, without steps where all are NaN."""
    steps = np.flatnonzero(~np.isnan(values).all(axis=0))
    present = values[:, steps]
    low, high = np.nanpercentile(present, SPREAD, axis=0)
    ax.fill_between(steps, low, high, color=colour, alpha=0.2, linewidth=0)
    ax.plot(steps, np.nanmean(present, axis=0), color=colour, linewidth=1.5, label=label,
            linestyle="--" if " " in label else "-")  # fmt: skip


def _positions(study: Study, x: str | None) -> dict[str, float]:
    if x is None:
        return {case: float(n) for n, case in enumerate(study.cases)}
    scenarios = study.config["scenarios"]
    for case in study.cases:
        if x not in scenarios[case]:
            hint = nearest(x, set(scenarios[case]) - {"type"})
            raise ValueError(f"x must be a parameter of every case; {case} has no {x!r}: {hint}")
    return {case: float(scenarios[case][x]) for case in study.cases}


def _draw(
    ax: Axes, study: Study, metric: str, label: str, positions: Mapping[str, float], n: int
) -> None:
    means = np.array([study.mean(metric, label, case) for case in positions])
    ends = np.array([study.interval(metric, label, case) for case in positions])
    ends = np.where(np.isnan(ends), means[:, None], ends)
    variant = label.partition(" ")[2]
    style: dict[str, Any] = {
        "color": _colour(label, n),
        "marker": "o",
        "markersize": 4,
        "linewidth": 1.2,
        "capsize": 2,
        "linestyle": "" if len(positions) == 1 else "--" if variant else "-",
    }
    half_width = np.abs(ends.T - means)
    ax.errorbar(np.array(list(positions.values())), means, yerr=half_width, label=label, **style)
