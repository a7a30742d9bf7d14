"""Tests of `arrivals locate` and of the map: outputs and errors."""

import csv
from pathlib import Path

import numpy as np
import pytest
from reading_tables import iso, sensors, text
from reading_tables import walk as walk_of_a_phone

import arrivals.scenarios
from arrivals.__main__ import main
from arrivals.plots.maps import ellipse, plot_map
from arrivals.recordings.networks import Network, calibrate
from arrivals.recordings.networks.tracking import locate_sources
from arrivals.scenarios import create, read_network
from arrivals.scenarios.reproduce.rss.measured_network import FLOOR_DB, track_transmitter
from arrivals.typing import Float

POWDER = Path(arrivals.scenarios.__file__).parent / "data" / "powder.npz"


def walk(n_steps: int = 12) -> tuple[Float, Float, Float]:
    """Return sensors, true positions, and levels in dBm of a walking source of 20 dBm at 1 m."""
    rng = np.random.default_rng(3)
    places = rng.uniform(0, 200, (25, 2))
    truth = np.stack([60 + 4.0 * np.arange(n_steps), np.full(n_steps, 90.0)], axis=-1)
    far = np.linalg.norm(truth[:, None] - places, axis=-1)
    levels = -20.0 - 20 * np.log10(np.maximum(far, 2)) + rng.normal(0, 1.0, far.shape)
    return places, truth, levels


def written(folder: Path) -> tuple[Path, Path]:
    places, _, levels = walk()
    sensors, readings = folder / "sensors.csv", folder / "readings.csv"
    name = [f"s{k}" for k in range(len(places))]
    with open(sensors, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["name", "x_m", "y_m"])
        table.writerows([one, *place] for one, place in zip(name, places.tolist(), strict=True))
    with open(readings, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["time_s", *name])
        for step, row in enumerate(levels):
            cells = ["" if step == 4 and k == 7 else f"{v:.2f}" for k, v in enumerate(row)]
            table.writerow([4 * step, *cells])
    return readings, sensors


def test_locate_writes_positions_and_a_map(tmp_path: Path) -> None:
    readings, sensors = written(tmp_path)
    out, plot = tmp_path / "positions.csv", tmp_path / "map.png"
    arguments = ["locate", str(readings), "--sensors", str(sensors), "--sources", "1",
                 "--sigma", "1", "--out", str(out), "--plot", str(plot), "--quiet"]  # fmt: skip
    assert main(arguments) == 0
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert list(rows[0]) == ["step", "time_s", "label", "x_m", "y_m", "std_x_m", "std_y_m",
                             "corr", "existence", "level_db"]  # fmt: skip
    assert [float(row["time_s"]) for row in rows] == [4.0 * k for k in range(12)]
    result = np.array([[float(row["x_m"]), float(row["y_m"])] for row in rows])
    assert np.abs(result - walk()[1]).max() < 8
    assert {row["label"] for row in rows} == {"0"}
    assert float(rows[-1]["level_db"]) == pytest.approx(-20.0, abs=1.5)
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_locate_prints_without_an_output_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings, sensors = written(tmp_path)
    command = ["locate", str(readings), "--sensors", str(sensors), "--sigma", "1", "--floor",
               "-97", "--quiet"]  # fmt: skip
    assert main(command) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("step,time_s,label,x_m")
    assert len(lines) == 11  # unknown number: the source is confirmed after two steps


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--sensors", "nowhere.csv"], "No such file"),
        (["--plot", "map.sketch"], "suffix of a picture"),
        (["--out", "nowhere/positions.csv"], "the folder does not exist"),
        (["--alpha", "-2"], "alpha must be finite and positive"),
        (["--sigma", "0"], "sigma must be positive"),
        (["--sources", "0"], "n_sources must be at least 1"),
        (["--sources", "few"], "--sources: must be a number or auto; got 'few'"),
        (["--missing", "100", "readings.csv"], "must be numbers; got 'readings.csv': write"),
        (["--group-by", "floor"], "group_by must be a column; got 'floor': found time_s, s0"),
        (["--window", "-1"], "window must be finite and positive"),
        (["--tracker", "svalse"], "must be one of "),
    ],
)
def test_locate_invalid_argument_prints_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: list[str], message: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    readings, sensors = written(tmp_path)
    monkeypatch.chdir(tmp_path)
    arguments = ["locate", str(readings), "--sensors", str(sensors), "--quiet"]
    assert main([*arguments, *change]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["readings.csv", "sensors.csv"]


def test_inputs_are_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    readings, sensors = written(tmp_path)
    before = readings.read_text()
    command = ["locate", str(readings), "--sensors", str(sensors), "--out", str(readings)]
    assert main(command) == 2
    assert "must be different files" in capsys.readouterr().err
    assert readings.read_text() == before


def test_times_must_increase() -> None:
    places, _, levels = walk(2)
    network = Network.fixed([str(k) for k in range(25)], places, levels, np.array([1.0, 1.0]))
    with pytest.raises(ValueError, match="time must increase"):
        locate_sources(network)


def test_ellipse_contains_its_probability() -> None:
    rng = np.random.default_rng(0)
    P = np.array([[4.0, 1.5], [1.5, 2.0]])
    drawn = rng.multivariate_normal([1.0, 2.0], P, 20000) - [1.0, 2.0]
    x, y = ellipse(np.array([1.0, 2.0]), P)
    edge = np.stack([x - 1.0, y - 2.0], axis=-1)
    reach = np.einsum("ni,ij,nj->n", edge, np.linalg.inv(P), edge)
    np.testing.assert_allclose(reach, reach[0], rtol=1e-9)
    inside = np.einsum("ni,ij,nj->n", drawn, np.linalg.inv(P), drawn) < reach[0]
    assert inside.mean() == pytest.approx(0.95, abs=0.01)


def test_map_shows_tracks_and_truth_and_rejects_directions() -> None:
    trial = create("rss_crossing", n_steps=6).sample(np.random.default_rng(0))
    run = trial.tracker("rss_vb").run(trial.measurements)
    ax = plot_map(run, sensors=np.zeros((2, 2)), truth=trial.truth, n_ellipses=3)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]  # type: ignore[union-attr]
    assert texts == ["sensors", "truth", "source 0", "source 1", "source 2"]
    assert len(ax.lines) == 3 * (1 + 1 + 3)
    line = create("svalse_fig4", n_steps=2).sample(np.random.default_rng(0))
    with pytest.raises(TypeError, match="run must contain positions; got DirectionEstimate"):
        plot_map(line.tracker("cbf").run(line.measurements))


def test_shipped_walk_is_tracked() -> None:
    network = read_network(POWDER)
    assert network.rss_db.shape[0] == 300
    known = calibrate(network.select(slice(150, 300)), floor_db=FLOOR_DB)
    assert 2.0 < known.alpha < 3.2
    result = track_transmitter(network.select(slice(0, 150)), known)
    assert np.median(result.error) < 250  # ten minutes calibrate the receivers poorly
    assert np.median(result.nees) < 5.991


def long_table(folder: Path, n_readings: int, fill: str = "") -> list[str]:
    """Write one reading a row of a walk, every fifth one missing; return arguments."""
    places, _, levels = walk(n_readings)
    (folder / "s.csv").write_text(
        "name,x_m,y_m\n" + "".join(f"s{k},{x},{y}\n" for k, (x, y) in enumerate(places.tolist()))
    )
    order = [(7 * step) % len(places) for step in range(n_readings)]
    (folder / "r.csv").write_text(
        "time_s,sensor,rss_db\n"
        + "".join(
            f"{0.1 * step},s{k},{fill if step % 5 == 2 else levels[0, k]}\n"
            for step, k in enumerate(order)
        )
    )
    return ["locate", str(folder / "r.csv"), "--sensors", str(folder / "s.csv"), "--quiet"]


@pytest.mark.parametrize("options", [[], ["--sources", "1"]])
def test_locate_finds_a_source_in_single_readings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str]
) -> None:
    arguments = long_table(tmp_path, 60)
    assert main([*arguments, "--sigma", "2", *options]) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert {row["label"] for row in rows} == {"0"}
    last = np.array([float(rows[-1]["x_m"]), float(rows[-1]["y_m"])])
    assert np.linalg.norm(last - [60.0, 90.0]) < 10


@pytest.mark.filterwarnings("always")
def test_locate_missing_names_a_fill_value(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = long_table(tmp_path, 60, fill="100")
    assert main([*arguments, "--missing", "100", "--missing", "-200"]) == 0
    named = capsys.readouterr()
    assert named.err == ""
    assert main(long_table(tmp_path, 60)) == 0
    assert capsys.readouterr().out == named.out
    assert main(long_table(tmp_path, 60, fill="100")) == 0
    assert "100 dB repeats far from all other readings" in capsys.readouterr().err


def test_locate_refuses_more_sources_than_sensors_with_readings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings, sensors = written(tmp_path)
    command = ["locate", str(readings), "--sensors", str(sensors), "--sources", "40", "--quiet"]
    assert main(command) == 2
    assert "n_sources must be at most 25, the number of sensors" in capsys.readouterr().err


def scan(folder: Path) -> list[str]:
    """Write a log of two devices at scattered times; return arguments."""
    late = np.random.default_rng(1)
    rows = [
        (iso(time + late.uniform(0, 0.9)), name, device, level)
        for device, seed in (("phone-1", 1), ("tag-2", 2))
        for time, name, level in walk_of_a_phone(12, seed=seed)
    ]
    (folder / "scan.csv").write_text(text(("timestamp", "BSSID", "device", "RSSI"), rows))
    return ["locate", str(folder / "scan.csv"), "--sensors", str(sensors(folder)), "--alpha", "2.5"]


def test_locate_says_in_one_line_what_was_understood(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, plot = tmp_path / "positions.csv", tmp_path / "map.png"
    assert main([*scan(tmp_path), "--out", str(out), "--plot", str(plot)]) == 0
    result = capsys.readouterr()
    assert result.out == ""
    lines = [line for line in result.err.splitlines() if line.startswith("arrivals: ")]
    assert lines == [
        "arrivals: time 'timestamp' (from 2026-05-01T12:00:00Z); sensor 'BSSID'; level 'RSSI'; "
        "device 'device' (2, each by itself); times are scattered: steps of 1 s (--window); "
        "1 source a device (--sources auto: estimate it)"
    ]
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["device"] for row in rows] == 12 * ["phone-1"] + 12 * ["tag-2"]
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_locate_options_of_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--group-by", "DEVICE", "--window", "2", "--missing", "100", "-200", "--sources",
               "1", "--quiet"]  # fmt: skip
    assert main([*scan(tmp_path), *options]) == 0
    result = capsys.readouterr()
    assert result.err == ""
    rows = list(csv.DictReader(result.out.splitlines()))
    assert [int(row["step"]) for row in rows] == 2 * list(range(6))
    assert main([*scan(tmp_path), "--sources", "auto", "--quiet"]) == 0
    assert len(capsys.readouterr().out.splitlines()) < 1 + 24  # found after two steps


@pytest.mark.filterwarnings("always")
def test_locate_warns_if_no_source_was_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = long_table(tmp_path, 2)
    assert main(arguments) == 0
    result = capsys.readouterr()
    assert result.out.count("\n") == 1
    assert "no source was found" in result.err
