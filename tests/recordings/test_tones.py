"""Tones whose frequency is shifted, followed from step to step."""

import io
from pathlib import Path

import numpy as np
import pytest
from command_line import table
from numpy.testing import assert_allclose
from recording_files import sio_bytes

import arrivals
from arrivals.__main__ import main
from arrivals.measurement_models import SensorArray
from arrivals.recordings import Recording
from arrivals.recordings.choice import Choice, TrackOptions, choose
from arrivals.recordings.choice.spectrum import MeanSpectrum
from arrivals.recordings.step_snapshots import candidate_frequencies, strongest_candidates
from arrivals.recordings.tracking import RecordedSteps
from arrivals.typing import Float

RATE, TONE, SHIFT = 1500.0, 198.0, 0.33  # Hz, of SWellEx-96; the Doppler shift at 2.5 m/s
ARRAY = SensorArray.ula(8, spacing=1.875, speed=1489.0)


def drifting_tone(doa_deg: float, array: SensorArray, n: int, amplitude: float = 1.0) -> Float:
    """Return samples of a tone whose frequency falls from 198.33 to 197.67 Hz, in noise."""
    t = np.arange(n) / RATE
    cycles = (TONE + SHIFT) * t - SHIFT * t**2 / t[-1]
    ahead = array.positions[:, 0] * np.sin(np.deg2rad(doa_deg)) / array.speed
    noise = np.random.default_rng(0).standard_normal((n, len(ahead)))
    tone = np.cos(2 * np.pi * (cycles[:, None] + TONE * ahead))
    return np.asarray(amplitude * (tone + 0.5 * noise))


def amplitudes(follow: float | None, window: int) -> Float:
    recording = Recording(drifting_tone(10.0, ARRAY, 40 * 4096), RATE)
    choice = Choice("tone", "svalse", (TONE,), window=window, follow=follow)
    values = np.array(list(RecordedSteps(recording, choice)))
    return np.asarray(np.abs(values).mean(axis=-1))


@pytest.mark.parametrize(("window", "most_lost"), [(4096, 0.6), (16384, 0.02)])
def test_drifting_tone_keeps_its_amplitude(window: int, most_lost: float) -> None:
    followed, fixed = amplitudes(0.35, window), amplitudes(None, window)
    assert followed.min() > 0.96  # 0.4 dB
    assert followed.max() < 1.05
    assert fixed.min() < most_lost


def test_strongest_candidate_is_chosen_in_each_step() -> None:
    rng = np.random.default_rng(0)
    values = rng.standard_normal((4, 6, 3, 2)) + 1j * rng.standard_normal((4, 6, 3, 2))
    values[0, :, 1, 0] = np.nan
    power = np.nansum(np.abs(values) ** 2, axis=(2, 3))
    chosen = strongest_candidates(values, 2)
    assert chosen.shape == (4, 2, 3, 2)
    for step in range(4):
        for i in range(2):
            best = 3 * i + power[step, 3 * i : 3 * i + 3].argmax()
            np.testing.assert_array_equal(chosen[step, i], values[step, best])
    assert strongest_candidates(values[:, :, 0], 1).shape == (4, 2)


def test_candidates_are_at_most_a_quarter_of_a_bin_apart() -> None:
    candidates = np.array(candidate_frequencies([TONE, 300.0], 0.33, 0.0916))
    assert candidates.reshape(2, -1)[:, [0, -1]].tolist() == [[197.67, 198.33], [299.67, 300.33]]
    assert np.diff(candidates[: len(candidates) // 2]).max() <= 0.0916 / 4
    with pytest.raises(ValueError, match="follow must lie below the frequency, 2 Hz; got 3"):
        candidate_frequencies([2.0], 3.0, 1.0)


def test_window_resolves_the_shift() -> None:
    options = TrackOptions(frequencies=TONE, follow=SHIFT)
    choice = choose(ARRAY, RATE, MeanSpectrum.empty(), options)
    assert (choice.window, choice.follow) == (4096, SHIFT)
    assert "--window 4096 --snapshots 1 --follow 0.33" in str(choice)
    given = TrackOptions(frequencies=TONE, follow=SHIFT, window=1000)
    assert choose(ARRAY, RATE, MeanSpectrum.empty(), given).window == 1000


def test_follow_without_a_tone_is_refused() -> None:
    with pytest.raises(ValueError, match="follow requires frequencies"):
        TrackOptions(follow=1.0)
    with pytest.raises(ValueError, match="follow must be None for complex"):
        choose(ARRAY, RATE, None, TrackOptions(frequencies=TONE, follow=1.0))
    options = TrackOptions("wideband_mixture", TONE, follow=1.0)
    with pytest.raises(ValueError, match="requires a tracker of tones"):
        choose(ARRAY, RATE, MeanSpectrum.empty(), options)


# SWellEx-96


@pytest.mark.parametrize("preset", ["swellex96-vla-21", "swellex96-vla"])
def test_swellex_file_is_tracked_by_one_command(
    preset: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    array = SensorArray.from_file(preset)
    samples = drifting_tone(-15.0, array, 8 * 16384, amplitude=3000.0)
    if preset == "swellex96-vla":  # the file has a channel of the defective element, 43
        samples = np.insert(samples, 42, 30_000.0, axis=1)
    path = tmp_path / "J1312315.sio"
    path.write_bytes(sio_bytes(samples.round().astype("i2"), record=4096))
    job = ["track", str(path), "--array", preset, "--rate", "1500", "--frequency", "198",
           "--follow", "0.33", "--window", "16384"]  # fmt: skip
    assert main(job) == 0
    rows = table(capsys.readouterr().out)
    assert {row["step"] for row in rows} == set(map(str, range(8)))
    strongest = [
        max((row for row in rows if row["step"] == str(i)), key=lambda row: float(row["level_db"]))
        for i in range(8)
    ]
    assert_allclose([float(row["doa_deg"]) for row in strongest], -15.0, atol=0.3)


def test_swellex_file_on_standard_input_is_no_raw_stream(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    array = SensorArray.from_file("swellex96-vla-21")
    samples = drifting_tone(-15.0, array, 3 * 4096, amplitude=3000.0)
    content = sio_bytes(samples.round().astype("i2"), record=4096)
    (tmp_path / "a.sio").write_bytes(content)
    more = ["--array", "swellex96-vla-21", "--rate", "1500", "--frequency", "198"]
    assert main(["track", str(tmp_path / "a.sio"), *more]) == 0
    expected = capsys.readouterr().out
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content)))
    assert main(["track", "-", *more]) == 0
    assert capsys.readouterr().out == expected


def test_stream_follows_as_the_file_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    samples = drifting_tone(10.0, ARRAY, 4 * 4096)
    np.savez(tmp_path / "a.npz", samples=samples, rate=RATE)
    keys = 'kind = "ula"\nn_sensors = 8\nspacing = 1.875\nspeed = 1489.0\n'
    (tmp_path / "a.toml").write_text(keys)
    more = ["--array", str(tmp_path / "a.toml"), "--rate", "1500", "--frequency", "198",
            "--follow", "0.33", "--snapshots", "2", "--window", "2048"]  # fmt: skip
    assert main(["track", str(tmp_path / "a.npz"), *more]) == 0
    expected = capsys.readouterr().out
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(samples.tobytes())))
    assert main(["track", "-", *more, "--dtype", "float64"]) == 0
    assert capsys.readouterr().out == expected


def test_track_takes_the_largest_shift() -> None:
    samples = drifting_tone(10.0, ARRAY, 8 * 4096)
    run = arrivals.track(samples, ARRAY, rate=RATE, frequencies=TONE, follow=SHIFT)
    assert_allclose(np.rad2deg(run.doa[:, 0]), 10.0, atol=0.5)
