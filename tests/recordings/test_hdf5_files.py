"""HDF5 files: acoular's, any dataset, and those of MATLAB v7.3."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from recording_files import NUMBERS, assert_refused

from arrivals.recordings.formats.file_contents import ReadingOptions
from arrivals.recordings.formats.hdf5 import read_hdf5
from arrivals.recordings.stored_samples import StoredSamples


def matlab_file(path: Path, variables: dict[str, Any]) -> Path:
    """Write a MATLAB v7.3 file: a text header, and datasets with their axes in reverse order."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            array = np.atleast_2d(value)
            if array.dtype.kind == "c":
                pairs = np.empty(array.shape, [("real", "f8"), ("imag", "f8")])
                pairs["real"], pairs["imag"] = array.real, array.imag
                array = pairs
            dataset = file.create_dataset(name, data=array.T)
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")
    return path


def test_acoular_file_has_samples_and_rate(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("time_data", data=NUMBERS.astype("f4"))
        data.attrs["sample_freq"] = 1500.0
        file.create_dataset("other", data=NUMBERS)
    contents = read_hdf5(tmp_path / "a.h5", ReadingOptions())
    assert isinstance(contents.array, StoredSamples)
    assert (contents.rate, contents.array.dtype) == (1500.0, np.dtype("f4"))
    assert_array_equal(contents.array[:], NUMBERS.astype("f4"))
    assert_array_equal(contents.array[2:5], NUMBERS[2:5].astype("f4"))


@pytest.mark.parametrize("name", ["rate", "fs", "Fs", "sampling_rate", "sample_rate"])
@pytest.mark.parametrize("place", ["of the group", "beside", "at the top"])
def test_dataset_by_path_has_the_rate_beside_it(tmp_path: Path, name: str, place: str) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["group/x"], file["group/y"] = NUMBERS, NUMBERS[::-1]
        if place == "of the group":
            file["group"].attrs[name] = 500
        else:
            file[name if place == "at the top" else f"group/{name}"] = [500.0]
        file["group/time"] = np.arange(len(NUMBERS)) / 500
    contents = read_hdf5(tmp_path / "a.h5", ReadingOptions("/group/y"))
    assert contents.rate == 500
    assert_array_equal(contents.array[:], NUMBERS[::-1])
    assert_array_equal(contents.time, np.arange(len(NUMBERS)) / 500)


@pytest.mark.parametrize("values", [NUMBERS, NUMBERS + 2j * NUMBERS])
def test_matlab_file_is_not_transposed(tmp_path: Path, values: Any) -> None:
    path = matlab_file(tmp_path / "a.mat", {"x": values, "fs": 1500.0})
    contents = read_hdf5(path, ReadingOptions())
    assert contents.rate == 1500
    assert_array_equal(contents.array[:], values)
    assert_array_equal(contents.array[1:4], values[1:4])


def test_one_channel_and_chunks_are_read(tmp_path: Path) -> None:
    x = np.arange(10_000, dtype="i2")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", data=x, chunks=(100,), compression="gzip")
    contents = read_hdf5(tmp_path / "a.h5", ReadingOptions())
    assert contents.rate is None
    assert_array_equal(contents.array[950:1250][:, 0], x[950:1250])


def test_several_datasets_are_listed_with_shapes(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"], file["b/c"] = NUMBERS, np.zeros((4, 2, 3))
        file["text"] = "abc"
    n, m = NUMBERS.shape
    with pytest.raises(ValueError, match=rf"several datasets: .* 'a' {n} x {m}, 'b/c' 4 x 2 x 3$"):
        read_hdf5(tmp_path / "a.h5", ReadingOptions())
    with pytest.raises(ValueError, match=r"must be one of 'a' .*; got 'd'"):
        read_hdf5(tmp_path / "a.h5", ReadingOptions("d"))
    with pytest.raises(ValueError, match="one or two dimensions"):
        read_hdf5(tmp_path / "a.h5", ReadingOptions("b/c"))


def test_file_without_numbers_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["text"], file["fs"] = "abc", 5.0
        file["none"] = h5py.Empty("f")
    with pytest.raises(ValueError, match="no dataset of numbers"):
        read_hdf5(tmp_path / "a.h5", ReadingOptions())


def test_damaged_file_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", data=np.random.default_rng(0).random((5000, 4)), chunks=(500, 4),
                            compression="gzip")  # fmt: skip
    whole = (tmp_path / "a.h5").read_bytes()
    for content in (b"", b"abc" * 100, whole[: len(whole) // 2]):
        (tmp_path / "b.h5").write_bytes(content)
        with pytest.raises(ValueError, match="truncated, or not a readable HDF5 file"):
            read_hdf5(tmp_path / "b.h5", ReadingOptions())
    middle = len(whole) // 2
    (tmp_path / "c.h5").write_bytes(whole[:middle] + bytes(20_000) + whole[middle + 20_000 :])
    with pytest.raises(ValueError, match="truncated, or not a readable HDF5 file"):
        read_hdf5(tmp_path / "c.h5", ReadingOptions()).array[:]
    assert_refused(tmp_path / "c.h5", r"c\.h5: truncated, or not a readable HDF5 file: [^/]*$")


def test_groups_may_contain_themselves_and_outer_files(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["group/x"] = NUMBERS
        file["group/again"] = file["group"]
        file["group/soft"] = h5py.SoftLink("/group/x")
        file["outer"] = h5py.ExternalLink("none.h5", "/x")
    contents = read_hdf5(tmp_path / "a.h5", ReadingOptions())
    assert_array_equal(contents.array[:], NUMBERS)
