"""Pictures of studies: a metric against a parameter of the scenario, with intervals and bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.plots.bearing_time import NEUTRAL, PALETTE

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
    """Draw means over runs with their bootstrap intervals, a colour a method.

    Parameters
    ----------
    study : Study
    metric : str
    x : str, optional
        Parameter of the scenarios that differs from case to case, such as "snr_db"; the cases
        stand side by side, by name, if None.
    methods : sequence of str, optional
        Labels, in order; all of them if None. A method without the metric is an error then, and
        left out otherwise.
    bound : mapping of str to float, optional
        A lower bound by case, drawn in black.
    ax : matplotlib Axes, optional
        A new figure's if None.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If no case has the parameter, or there is no such metric or method.

    Examples
    --------
    >>> from arrivals.scenarios import create, monte_carlo
    >>> cases = {f"{snr}": create("svalse_fig6", n_steps=5, snr_db=snr) for snr in (10.0, 20.0)}
    >>> ax = plot_metric(monte_carlo(cases, ["cbf"], runs=2), "gospa", x="snr_db")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('snr_db', 'gospa')
    """
    from arrivals.plots.bearing_time import new_axes

    ax = new_axes((6.4, 4.4)) if ax is None else ax
    places = _places(study, x)
    shown = study.methods if methods is None else list(methods)
    for n, label in enumerate(shown):
        try:
            _draw(ax, study, metric, label, places, n)
        except ValueError:
            if methods is not None or len(shown) == 1:
                raise
    if bound:
        cases = [case for case in study.cases if case in bound]
        at = [places[case] for case in cases]
        ax.plot(at, [bound[case] for case in cases], color="black", linewidth=1.2,
                linestyle="-" if len(at) > 1 else "", marker="" if len(at) > 1 else "_",
                markersize=18, label="bound")  # fmt: skip
    if x is None:
        ax.set_xticks(list(places.values()), list(places))
    ax.set(xlabel=x or "", ylabel=metric)
    ax.grid(color="0.92")
    ax.set_axisbelow(True)
    ax.legend(fontsize=8)
    return ax


def _places(study: Study, x: str | None) -> dict[str, float]:
    if x is None:
        return {case: float(n) for n, case in enumerate(study.cases)}
    scenarios = study.config["scenarios"]
    without = [case for case in study.cases if x not in scenarios[case]]
    if without:
        raise ValueError(f"x must be a parameter of every scenario; {without[0]} has no {x!r}")
    return {case: float(scenarios[case][x]) for case in study.cases}


def _draw(
    ax: Axes, study: Study, metric: str, label: str, places: Mapping[str, float], n: int
) -> None:
    means = np.array([study.mean(metric, label, case) for case in places])
    ends = np.array([study.interval(metric, label, case) for case in places])
    ends = np.where(np.isnan(ends), means[:, None], ends)
    any_colour = (*PALETTE, NEUTRAL)[n % (len(PALETTE) + 1)]
    name, _, variant = label.partition(" ")
    style: dict[str, Any] = {
        "color": METHOD_COLOURS.get(name, any_colour),
        "marker": "o",
        "markersize": 4,
        "linewidth": 1.2,
        "capsize": 2,
        "linestyle": "" if len(places) == 1 else "--" if variant else "-",
    }
    reach = np.abs(ends.T - means)
    ax.errorbar(np.array(list(places.values())), means, yerr=reach, label=label, **style)
