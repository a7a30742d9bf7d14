"""Columns of the figures of the page, from the steps of a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.live.steps import LiveScene, LiveStep
from arrivals.plots.colours import NEUTRAL, PALETTE
from arrivals.plots.maps import ellipse

BEAM_RANGE_DB = 9.0  # shown of the beam power, down from the maximum of each step
RAY = 0.85  # length of a direction in the polar view
LOWEST_ALPHA = 0.15  # of a source whose existence is 0
Columns = dict[str, Any]


def colour_of(label: int) -> str:
    """Return the colour of a label, dark for sources that are not tracked.

    Examples
    --------
    >>> colour_of(-1) == NEUTRAL, colour_of(0) == colour_of(len(PALETTE))
    (True, True)
    """
    return PALETTE[label % len(PALETTE)] if label >= 0 else NEUTRAL


def source_columns(steps: Sequence[LiveStep]) -> Columns:
    """Return a row a source and step: the columns of the tracks file, times, colours, opacities.

    Parameters
    ----------
    steps : sequence of LiveStep
        Steps of one kind of estimates.

    Returns
    -------
    dict of str to list
        Deviations as `low` and `high` edges of the direction where there are directions.

    Examples
    --------
    >>> from arrivals.trackers import DirectionEstimate
    >>> one = np.ones(1)
    >>> estimate = DirectionEstimate(0 * one, 0.1 * one, 0.5 * one, one + 0j, np.array([7]))
    >>> columns = source_columns([LiveStep(0, 0.5, estimate)])
    >>> columns["time"], columns["alpha"], round(columns["high"][0], 2)
    ([0.5], [0.5], 5.73)
    """
    rows = [{"time": step.time, **one} for step in steps for one in step.sources()]
    names = ("time", *steps[-1].estimate.columns) if steps else ("time",)
    columns: Columns = {name: [row[name] for row in rows] for name in names}
    existence = np.array([row.get("existence", np.nan) for row in rows], dtype=float)
    columns["colour"] = [colour_of(row.get("label", -1)) for row in rows]
    opaque = np.where(np.isnan(existence), 1.0, np.clip(existence, LOWEST_ALPHA, 1.0))
    columns["alpha"] = opaque.tolist()
    if "doa_deg" in columns:
        doa, std = (np.array(columns[name], dtype=float) for name in ("doa_deg", "std_deg"))
        columns["low"], columns["high"] = (doa - std).tolist(), (doa + std).tolist()
    return columns


def track_lines(columns: Columns, x: str, y: str, jump: float = np.inf) -> Columns:
    """Return one line a label through its points.

    Parameters
    ----------
    columns : dict of str to list
        Those of `source_columns`.
    x, y : str
        Names of the coordinates.
    jump : float
        Difference in y at which a line is interrupted, such as across 180 degrees.

    Returns
    -------
    dict of str to list
        `xs`, `ys` and `colour`; points without a label have no line.

    Examples
    --------
    >>> points = {"label": [3, -1, 3, 3], "t": [0.0, 0.0, 1.0, 2.0], "y": [1.0, 9.0, 2.0, 300.0]}
    >>> lines = track_lines(points, "t", "y", jump=180.0)
    >>> lines["xs"][0]
    [0.0, 1.0, nan, 2.0]
    """
    label = np.array(columns.get("label", []), dtype=int)
    lines: Columns = {"xs": [], "ys": [], "colour": []}
    for each in np.unique(label[label >= 0]).tolist():
        of_label = label == each
        at = np.array(columns[x], dtype=float)[of_label]
        value = np.array(columns[y], dtype=float)[of_label]
        breaks = np.flatnonzero(np.abs(np.diff(value)) > jump) + 1
        lines["xs"].append(np.insert(at, breaks, np.nan).tolist())
        lines["ys"].append(np.insert(value, breaks, np.nan).tolist())
        lines["colour"].append(colour_of(each))
    return lines


def beam_image(steps: Sequence[LiveStep], directions_deg: Sequence[float]) -> Columns:
    """Return the beam power of steps at equal times as an image of 256 levels.

    Parameters
    ----------
    steps : sequence of LiveStep
        Steps; those without a beam are at the lowest level.
    directions_deg : sequence of float
        Directions, degrees, equally spaced.

    Returns
    -------
    dict of str to list
        `image`, and its corner and size `x, y, dw, dh`; no image without steps.

    Examples
    --------
    >>> beam_image([], [0.0, 90.0])["image"]
    []
    """
    if not steps or not directions_deg:
        return {name: [] for name in ("image", "x", "y", "dw", "dh")}
    lowest = np.full(len(directions_deg), -np.inf)
    level = np.array([lowest if one.beam_db is None else one.beam_db for one in steps])
    share = 1 + np.maximum(level, -BEAM_RANGE_DB) / BEAM_RANGE_DB
    image: NDArray[np.uint8] = np.rint(255 * share).astype(np.uint8).T
    first, last = steps[0].time, steps[-1].time
    spacing = (last - first) / max(1, len(steps) - 1) or 1.0
    cell = directions_deg[1] - directions_deg[0]
    return {
        "image": [image], "x": [first - spacing / 2], "dw": [spacing * len(steps)],
        "y": [directions_deg[0] - cell / 2], "dh": [cell * len(directions_deg)],
    }  # fmt: skip


def polar_columns(step: LiveStep, scene: LiveScene) -> tuple[Columns, Columns, Columns]:
    """Return rays and sectors of the sources of a step, and the outline of the beam.

    Parameters
    ----------
    step : LiveStep
        The step.
    scene : LiveScene
        Whether directions are from broadside, which is upwards then.

    Returns
    -------
    rays, sectors, outline : dict of str to list
        In the unit circle; sectors reach one standard deviation to either side.
    """
    columns = source_columns([step])
    to_angle = (lambda deg: np.deg2rad(90.0 - np.asarray(deg))) if scene.line else np.deg2rad
    rays, sectors = dict(columns), dict(columns)
    doa, std = (np.array(columns[name], dtype=float) for name in ("doa_deg", "std_deg"))
    angle, half = to_angle(doa), np.deg2rad(np.nan_to_num(std))
    rays |= {"x": (RAY * np.cos(angle)).tolist(), "y": (RAY * np.sin(angle)).tolist()}
    sectors |= {"start": (angle - half).tolist(), "end": (angle + half).tolist()}
    outline: Columns = {"x": [], "y": []}
    if step.beam_db is not None:
        radius = 1 + np.maximum(step.beam_db, -BEAM_RANGE_DB) / BEAM_RANGE_DB
        around = to_angle(scene.directions_deg)
        outline = {"x": (radius * np.cos(around)).tolist(), "y": (radius * np.sin(around)).tolist()}
    return rays, sectors, outline


def sky_columns(columns: Columns) -> Columns:
    """Return source columns with x and y on a disc, the zenith in the middle, the horizon at 1.

    Parameters
    ----------
    columns : dict of str to list
        Those of `source_columns` with elevations.

    Returns
    -------
    dict of str to list

    Examples
    --------
    >>> sky_columns({"doa_deg": [90.0], "elevation_deg": [45.0]})["y"]
    [0.5]
    """
    azimuth = np.deg2rad(np.array(columns.get("doa_deg", []), dtype=float))
    elevation = np.array(columns.get("elevation_deg", []), dtype=float)
    radius = 1 - np.abs(elevation) / 90
    return {
        **columns,
        "x": (radius * np.cos(azimuth)).tolist(),
        "y": (radius * np.sin(azimuth)).tolist(),
    }


def ellipse_lines(step: LiveStep) -> Columns:
    """Return the outlines of the 95 % ellipses of the positions of a step.

    Parameters
    ----------
    step : LiveStep
        A step with positions.

    Returns
    -------
    dict of str to list
        `xs`, `ys` and `colour`.
    """
    lines: Columns = {"xs": [], "ys": [], "colour": []}
    for one in step.sources():
        sx, sy, corr = one["std_x_m"], one["std_y_m"], one["corr"]
        spread = np.array([[sx**2, corr * sx * sy], [corr * sx * sy, sy**2]])
        if np.isfinite(spread).all():
            x, y = ellipse(np.array([one["x_m"], one["y_m"]]), spread)
            lines["xs"].append(x.tolist())
            lines["ys"].append(y.tolist())
            lines["colour"].append(colour_of(one["label"]))
    return lines


def channel_columns(step: LiveStep) -> Columns:
    """Return number and level of each channel of a step.

    Parameters
    ----------
    step : LiveStep
        The step.

    Returns
    -------
    dict of str to list
        `channel` from 1, and `level`, dB; empty without levels.
    """
    level = np.zeros(0) if step.channel_db is None else step.channel_db
    finite = np.where(np.isfinite(level), level, np.nan)
    return {"channel": list(range(1, len(level) + 1)), "level": finite.tolist()}
