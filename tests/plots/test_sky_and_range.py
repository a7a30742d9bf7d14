"""Plots of azimuth and elevation, and of ranges: projection, gaps, colours, halves, limits."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.collections import PathCollection, PolyCollection
from two_unknowns import range_estimate, run_of, sphere_estimate

import arrivals
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.plots import plot_bearing_time, plot_range, plot_sky
from arrivals.plots.bearing_time import save
from arrivals.trackers import RangeEstimate, Run, SphereEstimate

LINE = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)


def sky(*steps: tuple[list[float], list[float]], label: list[int] | None = None) -> Run:
    return run_of([sphere_estimate(*step, label) for step in steps], SphereEstimate)


def ranges(*steps: list[float]) -> Run:
    return run_of([range_estimate(10 * np.arange(len(r)), r) for r in steps], RangeEstimate)


def segments(ax: Any) -> Any:
    (tracks,) = [c for c in ax.collections if c.get_label() == "_tracks"]
    return tracks.get_segments()


def dots(ax: Any) -> tuple[Any, Any]:
    alone, last = [c for c in ax.collections if isinstance(c, PathCollection)]
    return alone, last


def words(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.texts]


@settings(max_examples=30)
@given(st.floats(-180, 180), st.floats(0, 90))
def test_distance_from_the_middle_is_that_from_the_zenith(azimuth: float, elevation: float) -> None:
    _, last = dots(plot_sky(sky(([azimuth], [elevation]))))
    x, y = last.get_offsets()[0]
    assert np.hypot(x, y) == pytest.approx(90 - elevation, abs=1e-9)
    if elevation < 89:
        turn = np.rad2deg(np.arctan2(y, x)) - azimuth
        assert (turn + 180) % 360 - 180 == pytest.approx(0, abs=1e-9)


def test_compass_has_north_upwards_and_east_to_the_right() -> None:
    ax = plot_sky(sky(([0, 90], [0, 0])), clockwise=True)
    np.testing.assert_allclose(dots(ax)[1].get_offsets(), [[0, 90], [90, 0]], atol=1e-9)
    assert words(ax)[:2] == ["0° (north)", "90° (east)"]
    assert words(plot_sky(sky()))[:4] == ["0° (x)", "90° (y)", "180°", "−90°"]


def test_directions_below_the_horizon_are_on_a_second_disc() -> None:
    ax = plot_sky(sky(([0], [10]), ([0], [2]), ([0], [-3]), ([0], [-90])))
    drawn = np.concatenate(segments(ax))
    np.testing.assert_allclose(drawn, [[80, 0], [88, 0], [250 + 87, 0], [250, 0]])
    assert {"zenith in the middle", "nadir in the middle", "−30°"} <= set(words(ax))
    assert "nadir in the middle" not in words(plot_sky(sky(([0], [0]))))
    assert ax.get_xlim()[1] > 340


def test_gaps_break_tracks_and_a_label_keeps_its_colour() -> None:
    run = sky(([0, 90], [5, 60]), ([1, 91], [5, 60]), ([], []), ([2, 92], [5, 60]))
    ax = plot_sky(run)
    assert len(segments(ax)) == 2
    alone, last = dots(ax)
    assert len(alone.get_offsets()) == 2  # after the gap
    first, second = last.get_edgecolors()
    np.testing.assert_array_equal(alone.get_facecolors()[0], first)
    assert not np.array_equal(first, second)
    assert first[3] == 0.9  # the existence


def test_directions_without_label_have_no_end() -> None:
    alone, last = dots(plot_sky(sky(([0, 90], [5, 60]), label=[-1, -1])))
    assert (len(alone.get_offsets()), len(last.get_offsets())) == (2, 0)


def test_ends_of_many_tracks_are_not_marked() -> None:
    many = [float(k) for k in range(31)]
    assert len(dots(plot_sky(sky((many, many))))[1].get_offsets()) == 0
    assert len(dots(plot_sky(sky((many[:30], many[:30]))))[1].get_offsets()) == 30


def test_ranges_have_bands_of_one_deviation() -> None:
    ax = plot_range(ranges([50.0], [40.0]), time=[1.0, 1.5])
    np.testing.assert_allclose(segments(ax)[0], np.array([[1, 50], [1.5, 40]]))
    (areas,) = [c for c in ax.collections if isinstance(c, PolyCollection)]
    corners = np.asarray(areas.get_paths()[0].vertices)[:4]
    np.testing.assert_allclose(corners, np.array([[1, 45], [1.5, 36], [1.5, 44], [1, 55]]))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time, s", "range, m (± 1 std)")
    assert (ax.get_title(), ax.get_yscale(), ax.get_ylim()[0]) == ("", "linear", 0)


def test_plane_waves_are_left_out_and_counted_and_break_the_line() -> None:
    ax = plot_range(ranges([50.0], [np.inf], [49.0], [48.0]))
    np.testing.assert_allclose(segments(ax), [[[2, 49], [3, 48]]])
    assert ax.get_title() == "without plane waves, 25 % of the estimates"
    assert ax.get_xlabel() == "step"


def test_ranges_of_a_wide_span_have_a_logarithmic_axis() -> None:
    ax = plot_range(ranges([2.0, 8000.0]))
    assert ax.get_yscale() == "log"
    low, high = ax.get_ylim()
    assert low < 2 < 8000 < high


def test_range_without_deviation_has_no_band() -> None:
    unknown = replace(range_estimate(0, 50), range_std=np.full(1, np.nan))
    ax = plot_range(run_of([unknown, unknown], RangeEstimate))
    assert not [p for c in ax.collections if isinstance(c, PolyCollection) for p in c.get_paths()]
    assert len(segments(ax)) == 1


def test_plot_chooses_by_the_kind_of_the_run(tmp_path: Path) -> None:
    z = LINE.simulate(np.zeros((2, 1)), 1.0, np.random.default_rng(0))
    behind = {"snapshots": z, "measurement": LINE}
    on_sky = arrivals.plot(sky(([0], [10]), ([0], [20])), **behind)
    assert "0° (x)" in words(on_sky)
    over_time = arrivals.plot(ranges([50.0], [40.0]).at([3.0, 4.0]), **behind)
    above, below, _ = over_time.figure.axes
    assert over_time is below
    assert above.get_ylabel() == "direction of arrival, degrees"
    assert above.get_xlim() == below.get_xlim() == (2.5, 4.5)
    assert arrivals.plot(ranges([5.0]), ax=below) is below
    for ax in (on_sky, over_time):
        save(ax, tmp_path / "tracks.png", dpi=40)


@pytest.mark.parametrize("n_steps", [0, 1])
def test_runs_without_sources_are_drawn(n_steps: int, tmp_path: Path) -> None:
    for ax in (
        plot_sky(sky(*[([], [])] * n_steps)),
        plot_range(ranges(*[[]] * n_steps)),
        plot_range(ranges(*[[np.inf]] * n_steps)),
    ):
        save(ax, tmp_path / "tracks.png", dpi=40)


def test_runs_of_other_kinds_are_refused() -> None:
    with pytest.raises(TypeError, match="run must contain elevations; got RangeEstimate"):
        plot_sky(ranges([5.0]))
    with pytest.raises(TypeError, match="run must contain ranges; got SphereEstimate"):
        plot_range(sky(([0], [10])))
    with pytest.raises(ValueError, match="time"):
        plot_range(ranges([5.0]), time=[1.0, 2.0])


@pytest.mark.parametrize("draw", [plot_sky, plot_range, plot_bearing_time])
@pytest.mark.parametrize("run", [None, 3, "tracks.csv"])
def test_what_is_no_run_is_refused(draw: Any, run: Any) -> None:
    for plot, words in ((draw, "a Run"), (arrivals.plot, "a Run, or the result of locate")):
        with pytest.raises(TypeError, match=f"run must be {words}; got"):
            plot(run)


@pytest.mark.parametrize("time", [[2.0, 1.0], [1.0, 1.0], [0.0, np.nan], [0.0, np.inf]])
def test_times_must_increase(time: list[float]) -> None:
    run = run_of([range_estimate(10.0, 5.0)] * 2, RangeEstimate)
    for draw in (plot_range, plot_bearing_time):
        with pytest.raises(ValueError, match="time must be finite and increasing; got "):
            draw(run, time=time)


def test_axis_without_ranges_has_no_ticks() -> None:
    run = run_of([range_estimate(10.0, np.inf)] * 2, RangeEstimate)
    assert len(plot_range(run).get_yticks()) == 0
