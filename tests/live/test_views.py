"""What the views show of steps: lines of a terminal, JSON, beam power, columns of the page."""

import io
import json

import numpy as np
import pytest
from live_steps import CIRCLE, GRID, LINE, MAP, SKY, directions, line_steps, map_steps, sky_step

from arrivals.live.beam import FLOOR_DB, StepBeam, channel_levels
from arrivals.live.json_lines import json_line
from arrivals.live.page.columns import (
    beam_image,
    channel_columns,
    ellipse_lines,
    polar_columns,
    sky_columns,
    source_columns,
    track_lines,
)
from arrivals.live.page.table import table_html
from arrivals.live.steps import LiveScene, LiveStep, StepHistory
from arrivals.live.terminal import N_CELLS, TerminalView, has_colours
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.typing import Float

# JSON lines


def test_json_line_has_the_columns_of_the_tracks_file_and_null_for_nan() -> None:
    estimate = directions([10.0, -20.0], [3, 4])
    estimate.existence[1] = np.nan
    line = json_line(LiveStep(7, 0.5, estimate, lag=0.25))
    assert line.endswith("}\n")
    read = json.loads(line)
    assert {name: read[name] for name in ("step", "time_s", "lag_s")} == {
        "step": 7, "time_s": 0.5, "lag_s": 0.25,
    }  # fmt: skip
    assert read["sources"] == [
        {"label": 3, "doa_deg": 10.0, "std_deg": 2.0, "existence": 0.9, "level_db": 0.0},
        {"label": 4, "doa_deg": -20.0, "std_deg": 2.0, "existence": None, "level_db": 0.0},
    ]


# terminal


def drawn(scene: LiveScene, steps: list[LiveStep], colours: bool = False) -> list[str]:
    text = io.StringIO()
    view = TerminalView(scene, text.write, colours)
    for step in steps:
        view.show(step)
    return text.getvalue().splitlines()


def test_terminal_marks_labels_at_their_directions() -> None:
    lines = drawn(LINE, [LiveStep(0, 0.0, directions([-90, 0, 89.9], [1, 12, -1]))])
    strip = lines[-1].split("|")[1]
    assert len(strip) == N_CELLS
    assert (strip[0], strip[N_CELLS // 2], strip[-1]) == ("1", "2", "o")
    assert lines[-1].endswith("1: -90.0±2.0  12: 0.0±2.0  89.9±2.0")
    assert lines[1].split() == ["time,", "s", "-90", "0", "90", "degrees"]


def test_terminal_shades_are_darkest_at_the_highest_beam_power() -> None:
    beam = np.full(91, -30.0)
    beam[45] = 0.0
    strip = drawn(LINE, [LiveStep(0, 0.0, directions([], []), beam_db=beam)])[-1].split("|")[1]
    assert (strip.strip(), strip.index("#")) == ("#", N_CELLS // 2)


def test_terminal_has_a_line_each_quarter_of_a_second() -> None:
    steps = [LiveStep(k, 0.1 * k, directions(0.0, 1)) for k in range(11)]
    assert [line.split()[0] for line in drawn(CIRCLE, steps)[2:]] == ["0.0", "0.3", "0.6", "0.9"]


def test_terminal_names_lag_and_the_number_of_further_sources() -> None:
    line = drawn(CIRCLE, [LiveStep(0, 0.0, directions(np.zeros(9), np.arange(9)), lag=0.7)])[-1]
    assert line.endswith("5: 0.0±2.0  and 3 more  0.7 s late")


def test_terminal_colours_labels_only_where_asked() -> None:
    steps = [LiveStep(0, 0.0, directions(0.0, 1))]
    assert "\x1b" not in "".join(drawn(CIRCLE, steps))
    assert "\x1b[1;34m1:\x1b[0m 0.0±2.0" in drawn(CIRCLE, steps, colours=True)[-1]


def test_terminal_shows_elevations_and_positions() -> None:
    assert drawn(SKY, [sky_step()])[-1].endswith("4: 90.0±0.6/30.0")
    assert drawn(MAP, map_steps())[-1].split("  ")[-1] == "2: 5.0, 2.0 m"


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"TERM": "xterm"}, True),
        ({"TERM": "dumb"}, False),
        ({"TERM": "xterm", "NO_COLOR": "1"}, False),
    ],
)
def test_terminal_without_colours_is_recognised(
    variables: dict[str, str], expected: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.delenv("NO_COLOR", raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert has_colours(Terminal()) is expected


# beam power and levels


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (40, 1), (40, 20)])
def test_beam_of_a_step_is_highest_in_the_direction_of_the_source(shape: tuple[int, int]) -> None:
    array = SensorArray.uca(8, radius=0.05, speed=343.0)
    wavelengths = [array.wavelength(f) for f in np.linspace(2500, 3000, shape[0])]
    model = ArraySnapshot(array, wavelengths, n_snapshots=shape[1])
    rng = np.random.default_rng(0)
    w = rng.standard_normal((2, *shape, 1)).view()
    a = array.steering_vector(np.full(shape[0], 1.2), np.array(wavelengths))
    z = ((w[0] + 1j * w[1]) * a[:, None]).reshape(model.shape)
    z[..., 3] = np.nan  # a missing sensor
    beam = StepBeam(model)
    level = beam.level_db(z)
    assert level.max() == 0.0
    assert abs(beam.doa[level.argmax()] - 1.2) < np.deg2rad(4.0)


def test_beam_on_the_sphere_sees_a_source_of_any_elevation() -> None:
    array = SensorArray.uca(8, radius=0.05, speed=343.0)
    model = ArraySnapshot(array, array.wavelength(2500.0), unknowns="sphere")
    z = model.steering_vector(np.array(1.2), np.deg2rad(50.0))
    beam = StepBeam(model)
    assert abs(beam.doa[beam.level_db(z).argmax()] - 1.2) < np.deg2rad(4.0)


def test_beam_without_data_is_at_the_floor() -> None:
    model = ArraySnapshot(SensorArray.ula(4, 0.5), 1.0, n_snapshots=2)
    for z in (np.zeros((2, 4), complex), np.full((2, 4), np.nan + 0j)):
        np.testing.assert_array_equal(StepBeam(model).level_db(z), FLOOR_DB)


def test_channel_levels_are_mean_powers_in_db() -> None:
    z = np.array([[3.0, 4j, 0], [3.0, np.nan, 0]])
    np.testing.assert_allclose(channel_levels(z), [20 * np.log10(3), 20 * np.log10(4), -np.inf])


# columns of the page


def test_source_columns_have_a_row_a_source_and_step() -> None:
    estimate = directions([1.0, 2.0], [0, 10])
    columns = source_columns([LiveStep(0, 0.5, estimate), LiveStep(1, 0.6, directions(3.0, -1))])
    assert columns["time"] == [0.5, 0.5, 0.6]
    assert columns["colour"][0] == columns["colour"][1] != columns["colour"][2]
    np.testing.assert_allclose(columns["low"], [-1, 0, 1], atol=1e-12)
    np.testing.assert_allclose(columns["high"], [3, 4, 5])
    assert columns["alpha"] == [0.9] * 3


def test_track_lines_break_where_a_direction_crosses_180_degrees() -> None:
    steps = [LiveStep(k, float(k), directions(x, 5)) for k, x in enumerate((170.0, 179.0, -175.0))]
    lines = track_lines(source_columns(steps), "time", "doa_deg", jump=180.0)
    np.testing.assert_allclose(lines["ys"], [[170, 179, np.nan, -175]])
    assert track_lines(source_columns([]), "time", "time") == {"xs": [], "ys": [], "colour": []}


def test_beam_image_has_its_cells_about_times_and_directions() -> None:
    image = beam_image(line_steps(), GRID)
    assert (image["x"], image["y"], image["dh"]) == ([-0.05], [-91.0], [182.0])
    np.testing.assert_allclose(image["dw"], [0.5])
    assert image["image"][0].shape == (91, 5)
    brightest: Float = np.array(GRID)[image["image"][0].argmax(axis=0)]
    np.testing.assert_array_equal(brightest, [0, 10, 20, 30, 40])
    no_beam = beam_image([LiveStep(0, 0.0, directions(0.0, 1))], GRID)
    assert no_beam["image"][0].max() == 0


def test_polar_view_of_a_line_has_broadside_upwards() -> None:
    rays, sectors, outline = polar_columns(line_steps(4)[-1], LINE)
    assert np.arctan2(rays["x"][0], rays["y"][0]) == pytest.approx(np.deg2rad(30.0))
    width = np.subtract(sectors["end"], sectors["start"])
    np.testing.assert_allclose(np.rad2deg(width), 4.0)
    furthest = int(np.hypot(outline["x"], outline["y"]).argmax())
    assert outline["x"][furthest] == pytest.approx(np.sin(np.deg2rad(30.0)))


def test_polar_view_of_a_circle_has_azimuth_0_to_the_right() -> None:
    rays, _, outline = polar_columns(LiveStep(0, 0.0, directions(90.0, 1)), CIRCLE)
    assert (rays["x"][0], np.sign(rays["y"][0])) == (pytest.approx(0.0, abs=1e-12), 1.0)
    assert outline == {"x": [], "y": []}


def test_sky_has_the_horizon_on_the_unit_circle() -> None:
    columns = sky_columns(source_columns([sky_step()]))
    np.testing.assert_allclose([columns["x"][0], columns["y"][0]], [0, 2 / 3], atol=1e-12)


def test_ellipse_of_a_position_has_95_percent() -> None:
    lines = ellipse_lines(map_steps()[1])
    radius = np.sqrt(-2 * np.log(0.05))
    assert np.max(lines["xs"][0]) == pytest.approx(5 + 3 * radius, rel=1e-3)
    assert np.max(lines["ys"][0]) == pytest.approx(1 + radius, rel=1e-3)


def test_channel_without_power_has_no_level() -> None:
    columns = channel_columns(line_steps()[0])
    assert columns["channel"] == [1, 2]
    np.testing.assert_array_equal(columns["level"], [-10.0, np.nan])


def test_table_has_a_row_a_source_and_empty_cells_for_nan() -> None:
    estimate = directions([10.0, -20.0], [3, -1])
    estimate.std[1] = np.nan
    text = table_html(estimate.columns, LiveStep(0, 0.0, estimate))
    assert text.count("<tr>") == 3
    assert "nan" not in text
    assert ">-20.00<" in text
    assert "direction, °" in text


def test_history_keeps_the_latest_steps_in_order() -> None:
    history = StepHistory(3)
    for step in line_steps(5):
        history.append(step)
    assert [step.number for step in history.steps()] == [2, 3, 4]
    assert history.n_seen == 5
