"""Tracks over time: bands, pauses, colours, titles, legends, quantities."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from two_unknowns import range_estimate, run_of, sphere_estimate

import arrivals
from arrivals.measurement_models import (
    ArraySnapshot,
    LinearMeasurement,
    LogNormalRSS,
    SensorArray,
)
from arrivals.motion_models import RandomWalk
from arrivals.plots import plot_bearing_time, plot_map, plot_range, plot_sky, plot_tracks
from arrivals.plots.bearing_time import save
from arrivals.plots.colours import NEUTRAL, PALETTE, label_colours
from arrivals.scenarios import create
from arrivals.trackers import CBF, Kalman, RangeEstimate, Run, SphereEstimate
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Float

# Machado, Oliveira and Fernandes, 2009: linear RGB as seen without one kind of cones
BLINDNESS = {
    "none": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                     [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                   [0.004733, 0.691367, 0.303900]],
}  # fmt: skip


def tracks(*steps: list[tuple[float, int]], std_deg: float = 2.0) -> Run:
    """Return a run of (degrees, label) of each step, on the horizon."""
    estimates = []
    for step in steps:
        degrees, label = np.array(step, dtype=float).reshape(-1, 2).T
        estimates.append(sphere_estimate(degrees, 0 * degrees, label.astype(int), std_deg))
    return run_of(estimates, SphereEstimate)


def drawn(ax: Any, name: str) -> Any:
    (artist,) = [each for each in ax.collections if each.get_label() == f"_{name}"]
    return artist


def lab(colour: str, matrix: Any) -> Float:
    """Return CIELAB coordinates of a colour under D65."""
    srgb = np.array(to_rgb(colour))
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.asarray(matrix) @ linear, 0, 1)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    share = np.array(to_xyz) @ seen / [0.9505, 1.0, 1.089]
    x, y, z = np.where(share > 0.008856, np.cbrt(share), 7.787 * share + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("kind", BLINDNESS)
def test_colours_of_labels_differ_for_the_colour_blind(kind: str) -> None:
    points = np.array([lab(colour, BLINDNESS[kind]) for colour in (*PALETTE, NEUTRAL)])
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    assert apart[np.triu_indices(len(points), 1)].min() > 16


def test_label_has_one_colour_in_every_plot_and_no_other_label_has_it() -> None:
    run = tracks([(10, 3), (40, 13)], [(11, 3), (41, 13)])
    for draw in (plot_bearing_time, plot_sky, plot_tracks):
        seen = {to_hex(colour) for colour in drawn(draw(run), "tracks").get_colors()}
        assert seen == {PALETTE[3].lower(), PALETTE[4].lower()}
    later = tracks([(10, 3), (40, 13)], [(11, 3), (41, 13), (70, 14)])
    assert label_colours([3, 13, 14])[3] == label_colours([3])[3]
    assert len(set(label_colours(range(100, 110)).values())) == 10
    of_14 = drawn(plot_bearing_time(later), "dots").get_facecolors()
    assert to_hex(of_14[-1]) == PALETTE[5].lower()


def test_pause_is_a_thin_line_of_the_label_and_no_track() -> None:
    run = tracks([(10, 0)], [(11, 0)], [], [], [(13, 0), (60, 1)], [(14, 0)])
    ax = plot_bearing_time(run)
    np.testing.assert_allclose(drawn(ax, "pauses").get_segments(), [[[1, 11], [4, 13]]])
    assert drawn(ax, "pauses").get_linewidth()[0] < drawn(ax, "tracks").get_linewidth()[0] / 2
    assert len(drawn(ax, "tracks").get_segments()) == 2
    assert len(drawn(plot_sky(run), "pauses").get_segments()) == 1
    unlabelled = tracks([(10, -1)], [], [(11, -1)])
    assert len(drawn(plot_bearing_time(unlabelled), "pauses").get_segments()) == 0


def test_pause_across_180_degrees_is_not_joined() -> None:
    ax = plot_bearing_time(tracks([(170, 0)], [], [(-170, 0)]))
    assert len(drawn(ax, "pauses").get_segments()) == 0


def test_plane_waves_of_a_track_are_a_pause() -> None:
    ranges = [[50.0], [np.inf], [40.0], [], [30.0]]
    run = run_of([range_estimate(10 * np.arange(len(r)), r) for r in ranges], RangeEstimate)
    segments = drawn(plot_range(run), "pauses").get_segments()
    np.testing.assert_allclose(segments, [[[0, 50], [2, 40]], [[2, 40], [4, 30]]])


def test_bands_are_one_deviation_and_go_on_beyond_180_degrees() -> None:
    ax = plot_bearing_time(tracks([(100, 0), (179, 1)], [(110, 0), (179, 1)], std_deg=3.0))
    areas = [
        np.asarray(path.vertices)[:4]
        for each in ax.collections
        if each.get_label() == "_bands"
        for path in each.get_paths()
    ]
    wanted = [[[0, 97], [1, 107], [1, 113], [0, 103]], [[0, 176], [1, 176], [1, 182], [0, 182]],
              [[0, -184], [1, -184], [1, -178], [0, -178]]]  # fmt: skip
    np.testing.assert_allclose(sorted(areas, key=lambda area: float(-area[0, 1])),
                               sorted(wanted, key=lambda area: float(-area[0][1])))  # fmt: skip


def test_isolated_direction_has_a_bar_and_unknown_deviation_none() -> None:
    ax = plot_bearing_time(tracks([(100, 0)], std_deg=3.0))
    bars = [b for c in ax.collections if c.get_label() == "_bars" for b in c.get_segments()]  # type: ignore[attr-defined]
    np.testing.assert_allclose(bars, [[[0, 97], [0, 103]]])
    run = tracks([(100, 0)])
    unknown = replace(run, fields={**run.fields, "std": np.full((1, 1), np.nan)})
    ax = plot_bearing_time(unknown)
    assert [b for c in ax.collections if c.get_label() == "_bars" for b in c.get_segments()] == []  # type: ignore[attr-defined]


def test_one_colour_for_all_labels_leaves_unlabelled_directions_dark() -> None:
    ax = plot_bearing_time(tracks([(10, 0), (30, 5), (50, -1)]), colour="#123456")
    seen = [to_hex(colour) for colour in drawn(ax, "dots").get_facecolors()]
    assert sorted(seen) == ["#123456", "#123456", NEUTRAL]


def test_sky_shades_one_deviation_about_a_direction() -> None:
    run = run_of([sphere_estimate(90.0, 60.0, std_deg=4.0)], SphereEstimate)
    (area,) = drawn(plot_sky(run), "deviations").get_paths()
    low, high = area.vertices.min(axis=0), area.vertices.max(axis=0)
    np.testing.assert_allclose([low[1], high[1]], [26, 34], atol=0.05)  # 30 ± 4 from the zenith
    half = np.rad2deg(np.arctan(np.tan(np.deg2rad(4)) / np.cos(np.deg2rad(60))))  # of azimuth
    assert high[0] == pytest.approx(30 * np.sin(np.deg2rad(half)), rel=0.03)


def test_titles_have_the_settings_of_the_run_and_keep_a_given_title() -> None:
    array = SensorArray.uca(8, radius=0.05, speed=343.0)
    model = ArraySnapshot(
        array, [array.wavelength(f) for f in (500.0, 900.0)], noise=0.1, n_snapshots=4
    )
    z = model.simulate([[0.5], [0.6]], 1.0, np.random.default_rng(0))
    run = CBF(model).run(z)
    words = "CBF, 8 sensors in a plane, 500 to 900 Hz (2 bins), 4 snapshots a step, noise −10 dB"
    assert arrivals.plot(run, snapshots=z).get_title().replace("\n", " ") == words
    assert CBF(model).run_batch([z])[0].tracker == "CBF"
    ax = Figure().subplots()
    ax.set_title("mine")
    assert plot_bearing_time(run, ax=ax).get_title() == "mine"
    bare = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=2.0)
    one = CBF(bare).run([bare.steering_vector(0.5)])
    assert plot_tracks(one).get_title() == "CBF, 8 sensors on a line, wavelength 2 m"
    assert plot_bearing_time(replace(one, tracker="", measurement=None)).get_title() == ""


def test_title_of_a_map_has_sensors_and_shadowing() -> None:
    scene = rss_scene()
    ax = plot_map(scene.tracker("rss_vb").run(scene.measurements))
    assert ax.get_title() == "RSSVB, 100 sensors"
    shadowed = LogNormalRSS(scene.measurement.sensors, sigma=np.log(10) / 5)
    run = replace(scene.tracker("rss_vb").run(scene.measurements), measurement=shadowed)
    assert plot_map(run).get_title() == "RSSVB, 100 sensors, σ = 4 dB"


def rss_scene() -> Any:
    return create("rss_crossing", n_steps=3).sample(np.random.default_rng(0))


@pytest.mark.parametrize("name", ["map", "tracks"])
def test_legend_is_beside_the_axes(name: str) -> None:
    if name == "map":
        scene = rss_scene()
        run = scene.tracker("rss_vb").run(scene.measurements)
        ax: Any = plot_map(run, sensors=scene.measurement.sensors, truth=scene.truth)
    else:
        ax = plot_tracks(tracks([(10, 0)], [(12, 0)]), truth=[[0.1], [0.2]])
    ax.figure.draw_without_rendering()
    legend = ax.get_legend().get_window_extent()
    assert legend.x0 >= ax.get_window_extent().x1
    assert legend.x1 <= ax.figure.bbox.x1


def test_tracks_of_a_state_have_bands_of_its_covariance() -> None:
    model = LinearMeasurement([[1.0]], [[4.0]])
    run = Kalman(RandomWalk(1.0, n_dims=1), model, [0.0], [[9.0]]).run([[1.0], [2.0]])
    ax = arrivals.plot(run)
    (area,) = drawn(ax, "bands").get_paths()
    x, std = run.fields["x"][:, 0], np.sqrt(run.P[:, 0, 0])
    np.testing.assert_allclose(area.vertices[:4, 1], [*(x - std), *(x + std)[::-1]])
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["entry 0"]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("quantity", "value", "name"),
    [("doa", 10.0, "azimuth, degrees"), ("elevation", 40.0, "elevation, degrees (± 1 std)"),
     ("existence", 0.9, "existence")],
)  # fmt: skip
def test_tracks_of_each_quantity(quantity: str, value: float, name: str) -> None:
    run = run_of([sphere_estimate([10.0, 100.0], [40.0, 0.0])] * 2, SphereEstimate)
    ax = plot_tracks(run, quantity)
    first = drawn(ax, "tracks").get_segments()[0]
    np.testing.assert_allclose(first, [[0, value], [1, value]])
    assert ax.get_ylabel() == name


def test_tracks_of_coordinates_are_those_of_the_positions() -> None:
    scene = rss_scene()
    run = scene.tracker("rss_vb").run(scene.measurements)
    segments = np.array(drawn(plot_tracks(run, "y"), "tracks").get_segments())
    np.testing.assert_allclose(segments[:, 0, 1], run.position[:2, :, 1].T.ravel())


def test_truth_is_wrapped_and_not_joined_across_180_degrees() -> None:
    run = tracks([(170, 0)], [(178, 0)], [(-174, 0)])
    truth = np.deg2rad([[171.0, 30.0], [179.0, 31.0], [187.0, 32.0]])
    first, second = [
        np.asarray(line.get_xydata()) for line in plot_tracks(run, truth=truth).lines[:2]
    ]
    np.testing.assert_allclose(first[:, 0], [0, 1, np.nan, 2])
    np.testing.assert_allclose(first[:, 1], [171, 179, np.nan, -173])
    np.testing.assert_allclose(second[:, 1], [30, 31, 32])


def test_wrong_arguments_are_refused() -> None:
    run = tracks([(10, 0)])
    with pytest.raises(ValueError, match=r"quantity must be one of 'doa', .*; got 'speed'"):
        plot_tracks(run, "speed")
    with pytest.raises(TypeError, match="run must contain positions; got SphereEstimate"):
        plot_tracks(run, "x")
    with pytest.raises(ValueError, match=r"truth must have shape \(1, n_sources\); got \(2, 1\)"):
        plot_tracks(run, truth=[[1.0], [2.0]])
    with pytest.raises(TypeError, match="run must be a Run; got 3"):
        plot_tracks(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="normalize must be one of 'run', 'step'; got 'each'"):
        plot_bearing_time(run, normalize="each")  # type: ignore[arg-type]
    scene = rss_scene()
    places = scene.tracker("rss_vb").run(scene.measurements)
    with pytest.raises(ValueError, match="sensors must have 2 axes, the last of 2; got shape"):
        plot_map(places, sensors=[1.0, 2.0])
    with pytest.raises(ValueError, match="truth must have 3 axes, the last of 2; got shape"):
        plot_map(places, truth=np.zeros((3, 2)))


def test_empty_runs_of_every_kind_are_drawn(tmp_path: Any) -> None:
    for kind in (SphereEstimate, RangeEstimate):
        save(plot_tracks(RunRecorder(kind).run(1.0, 0.0)), tmp_path / "a.png", dpi=30)
    for name in ("x", "y"):
        empty = rss_scene().tracker("rss_vb").run([])
        save(plot_tracks(empty, name), tmp_path / "b.png", dpi=30)
