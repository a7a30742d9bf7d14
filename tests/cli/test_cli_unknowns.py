"""The command line and `arrivals.track` with azimuth and elevation, or direction and range."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import HEADING, RATE, assert_rejected, table, track
from scipy.io import wavfile
from two_unknowns import range_estimate, sphere_estimate

import arrivals
from arrivals.__main__ import main
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.recordings.check import warn_of_faults
from arrivals.recordings.choice import Choice, MeanSpectrum, TrackOptions, choose
from arrivals.recordings.choice.unknowns import unknowns_in_words
from arrivals.recordings.recording import Recording
from arrivals.trackers import DirectionTracker, RangeEstimate, SphereEstimate, register

PLANE = SensorArray.uca(8, radius=0.046, speed=343.0)
TOML = 'kind = "uca"\nn_sensors = 8\nradius = 0.2\nspeed = 343.0\n'
UPPER = "arrivals: azimuth and elevation, in the upper half space alone"


@register("still_source")
class StillSource(DirectionTracker):
    """Reports one source at rest, in the unknowns of its measurement model."""

    n_slots = 1

    def __init__(self, measurement: ArraySnapshot) -> None:
        self.measurement = measurement
        on_sphere = measurement.unknowns == "sphere"
        self.estimate_kind = SphereEstimate if on_sphere else RangeEstimate
        nearest = np.inf if measurement.nearest is None else measurement.nearest
        self.still = sphere_estimate(30, 60) if on_sphere else range_estimate(30, nearest)
        self.reset()

    def predict(self, u: Any = None, *, dt: float = 1.0) -> None:
        self.reset()

    def update(self, z: Any) -> None:
        self.report_estimate(self.still)


@register("one_angle")
class OneAngle(DirectionTracker):
    """Reports a direction, whatever the unknowns of its measurement model."""

    n_slots = 1

    def __init__(self, measurement: ArraySnapshot) -> None:
        self.measurement = measurement
        self.reset()

    def predict(self, u: Any = None, *, dt: float = 1.0) -> None:
        self.reset()

    def update(self, z: Any) -> None:
        self.report([0.1])


@pytest.fixture
def plane(here: Path) -> str:
    Path("plane.toml").write_text(TOML)
    return str(here / "plane.toml")


STILL = ("--tracker", "still_source", "--snapshots", "1")
SPHERE = ("--unknowns", "sphere", *STILL)
RANGE = ("--unknowns", "range", "--nearest", "5", *STILL)


def test_file_has_columns_of_the_elevation_and_a_picture_of_the_sky(
    scene: Path, here: Path, plane: str, capsys: pytest.CaptureFixture[str]
) -> None:
    job = track(scene, *SPHERE, "--out", "t.csv", "--plot", "t.png", array=plane)
    assert main(job) == 0
    printed, message = capsys.readouterr()
    assert (printed, message.count("\n")) == ("", 1)
    assert message.startswith(UPPER)
    rows = table((here / "t.csv").read_text())
    assert {(row["doa_deg"], row["elevation_deg"]) for row in rows} == {("30", "60")}
    assert len(rows) == 20
    assert (here / "t.png").stat().st_size > 1000


def test_file_has_columns_of_the_range_and_a_picture_of_it(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, *RANGE, "--out", "t.csv", "--plot", "t.png")) == 0
    printed, message = capsys.readouterr()
    assert (printed, message.count("\n")) == ("", 1)
    assert message.startswith("arrivals: direction and range: ")
    assert "5 m or more" in message
    rows = table((here / "t.csv").read_text())
    assert {(row["range_m"], row["range_std_m"]) for row in rows} == {("5", "0.5")}
    assert (here / "t.png").stat().st_size > 1000


def test_stream_equals_the_file(
    scene: Path, plane: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    main(track(scene, *SPHERE, array=plane))
    expected, said = capsys.readouterr()
    raw = (scene / "tow.raw").read_bytes()
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(raw)))
    assert main(track(scene, *SPHERE, "--rate", str(RATE), file="-", array=plane)) == 0
    assert capsys.readouterr() == (expected, said)
    assert expected.startswith(HEADING.replace("existence", "elevation_deg,elevation_std_deg,ex"
                                               "istence"))  # fmt: skip


def test_track_in_python_passes_unknowns_on(scene: Path, plane: str) -> None:
    given: dict[str, Any] = {"frequencies": 1000, "tracker": "still_source"}
    run = arrivals.track(scene / "tow.wav", plane, unknowns="sphere", **given)
    assert run.kind is SphereEstimate
    line = str(scene / "array.toml")
    run = arrivals.track(scene / "tow.wav", line, unknowns="range", nearest=7, **given)
    assert run.range.tolist() == [[7.0]] * len(run)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--unknowns", "elevation"), ("must be one of sphere, range; got 'elevation'",)),
        (("--nearest", "2"), ("nearest must be None unless unknowns='range'; got 'azimuth'",)),
        (("--unknowns", "sphere", "--nearest", "2"), ("got 'sphere'",)),
        (("--unknowns", "range", "--nearest", "-2"), ("nearest must be finite and positive",)),
        (("--unknowns", "sphere"), ("unknowns='sphere'; got a line",)),
        (("--unknowns", "range", "--tracker", "one_angle"),
         ("the tracker 'one_angle' estimates one angle a source", "such as svalse")),
        (("--unknowns", "range", "--tracker", "esprit"), ("unknowns='azimuth'; got 'range'",)),
        (("--unknowns", "range", "--tracker", "ar_kalman_qrd_rls"), ("--unknowns requires ano",)),
        (("--unknowns", "range", "--nearest", "0.1"), ("nearest must be at least", "got 0.1")),
    ],
)  # fmt: skip
def test_invalid_combination_prints_one_line(
    arguments: tuple[str, ...], words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert_rejected(track(scene, "--out", "t.csv", *arguments), capsys, here, *words)


def test_tracker_of_real_samples_has_one_angle(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = ["track", str(scene / "tow.wav"), "--array", str(scene / "array.toml"), "--band", "700",
           "990", "--tracker", "interpolation_ekf", "--unknowns", "range"]  # fmt: skip
    assert_rejected(job, capsys, here, "--unknowns requires snapshots")
    with pytest.raises(ValueError, match="unknowns must be left out for 'interpolation_ekf'"):
        arrivals.track(scene / "tow.wav", scene / "array.toml", band=(700, 990),
                       tracker="interpolation_ekf", unknowns="range")  # fmt: skip


def test_nothing_is_said_if_no_sample_is_valid(
    here: Path, plane: str, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save("none.npy", np.full((4, 8), complex(np.nan, np.nan)))
    assert_rejected(track(here, *SPHERE, file="none.npy", array=plane), capsys, here, "finite")


# svalse, from samples to the file


def tone(a: Any, seed: int) -> Any:
    """Return samples of a tone at 1 kHz with the responses a (n_sensors,), in noise."""
    phasor = np.exp(2j * np.pi * 1000 * np.arange(4000) / RATE)
    noise = 0.03 * np.random.default_rng(seed).standard_normal((4000, len(a)))
    return (0.3 * (phasor[:, None] * a).real + noise).astype(np.float32)


def test_track_of_a_tone_overhead_finds_azimuth_and_elevation(
    here: Path, plane: str, capsys: pytest.CaptureFixture[str]
) -> None:
    array = SensorArray.uca(8, radius=0.2, speed=343.0)
    model = ArraySnapshot(array, array.wavelength(1000.0), unknowns="sphere")
    a = model.steering_vector(np.deg2rad(-140), np.deg2rad(50))
    wavfile.write("tone.wav", RATE, tone(a, seed=0))
    job = ["track", "tone.wav", "--array", plane, "--unknowns", "sphere", "--plot", "sky.png"]
    assert main([*job, "--out", "t.csv"]) == 0
    chosen, said = capsys.readouterr().err.splitlines()
    assert "--tracker svalse" in chosen
    assert "--unknowns sphere" in chosen
    assert said.startswith(UPPER)
    rows = table((here / "t.csv").read_text())
    assert len({row["label"] for row in rows}) == 1
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], -140, atol=1.5)
    np.testing.assert_allclose([float(row["elevation_deg"]) for row in rows], 50, atol=1.5)
    assert all(0 < float(row["elevation_std_deg"]) < 3 for row in rows)


def test_track_of_a_tone_nearby_finds_its_range_and_a_far_one_has_none(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("line.toml").write_text('kind = "ula"\nn_sensors = 16\nspacing = 0.16\nspeed = 343.0\n')
    array = SensorArray.ula(16, 0.16, speed=343.0)
    model = ArraySnapshot(array, array.wavelength(1000.0), unknowns="range")
    near = model.steering_vector(np.deg2rad(20), distance=3.0)
    far = model.steering_vector(np.deg2rad(-40))
    for name, a in (("near", near), ("far", far)):
        wavfile.write(f"{name}.wav", RATE, tone(a, seed=1))
        job = ["track", f"{name}.wav", "--array", "line.toml", "--frequency", "1000", "--window",
               "256", "--unknowns", "range", "--nearest", "1"]  # fmt: skip
        assert main([*job, "--out", f"{name}.csv", "--plot", f"{name}.png"]) == 0
        assert "spherical waves, sources at 1 m or more" in capsys.readouterr().err
    rows = table((here / "near.csv").read_text())
    assert len(rows) == 4000 // 256
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], 20, atol=1)
    np.testing.assert_allclose([float(row["range_m"]) for row in rows], 3.0, rtol=0.1)
    rows = table((here / "far.csv").read_text())
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], -40, atol=1)
    ranges = [row["range_m"] for row in rows]
    assert np.mean([each == "" for each in ranges]) > 0.8


# choice


def test_talkers_get_wideband_mixture_on_the_sphere_and_svalse_for_ranges() -> None:
    spectrum = MeanSpectrum.of(np.random.default_rng(3).standard_normal((16000, 8)), 16000.0)
    plain = choose(PLANE, 16000.0, spectrum)
    sphere = choose(PLANE, 16000.0, spectrum, TrackOptions(unknowns="sphere"))
    near = choose(SensorArray.ula(8, 0.04, speed=343.0), 16000.0, spectrum,
                  TrackOptions(unknowns="range"))  # fmt: skip
    chosen = [each.tracker for each in (plain, sphere, near)]
    assert chosen == ["wideband_mixture", "wideband_mixture", "svalse"]
    assert sphere.frequencies == plain.frequencies
    assert near.settings["solver__tempering"] == 4 * near.n_snapshots
    assert "--unknowns sphere" in str(sphere)
    given = choose(PLANE, 16000.0, spectrum, TrackOptions("cbf", unknowns="sphere"))
    assert given.tracker == "cbf"


def test_choice_is_written_as_options() -> None:
    choice = Choice("a tone", "svalse", (440.0,), unknowns="range", nearest=1.5)
    assert str(choice).endswith("--snapshots 1 --unknowns range --nearest 1.5")
    assert "unknowns" not in str(Choice("a tone", "svalse", (440.0,)))


# words and warnings


def test_side_of_a_plane_is_in_the_line() -> None:
    square = np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0]), axis=-1).reshape(4, 2)
    for columns, words in (((0, 1), "the upper half space alone"),
                           ((0, 2), "about azimuth 90, elevation 0 degrees alone"),
                           ((1, 2), "about azimuth 0, elevation 0 degrees alone")):  # fmt: skip
        positions = np.zeros((4, 3))
        positions[:, columns] = square
        model = ArraySnapshot(SensorArray(positions), 3.0, unknowns="sphere")
        assert words in unknowns_in_words(model)
    tilted = np.array([[1.0, 0, -1], [0, 1, 0], [-1, 0, 1], [0, -1, 0]])
    model = ArraySnapshot(SensorArray(tilted), 3.0, unknowns="sphere")
    assert "about azimuth 0, elevation 45 degrees alone" in unknowns_in_words(model)


def test_delays_of_a_source_nearby_are_no_fault_of_the_wiring(
    recwarn: pytest.WarningsRecorder,
) -> None:
    array = SensorArray.ula(12, 0.04, speed=343.0)
    x = array.positions[:, 0] - array.positions.mean()
    delay = np.hypot(x - 0.25, 0.54) / 343.0
    source = np.fft.rfft(np.random.default_rng(0).standard_normal(16000))
    turn = np.exp(-2j * np.pi * np.outer(np.fft.rfftfreq(16000, 1 / 16000), delay))
    samples = np.fft.irfft(source[:, None] * turn, axis=0)
    recording = Recording(samples, 16000.0, array=array)
    warn_of_faults(recording)
    assert any("late" in str(each.message) for each in recwarn)
    recwarn.clear()
    run = arrivals.track(recording, frequencies=3000, unknowns="range", nearest=0.4)
    assert not recwarn.list
    assert np.nanmedian(run.range) == pytest.approx(0.6, rel=0.03)
