"""Plots of studies: a metric over a parameter of the scenario, with intervals and bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.messages import nearest
from arrivals.plots.bearing_time import NEUTRAL, PALETTE
from arrivals.plots.labels import metric_label, parameter_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from arrivals.scenarios.experiments.study import Study

METHOD_COLOURS = {
    "svalse": PALETTE[0], "valse": PALETTE[2], "ssbl": PALETTE[1], "sbl": PALETTE[6],
    "peaks_gnn": PALETTE[3], "cbf": PALETTE[7],
}  # fmt: skip


def plot_metric(
    study: Study,
    metric: str,
    *,
    x: str | None = None,
    methods: Sequence[str] | None = None,
    bound: Mapping[str, float] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw means over runs with bootstrap intervals, one colour per method.

    Parameters
    ----------
    study : Study
        Results of a study.
    metric : str
        Name of the metric.
    x : str, optional
        Parameter of the scenarios that differs from case to case, such as "snr_db"; the axis
        shows the names of the cases if None.
    methods : sequence of str, optional
        Labels, in order; all of them if None. A listed method without the metric is an error,
        others are left out.
    bound : mapping of str to float, optional
        A lower bound by case, drawn in black.
    ax : matplotlib Axes, optional
        Axes of a new figure if None.

    Returns
    -------
    matplotlib Axes
        Axes with one curve per method.

    Raises
    ------
    ValueError
        If a case lacks the parameter, or the metric or a method is unknown.

    Examples
    --------
    >>> from arrivals.scenarios import create, monte_carlo
    >>> cases = [create("svalse_fig6", n_steps=5, snr_db=snr) for snr in (10.0, 20.0)]
    >>> ax = plot_metric(monte_carlo(cases, ["cbf"], runs=2), "gospa", x="snr_db")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('SNR, dB', 'GOSPA, degrees')
    """
    from arrivals.plots.bearing_time import new_axes

    ax = new_axes((6.4, 4.4)) if ax is None else ax
    positions = _positions(study, x)
    shown = study.methods if methods is None else list(methods)
    for n, label in enumerate(shown):
        try:
            _draw(ax, study, metric, label, positions, n)
        except ValueError:
            if methods is not None or len(shown) == 1:
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
    ax.grid(color="0.92")
    ax.set_axisbelow(True)
    ax.legend(fontsize=8)
    return ax


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
    any_colour = (*PALETTE, NEUTRAL)[n % (len(PALETTE) + 1)]
    name, _, variant = label.partition(" ")
    style: dict[str, Any] = {
        "color": METHOD_COLOURS.get(name, any_colour),
        "marker": "o",
        "markersize": 4,
        "linewidth": 1.2,
        "capsize": 2,
        "linestyle": "" if len(positions) == 1 else "--" if variant else "-",
    }
    half_width = np.abs(ends.T - means)
    ax.errorbar(np.array(list(positions.values())), means, yerr=half_width, label=label, **style)
