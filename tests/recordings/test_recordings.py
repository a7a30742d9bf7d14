"""Files of every format there and back, damaged files, and narrowband snapshots of known tones."""

import contextlib
import io
import math
import struct
import wave
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import wavfile

from arrivals.measurement_models import SensorArray
from arrivals.recordings import recording as recordings
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording, default_window, narrowband
from arrivals.typing import Float

RATE = 8000.0
NUMBERS = np.random.default_rng(0).uniform(-1, 1, (50, 3))


def plane_wave(
    delays: Float, frequency: float, n_samples: int = 4000, amplitude: float = 1.0
) -> Float:
    t = np.arange(n_samples)[:, None] / RATE
    return amplitude * np.cos(2 * np.pi * frequency * (t - delays) + 0.3)


# Narrowband snapshots


def test_a_plane_wave_has_the_phases_of_its_delays() -> None:
    delays = np.array([0.0, 1e-4, 2.7e-4, -0.4e-4])
    recording = Recording(plane_wave(delays, 1234.5, amplitude=2.5), RATE)
    y = recording.snapshots(1234.5, window=512, hop=200)
    expected = 2.5 * np.exp(1j * (0.3 - 2 * np.pi * 1234.5 * delays))
    assert_allclose(y.values, np.tile(expected, (len(y.values), 1)), atol=1e-4)
    assert y.values.shape == (1 + (4000 - 512) // 200, 4)
    assert_allclose(y.time, (np.arange(len(y.values)) * 200 + 256) / RATE)
    assert y.frequency == 1234.5


@settings(deadline=None)
@given(
    st.integers(2, 70), st.integers(1, 90), st.integers(0, 10**9), st.floats(1.0, 3999.0), st.data()
)
def test_it_is_the_windowed_sum_of_the_docstring(
    window: int, hop: int, first: int, frequency: float, data: Any
) -> None:
    samples = np.random.default_rng(hop).standard_normal((data.draw(st.integers(0, 200)), 2))
    y = narrowband(samples, RATE, frequency, window, hop, first)
    starts = np.arange(0, len(samples) - window + 1, hop)
    k = np.arange(window)
    w = np.sin(np.pi * k / window) ** 2
    assert y.shape == (len(starts), 2)
    for y_s, s in zip(y, starts, strict=True):
        turns = math.fmod((first + int(s)) * frequency / RATE, 1) + k * frequency / RATE
        expected = 2 / w.sum() * (w * np.exp(-2j * np.pi * turns)) @ samples[s : s + window]
        assert_allclose(y_s, expected, atol=1e-6)


@settings(deadline=None)
@given(st.integers(16, 64), st.integers(1, 100), st.lists(st.integers(1, 300), max_size=8))
def test_a_stream_in_chunks_gives_the_numbers_of_the_whole(
    window: int, hop: int, lengths: list[int]
) -> None:
    whole = np.random.default_rng(window).standard_normal((sum(lengths), 2))
    pending, first, steps, skip = whole[:0], 0, [np.empty((0, 2), complex)], 0
    for chunk in np.split(whole, np.cumsum(lengths)[:-1]):
        pending = np.vstack([pending, chunk])
        steps.append(narrowband(pending[skip:], RATE, 700.0, window, hop, first + skip))
        used = skip + len(steps[-1]) * hop
        skip = max(0, used - len(pending))  # a hop may end beyond what has arrived
        pending, first = pending[used - skip :], first + used - skip
    assert_allclose(np.vstack(steps), narrowband(whole, RATE, 700.0, window, hop), atol=1e-12)


def test_starting_later_leaves_phases_and_times_alone() -> None:
    recording = Recording(plane_wave(np.zeros(2), 777.0), RATE)
    whole = recording.snapshots(777.0, window=100)
    late = recording.snapshots(777.0, window=100, start=300)
    assert_allclose(late.values, whole.values[3:], atol=1e-12)
    assert_allclose(late.time, whole.time[3:])


@pytest.mark.parametrize("hop", [64, 100, 1000])
def test_blocks_do_not_show(hop: int, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = np.random.default_rng(1).standard_normal((20_000, 3))
    at_once = narrowband(samples, RATE, 440.0, 100, hop)
    monkeypatch.setattr(recordings, "BLOCK", 1500)
    assert_allclose(narrowband(samples, RATE, 440.0, 100, hop), at_once, atol=1e-12)


def test_long_recordings_take_several_blocks() -> None:
    delays = np.linspace(0, 1e-3, 8)
    samples = plane_wave(delays, 1000.0, n_samples=600_000).astype(np.float32)
    assert samples.size > 2 * recordings.BLOCK
    y = Recording(samples, RATE).snapshots(1000.0).values
    expected = np.exp(1j * (0.3 - 2 * np.pi * 1000.0 * delays))
    assert_allclose(y, np.tile(expected, (600_000 // 256, 1)), atol=1e-4)


@pytest.mark.parametrize("hole", [np.nan, np.inf, -np.inf])
def test_a_missing_sample_spoils_its_channel_and_window_only(hole: float) -> None:
    samples = plane_wave(np.zeros(4), 1000.0, n_samples=1024)
    samples[300, 2] = hole
    whole = narrowband(plane_wave(np.zeros(4), 1000.0, n_samples=1024), RATE, 1000.0, 256, 256)
    for y in (
        narrowband(samples, RATE, 1000.0, 256, 256),
        Recording(samples, RATE).snapshots(1000.0).values,
    ):
        assert_array_equal(np.argwhere(np.isnan(y)), [[1, 2]])
        assert_allclose(y[~np.isnan(y)], whole[~np.isnan(y)], atol=1e-12)


@given(st.floats(1.0, 1e6), st.floats(1e-3, 0.49))
def test_the_default_window_holds_eight_periods(rate: float, share: float) -> None:
    window = default_window(rate, share * rate)
    assert window >= 256
    assert window * share >= 8 * (1 - 1e-9)
    assert window == 256 or window / 2 * share < 8


def test_complex_snapshots_are_given_as_they_are() -> None:
    values = NUMBERS + 1j
    timed = Recording(values, time=np.arange(50.0) ** 2)
    assert timed.is_narrowband
    assert (timed.n_channels, timed.duration) == (3, 49.0**2)
    y = timed.snapshots(start=10)
    assert_array_equal(y.values, values[10:])
    assert_array_equal(y.time, np.arange(10.0, 50.0) ** 2)
    assert y.frequency is None
    assert_allclose(Recording(values, rate=4).snapshots(100.0).time, np.arange(50) / 4)
    unknown = Recording(values)
    assert np.isnan(unknown.duration)
    assert np.all(np.isnan(unknown.snapshots().time))


def test_a_recording_keeps_single_precision_and_marks_what_is_missing() -> None:
    assert Recording(NUMBERS.astype(np.float32)).samples.dtype == np.float32
    assert Recording([[1, 2]]).samples.dtype == np.float64  # type: ignore[arg-type]
    assert Recording(NUMBERS.astype(np.complex64)).samples.dtype == np.complex128
    given_samples = np.array([1.0, np.inf])
    assert_array_equal(Recording(given_samples).samples, [[1.0], [np.nan]])
    assert given_samples[1] == np.inf
    assert np.isnan(Recording(np.array([1.0, complex(0, np.inf)])).samples[1, 0])


def no_snapshots(message: str, rate: float | None = RATE, **arguments: Any) -> None:
    with pytest.raises(ValueError, match=message):
        Recording(NUMBERS, rate).snapshots(**({"frequency": 100.0} | arguments))


def test_snapshots_that_cannot_be_had() -> None:
    no_snapshots(r"below half the rate, 4000 Hz; got 4000 Hz", frequency=4000.0)
    no_snapshots("frequency must be finite and positive; got 0", frequency=0)
    no_snapshots("pass a frequency in Hz", frequency=None)
    no_snapshots("pass rate= in Hz", rate=None)
    no_snapshots("has 50 samples; one window takes 1024: pass a shorter window=")
    no_snapshots("has 10 samples after sample 40; one window takes 20", window=20, start=40)
    no_snapshots("has 0 samples after sample 70", window=20, start=70)
    no_snapshots("window must be at least 2; got 1", window=1)
    no_snapshots("hop must be at least 1; got 0", window=20, hop=0)
    no_snapshots("start must be at least 0; got -1", start=-1)
    with pytest.raises(ValueError, match="if its rows are channels, transpose it"):
        Recording(NUMBERS.T, RATE).snapshots(100.0)
    with pytest.raises(ValueError, match="it takes no window or hop"):
        Recording(NUMBERS + 0j).snapshots(window=10)
    with pytest.raises(ValueError, match="start must be below 50; got 50"):
        Recording(NUMBERS + 0j).snapshots(start=50)
    with pytest.raises(TypeError, match="samples must be real numbers"):
        narrowband(NUMBERS + 0j, RATE, 100.0, 8, 8)
    with pytest.raises(
        ValueError, match=r"\(n_samples, n_channels\); got float64 of shape \(50,\)"
    ):
        narrowband(NUMBERS[:, 0], RATE, 100.0, 8, 8)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"samples": np.zeros((2, 3, 4))}, r"shape \(n_samples, n_channels\); got \(2, 3, 4\)"),
        ({"samples": np.float64(3)}, r"got \(\)"),
        ({"samples": np.empty((0, 4))}, r"is empty; its shape is \(0, 4\)"),
        ({"samples": np.full((5, 2), np.nan)}, "no sample of the recording is finite"),
        ({"samples": NUMBERS, "rate": 0}, "rate must be finite and positive; got 0"),
        ({"samples": NUMBERS, "time": np.arange(50)}, "real samples have a rate"),
        ({"samples": NUMBERS + 0j, "time": np.arange(49)}, r"time must have shape \(50,\)"),
    ],
)
def test_a_recording_refuses_what_does_not_fit(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Recording(**arguments)


def test_a_recording_is_made_of_numbers() -> None:
    with pytest.raises(TypeError, match="samples must be numbers; got <U1"):
        Recording(np.array(["a", "b"]))


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


def test_wav_with_chunks_that_nobody_knows_is_read_in_silence(tmp_path: Path) -> None:
    expected = integer_wav(tmp_path / "a.wav", 2)
    raw = (tmp_path / "a.wav").read_bytes()
    odd = b"odd " + struct.pack("<I", 3) + b"abc\0"
    size = struct.pack("<I", len(raw) - 8 + 2 * len(odd))
    (tmp_path / "b.wav").write_bytes(b"RIFF" + size + b"WAVE" + odd + raw[12:] + odd)
    assert_array_equal(read(tmp_path / "b.wav").samples, expected)


@pytest.mark.parametrize("size", [0, 0x7FFFF000, 0x80000000, 0xFFFFFFFF])
@pytest.mark.parametrize("extra", [b"", b"\1"])
def test_wav_from_a_pipe_does_not_know_its_size(tmp_path: Path, size: int, extra: bytes) -> None:
    expected = integer_wav(tmp_path / "a.wav", 3)
    raw = bytearray((tmp_path / "a.wav").read_bytes())
    raw[4:8] = raw[40:44] = struct.pack("<I", size)
    (tmp_path / "a.wav").write_bytes(raw + extra)
    assert_array_equal(read(tmp_path / "a.wav").samples, expected)


def test_wav_without_samples(tmp_path: Path) -> None:
    with wave.open(str(tmp_path / "a.wav"), "wb") as file:
        file.setparams((2, 2, 8000, 0, "NONE", ""))
    refused(tmp_path / "a.wav", "the recording is empty")


def test_truncated_wav_of_64_bit_size(tmp_path: Path) -> None:
    integer_wav(tmp_path / "a.wav", 2)
    raw = (tmp_path / "a.wav").read_bytes()
    sizes = b"ds64" + struct.pack("<IQQQI", 28, 2**33, 2**33 - 80, 0, 0)
    (tmp_path / "a.wav").write_bytes(b"RF64" + b"\xff" * 4 + b"WAVE" + sizes + raw[12:])
    refused(tmp_path / "a.wav", "truncated: 8589934512 bytes of samples are announced, 30 are")


def test_wav_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(b"OggS" + bytes(100))
    refused(tmp_path / "a.wav", "this is not a WAV file")
    integer_wav(tmp_path / "b.wav", 2)
    raw = bytearray((tmp_path / "b.wav").read_bytes())
    raw[20:22] = b"\x07\x00"
    (tmp_path / "b.wav").write_bytes(raw)
    refused(tmp_path / "b.wav", "Unknown wave file format: MULAW")
    refused(tmp_path / "b.wav", "variable is for npz and mat files; got 'x'", variable="x")


# NumPy and MATLAB


def refused(path: Path, message: str, **arguments: Any) -> None:
    with pytest.raises(ValueError, match=message) as error:
        read(path, **arguments)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", ["f4", "f8", "i2", "c8", "c16", ">f8"])
def test_npy_there_and_back(tmp_path: Path, kind: str) -> None:
    stored = (100 * NUMBERS).astype(kind)
    np.save(tmp_path / "a.npy", stored)
    recording = read(tmp_path / "a.npy", rate=RATE)
    assert_array_equal(recording.samples, stored)
    assert recording.is_narrowband == (kind[0] == "c")
    assert read(tmp_path / "a.npy", transpose=True).samples.shape == (3, 50)


def test_one_channel_may_be_a_plain_series(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", NUMBERS[:, 0])
    assert_array_equal(read(tmp_path / "a.npy").samples, NUMBERS[:, :1])


def test_our_own_npz(tmp_path: Path) -> None:
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
def test_uneven_times_give_no_rate(tmp_path: Path, time: Float) -> None:
    np.savez(tmp_path / "a.npz", samples=NUMBERS, time=time)
    refused(tmp_path / "a.npz", "not evenly spaced: pass rate= in Hz")
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
    refused(two, "several arrays, pass variable=; there is: 'left', 'right', 'Fs'")
    refused(two, "there is no variable 'middle'; there is: 'left', 'right'", variable="middle")


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_nothing_of_use(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_named(path, text="abc", fs=3.0)
    refused(path, "samples must be numbers", variable="text")
    write_named(path, fs=3.0)
    refused(path, "no array, pass variable=; there is: 'fs'")
    write_named(path, samples=np.zeros((2, 3, 4)))
    refused(path, r"got \(2, 3, 4\)")


@pytest.mark.parametrize("version", ["4", "5"])
@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_of_every_version_that_scipy_writes(
    tmp_path: Path, version: str, compressed: bool
) -> None:
    variables = {"y": NUMBERS + 1j * NUMBERS[::-1], "fs": 12.0}
    scipy.io.savemat(tmp_path / "a.mat", variables, format=version, do_compression=compressed)
    assert_array_equal(read(tmp_path / "a.mat").samples, variables["y"])
    assert read(tmp_path / "a.mat").rate == 12.0


def test_matlab_of_version_7_3(tmp_path: Path) -> None:
    header = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM"
    (tmp_path / "a.mat").write_bytes(header + bytes(384) + b"\x89HDF\r\n\x1a\n" + bytes(500))
    refused(tmp_path / "a.mat", "v7.3 .* h5py, which is not supported: save it with -v7")


def test_pickles_are_left_alone(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{}, []], dtype=object), allow_pickle=True)
    refused(tmp_path / "a.npy", "Object arrays cannot be loaded")


# Text


def text(path: Path, content: str) -> Any:
    path.write_text(content, encoding="utf-8")
    return read(path).samples


@pytest.mark.parametrize(
    "content",
    [
        "1,2.5\n-3,4\n",
        "a;b\n1;2,5\n-3;4",
        "# made by hand\n\n 1   2.5 \n-3e0 4\n",
        "\ufeffleft\tright\r\n1\t2.5\r\n-3\t4\r\n",
        "% left, right\n1, 2.5\n-3, 4\n",
    ],
)
@pytest.mark.parametrize("suffix", ["csv", "txt"])
def test_text_of_many_kinds(tmp_path: Path, content: str, suffix: str) -> None:
    assert_array_equal(text(tmp_path / f"a.{suffix}", content), [[1, 2.5], [-3, 4]])


@pytest.mark.parametrize(
    "content", ["1+2j,3\n-4i,nan\n", "(1+2j) (3+0j)\n(0-4j) nan", "1 + 2i; 3\n0+-4i;\n"]
)
def test_complex_text(tmp_path: Path, content: str) -> None:
    assert_array_equal(text(tmp_path / "a.csv", content), [[1 + 2j, 3], [-4j, np.nan]])


def test_what_numpy_saves_as_text(tmp_path: Path) -> None:
    for numbers in (NUMBERS, NUMBERS - 1j * NUMBERS):
        np.savetxt(tmp_path / "a.txt", numbers, header="three channels")
        assert_allclose(read(tmp_path / "a.txt").samples, numbers)


def test_an_empty_cell_is_missing(tmp_path: Path) -> None:
    assert_array_equal(
        text(tmp_path / "a.csv", "1,,3\n,5,\n"), [[1, np.nan, 3], [np.nan, 5, np.nan]]
    )


def test_a_column_of_times_is_no_channel(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,a,b\n1.0,5,6\n1.5,7,8\n2.0,9,1\n")
    recording = read(tmp_path / "a.csv")
    assert (recording.rate, recording.n_channels) == (2.0, 2)
    (tmp_path / "b.csv").write_text("t,a\n1,5j\n7,6j\n")
    assert_array_equal(read(tmp_path / "b.csv").snapshots().time, [1, 7])


def test_text_that_does_not_fit(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for content, message in [
        ("a,b\n1,2\n\n3,4,5\n", "line 4 has 3 values, those before 2"),
        ("1,2\n3", "line 2 has 1 values, those before 2"),
        ("1,2\n3,x y\n", "line 2 holds 'x y', which is not a number"),
        ("a,b\nc,d\n", "line 2 holds 'c', which is not a number"),
        ("1,b\n", "line 1 holds 'b'"),
        ("# nothing\n\n", "the file holds no numbers"),
        ("nan,inf\n", "no sample of the recording is finite"),
    ]:
        path.write_text(content)
        refused(path, message)
    path.write_bytes(b"\xff\xfe\x00\x81")
    refused(path, "codec can't decode")


# Any file


def test_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="No such file or directory") as error:
        read(tmp_path / "a.wav")
    assert "\n" not in str(error.value)
    (tmp_path / "a.flac").write_bytes(b"fLaC")
    refused(tmp_path / "a.flac", r"one of .wav, .npy, .npz, .mat, .csv, .txt; got '.flac'")
    for suffix in ("wav", "npy", "npz", "mat", "csv"):
        (tmp_path / f"a.{suffix}").touch()
        refused(tmp_path / f"a.{suffix}", "the file is empty")


def whole_file(suffix: str) -> bytes:
    file = io.BytesIO()
    if suffix == ".wav":
        wavfile.write(file, 8000, (NUMBERS * 2**15).astype(np.int16))
    elif suffix == ".npy":
        np.save(file, NUMBERS)
    elif suffix == ".npz":
        np.savez_compressed(file, samples=NUMBERS, rate=RATE)
    else:
        scipy.io.savemat(file, {"samples": NUMBERS}, do_compression=suffix == ".z.mat")
    return file.getvalue()


@pytest.mark.parametrize("suffix", [".wav", ".npy", ".npz", ".mat", ".z.mat"])
def test_truncated_files(tmp_path: Path, suffix: str) -> None:
    whole, path = whole_file(suffix), tmp_path / f"a{suffix}"
    path.write_bytes(whole)
    assert read(path).samples.shape == (50, 3)
    for length in [3, 10, 30, 50, 130, 170, *range(200, len(whole), 97), len(whole) - 1]:
        path.write_bytes(whole[:length])
        refused(path, ".")
    path.write_bytes(whole[:-20])
    refused(path, "truncated")


@pytest.mark.parametrize("suffix", [".wav", ".npy", ".npz"])  # a damaged .mat can crash scipy
def test_damaged_files_fail_in_no_other_way(tmp_path: Path, suffix: str) -> None:
    whole, path, rng = whole_file(suffix), tmp_path / f"a{suffix}", np.random.default_rng(3)
    for _ in range(60):
        damaged = bytearray(whole)
        for place in rng.integers(0, 200, 3):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged)
        with contextlib.suppress(ValueError):
            read(path)


def test_a_rate_is_positive(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="rate must be finite and positive; got -1"):
        read(tmp_path / "a.npy", rate=-1)


def test_a_file_of_a_plane_wave_from_end_to_end(tmp_path: Path) -> None:
    delays = np.array([0.0, 1e-4, 2e-4])
    wave_int16 = np.round(2**15 * plane_wave(delays, 1000.0, amplitude=0.5)).astype(np.int16)
    wavfile.write(tmp_path / "a.wav", int(RATE), wave_int16)
    y = read(tmp_path / "a.wav").snapshots(1000.0).values
    assert_allclose(y.mean(axis=0), 0.5 * np.exp(1j * (0.3 - 2e3 * np.pi * delays)), atol=3e-5)


def test_an_array_takes_its_channels_and_goes_with_the_recording(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.arange(8.0).reshape(2, 4))
    array = SensorArray.ula(4, 0.5, missing=[1])
    recording = read(tmp_path / "a.npy", rate=10.0, array=array)
    assert recording.samples.tolist() == [[0, 2, 3], [4, 6, 7]]
    assert recording.array == array
    with pytest.raises(ValueError, match="the recording must have 5 channels; got 4"):
        read(tmp_path / "a.npy", rate=10.0, array=SensorArray.ula(5, 0.5))
    with pytest.raises(ValueError, match="the array has 3 sensors, the recording 4 channels"):
        Recording(np.ones((2, 4)), array=array)
