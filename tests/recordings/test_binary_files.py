"""WAV, NumPy and MATLAB files."""

import struct
import wave
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from numpy.testing import assert_array_equal
from recording_files import NUMBERS, RATE, assert_refused
from scipy.io import wavfile

from arrivals.recordings import read
from arrivals.typing import Float

# WAV


def integer_wav(path: Path, n_bytes: int, n_channels: int = 3) -> Float:
    """Write the extremes and some in between through `wave`; return them in [-1, 1)."""
    half = 2 ** (8 * n_bytes - 1)
    numbers = np.r_[-half, half - 1, 0, 1, -1, np.linspace(-half, half - 1, 10).astype(int)]
    offset = half if n_bytes == 1 else 0
    raw = [int(v + offset).to_bytes(n_bytes, "little", signed=n_bytes > 1) for v in numbers]
    with wave.open(str(path), "wb") as file:
        file.setparams((n_channels, n_bytes, int(RATE), 0, "NONE", ""))
        file.writeframes(b"".join(raw))
    return np.reshape(numbers / half, (-1, n_channels))


@pytest.mark.parametrize(("n_bytes", "kind"), [(1, "f4"), (2, "f4"), (3, "f8"), (4, "f8")])
@pytest.mark.parametrize("n_channels", [1, 3])
def test_integer_wav_of_every_depth(
    tmp_path: Path, n_bytes: int, kind: str, n_channels: int
) -> None:
    expected = integer_wav(tmp_path / "a.WAV", n_bytes, n_channels)
    recording = read(tmp_path / "a.WAV")
    assert (recording.rate, recording.samples.dtype) == (RATE, np.dtype(kind))
    assert_array_equal(recording.samples, expected)


@pytest.mark.parametrize("kind", ["<f4", "<f8", ">f4", ">i2"])
def test_other_wav(tmp_path: Path, kind: str) -> None:
    numbers = np.array([[0.5, -0.25], [0.125, -1.0]])
    stored = numbers * 2**15 if kind == ">i2" else numbers
    wavfile.write(tmp_path / "a.wav", int(RATE), stored.astype(kind))
    recording = read(str(tmp_path / "a.wav"), rate=10.0)
    assert recording.rate == 10.0
    assert recording.samples.dtype.isnative
    assert recording.duration == 0.2
    assert_array_equal(recording.samples, numbers)


def test_wav_with_unknown_chunks_is_read_without_warnings(tmp_path: Path) -> None:
    expected = integer_wav(tmp_path / "a.wav", 2)
    raw = (tmp_path / "a.wav").read_bytes()
    odd = b"odd " + struct.pack("<I", 3) + b"abc\0"
    size = struct.pack("<I", len(raw) - 8 + 2 * len(odd))
    (tmp_path / "b.wav").write_bytes(b"RIFF" + size + b"WAVE" + odd + raw[12:] + odd)
    assert_array_equal(read(tmp_path / "b.wav").samples, expected)


@pytest.mark.parametrize("size", [0, 0x7FFFF000, 0x80000000, 0xFFFFFFFF])
@pytest.mark.parametrize("extra", [b"", b"\1"])
def test_wav_from_a_pipe_with_unknown_size_is_read(tmp_path: Path, size: int, extra: bytes) -> None:
    expected = integer_wav(tmp_path / "a.wav", 3)
    raw = bytearray((tmp_path / "a.wav").read_bytes())
    raw[4:8] = raw[40:44] = struct.pack("<I", size)
    (tmp_path / "a.wav").write_bytes(raw + extra)
    assert_array_equal(read(tmp_path / "a.wav").samples, expected)


def test_wav_without_samples(tmp_path: Path) -> None:
    with wave.open(str(tmp_path / "a.wav"), "wb") as file:
        file.setparams((2, 2, 8000, 0, "NONE", ""))
    assert_refused(tmp_path / "a.wav", "the recording is empty")


def test_truncated_wav_of_64_bit_size(tmp_path: Path) -> None:
    integer_wav(tmp_path / "a.wav", 2)
    raw = (tmp_path / "a.wav").read_bytes()
    sizes = b"ds64" + struct.pack("<IQQQI", 28, 2**33, 2**33 - 80, 0, 0)
    (tmp_path / "a.wav").write_bytes(b"RF64" + b"\xff" * 4 + b"WAVE" + sizes + raw[12:])
    assert_refused(tmp_path / "a.wav", "truncated: expected 8589934512 bytes of samples; got 30")


def test_file_that_is_not_wav_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(b"OggS" + bytes(100))
    assert_refused(tmp_path / "a.wav", "the suffix is .wav, the content is OGG: .* damaged")
    (tmp_path / "a.wav").write_bytes(b"abcd" + bytes(100))
    assert_refused(tmp_path / "a.wav", "not a WAV file")
    integer_wav(tmp_path / "b.wav", 2)
    raw = bytearray((tmp_path / "b.wav").read_bytes())
    raw[20:22] = b"\x0c\x00"
    (tmp_path / "b.wav").write_bytes(raw)
    assert_refused(tmp_path / "b.wav", "damaged: .*fmt")
    assert_refused(
        tmp_path / "b.wav",
        "variable must be None without named arrays; got 'x' for a WAV file",
        variable="x",
    )


# NumPy and MATLAB


@pytest.mark.parametrize("kind", ["f4", "f8", "i2", "c8", "c16", ">f8"])
def test_npy_round_trip(tmp_path: Path, kind: str) -> None:
    stored = (100 * NUMBERS).astype(kind)
    np.save(tmp_path / "a.npy", stored)
    recording = read(tmp_path / "a.npy", rate=RATE)
    assert_array_equal(recording.samples, stored)
    assert recording.is_narrowband == (kind[0] == "c")
    assert read(tmp_path / "a.npy", transpose=True).samples.shape == (3, 50)


def test_one_dimensional_array_is_one_channel(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", NUMBERS[:, 0])
    assert_array_equal(read(tmp_path / "a.npy").samples, NUMBERS[:, :1])


def test_npz_with_rate_and_time(tmp_path: Path) -> None:
    times = np.linspace(3, 9, 50)
    np.savez(tmp_path / "a.npz", samples=NUMBERS, rate=RATE, sensors=np.arange(3))
    np.savez(tmp_path / "b.npz", snapshots=NUMBERS, time=times)
    np.savez(tmp_path / "c.npz", samples=NUMBERS, time=np.arange(50) / RATE)
    assert_array_equal(read(tmp_path / "a.npz").samples, NUMBERS)
    assert read(tmp_path / "a.npz").rate == RATE
    assert_array_equal(read(tmp_path / "b.npz").snapshots().values, NUMBERS.astype(complex))
    assert_array_equal(read(tmp_path / "b.npz").snapshots().time, times)
    assert read(tmp_path / "c.npz").rate == pytest.approx(RATE)


@pytest.mark.parametrize("time", [np.arange(50) ** 2, np.zeros(50), np.full(50, np.nan)])
def test_uneven_times_are_refused(tmp_path: Path, time: Float) -> None:
    np.savez(tmp_path / "a.npz", samples=NUMBERS, time=time)
    assert_refused(tmp_path / "a.npz", "not evenly spaced: pass rate= in Hz")
    assert read(tmp_path / "a.npz", rate=5).rate == 5


def write_named(path: Path, **arrays: Any) -> None:
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        scipy.io.savemat(path, arrays)


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_arrays_with_names(tmp_path: Path, suffix: str) -> None:
    one, two = tmp_path / f"one{suffix}", tmp_path / f"two{suffix}"
    write_named(one, recording=NUMBERS, fs=500.0)
    write_named(two, left=NUMBERS, right=2 * NUMBERS, Fs=250)
    assert_array_equal(read(one).samples, NUMBERS)
    assert read(one).rate == 500.0
    assert_array_equal(read(two, variable="right").samples, 2 * NUMBERS)
    assert read(two, variable="left").rate == 250.0
    assert read(two, variable="left", rate=1).rate == 1.0
    assert_refused(two, "several arrays: pass variable=, one of 'left', 'right', 'Fs'")
    assert_refused(
        two, "variable must be one of 'left', 'right', 'Fs'; got 'middle'", variable="middle"
    )


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_file_without_arrays_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_named(path, text="abc", fs=3.0)
    assert_refused(path, "samples must be numbers", variable="text")
    write_named(path, fs=3.0)
    assert_refused(path, "no array: pass variable=, one of 'fs'")
    write_named(path, samples=np.zeros((2, 3, 4)))
    assert_refused(path, r"got \(2, 3, 4\)")


@pytest.mark.parametrize("version", ["4", "5"])
@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_of_every_version_that_scipy_writes(
    tmp_path: Path, version: str, compressed: bool
) -> None:
    variables = {"y": NUMBERS + 1j * NUMBERS[::-1], "fs": 12.0}
    scipy.io.savemat(tmp_path / "a.mat", variables, format=version, do_compression=compressed)
    assert_array_equal(read(tmp_path / "a.mat").samples, variables["y"])
    assert read(tmp_path / "a.mat").rate == 12.0


def test_pickles_are_not_loaded(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{}, []], dtype=object), allow_pickle=True)
    assert_refused(tmp_path / "a.npy", "samples must be numbers; got object")
