"""Separated sources from recordings, by the command line."""

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile
from scipy.signal import hilbert, lfilter

from arrivals.__main__ import main
from arrivals.cli.separated_signals import analytic, write_signals
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.typing import Float

RATE, FREQUENCY = 8000, 1000.0
ARRAY = 'kind = "symmetric"\ndistances = [0.06, 0.12]\nspeed = 343.0\n'
DOA = np.deg2rad([-20.0, 30.0])


def delayed(x: Float, lag: float) -> Float:
    """Return a signal later by some seconds, exactly, as on a circle."""
    frequency = np.fft.rfftfreq(len(x), 1 / RATE)
    turned = np.fft.rfft(x) * np.exp(-2j * np.pi * frequency * lag)
    return np.asarray(np.fft.irfft(turned, len(x)))


@pytest.fixture(scope="module")
def voices() -> Float:
    """Two sources about 1 kHz, (n, 2)."""
    rng, r = np.random.default_rng(0), 0.97
    poles = [[1.0, -2 * r * np.cos(2 * np.pi * f / RATE), r * r] for f in (900.0, 1100.0)]
    s = np.stack([lfilter([1.0], a, rng.standard_normal(8000)) for a in poles], axis=-1)
    return np.asarray(0.05 * s / s.std(axis=0))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory, voices: Float) -> Path:
    """Write the real samples of five microphones, with the true delays."""
    folder = tmp_path_factory.mktemp("scene")
    (folder / "array.toml").write_text(ARRAY)
    (folder / "even.toml").write_text(
        'kind = "ula"\nn_sensors = 5\nspacing = 0.06\nspeed = 343.0\n'
    )
    places = SensorArray.symmetric([0.06, 0.12]).positions[:, 0]
    lags = -places[:, None] * np.sin(DOA) / 343.0
    received = [sum(delayed(s, lag) for s, lag in zip(voices.T, row, strict=True)) for row in lags]
    noise = 0.005 * np.random.default_rng(1).standard_normal((8000, 5))
    samples = np.stack(received, axis=-1) + noise
    wavfile.write(folder / "talk.wav", RATE, samples.astype(np.float32))
    wavfile.write(folder / "zeros.wav", RATE, np.zeros((800, 5), np.float32))
    model = ArraySnapshot(SensorArray.symmetric([0.06, 0.12]), 0.343, noise=1e-3)
    z = model.simulate(np.tile(DOA, (600, 1)), voices[:600], np.random.default_rng(2))
    np.savez(folder / "complex.npz", snapshots=z, rate=RATE)
    return folder


def track(scene: Path, *more: str, file: str = "talk.wav") -> list[str]:
    return ["track", str(scene / file), "--array", str(scene / "array.toml"), "--tracker",
            "ar_kalman_qrd_rls", "--quiet", *more]  # fmt: skip


def table(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text().splitlines()))


@pytest.mark.parametrize("how", [("--frequency", "1000"), ("--band", "500", "1500")], ids=str)
def test_signals_of_a_recording_are_written_as_wav(
    how: tuple[str, ...], scene: Path, tmp_path: Path, voices: Float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(track(scene, *how, "--signals", "out.wav", "--out", "t.csv")) == 0
    rate, signals = wavfile.read("out.wav")
    assert (rate, signals.shape, signals.dtype) == (RATE, (8000, 2), np.float32)
    correlation = np.corrcoef(signals[1500:].T, voices[1500:].T)[:2, 2:]
    assert np.diag(correlation).min() > 0.95  # 0.7 at a microphone
    assert abs(correlation[[0, 1], [1, 0]]).max() < 0.2
    rows = table(tmp_path / "t.csv")
    assert len(rows) == 2 * (8000 // 30 - 1)  # after acquisition
    assert float(rows[-1]["time_s"]) == pytest.approx((8000 // 30 * 30 - 1) / RATE)
    # the response is that at 1 kHz; a source at f shows sin β f / 1 kHz
    expected = np.rad2deg(np.arcsin(np.sin(DOA) * [0.9, 1.1]))
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows[-2:]], expected, atol=3.0)


def test_hop_selects_lines_and_a_picture_is_drawn(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    more = ("--frequency", "1000", "--hop", "800", "--out", "t.csv", "--plot", "t.png")
    assert main(track(scene, *more)) == 0
    assert [row["step"] for row in table(tmp_path / "t.csv")] == [str(k // 2) for k in range(20)]
    assert (tmp_path / "t.png").read_bytes().startswith(b"\x89PNG")


def test_windows_and_complex_snapshots_have_complex_signals(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch, voices: Float,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    window = ("--frequency", "1000", "--window", "64", "--hop", "16", "--out", "w.csv")
    assert main(track(scene, *window, "--signals", "w.npy")) == 0
    assert (np.load("w.npy").dtype, np.load("w.npy").shape) == (np.complex128, (497, 2))
    snapshots = ("--frequency", "1000", "--out", "z.csv", "--signals", "z.npy")
    assert main(track(scene, *snapshots, file="complex.npz")) == 0
    correlation = np.corrcoef(np.load("z.npy")[200:].T, voices[200:600].T)[:2, 2:]
    assert abs(correlation).max(axis=1).min() > 0.95
    message = ("--set", "motion__real_valued=True", "--signals", "z.wav", "--out", "r.csv")
    assert main(track(scene, "--frequency", "1000", *message, file="complex.npz")) == 0
    assert wavfile.read("z.wav")[1].shape == (600, 2)
    assert capsys.readouterr() == ("", "")


def test_number_and_spectra_of_the_sources_are_set_by_the_model(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    models = "motion__coefficients=[[0.9], [0.5], [0.1]]"
    more = ("--set", models, "--set", "interval=40", "--signals", "three.wav", "--out", "t.csv")
    assert main(track(scene, "--frequency", "1000", *more)) == 0
    assert wavfile.read("three.wav")[1].shape == (8000, 3)
    assert len(table(tmp_path / "t.csv")) == 3 * 199  # after acquisition


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--signals", "o.mp3"), ("signal files must end in .wav or .npy",)),
        (("--signals", "nowhere/o.wav"), ("the folder does not exist",)),
        (("--signals", "t.csv", "--out", "t.csv"), ("different files",)),
        (
            ("--signals", "o.wav", "--tracker", "cbf"),
            ("that estimates signals; got cbf",),
        ),
        (("--signals", "o.wav", "--window", "64"), ("cannot store complex signals: use .npy",)),
        (("--band", "500", "9000"), ("half the rate, 4000 Hz; got 500 and 9000",)),
        (("--band", "500", "900", "--window", "64"), ("--band requires real samples",)),
        (("--set", "kapa=3"), ("no parameter 'kapa'",)),
        (("--set", "measurement__noise=3"), ("the measurement comes from --array",)),
        (("--set", "motion__coefficients=[[1.5]]"), ("unstable",)),
        (("--set", "motion=3"), ("motion must be an AutoregressiveSources; got 3",)),
        (("--set", "doa=[0.1]"), ("doa must have shape (2,)",)),
        (("--set", "interval=1"), ("AR orders must be at most the interval",)),
        (("--frequency", "3000"), ("alias limit",)),
        (("--dtype", "int16"), ("requires samples from standard input",)),
    ],
)
def test_signals_invalid_argument_prints_one_line_and_writes_no_file(
    more: tuple[str, ...], words: tuple[str, ...], scene: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(track(scene, "--frequency", "1000", *more)) == 2
    printed, message = capsys.readouterr()
    assert printed == ""
    assert message.startswith("arrivals: ")
    assert message.count("\n") == 1
    assert all(word in message for word in words)
    assert list(tmp_path.iterdir()) == []


def test_signals_without_a_tracker_are_refused(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = ["track", str(scene / "talk.wav"), "--array", str(scene / "array.toml")]
    assert main([*job, "--signals", "o.wav"]) == 2
    assert "requires a tracker that estimates signals; got None" in capsys.readouterr().err


def test_signals_of_zeros_streams_and_other_arrays_are_refused(
    scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"")))
    assert main(track(scene, "--frequency", "1000", file="zeros.wav")) == 2
    assert "the recording is zero" in capsys.readouterr().err
    stream = ["track", "-", *track(scene, "--frequency", "1000")[2:], "--signals", "o.wav"]
    assert main(stream) == 2
    assert "--signals requires a file" in capsys.readouterr().err
    (scene / "four.toml").write_text('kind = "ula"\nn_sensors = 4\nspacing = 0.06\nspeed = 343.0\n')
    four = track(scene, "--frequency", "1000")
    four[four.index("--array") + 1] = str(scene / "four.toml")
    assert main(four) == 2
    assert "the recording must have 4 channels" in capsys.readouterr().err


def test_write_signals_after_an_error_keeps_the_old_file(tmp_path: Path, scene: Path) -> None:
    (tmp_path / "o.wav").write_text("old")
    with pytest.raises(ValueError, match="cannot store complex signals"):
        write_signals(tmp_path / "o.wav", np.zeros((3, 2), complex), 8000.0)
    with pytest.raises(ValueError, match="pass --rate"):
        write_signals(tmp_path / "o.wav", np.zeros((3, 2)))
    assert (tmp_path / "o.wav").read_text() == "old"
    write_signals(tmp_path / "o.wav", np.array([[0.5], [np.nan]]), 8000.0)
    np.testing.assert_array_equal(wavfile.read(tmp_path / "o.wav")[1], [0.5, 0.0])


@pytest.mark.parametrize("n", [64, 65])
def test_analytic_equals_scipy_hilbert(n: int) -> None:
    x = np.random.default_rng(n).standard_normal((n, 2))
    np.testing.assert_allclose(analytic(x, 1.0), hilbert(x, axis=0), atol=1e-12)
    gap: Any = x.copy()
    gap[3, 1] = np.nan
    assert np.isnan(analytic(gap, 1.0)).sum() == 1
