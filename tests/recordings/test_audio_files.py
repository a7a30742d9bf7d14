"""Audio files: round trips, blocks, suffixes that do not fit the content."""

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from numpy.testing import assert_allclose, assert_array_equal
from recording_files import NUMBERS, RATE, assert_refused

import arrivals.recordings.readers
from arrivals.recordings import StoredSamples, read

LOSSLESS = [
    ("WAV", "PCM_U8"), ("WAV", "PCM_16"), ("WAV", "PCM_24"), ("WAV", "PCM_32"), ("WAV", "FLOAT"),
    ("WAV", "DOUBLE"), ("WAVEX", "PCM_16"), ("WAVEX", "PCM_24"), ("WAVEX", "FLOAT"),
    ("RF64", "PCM_16"), ("RF64", "PCM_24"), ("W64", "PCM_16"), ("W64", "PCM_24"), ("W64", "FLOAT"),
    ("FLAC", "PCM_16"), ("FLAC", "PCM_24"), ("AIFF", "PCM_16"), ("AIFF", "PCM_24"),
    ("AIFF", "FLOAT"), ("CAF", "PCM_16"), ("CAF", "PCM_32"), ("CAF", "DOUBLE"),
]  # fmt: skip
PRECISION = {"U8": 2.0**-7, "16": 2.0**-15, "24": 2.0**-23, "32": 2.0**-31, "FLOAT": 2.0**-24}
SUFFIX = {"WAVEX": ".wav", "RF64": ".rf64", "OGG": ".ogg"}


def audio_file(path: Path, form: str, subtype: str, numbers: Any = NUMBERS) -> Path:
    path = path / f"a{SUFFIX.get(form, f'.{form.lower()}')}"
    soundfile.write(path, numbers, int(RATE), format=form, subtype=subtype)
    return path


@pytest.mark.parametrize(("form", "subtype"), LOSSLESS)
def test_round_trip_in_one_piece_and_in_blocks(
    form: str, subtype: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = audio_file(tmp_path, form, subtype)
    recording = read(path)
    expected = soundfile.read(path)[0]
    assert recording.rate == RATE
    assert_array_equal(recording.samples, expected)  # float32 is exact where it is used
    precision = PRECISION.get(subtype.removeprefix("PCM_"), 0.0)
    assert_allclose(expected, NUMBERS, rtol=0, atol=1.01 * precision)
    monkeypatch.setattr(arrivals.recordings.readers, "LOADED_AT_ONCE", 0)
    stored = read(path).samples
    assert isinstance(stored, StoredSamples)
    assert stored.dtype == recording.samples.dtype
    blocks = [stored[i : i + 7] for i in range(0, len(stored), 7)]
    assert_array_equal(np.concatenate(blocks), expected)
    assert_array_equal(stored.select([2, 0])[11:29], expected[11:29, [2, 0]])


@pytest.mark.parametrize(
    ("form", "subtype"), [("OGG", "VORBIS"), ("OGG", "OPUS"), ("WAV", "ULAW"), ("WAV", "IMA_ADPCM")]
)
def test_lossy_file_is_close(form: str, subtype: str, tmp_path: Path) -> None:
    t = np.arange(4800)[:, None] / RATE
    tone = 0.5 * np.sin(2 * np.pi * 440 * t) * np.ones(2)
    path = audio_file(tmp_path, form, subtype, tone)
    samples = np.asarray(read(path).samples)[: len(tone)]
    assert_allclose(samples, soundfile.read(path)[0][: len(tone)], rtol=0, atol=1e-6)
    assert np.mean((samples[200:-200] - tone[200:-200]) ** 2) < 1e-3


@pytest.mark.parametrize(
    ("form", "suffix"), [("FLAC", ".wav"), ("WAV", ".flac"), ("OGG", ".csv"), ("AIFF", ".xyz")]
)
def test_mislabelled_file_is_read_by_its_content_with_a_warning(
    form: str, suffix: str, tmp_path: Path
) -> None:
    path = audio_file(tmp_path, form, "VORBIS" if form == "OGG" else "PCM_16")
    expected, wrong = read(path).samples, path.rename(tmp_path / f"b{suffix}")
    message = f"^{wrong}: the suffix is {suffix}, the content is {form}: read as {form}$"
    with pytest.warns(UserWarning, match=message):
        assert_array_equal(read(wrong).samples, expected)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_array_equal(read(wrong, format=form.lower()).samples, expected)


def test_unknown_format_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"abcd")
    assert_refused(tmp_path / "a", "suffix must be one of .*; got ''")
    assert_refused(tmp_path / "a", "format must be one of .*flac.*; got 'mp7'", format="mp7")


@pytest.mark.parametrize("form", ["FLAC", "OGG", "AIFF", "CAF", "W64", "RF64", "WAVEX"])
def test_truncated_and_empty_files_are_refused(form: str, tmp_path: Path) -> None:
    numbers = np.random.default_rng(0).uniform(-1, 1, (9000, 2))
    path = audio_file(tmp_path, form, "VORBIS" if form == "OGG" else "PCM_16", numbers)
    whole = path.read_bytes()
    for n in (60, len(whole) // 2):
        path.write_bytes(whole[:n])
        try:
            assert form == "OGG" or not len(read(path).samples), form
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")  # noqa: PT017  (a cut OGG file is a file)
            assert "\n" not in str(error)  # noqa: PT017
    path.write_bytes(b"")
    assert_refused(path, "the file is empty")
    path.write_bytes(whole[:16] + np.random.default_rng(0).bytes(len(whole)))  # as if encrypted
    assert_refused(path, "truncated|damaged")


def test_flac_from_a_pipe_without_its_length_is_read(tmp_path: Path) -> None:
    file = io.BytesIO()
    numbers = np.tile(NUMBERS, (1000, 1))
    soundfile.write(file, numbers, int(RATE), format="FLAC", subtype="PCM_16")
    whole = bytearray(file.getvalue())
    expected = soundfile.read(io.BytesIO(whole))[0]
    whole[21] &= 0xF0
    whole[22:26] = bytes(4)  # number of samples in STREAMINFO
    (tmp_path / "a.flac").write_bytes(whole)
    assert_array_equal(read(tmp_path / "a.flac").samples, expected)
    assert_refused(tmp_path / "a.flac", "at most 0.0001 GB; got 0.0006 GB", max_bytes=1e5)
