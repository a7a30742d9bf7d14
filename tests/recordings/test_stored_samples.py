"""Samples that stay in their file: laws, files that change, readers without their package."""

import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from recording_files import NUMBERS, RATE, assert_refused
from scipy.io import wavfile

import arrivals.recordings.readers
from arrivals.measurement_models import SensorArray
from arrivals.recordings import Recording, StoredSamples, read
from arrivals.recordings.choice import Choice, MeanSpectrum
from arrivals.recordings.tracking import RecordedSteps, track

BOUNDS = st.none() | st.integers(-60, 60)


def stored(numbers: Any) -> StoredSamples:
    return StoredSamples(numbers.shape, np.dtype(float), lambda start, stop: numbers[start:stop])


@pytest.fixture
def nothing_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep small files on disk, too."""
    monkeypatch.setattr(arrivals.recordings.readers, "LOADED_AT_ONCE", 0)


@given(BOUNDS, BOUNDS, st.none() | st.integers(1, 7))
def test_rows_equal_those_of_numpy(start: int | None, stop: int | None, step: int | None) -> None:
    rows = slice(start, stop, step)
    assert_array_equal(stored(NUMBERS)[rows], NUMBERS[rows])
    assert_array_equal(stored(NUMBERS)[rows, 1:], NUMBERS[rows, 1:])


@given(st.lists(st.integers(0, 2), min_size=1, max_size=4), st.permutations([0, 1, 2]))
def test_selected_channels_equal_those_of_numpy(some: list[int], order: list[int]) -> None:
    selected = stored(NUMBERS).select(order).select(some)
    assert selected.shape == (50, len(some))
    assert_array_equal(np.asarray(selected), NUMBERS[:, order][:, some])
    assert_array_equal(np.array(list(selected)), NUMBERS[:, order][:, some])


def test_missing_samples_are_nan_and_other_indices_are_refused() -> None:
    numbers = np.array([[1.0, np.inf], [1e300, 2.0]])
    assert_array_equal(stored(numbers)[:], [[1, np.nan], [np.nan, 2]])
    with pytest.raises(TypeError, match="rows of stored samples must be a slice; got int"):
        stored(numbers)[0]
    with pytest.raises(ValueError, match="step of rows must be positive; got -1"):
        stored(numbers)[::-1]
    with pytest.raises(ValueError, match="the recording is empty"):
        Recording(stored(np.zeros((0, 2))))


def test_steps_and_spectrum_equal_those_of_samples_in_memory() -> None:
    samples = np.random.default_rng(0).standard_normal((60_000, 3))
    choice = Choice("noise", "svalse", (100.0, 212.3), window=100, hop=70, n_snapshots=4)
    two = Recording(samples, RATE), Recording(stored(samples), RATE)
    expected, got = (np.array(list(RecordedSteps(each, choice))) for each in two)
    assert_array_equal(got, expected)
    expected, got = (MeanSpectrum.of(each.samples, RATE).power for each in two)
    assert_array_equal(got, expected)


def test_steps_load_blocks_of_bounded_size(monkeypatch: pytest.MonkeyPatch) -> None:
    samples, longest = np.ones((100_000, 3)), 0

    def load(start: int, stop: int) -> Any:
        nonlocal longest
        longest = max(longest, stop - start)
        return samples[start:stop]

    monkeypatch.setattr("arrivals.recordings.tracking.BLOCK", 3 * 2000)
    recording = Recording(StoredSamples(samples.shape, np.dtype(float), load), RATE)
    choice = Choice("noise", "svalse", (800.0,), window=100, n_snapshots=2)
    assert len(list(RecordedSteps(recording, choice))) == 500
    assert 100 < longest <= 2000


@pytest.mark.usefixtures("nothing_at_once")
@pytest.mark.parametrize("form", ["wav", "flac", "npy"])
def test_tracks_of_a_file_in_blocks_equal_those_in_memory(form: str, tmp_path: Path) -> None:
    t = np.arange(8000)[:, None] / RATE
    samples = 0.4 * np.cos(2 * np.pi * 1000 * (t + 1e-4 * np.arange(4)))
    path, array = tmp_path / f"a.{form}", SensorArray.ula(4, 0.1, speed=343.0)
    np.save(path, samples) if form == "npy" else soundfile.write(path, samples, int(RATE))
    rate: dict[str, Any] = {"rate": RATE} if form == "npy" else {}
    recording = read(path, array=array, **rate)
    assert isinstance(recording.samples, StoredSamples)
    expected = track(np.asarray(recording.samples), array, rate=RATE, frequencies=1000.0)
    run = track(recording, frequencies=1000.0)
    assert_array_equal(run.doa, expected.doa)
    assert np.nanmedian(run.doa) > 0.3


def test_band_of_stored_samples_is_tracked_as_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("arrivals.recordings.stored_samples.BLOCK", 100)
    array = SensorArray.ula(3, 0.1, speed=343.0)
    arguments: Any = {"tracker": "interpolation_ekf", "band": (600, 1400), "hop": 50}
    noise = np.random.default_rng(0).standard_normal((400, 3))
    one, other = (
        track(Recording(each, RATE, array=array), **arguments) for each in (noise, stored(noise))
    )
    assert_array_equal(one.doa, other.doa)
    assert len(one) == 8


@pytest.mark.usefixtures("nothing_at_once")
@pytest.mark.parametrize("form", ["wav", "flac", "npy"])
def test_file_that_changes_between_blocks_is_one_line(form: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{form}"
    np.save(path, NUMBERS) if form == "npy" else soundfile.write(path, NUMBERS, int(RATE))
    samples: Any = pickle.loads(pickle.dumps(read(path).samples))
    assert len(samples[:10]) == 10
    content = path.read_bytes()
    path.write_bytes(content[:-400])
    with pytest.raises(ValueError, match=f"^{path}: the file changed while it was read$"):
        samples[10:]
    path.unlink()
    with pytest.raises(ValueError, match=f"^{path}: the file changed while it was read$"):
        samples[10:20]


@pytest.mark.usefixtures("nothing_at_once")
def test_columns_of_a_file_equal_the_whole(tmp_path: Path) -> None:
    """An array that is stored column by column, and one that is transposed."""
    np.save(tmp_path / "a.npy", np.asfortranarray(NUMBERS))
    samples: Any = read(tmp_path / "a.npy").samples
    assert isinstance(samples, StoredSamples)
    assert_array_equal(samples[7:31], NUMBERS[7:31])
    np.save(tmp_path / "b.npy", NUMBERS.T)
    assert_array_equal(read(tmp_path / "b.npy", transpose=True).samples, NUMBERS)


def test_formats_without_their_package_name_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "soundfile", None)
    wavfile.write(tmp_path / "a.wav", int(RATE), NUMBERS)
    np.save(tmp_path / "a.npy", NUMBERS)
    np.savetxt(tmp_path / "a.csv", NUMBERS)
    for name in ("a.wav", "a.npy", "a.csv"):
        assert_array_equal(read(tmp_path / name).samples, NUMBERS)
    (tmp_path / "a.flac").write_bytes(b"fLaC" + bytes(100))
    message = r'a .flac file requires soundfile: pip install "arrivals\[io\]"'
    assert_refused(tmp_path / "a.flac", message)
