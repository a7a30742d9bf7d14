"""Steps of a run as lines of JSON."""

from __future__ import annotations

import json
import math
from typing import Any

from arrivals.live.steps import LiveStep

DIGITS = 9  # as in the tracks file


def json_line(step: LiveStep) -> str:
    r"""Return a step as one JSON object in a line; numbers that are not finite are null.

    Parameters
    ----------
    step : LiveStep
        The step.

    Returns
    -------
    str
        With `step`, `time_s`, `lag_s` and `sources`; these by the columns of the tracks file.

    Examples
    --------
    >>> from arrivals.trackers import DirectionEstimate
    >>> json_line(LiveStep(3, 0.5, DirectionEstimate.empty()))
    '{"step": 3, "time_s": 0.5, "lag_s": null, "sources": []}\n'
    """
    sources = [{name: _cell(cell) for name, cell in one.items()} for one in step.sources()]
    content = {
        "step": step.number, "time_s": _cell(step.time), "lag_s": _cell(step.lag),
        "sources": sources,
    }  # fmt: skip
    return json.dumps(content) + "\n"


def _cell(value: Any) -> Any:
    if not isinstance(value, float):
        return value
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
