"""Damaged, lying and huge recording files: an error with the file's name, and no more."""

import contextlib
import io
import os
import struct
import sys
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import soundfile
from numpy.testing import assert_array_equal
from recording_files import NUMBERS, RATE, assert_refused
from scipy.io import wavfile

from arrivals.recordings import Recording, StoredSamples, read
from arrivals.recordings.formats.matlab import matlab_arrays
from arrivals.recordings.formats.numpy_files import numpy_arrays

VARIABLES: dict[str, Any] = {
    "samples": NUMBERS,
    "single": NUMBERS.astype("f4") + 1j,
    "whole": np.arange(300, dtype="f8").reshape(20, 15),
    "long": np.arange(8, dtype="i8")[:, None],
    "cube": np.ones((2, 3, 4), "u2"),
    "logical": np.eye(3, dtype=bool),
    "nothing": np.zeros((0, 3)),
    "text": "abc",
    "cell": np.array([[1.0], "x"], dtype=object),
    "record": {"a": NUMBERS, "b": "c"},
    "fs": RATE,
}


def matlab_file(form: str = "5", compressed: bool = False, **variables: Any) -> bytes:
    file = io.BytesIO()
    scipy.io.savemat(file, variables, format=form, do_compression=compressed)
    return file.getvalue()


def mutated(whole: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with some bytes changed, cut, doubled or inserted, mostly near its start."""
    damaged = bytearray(whole)
    near = min(len(whole), int(rng.choice([60, 250, 500, len(whole)])))
    kind = rng.integers(8)
    at = int(rng.integers(near))
    if kind == 0:
        return bytes(damaged[:at])
    if kind == 1:
        return bytes(damaged[:at] + damaged[at // 2 :])
    if kind == 2:
        return bytes(damaged[:at] + rng.bytes(4) + damaged[at:])
    for place in rng.integers(0, near, rng.integers(1, 4)):
        damaged[place] = rng.choice([0, 255, damaged[place] ^ (1 << rng.integers(8))])
    return bytes(damaged)


@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_arrays_equal_those_of_scipy(compressed: bool) -> None:
    whole = matlab_file(compressed=compressed, **VARIABLES)
    expected = scipy.io.loadmat(io.BytesIO(whole))
    arrays = matlab_arrays(io.BytesIO(whole))
    assert list(arrays) == list(VARIABLES)
    for name in ("text", "cell", "record"):
        assert not arrays[name].is_numeric
        del arrays[name]
    for name, stored in arrays.items():
        loaded = stored.load()
        assert_array_equal(loaded, expected[name], strict=True)
        assert (stored.shape, stored.dtype) == (loaded.shape, loaded.dtype)


def test_matlab_arrays_of_level_4_equal_those_of_scipy() -> None:
    numbers: dict[str, Any] = {
        "a": NUMBERS,
        "b": NUMBERS[:4] + 1j,
        "fs": 8.0,
        "whole": np.eye(3, dtype="i2"),
    }
    whole = matlab_file("4", **numbers, text="abc")
    arrays = matlab_arrays(io.BytesIO(whole))
    assert not arrays.pop("text").is_numeric
    for name, stored in arrays.items():
        assert_array_equal(stored.load(), numbers[name])


def swapped_level_4(numbers: Any) -> bytes:
    head = struct.pack(">5i", 1000, *numbers.shape, 0, 2) + b"x\0"
    return bytes(head + numbers.T.astype(">f8").tobytes())


def test_big_endian_matlab_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_bytes(swapped_level_4(NUMBERS))
    assert_array_equal(read(tmp_path / "a.mat").samples, NUMBERS)


@pytest.mark.parametrize(
    "whole",
    [
        matlab_file(samples=np.ones((30, 4)), fs=8000),
        matlab_file(samples=np.ones((30, 4)) + 1j, text="abc", compressed=True),
        matlab_file("4", samples=np.ones((30, 4)), text="abc"),
        matlab_file(cell=VARIABLES["cell"], record=VARIABLES["record"], samples=NUMBERS),
    ],
    ids=["level 5", "compressed", "level 4", "parts"],
)
def test_damaged_matlab_file_is_a_value_error(tmp_path: Path, whole: bytes) -> None:
    rng, path = np.random.default_rng(5), tmp_path / "a.mat"
    for _ in range(100):
        path.write_bytes(mutated(whole, rng))
        with contextlib.suppress(ValueError):
            read(path, variable="samples")


@pytest.mark.parametrize(
    "suffix",
    [".wav", ".npy", ".npz", ".csv", ".flac", ".ogg", ".aiff", ".caf", ".w64", ".rf64"],
)
def test_damaged_file_is_a_value_error_with_its_name(tmp_path: Path, suffix: str) -> None:
    file, path, rng = io.BytesIO(), tmp_path / f"a{suffix}", np.random.default_rng(6)
    if suffix == ".wav":
        wavfile.write(file, 8000, (NUMBERS * 2**15).astype(np.int16))
    elif suffix == ".csv":
        np.savetxt(file, NUMBERS, delimiter=",")
    elif suffix == ".npy":
        np.save(file, NUMBERS)
    elif suffix == ".npz":
        np.savez_compressed(file, samples=NUMBERS, rate=RATE)
    else:
        soundfile.write(file, NUMBERS, 8000, format=suffix[1:].upper())
    for _ in range(100):
        path.write_bytes(mutated(file.getvalue(), rng))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # about another format
                assert read(path).samples.ndim == 2
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")  # noqa: PT017  (many may be right)
            assert "\n" not in str(error)  # noqa: PT017


def test_changed_byte_in_a_compressed_array_is_seen(tmp_path: Path) -> None:
    whole = bytearray(matlab_file(compressed=True, samples=NUMBERS))
    whole[-40] ^= 1
    (tmp_path / "a.mat").write_bytes(whole)
    assert_refused(tmp_path / "a.mat", "Error -3 while decompressing|decompress to")


# sizes


def npy_header(shape: tuple[int, ...]) -> bytes:
    file = io.BytesIO()
    header: Any = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue()


@pytest.fixture
def little_memory() -> Any:
    """Limit the memory of the process to half a gigabyte more than it has."""
    if sys.platform != "linux":
        yield
        return
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    old = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * os.sysconf("SC_PAGE_SIZE") + 2**29, old[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, old)


@pytest.mark.usefixtures("little_memory")
def test_sizes_that_lie_are_refused_unread(tmp_path: Path) -> None:
    npy, npz, mat = (tmp_path / f"a.{suffix}" for suffix in ("npy", "npz", "mat"))
    npy.write_bytes(npy_header((10**12, 4)) + bytes(1000))
    with zipfile.ZipFile(npz, "w") as archive:
        archive.writestr("samples.npy", npy_header((10**12, 4)) + bytes(1000))
    zeros = zlib.compress(bytes(8)) + bytes(100)
    mat.write_bytes(b"MATLAB 5.0".ljust(124) + b"\0\1IM" + struct.pack("<II", 15, 2**31) + zeros)
    for path in (npy, npz, mat):
        assert_refused(path, "truncated.*expected")


@pytest.mark.usefixtures("little_memory")
def test_compressed_bombs_are_refused_unread(tmp_path: Path) -> None:
    npz, mat = tmp_path / "a.npz", tmp_path / "a.mat"
    zeros = np.zeros(2**22)  # 34 MB in 33 kB
    np.savez_compressed(npz, samples=zeros)
    mat.write_bytes(matlab_file(compressed=True, samples=zeros[:, None]))
    for path in (npz, mat):
        assert path.stat().st_size < 60_000
        assert_refused(path, "at most 0.02 GB; got 0.03355 GB: pass max_bytes=", max_bytes=2e7)


@pytest.mark.parametrize("suffix", ["wav", "npy", "npz", "mat", "csv"])
def test_file_above_the_limit_is_refused_or_stays_on_disk(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    if suffix == "wav":
        wavfile.write(path, 8000, NUMBERS)
    elif suffix == "csv":
        np.savetxt(path, NUMBERS)
    elif suffix == "npy":
        np.save(path, NUMBERS)
    elif suffix == "npz":
        np.savez(path, samples=NUMBERS)
    else:
        scipy.io.savemat(path, {"samples": NUMBERS})
    if suffix in ("wav", "npy"):
        assert isinstance(read(path, max_bytes=1000).samples, StoredSamples)
        limited: dict[str, Any] = {"transpose": True}
    else:
        limited = {}
    assert_refused(path, "the data must have at most 1e-06 GB", max_bytes=1000, **limited)
    assert read(path, max_bytes=10_000).samples.shape == (50, 3)


def test_missing_rate_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, samples=NUMBERS)
    monkeypatch.setattr(
        "arrivals.recordings.formats.numpy_files.read_array", lambda *_, **__: pytest.fail("loaded")
    )
    assert_refused(path, "the rate is unknown: pass rate=", rate_required=True)
    monkeypatch.undo()
    assert read(path, rate=8.0, rate_required=True).rate == 8.0
    np.savez(path, snapshots=NUMBERS)
    assert read(path, rate_required=True).is_narrowband


# other inputs


def test_pipe_and_folder_are_refused(tmp_path: Path) -> None:
    for suffix in ("wav", "csv", "npz", "mat"):
        (tmp_path / f"folder.{suffix}").mkdir()
        with pytest.raises(OSError, match="not a regular file"):
            read(tmp_path / f"folder.{suffix}")
    if sys.platform != "win32":
        os.mkfifo(tmp_path / "a.wav")
        with pytest.raises(OSError, match="not a regular file"):
            read(tmp_path / "a.wav")


def test_array_of_numbers_passes_the_gate() -> None:
    masked = np.ma.masked_greater(NUMBERS, 0.5)
    expected = np.where(NUMBERS > 0.5, np.nan, NUMBERS)
    for recording in (read(masked, rate=RATE), Recording(masked, RATE)):
        assert_array_equal(recording.samples, expected)
    rows: Any = [[1.0, None], [np.inf, 2.0]]
    assert_array_equal(read(rows).samples, [[1, np.nan], [np.nan, 2]])
    with pytest.raises(ValueError, match="rows of one length"):
        read([[1.0, 2.0], [3.0]])
    with pytest.raises(ValueError, match="the rate is unknown"):
        read(NUMBERS, rate_required=True)


def test_arrays_of_an_archive_are_loaded_on_demand() -> None:
    file = io.BytesIO()
    np.savez(file, samples=NUMBERS, names=np.array(["a", "b"]))
    arrays = numpy_arrays(file)
    assert [arrays[name].is_numeric for name in arrays] == [True, False]
    assert_array_equal(arrays["samples"].load(), NUMBERS)


def test_encrypted_npz_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, samples=np.ones((9, 2)), rate=8.0)
    data = bytearray(path.read_bytes())
    at = data.index(b"PK\1\2")
    data[6], data[at + 8] = data[6] | 1, data[at + 8] | 1
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"a.npz: the file is encrypted: save it without"):
        read(path)
