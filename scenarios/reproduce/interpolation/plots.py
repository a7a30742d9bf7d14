"""Names, colours and axes of the figures of the studies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMES = {
    "B": "filter, two taps (B)",
    "C": "filter, eight taps (C)",
    "D": "filter, four baselines (D)",
    "E": "joint filter (E)",
    "E2": "joint filter (E2)",
    "conventional": "conventional",
    "mvdr": "MVDR",
}
COLOURS = {"B": "#d62728", "C": "#ff7f0e", "D": "#9467bd", "E": "#2ca02c", "E2": "#2ca02c",
           "conventional": "#1f77b4", "mvdr": "#17becf"}  # fmt: skip


def make_figure(
    n_rows: int, n_columns: int, size: tuple[float, float], **shared: Any
) -> tuple[Figure, list[Axes]]:
    """Return a figure and its axes, row by row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(n_rows, n_columns, squeeze=False, **shared)
    return figure, list(axes.ravel())
