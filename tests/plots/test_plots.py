"""Plots: lines, colours, beam power, axes and files."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

import arrivals
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.description import from_description
from arrivals.plots import plot_array, plot_bearing_time
from arrivals.plots.bearing_time import save
from arrivals.trackers import CBF, DirectionEstimate, PositionEstimate, Run
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Complex

LINE = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)
CIRCLE = ArraySnapshot(SensorArray.uca(8, radius=0.4), wavelength=1.0, noise=0.01)


def run_of(steps: list[list[tuple[float, int, float]]]) -> Run:
    """Make a run from (degrees, label, existence) of each step."""
    recorder = RunRecorder(DirectionEstimate)
    for step in steps:
        degrees, label, existence = np.array(step, dtype=float).reshape(-1, 3).T
        none = np.full(len(step), np.nan)
        recorder.add(
            DirectionEstimate(
                np.deg2rad(degrees), none, existence, none.astype(complex), label.astype(int)
            ),
            np.zeros(0),
        )
    return recorder.run(dt=1.0, elapsed=0.0)


def scene(model: ArraySnapshot, n_steps: int = 20) -> Complex:
    doa = np.linspace(0.2, 0.6, n_steps)[:, None]
    return model.simulate(doa, 1.0, np.random.default_rng(0))


def drawn(ax: Any, name: str) -> Any:
    (artist,) = [each for each in ax.collections if each.get_label() == f"_{name}"]
    return artist


def lines(ax: Any) -> tuple[Any, Any]:
    return drawn(ax, "halo"), drawn(ax, "tracks")


def dots(ax: Any) -> Any:
    return drawn(ax, "dots")


def test_each_label_is_one_line_of_its_own_colour() -> None:
    ax = plot_bearing_time(run_of([[(10, 0, 1), (-40, 1, 1)], [(11, 0, 1), (-41, 1, 1)]]))
    _, tracks = lines(ax)
    np.testing.assert_allclose(tracks.get_segments()[0], [[0, 10], [1, 11]])
    first, second = tracks.get_colors()
    assert not np.array_equal(first, second)
    assert len(dots(ax).get_offsets()) == 0


def test_track_of_a_line_is_not_joined_across_endfire() -> None:
    steps: list[list[tuple[float, int, float]]] = [[(d, 0, 1)] for d in (85, 88, -87, -85)]
    _, tracks = lines(plot_bearing_time(run_of(steps)))
    ends = [segment[:, 1] for segment in tracks.get_segments()]
    np.testing.assert_allclose(ends, [[85, 88], [-87, -85]])


def test_existence_sets_the_opacity() -> None:
    ax = plot_bearing_time(run_of([[(10, 0, 0.25), (20, -1, np.nan)]]))
    assert dots(ax).get_facecolors()[:, 3].tolist() == [1.0, 0.25]


def test_directions_without_label_and_across_gaps_are_not_joined() -> None:
    ax = plot_bearing_time(run_of([[(10, -1, 1)], [(10, -1, 1), (3, 0, 1)], [], [(3, 0, 1)]]))
    assert len(lines(ax)[1].get_segments()) == 0
    assert len(dots(ax).get_offsets()) == 4


def test_track_through_180_degrees_is_split() -> None:
    run = run_of([[(178, 0, 1)], [(-178, 0, 1)], [(-175, 0, 1)]])
    ax = plot_bearing_time(run)
    assert len(lines(ax)[1].get_segments()) == 1
    assert ax.get_ylim() == (-180, 180)


@pytest.mark.parametrize(("model", "limit"), [(LINE, 90), (CIRCLE, 180)])
def test_beam_power_is_highest_at_the_source(model: ArraySnapshot, limit: int) -> None:
    z = scene(model)
    ax = plot_bearing_time(CBF(model).run(z), snapshots=z, measurement=model)
    (image,) = [c for c in ax.collections if isinstance(c, QuadMesh)]
    power = np.asarray(image.get_array())
    assert power.max() == 0
    degrees = np.linspace(-limit, limit, 361, endpoint=limit == 90)
    np.testing.assert_allclose(
        degrees[power.argmax(axis=0)], np.rad2deg(np.linspace(0.2, 0.6, 20)), atol=3
    )
    assert image.get_clim() == (-30, 0)
    assert ax.figure.axes[-1].get_ylabel() == "beam power, dB re maximum"


def test_long_recording_has_a_bounded_number_of_columns() -> None:
    z = scene(LINE, 4000)
    ax = plot_bearing_time(run_of([[]] * 4000), snapshots=z, measurement=LINE)
    (image,) = [c for c in ax.collections if isinstance(c, QuadMesh)]
    assert np.asarray(image.get_array()).shape[1] <= 1500


def test_snapshots_of_an_iterable_are_drawn_as_those_of_an_array() -> None:
    z = scene(CIRCLE, 3100)
    run, images = run_of([[]] * 3100), []
    for snapshots in (z, iter(z), list(z)):
        ax = plot_bearing_time(run, snapshots=snapshots, measurement=CIRCLE)
        (image,) = [c for c in ax.collections if isinstance(c, QuadMesh)]
        images.append(np.asarray(image.get_array()))
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])
    for wrong in (iter(z[1:]), iter([*z, z[0]])):
        with pytest.raises(ValueError, match="snapshots must have shape"):
            plot_bearing_time(run, snapshots=wrong, measurement=CIRCLE)


def test_long_track_has_a_bounded_number_of_segments_of_one_line() -> None:
    _, tracks = lines(plot_bearing_time(run_of([[(5, 3, 1)]] * 13_000)))
    at = np.array(tracks.get_segments())[:, :, 0]
    assert len(at) == 13_000 // 3
    np.testing.assert_array_equal(at[:, 1] - at[:, 0], 3)


def test_plot_draws_directions_or_a_map() -> None:
    ax = arrivals.plot(run_of([[(1, 0, 1)]] * 3), ax=Figure().add_subplot())
    assert (ax.get_xlabel(), ax.get_xlim()) == ("time, s", (-0.5, 2.5))
    positions = RunRecorder(PositionEstimate).run(1.0, 0.0)
    assert arrivals.plot(positions).get_xlabel() == "x, m"


def test_axis_shows_time_if_given() -> None:
    ax = plot_bearing_time(run_of([[(1, 0, 1)]] * 3), time=[10.0, 12.0, 14.0])
    assert ax.get_xlabel() == "time, s"
    assert ax.get_xlim() == (9, 15)


def test_plots_draw_into_the_given_axes() -> None:
    ax = Figure().add_subplot()
    assert plot_bearing_time(run_of([[(1, 0, 1)]]), ax=ax) is ax
    assert plot_array(SensorArray.ula(3, 0.5), ax=ax) is ax


@pytest.mark.parametrize("n_steps", [0, 1, 2])
def test_runs_without_sources_and_few_steps_are_drawn(n_steps: int, tmp_path: Path) -> None:
    z = np.zeros((n_steps, 8))
    ax = plot_bearing_time(CBF(LINE).run(z), snapshots=z, measurement=LINE)
    save(ax, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "array",
    [SensorArray.ula(9, 0.5), SensorArray.uca(40, 2.0), SensorArray(np.eye(3))],
)
def test_array_of_any_dimension_is_drawn(array: SensorArray, tmp_path: Path) -> None:
    ax = plot_array(array, directions=False)
    assert [text.get_text() for text in ax.texts] == list("123456789" if array.dim == 1 else "")
    save(ax, tmp_path / "array.png")


@pytest.mark.parametrize("clockwise", [False, True])
def test_array_picture_shows_element_1_and_0_degrees_where_directions_say(clockwise: bool) -> None:
    keys = {"kind": "uca", "n_sensors": 6, "radius": 2.0, "clockwise": clockwise}
    ax = plot_array(from_description(keys), clockwise=clockwise)
    place = {text.get_text(): np.array(text.xy) for text in ax.texts if text.get_text()}  # type: ignore[attr-defined]
    names = (ax.get_xlabel(), ax.get_ylabel())
    assert names == (("east, m", "north, m") if clockwise else ("x, m", "y, m"))
    ahead, aside = ([0, 1], [1, 0]) if clockwise else ([1, 0], [0, 1])
    for name in ("1", "0°"):
        np.testing.assert_allclose(place[name] / np.linalg.norm(place[name]), ahead, atol=1e-12)
    for name in ("2", "40°"):
        assert place[name] @ aside > 0


def test_invalid_arguments_are_refused() -> None:
    run = run_of([[(1, 0, 1)]] * 3)
    with pytest.raises(ValueError, match="measurement must be set with snapshots; got None"):
        plot_bearing_time(run, snapshots=np.ones((3, 8)))
    with pytest.raises(ValueError, match=r"snapshots must have shape \(3, 8\); got \(2, 8\)"):
        plot_bearing_time(run, snapshots=np.ones((2, 8)), measurement=LINE)
    with pytest.raises(ValueError, match="time must have shape"):
        plot_bearing_time(run, time=[1.0])
    with pytest.raises(ValueError, match="dynamic_range_db"):
        plot_bearing_time(run, snapshots=np.ones((3, 8)), measurement=LINE, dynamic_range_db=-1.0)
    with pytest.raises(TypeError, match="PositionEstimate"):
        plot_bearing_time(RunRecorder(PositionEstimate).run(1.0, 0.0))


def test_failed_picture_leaves_no_file(tmp_path: Path) -> None:
    ax = Figure().add_subplot()
    with pytest.raises(ValueError, match="suffix"):
        save(ax, tmp_path / "a.xyz")
    ax.set_title("$\\nonsense{$")
    with pytest.raises(ValueError, match="nonsense"):
        save(ax, tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_plots_import_no_matplotlib_and_drawing_no_pyplot() -> None:
    code = (
        "import sys, arrivals.plots as p; assert 'matplotlib' not in sys.modules;"
        "from arrivals.measurement_models import SensorArray as A; p.plot_array(A.ula(3, 1.0));"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
