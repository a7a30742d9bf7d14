"""`arrivals track` with complex samples of radios: files, a file a channel, streams."""

import io
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_rejected, table

from arrivals.__main__ import main
from arrivals.measurement_models import SensorArray
from arrivals.typing import Complex

RATE, CENTER = 48e3, 433.92e6
KEYS = 'kind = "uca"\nn_sensors = 5\nradius = 0.35\nspeed = 299792458.0\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write 0.4 s of two sources at 30 and -160 degrees: as cf32, as cs16, and a file a channel."""
    folder = tmp_path_factory.mktemp("iq")
    (folder / "k.toml").write_text(KEYS)
    y = scene(19_200)
    y.astype("c8").tofile(folder / "all.cf32")
    for i, channel in enumerate(y.T):
        channel.astype("c8").tofile(folder / f"ch{i}.cf32")
    words = np.stack([y.real, y.imag], axis=-1) * 2**15
    words.round().astype("<i2").tofile(folder / "all.bin")
    return folder


def scene(n: int) -> Complex:
    rng = np.random.default_rng(0)
    white = rng.standard_normal((n, 7)) + 1j * rng.standard_normal((n, 7))
    array = SensorArray.uca(5, radius=0.35, speed=299792458.0)
    A = array.steering_vector(np.deg2rad([30.0, -160.0]), array.wavelength(CENTER))
    return np.asarray(0.05 * (white[:, :2] * [1.0, 0.6] @ A + 0.3 * white[:, 2:]))


def job(folder: Path, *more: str) -> list[str]:
    return ["track", *more, "--array", str(folder / "k.toml"), "--rate", str(RATE)]


def tracked(text: str) -> dict[int, float]:
    """Return the mean direction of each label of a tracks file with a row a step."""
    rows = table(text)
    labels = {int(row["label"]) for row in rows}
    means = {
        label: [float(row["doa_deg"]) for row in rows if int(row["label"]) == label]
        for label in labels
    }
    assert all(len(each) == 20 for each in means.values())
    return {label: float(np.mean(each)) for label, each in means.items()}


def test_iq_file_is_tracked_in_steps_of_20_ms(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    center = ("--center", str(CENTER))
    assert main(job(folder, str(folder / "all.cf32"), *center)) == 0
    whole, message = capsys.readouterr()
    assert "complex snapshots, 960 a step: --tracker svalse" in message
    assert sorted(tracked(whole).values()) == pytest.approx([-160, 30], abs=1)

    parts = [str(folder / f"ch{i}.cf32") for i in range(5)]
    assert main(job(folder, *parts, *center)) == 0
    assert capsys.readouterr().out == whole

    raw = ("--format", "cs16", "--channels", "5")
    assert main(job(folder, str(folder / "all.bin"), *raw, *center)) == 0
    assert sorted(tracked(capsys.readouterr().out).values()) == pytest.approx([-160, 30], abs=1)

    options = message.split(": ", 2)[2].split()
    assert main(job(folder, str(folder / "all.cf32"), *options)) == 0
    assert capsys.readouterr().out == whole


def test_iq_stream_is_the_file(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = (folder / "all.bin").read_bytes()
    center = ("--center", str(CENTER))
    assert main(job(folder, str(folder / "all.bin"), "--format", "cs16", *center)) == 0
    expected = capsys.readouterr().out
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(raw)))
    assert main(job(folder, "-", "--dtype", "cs16", *center)) == 0
    assert capsys.readouterr().out == expected


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("all.bin", "--center", "4e8"), "all.bin: the type of raw samples is unknown"),
        (("all.bin", "--format", "cf33", "--center", "4e8"), "format must be one of"),
        (("all.cf32",), "complex snapshots require their frequency"),
        (("all.cf32", "--center", "4e8", "--frequency", "4e8"), "pass only one of"),
        (("all.cf32", "--center", "4e8", "--channels", "7"), "not cf32 of 7 channels"),
        (("all.cf32", "--center", "4e8", "--channels", "0"), "channels must be at least 1; got 0"),
        (("ch0.cf32", "ch1.cf32", "--center", "4e8"), "the recording must have 5 channels; got 2"),
        (("ch0.cf32", "-", "--center", "4e8"), "standard input (-) must be the only file"),
        (("real.npy", "--center", "4e8"), "--center requires complex samples; got real ones"),
        (("-", "--center", "4e8"), "--center requires complex samples: pass --dtype; got int16"),
        (("-", "--dtype", "cs16", "--center", "4e8"), "ended after 0 frames"),
    ],
)
def test_iq_that_does_not_fit_is_refused(
    arguments: tuple[str, ...], words: str, folder: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    np.save(folder / "real.npy", np.ones((99, 5)))
    monkeypatch.chdir(folder)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"")))
    assert_rejected(job(folder, *arguments), capsys, folder, words)
