"""Text files; missing, truncated and damaged files of any format."""

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from numpy.testing import assert_allclose, assert_array_equal
from recording_files import NUMBERS, RATE, assert_refused, plane_wave
from scipy.io import wavfile

from arrivals.measurement_models import SensorArray
from arrivals.recordings import Recording, read


def text(path: Path, content: str) -> Any:
    path.write_text(content, encoding="utf-8")
    return read(path).samples


@pytest.mark.parametrize(
    "content",
    [
        "1,2.5\n-3,4\n",
        "a;b\n1;2,5\n-3;4",
        "a\tb\n1\t2,5\n-3\t4",
        '"a";"b"\r\n"1";"2,5"\r\n"-3";"4"\r\n',
        "# made by hand\n\n 1   2.5 \n-3e0 4\n",
        "\ufeffleft\tright\r\n1\t2.5\r\n-3\t4\r\n",
        "% left, right\n1, 2.5\n-3, 4\n",
    ],
)
@pytest.mark.parametrize("suffix", ["csv", "txt"])
def test_text_with_any_separator(tmp_path: Path, content: str, suffix: str) -> None:
    assert_array_equal(text(tmp_path / f"a.{suffix}", content), [[1, 2.5], [-3, 4]])


@pytest.mark.parametrize(
    "content", ["1+2j,3\n-4i,nan\n", "(1+2j) (3+0j)\n(0-4j) nan", "1 + 2i; 3\n0+-4i;\n"]
)
def test_complex_text(tmp_path: Path, content: str) -> None:
    assert_array_equal(text(tmp_path / "a.csv", content), [[1 + 2j, 3], [-4j, np.nan]])


def test_text_of_numpy_savetxt(tmp_path: Path) -> None:
    for numbers in (NUMBERS, NUMBERS - 1j * NUMBERS):
        np.savetxt(tmp_path / "a.txt", numbers, header="three channels")
        assert_allclose(read(tmp_path / "a.txt").samples, numbers)


def test_empty_cell_is_missing(tmp_path: Path) -> None:
    assert_array_equal(
        text(tmp_path / "a.csv", "1,,3\n,5,\n"), [[1, np.nan, 3], [np.nan, 5, np.nan]]
    )


@pytest.mark.parametrize("word", ["nan", "None", "NA", "N/A", "#N/A", "null", "", "1e999", "-inf"])
def test_word_for_missing_is_missing(tmp_path: Path, word: str) -> None:
    assert_array_equal(text(tmp_path / "a.csv", f"a,b\n{word},2\n3,4\n"), [[np.nan, 2], [3, 4]])
    assert_array_equal(text(tmp_path / "a.csv", f"{word},{word}\n3,4\n")[-1], [3, 4])
    assert len(text(tmp_path / "a.csv", f"{word},{word}\n3,4\n")) == 2


def test_text_in_utf_16_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes("a\tb\r\n1\t2,5\r\n".encode("utf-16"))
    assert_array_equal(read(tmp_path / "a.txt").samples, [[1, 2.5]])


def test_column_of_times_is_not_a_channel(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,a,b\n1.0,5,6\n1.5,7,8\n2.0,9,1\n")
    recording = read(tmp_path / "a.csv")
    assert (recording.rate, recording.n_channels) == (2.0, 2)
    (tmp_path / "b.csv").write_text("t,a\n1,5j\n7,6j\n")
    assert_array_equal(read(tmp_path / "b.csv").snapshots().time, [1, 7])


def test_invalid_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for content, message in [
        ("a,b\n1,2\n\n3,4,5\n", "line 4 must have 2 values; got 3"),
        ("1,2\n3", "line 2 must have 2 values; got 1"),
        ("1,2\n3,x y\n", "line 2 must contain numbers; got 'x y'"),
        ("a,b\nc,d\n", "line 2 must contain numbers; got 'c'"),
        ("1,b\n", "line 1 must contain numbers; got 'b'"),
        ("# nothing\n\n", "the file contains no numbers"),
        ("nan,inf\n", "no sample of the recording is finite"),
    ]:
        path.write_text(content)
        assert_refused(path, message)
    for raw, message in [
        (b"1,2\n3,\xe4\n", "line 2 must be UTF-8 text; got the byte 0xe4: save the file as UTF-8"),
        (b'1,2\n"3,4\n', "line 2: unexpected end of data"),
        (b"1,2\n3,\0\n", "line 2"),
        (b"1,5 2,5\n", "line 1 must contain numbers; got '5 2'"),
        (b"1,2\n3," + b"[" * 5000, r"line 2 must contain numbers; got '\[{100,400}\.\.\.$"),
        (b"1_000,2\n", "line 1 must contain numbers; got '1_000'"),
    ]:
        path.write_bytes(raw)
        assert_refused(path, message)


# Any file


def test_missing_unknown_and_empty_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="No such file or directory") as error:
        read(tmp_path / "a.wav")
    assert "\n" not in str(error.value)
    (tmp_path / "a.pcap").write_bytes(b"abcd")
    assert_refused(tmp_path / "a.pcap", r"suffix must be one of .wav, .*, .txt; got '.pcap'")
    for suffix in ("wav", "npy", "npz", "mat", "csv"):
        (tmp_path / f"a.{suffix}").touch()
        assert_refused(tmp_path / f"a.{suffix}", "the file is empty")


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
        assert_refused(path, ".")
    path.write_bytes(whole[:-20])
    assert_refused(path, "truncated")


@pytest.mark.parametrize("suffix", [".wav", ".npy", ".npz"])  # a damaged .mat can crash scipy
def test_damaged_files_raise_only_value_errors(tmp_path: Path, suffix: str) -> None:
    whole, path, rng = whole_file(suffix), tmp_path / f"a{suffix}", np.random.default_rng(3)
    for _ in range(60):
        damaged = bytearray(whole)
        for place in rng.integers(0, 200, 3):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged)
        with contextlib.suppress(ValueError):
            read(path)


def test_rate_must_be_positive(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="rate must be finite and positive; got -1"):
        read(tmp_path / "a.npy", rate=-1)


def test_wav_of_a_plane_wave_has_its_phases(tmp_path: Path) -> None:
    delays = np.array([0.0, 1e-4, 2e-4])
    wave_int16 = np.round(2**15 * plane_wave(delays, 1000.0, amplitude=0.5)).astype(np.int16)
    wavfile.write(tmp_path / "a.wav", int(RATE), wave_int16)
    y = read(tmp_path / "a.wav").snapshots(1000.0).values
    assert_allclose(y.mean(axis=0), 0.5 * np.exp(1j * (0.3 - 2e3 * np.pi * delays)), atol=3e-5)


def test_array_selects_its_channels(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.arange(8.0).reshape(2, 4))
    array = SensorArray.ula(4, 0.5, missing=[1])
    recording = read(tmp_path / "a.npy", rate=10.0, array=array)
    assert np.array_equal(recording.samples, [[0, 2, 3], [4, 6, 7]])
    assert recording.array == array
    with pytest.raises(ValueError, match="5 channels"):
        read(tmp_path / "a.npy", rate=10.0, array=SensorArray.ula(5, 0.5))
    with pytest.raises(
        ValueError, match="samples must have 3 channels, the sensors of the array; got 4"
    ):
        Recording(np.ones((2, 4)), array=array)
