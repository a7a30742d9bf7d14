"""`arrivals.track` and `arrivals track` without a setting, on synthetic recordings."""

import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import arrivals
from arrivals.__main__ import main
from arrivals.cli.standard_input import HEAD
from arrivals.measurement_models import SensorArray
from arrivals.recordings import Recording, read, tracking
from arrivals.recordings.choice import Choice
from arrivals.recordings.tracking import RecordedSteps
from arrivals.typing import Complex, Float

RATE = 16000
ARRAY = SensorArray.uca(6, radius=0.046, speed=343.0)
TOML = 'kind = "uca"\nn_sensors = 6\nradius = 0.046\nspeed = 343.0\n'
DOA = (60.0, -100.0)


def plane_wave(x: Float, doa: float) -> Float:
    """Return a plane wave at the sensors, of a signal at the origin: (n_samples, 6)."""
    f = np.fft.rfftfreq(len(x), 1 / RATE)
    wavelength = 343.0 / np.maximum(f, 1e-9)
    a: Complex = ARRAY.steering_vector(np.deg2rad(doa), wavelength)
    return np.asarray(np.fft.irfft(np.fft.rfft(x)[:, None] * a, axis=0, n=len(x)))


def syllables(rng: np.random.Generator, start: float, end: float, seconds: float) -> Float:
    """Return bursts of harmonics of changing pitch, as of a talker: (n_samples,)."""
    t = np.arange(int(seconds * RATE)) / RATE
    x = np.zeros(len(t))
    for onset in np.arange(start, end - 0.1, 0.25):
        pitch, length = rng.uniform(90, 220), rng.uniform(0.1, 0.2)
        harmonics = pitch * np.arange(1, int(7000 / pitch))
        gain = rng.gamma(0.4, size=len(harmonics)) / np.arange(1, len(harmonics) + 1) ** 0.3
        on = (t >= onset) & (t < onset + length)
        envelope = np.sin(np.pi * (t[on] - onset) / length) ** 0.5
        phase = rng.uniform(0, 2 * np.pi, len(harmonics))
        tones = np.cos(2 * np.pi * np.outer(t[on], harmonics) + phase)
        x[on] += envelope * (tones @ gain)
    return x


@pytest.fixture(scope="module")
def talk() -> Float:
    """Two talkers, the second with a pause of 1.5 s, in white noise; 6 s."""
    rng = np.random.default_rng(2)
    first = syllables(rng, 0.3, 5.8, 6.0)
    second = syllables(rng, 0.8, 2.6, 6.0) + syllables(rng, 4.1, 5.8, 6.0)
    y = plane_wave(first, DOA[0]) + plane_wave(second, DOA[1])
    return np.asarray(0.05 * (y + 0.05 * rng.standard_normal(y.shape)))


def test_talkers_are_tracked_with_one_label_each_through_a_pause(talk: Float) -> None:
    run = arrivals.track(talk, ARRAY, rate=RATE)
    doa = np.rad2deg(run.doa)
    errors = np.abs((doa[..., None] - DOA + 180) % 360 - 180)
    found = ~np.isnan(doa)
    assert np.mean(errors.min(axis=-1)[found] < 8) > 0.95
    for talker in (0, 1):
        near = found & (errors[..., talker] < 8)
        assert len(set(run.label[near])) == 1
    assert np.mean((errors[..., 0] < 8).any(axis=1)[run.time > 0.8]) > 0.8
    assert_allclose(np.diff(run.time), 0.064)


def test_noise_alone_has_no_track() -> None:
    noise = np.random.default_rng(0).standard_normal((4 * RATE, 6))
    assert arrivals.track(noise, ARRAY, rate=RATE).n_found.sum() == 0


def test_forms_of_recording_and_array_give_the_same_run(talk: Float, tmp_path: Path) -> None:
    samples = talk[: 2 * RATE].astype(np.float32)
    np.savez(tmp_path / "talk.npz", samples=samples, rate=RATE)
    (tmp_path / "a.toml").write_text(TOML)
    expected = arrivals.track(samples, ARRAY, rate=RATE)
    assert expected.n_found.sum() > 10
    for run in (
        arrivals.track(tmp_path / "talk.npz", str(tmp_path / "a.toml")),
        arrivals.track(Recording(samples, RATE, array=ARRAY)),
        arrivals.track(read(tmp_path / "talk.npz"), ARRAY),
        arrivals.track(arrivals.read(tmp_path / "talk.npz", array=tmp_path / "a.toml")),
        arrivals.track(samples, ARRAY, tracker="wideband_mixture", rate=RATE),
    ):
        assert_array_equal(run.doa, expected.doa)
        assert_array_equal(run.time, expected.time)


@pytest.mark.parametrize("is_complex", [False, True])
def test_steps_do_not_depend_on_the_block_size(
    talk: Float, is_complex: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = Recording(talk[:20_000] + (0j if is_complex else 0), RATE, array=ARRAY)
    framing = (None, None, 7) if is_complex else (512, 200, 7)
    choice = Choice("", "svalse", (500.0, 1000.0)[: 1 if is_complex else 2], None, *framing)
    whole = RecordedSteps(recording, choice)
    expected = whole.framed()
    assert len(whole) == len(expected.values)
    assert_allclose(whole.time, expected.time)
    monkeypatch.setattr(tracking, "BLOCK", 500)
    assert_allclose(list(RecordedSteps(recording, choice)), expected.values, atol=1e-15)


def test_settings_of_the_tracker_are_passed_on(talk: Float) -> None:
    one = arrivals.track(talk, ARRAY, rate=RATE, settings__max_sources=1, snapshots=8)
    assert one.n_found.max() == 1
    assert_allclose(np.diff(one.time), 0.128)
    peaks = arrivals.track(talk, ARRAY, rate=RATE, tracker="cbf", frequencies=2000, max_sources=2)
    assert len(peaks) == len(talk) // 256


def test_command_writes_the_run_and_one_line_to_repeat_it_by(
    talk: Float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    samples = talk[: 3 * RATE].astype("<f4")
    np.savez("talk.npz", samples=samples, rate=RATE)
    Path("a.toml").write_text(TOML)
    arrivals.track(samples, ARRAY, rate=RATE).to_csv("run.csv")
    assert main(["track", "talk.npz", "--array", "a.toml"]) == 0
    table, line = capsys.readouterr()
    assert table == Path("run.csv").read_text()
    assert line.count("\n") == 1
    by_hand = line.split(": ")[2].split()
    assert main(["track", "talk.npz", "--array", "a.toml", *by_hand]) == 0
    assert capsys.readouterr() == (table, "")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(samples.tobytes())))
    live = ["track", "-", "--array", "a.toml", "--rate", str(RATE), "--dtype", "float32"]
    assert main(live) == 0
    assert capsys.readouterr() == (table, line)


def test_stream_without_a_rate_is_refused_after_its_first_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Unread(io.BytesIO):
        def read(self, size: int | None = -1) -> bytes:
            assert size == HEAD, "more than the first bytes were read"
            return bytes(HEAD)

    (tmp_path / "a.toml").write_text(TOML)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(Unread()))
    for more in ((), ("--band", "500", "900"), ("--frequency", "500")):
        assert main(["track", "-", "--array", str(tmp_path / "a.toml"), *more]) == 2
        assert "real samples require a rate" in capsys.readouterr().err


def test_error_of_a_recording_without_a_valid_step_is_the_only_line(
    talk: Float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.toml").write_text(TOML)
    samples = talk[: 2 * RATE].astype("<f4")
    samples[::100] = np.nan
    np.savez("gaps.npz", samples=samples, rate=RATE)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(samples.tobytes())))
    for source in (["gaps.npz"], ["-", "--rate", str(RATE), "--dtype", "float32"]):
        assert main(["track", *source, "--array", "a.toml", "--out", "t.csv"]) == 2
        message = capsys.readouterr().err
        assert message.count("\n") == 1
        assert "is finite" in message
        assert not Path("t.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "more", "message"),
    [
        (
            (np.zeros((99, 6)),),
            {"rate": 8000},
            "array must be an array file, a preset or a SensorArray",
        ),
        ((Recording(np.ones((99, 6)), 8000.0),), {}, "the recording has no array: pass array"),
        ((np.ones((99, 6)), ARRAY), {}, "the rate is unknown"),
        ((np.ones((9999, 6)), ARRAY), {"rate": 8000, "wndow": 3}, "did you mean window?"),
        ((np.ones((9999, 6)), ARRAY), {"rate": 8000, "frequency": 900}, "did you mean frequencies"),
        (
            (np.ones((9999, 6)), "uma-9"),
            {"rate": 8000},
            "got 'uma-9': did you mean uma-",
        ),
        ((np.ones((9999, 5)), ARRAY), {"rate": 8000}, "must have 6 channels; got 5"),
        ((np.ones((9999, 6)), np.ones((6, 2))), {"rate": 8000}, "SensorArray; got ndarray"),
        ((np.ones((9999, 6)), ARRAY), {"rate": 8000, "band": 900}, "band must be a sequence"),
        ((np.ones((9999, 6)), ARRAY), {"rate": 8000, "window": 10**9}, "9999 samples; one window"),
    ],
)
def test_track_of_incomplete_arguments_is_refused(
    arguments: tuple[Any, ...], more: dict[str, Any], message: str
) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        arrivals.track(*arguments, **more)
    with pytest.raises(TypeError, match="rate must be left out for a Recording"):
        arrivals.track(Recording(np.ones((99, 6)), 8000.0, array=ARRAY), rate=8000)


def test_tracker_of_real_samples_requires_a_band() -> None:
    line = SensorArray.ula(6, spacing=0.04, speed=343.0)
    x = np.random.default_rng(0).standard_normal((2000, 6))
    with pytest.raises(ValueError, match=r"takes real samples of a band: pass band \(--band\)"):
        arrivals.track(x, line, rate=RATE, tracker="interpolation_ekf")
    sampled: dict[str, Any] = {"tracker": "interpolation_ekf", "band": (500.0, 2000.0), "hop": 100}
    run = arrivals.track(x, line, rate=RATE, **sampled)
    with pytest.raises(ValueError, match="window must be left out for 'interpolation_ekf'"):
        arrivals.track(x, line, rate=RATE, window=512, **sampled)
    assert_allclose(run.time, (100 * np.arange(1, 21) - 1) / RATE)


def test_shipped_infrasound_has_its_three_arrivals_without_any_setting() -> None:
    data = Path(arrivals.__file__).parent / "scenarios" / "data"
    run = arrivals.track(data / "brp2012.npz", data / "brp2012.toml", variable="samples")
    size = np.where(np.isnan(run.doa), -1.0, np.abs(run.amplitude))
    best = np.take_along_axis(run.doa, size.argmax(axis=1)[:, None], axis=1)[:, 0]
    for start, end, expected in ((420, 435, 320), (610, 800, 250), (805, 895, 321)):
        within = (run.time >= start) & (run.time <= end)
        error = np.abs((np.rad2deg(best[within]) - expected + 180) % 360 - 180)
        assert len(error) >= 1
        assert error.max() < 5


def test_import_of_the_package_stays_light() -> None:
    code = "import arrivals, sys; print('numpy' in sys.modules, callable(arrivals.track))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.decode().split() == ["False", "True"]
