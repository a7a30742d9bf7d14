"""SIO files of the Scripps Institution of Oceanography."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from recording_files import sio_bytes

from arrivals.recordings.formats.file_contents import ReadingOptions
from arrivals.recordings.formats.sio import read_sio


@given(
    st.sampled_from(["i2", "i4", "f4"]), st.sampled_from("><"), st.integers(1, 200),
    st.integers(1, 4), st.sampled_from([128, 256]), st.booleans(), st.data(),
)  # fmt: skip
def test_sio_rows_are_those_written(
    tmp_path_factory: pytest.TempPathFactory, kind: str, order: str, n: int, channels: int,
    record: int, pad: bool, data: st.DataObject,
) -> None:  # fmt: skip
    samples = np.random.default_rng(n).integers(-3000, 3000, (n, channels)).astype(kind)
    path = tmp_path_factory.mktemp("sio") / "a.sio"
    path.write_bytes(sio_bytes(samples, order, record, pad))
    array = read_sio(path, ReadingOptions()).array
    start, stop = sorted(data.draw(st.tuples(st.integers(0, n), st.integers(0, n))))
    assert array.shape == (n, channels)
    assert_array_equal(array[:], samples)
    assert_array_equal(array[start:stop], samples[start:stop])


SAMPLES = np.arange(300, dtype="i2").reshape(150, 2)
WHOLE = sio_bytes(SAMPLES)


def with_word(place: int, value: int) -> bytes:
    return WHOLE[: 4 * place] + struct.pack(">I", value) + WHOLE[4 * place + 4 :]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "truncated: expected 128 bytes of a header; got 0: copy it again"),
        (WHOLE[:100], "truncated: expected 128 bytes"),
        (b"RIFF" * 100, "not an SIO file"),
        (WHOLE[:-128], "truncated: expected"),
        (with_word(4, 3), "integers of 2 or 4 bytes"),
        (with_word(5, 1), "integers of 2 or 4 bytes"),
        (with_word(3, 0), "damaged header: 0 channels"),
        (with_word(6, 0), "damaged header: 2 channels of 0"),
        (with_word(6, 2**32 - 1), "truncated: expected"),
        (with_word(2, 1), "damaged header: a record of 1"),
    ],
)
def test_damaged_sio_file_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "a.sio").write_bytes(content)
    with pytest.raises(ValueError, match=message):
        read_sio(tmp_path / "a.sio", ReadingOptions())
