"""Maps with stations: marks, names, heading ticks, rays, and legends beside the map."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

import arrivals
from arrivals.measurement_models import ArraySnapshot, SensorArray, Station
from arrivals.plots import plot_map
from arrivals.plots.bearing_time import new_axes
from arrivals.plots.station_map import draw_bearings, draw_stations
from arrivals.recordings.fusion import BearingTable, FusedRun

PLACES = {"west": (0.0, 0.0), "east": (900.0, 0.0), "north": (400.0, 800.0)}
SOURCE = np.array([500.0, 300.0])


def fused() -> FusedRun:
    """Return positions of a source at rest."""
    keys = [{"name": name, "x_m": x, "y_m": y, "heading_deg": 0.0}
            for name, (x, y) in PLACES.items()]  # fmt: skip
    d = SOURCE - np.array([*PLACES.values()])
    azimuth, time = np.tile(np.arctan2(d[:, 1], d[:, 0]), 5), np.repeat(np.arange(5.0), 3)
    table = BearingTable(time, np.tile([0, 1, 2], 5), azimuth, np.full(15, 3e-4))
    return arrivals.fuse({"station": keys}, bearings=table)


def rays(ax: Any) -> list[Any]:
    return [each for each in ax.collections if each.get_label() == "last bearings"]


def test_plot_of_fused_positions_has_stations_and_bearings_through_the_source() -> None:
    ax = arrivals.plot(fused())
    names = [text.get_text() for text in ax.texts]
    assert [name for name in names if name] == list(PLACES)
    segments = rays(ax)[0].get_segments()
    assert len(segments) == 3
    for (x0, y0), (x1, y1) in segments:
        along, away = np.array([x1 - x0, y1 - y0]), SOURCE - [x0, y0]
        across = along[0] * away[1] - along[1] * away[0]
        assert abs(across) / np.hypot(*along) < 1e-6 * np.hypot(*along)
    legend = cast(Any, ax.get_legend())
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == ["source 0", "stations", "last bearings"]


def test_rays_do_not_change_the_limits_and_the_legend_is_beside_the_map() -> None:
    run = fused()
    ax = plot_map(run, stations=run.stations, bearings=run.bearings)
    cast(Any, ax.figure).draw_without_rendering()
    assert ax.get_xlim()[0] > -600
    assert ax.get_xlim()[1] < 1500
    legend, inside = cast(Any, ax.get_legend()).get_window_extent(), ax.get_window_extent()
    assert legend.x0 >= inside.x1
    plain = plot_map(run)
    assert rays(plain) == []
    assert [text for text in plain.texts if text.get_text()] == []


def test_names_are_inside_the_axes_and_beside_the_ticks() -> None:
    model = ArraySnapshot(SensorArray.uca(4, 0.1), wavelength=1.0)
    headings = {"west": 3.5, "east": 0.1, "north": 1.6}  # away from the others
    stations = [Station(model, place, heading=headings[name], name=name)
                for name, place in PLACES.items()]  # fmt: skip
    ax = plot_map(fused(), stations=stations)
    cast(Any, ax.figure).draw_without_rendering()
    inside = ax.get_window_extent()
    texts = [cast(Any, text) for text in ax.texts]
    ticks = [text.arrow_patch.get_window_extent() for text in texts if not text.get_text()]
    labels = [text.get_window_extent() for text in texts if text.get_text()]
    assert len(ticks) == len(labels) == 3
    for label in labels:
        assert inside.x0 <= label.x0 < label.x1 <= inside.x1
        assert inside.y0 <= label.y0 < label.y1 <= inside.y1
    assert not any(label.overlaps(tick) for label in labels for tick in ticks)


def test_station_with_ready_made_bearings_and_no_heading_has_no_tick() -> None:
    ax = new_axes((3.0, 3.0))
    draw_stations(ax, [Station(None, [0.0, 0.0]), Station(None, [1.0, 0.0], heading=1.0)])
    assert len(ax.texts) == 1


def test_bearings_must_fit_the_stations() -> None:
    run = fused()
    with pytest.raises(ValueError, match="bearings must come with stations; got None"):
        plot_map(run, bearings=run.bearings)
    with pytest.raises(ValueError, match="bearings must be one a station, 3; got 2"):
        plot_map(run, stations=run.stations, bearings=run.bearings[:2])
    ax = new_axes((3.0, 3.0))
    draw_bearings(ax, run.stations, [None, None, None])  # nothing sets the limits
    assert rays(ax)[0].get_segments() == []


def test_tracks_have_different_colours_whatever_their_labels() -> None:
    run = fused()
    labels = np.where(run.label >= 0, 10 * np.arange(len(run))[:, None] + 1, -1)
    spread = replace(run, fields={**run.fields, "label": labels})
    ax = plot_map(spread)
    tracks = [line for line in ax.lines if str(line.get_label()).startswith("source")]
    assert [line.get_label() for line in tracks] == [f"source {10 * k + 1}" for k in range(5)]
    assert len({line.get_color() for line in tracks}) == 5
