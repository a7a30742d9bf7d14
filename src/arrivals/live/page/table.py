"""Table of the present sources of the page, in HTML."""

from __future__ import annotations

import html
import math
from typing import Any

from arrivals.live.page.columns import colour_of
from arrivals.live.steps import LiveStep

UNITS = {"deg": "°", "db": "dB", "m": "m", "mps": "m/s"}
HIDDEN = ("corr",)  # columns of the tracks file that are left out
STYLE = "border-collapse: collapse; width: 100%; font: 13px sans-serif; color: #2b2f36"
CELL = "text-align: right; padding: 3px 12px; border-bottom: 1px solid #dfe3e8"


def table_html(columns: tuple[str, ...], step: LiveStep | None = None) -> str:
    """Return a table with a row a source, in the colour of its label.

    Parameters
    ----------
    columns : tuple of str
        Names of the columns of the tracks file.
    step : LiveStep, optional
        The present step; a table without rows if None.

    Returns
    -------
    str
        An element of HTML.

    Examples
    --------
    >>> table_html(("label", "doa_deg")).count("<th")
    2
    """
    shown = [name for name in columns if name not in HIDDEN]
    heads = "".join(f'<th style="{CELL}">{html.escape(title_of(name))}</th>' for name in shown)
    sources = [] if step is None else step.sources()
    rows = "".join(
        f"<tr>{''.join(_cell(name, one[name], one.get('label', -1)) for name in shown)}</tr>"
        for one in sources
    )
    return f'<table style="{STYLE}"><tr>{heads}</tr>{rows}</table>'


def _cell(name: str, value: Any, label: int) -> str:
    if name == "label":
        style = f"{CELL}; font-weight: bold; color: {colour_of(label)}"
        return f'<td style="{style}">&#9679; {"" if label < 0 else label}</td>'
    if isinstance(value, float):
        value = f"{value:.2f}" if math.isfinite(value) else ""
    return f'<td style="{CELL}">{html.escape(str(value))}</td>'


def title_of(name: str) -> str:
    """Return the title of a column of the tracks file.

    Examples
    --------
    >>> title_of("std_deg"), title_of("existence")
    ('std, °', 'existence')
    """
    words, _, unit = name.rpartition("_")
    named = f"{words}, {UNITS[unit]}" if unit in UNITS else name
    return named.replace("doa", "direction").replace("_", " ")
