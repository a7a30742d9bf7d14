"""One recording of several files, and files without a header whose array gives the channels."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from recording_files import NUMBERS, RATE, assert_refused
from scipy.io import wavfile

from arrivals.measurement_models import SensorArray
from arrivals.recordings import read
from arrivals.recordings.formats.file_contents import FileContents
from arrivals.recordings.formats.several_files import joined
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.typing import Float

Z = (NUMBERS + 1j * NUMBERS[::-1]).astype("c8")


def channel_files(folder: Path) -> list[Path]:
    paths = [folder / f"ch{i}.cf32" for i in range(3)]
    for path, column in zip(paths, Z.T, strict=True):
        column.tofile(path)
    return paths


def test_one_file_a_channel_is_the_interleaved_file(tmp_path: Path) -> None:
    array = SensorArray.ula(3, 0.5)
    Z.tofile(tmp_path / "all.cf32")
    whole = read(tmp_path / "all.cf32", array=array, rate=5.0)
    several = read(channel_files(tmp_path), array=array, rate=5.0)
    assert_array_equal(whole.samples, Z)
    assert_array_equal(several.samples, Z)
    assert (several.rate, several.array) == (5.0, array)
    assert_array_equal(read(channel_files(tmp_path)[::-1]).samples, Z[:, ::-1])


def test_missing_element_of_a_raw_file_has_a_channel(tmp_path: Path) -> None:
    Z.tofile(tmp_path / "all.cf32")
    array = SensorArray.ula(3, 0.5, missing=[1])
    assert_array_equal(read(tmp_path / "all.cf32", array=array).samples, Z[:, [0, 2]])


def test_format_has_the_number_of_channels(tmp_path: Path) -> None:
    Z.tofile(tmp_path / "all.bin")
    assert_array_equal(read(tmp_path / "all.bin", format="cf32:3").samples, Z)
    np.save(tmp_path / "a.npy", NUMBERS)
    assert_array_equal(read(tmp_path / "a.npy", format=":3").samples, NUMBERS)
    assert_refused(tmp_path / "a.npy", "channels must be 3, that of the file; got 4", format=":4")
    with pytest.raises(ValueError, match="such as cs16 or cs16:5; got 'cs16:x'"):
        read(tmp_path / "all.bin", format="cs16:x")
    with pytest.raises(ValueError, match=r"format must be one of .*; got 'cs17'"):
        read(tmp_path / "all.bin", format="cs17")


def test_mono_wavs_are_one_recording(tmp_path: Path) -> None:
    for i in range(3):
        wavfile.write(tmp_path / f"{i}.wav", int(RATE), NUMBERS[:, i].astype("f4"))
    recording = read([str(tmp_path / f"{i}.wav") for i in range(3)])
    assert recording.rate == RATE
    assert_array_equal(recording.samples, NUMBERS.astype("f4"))


def test_files_that_differ_are_refused(tmp_path: Path) -> None:
    paths = channel_files(tmp_path)
    Z[:-1, 1].tofile(paths[1])
    with pytest.raises(ValueError, match=r"ch0.cf32: .*ch1.cf32 must have the same length: 50"):
        read(paths)
    np.save(tmp_path / "real.npy", NUMBERS[:, 0])
    with pytest.raises(ValueError, match="the same kind of samples: complex; got real"):
        read([paths[0], tmp_path / "real.npy"])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["samples"], file["rate"] = NUMBERS, 3.0
    with pytest.raises(ValueError, match="the same rate: None; got 3"):
        read([tmp_path / "real.npy", tmp_path / "a.h5"])
    with pytest.raises(ValueError, match="transpose requires a single file"):
        read([paths[0], paths[2]], transpose=True)
    with pytest.raises(OSError, match=r"no\.npy"):
        read([paths[0], tmp_path / "no.npy"])


def test_stored_samples_are_joined_by_blocks() -> None:
    def part(column: Float) -> StoredSamples:
        return StoredSamples((50, 1), np.dtype(float), lambda a, b: column[a:b, None])

    parts = [part(column) for column in NUMBERS.T]
    whole = joined([FileContents(each) for each in parts], [Path("a")] * 3).array
    assert isinstance(whole, StoredSamples)
    assert_array_equal(whole[7:20], NUMBERS[7:20])


@pytest.mark.parametrize(
    ("name", "content", "package"),
    [
        ("a.h5", b"\x89HDF\r\n\x1a\n", "h5py"),
        ("a.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM", "h5py"),
        ("a.mseed", b"000001D ".ljust(512), "pymseed"),
        ("a.sigmf-meta", b"{}", "sigmf"),
    ],
)
def test_package_that_is_missing_is_named(
    name: str, content: bytes, package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / name).write_bytes(content)
    monkeypatch.setitem(sys.modules, package, None)
    assert_refused(tmp_path / name, rf'requires {package}: pip install "arrivals\[io\]"$')


def test_sigmf_samples_without_metadata_are_read_by_format(tmp_path: Path) -> None:
    Z.tofile(tmp_path / "a.sigmf-data")
    assert_refused(tmp_path / "a.sigmf-data", r"a\.sigmf-meta is missing: .* --format and --rate")
    assert_array_equal(read(tmp_path / "a.sigmf-data", format="cf32:3").samples, Z)


@pytest.mark.parametrize("suffix", ["h5", "sigmf-meta", "sigmf", "cf32", "sio", "mseed"])
def test_empty_file_of_any_format_is_refused(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"a.{suffix}").touch()
    assert_refused(tmp_path / f"a.{suffix}", "the file is empty")
