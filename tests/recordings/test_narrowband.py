"""Narrowband snapshots of known tones, and recordings."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from recording_files import NUMBERS, RATE, plane_wave

from arrivals.recordings import Recording
from arrivals.recordings import narrowband as narrowband_module
from arrivals.recordings.narrowband import default_window, narrowband


def test_narrowband_of_a_plane_wave_has_the_phases_of_its_delays() -> None:
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
def test_narrowband_equals_the_windowed_sum(
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
def test_narrowband_of_chunks_equals_that_of_the_whole(
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


def test_snapshots_from_a_later_start_keep_phases_and_times() -> None:
    recording = Recording(plane_wave(np.zeros(2), 777.0), RATE)
    whole = recording.snapshots(777.0, window=100)
    late = recording.snapshots(777.0, window=100, start=300)
    assert_allclose(late.values, whole.values[3:], atol=1e-12)
    assert_allclose(late.time, whole.time[3:])


@pytest.mark.parametrize("hop", [16, 64, 100, 1000])
@pytest.mark.parametrize("limit", ["MAX_BLOCK", "CACHED_BLOCK"])
def test_narrowband_does_not_depend_on_the_block_size(
    limit: str, hop: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    samples = np.random.default_rng(1).standard_normal((20_000, 3))
    at_once = narrowband(samples, RATE, 440.0, 100, hop)
    monkeypatch.setattr(narrowband_module, limit, 1500)
    assert_allclose(narrowband(samples, RATE, 440.0, 100, hop), at_once, atol=1e-12)


def test_few_bins_equal_the_first_of_many() -> None:
    samples = np.random.default_rng(3).standard_normal((2000, 2))
    samples[700, 1] = np.nan
    bins = [k * RATE / 128 for k in range(1, 13)]
    few, many = (
        narrowband_module.WindowedSpectrum(RATE, each, 128).amplitudes(samples, 64)
        for each in (bins[:3], bins)
    )
    assert_allclose(few, many[:, :3], atol=1e-12)


def test_long_recordings_are_read_in_several_blocks() -> None:
    delays = np.linspace(0, 1e-3, 8)
    samples = plane_wave(delays, 1000.0, n_samples=600_000).astype(np.float32)
    assert samples.size > 2 * narrowband_module.MAX_BLOCK
    y = Recording(samples, RATE).snapshots(1000.0).values
    expected = np.exp(1j * (0.3 - 2 * np.pi * 1000.0 * delays))
    assert_allclose(y, np.tile(expected, (600_000 // 256, 1)), atol=1e-4)


@pytest.mark.parametrize("bad_value", [np.nan, np.inf, -np.inf])
def test_missing_sample_affects_its_channel_and_window_only(bad_value: float) -> None:
    samples = plane_wave(np.zeros(4), 1000.0, n_samples=1024)
    samples[300, 2] = bad_value
    whole = narrowband(plane_wave(np.zeros(4), 1000.0, n_samples=1024), RATE, 1000.0, 256, 256)
    for y in (
        narrowband(samples, RATE, 1000.0, 256, 256),
        Recording(samples, RATE).snapshots(1000.0).values,
    ):
        assert_array_equal(np.argwhere(np.isnan(y)), [[1, 2]])
        assert_allclose(y[~np.isnan(y)], whole[~np.isnan(y)], atol=1e-12)


@given(st.floats(1.0, 1e6), st.floats(1e-3, 0.49))
def test_default_window_has_eight_periods(rate: float, share: float) -> None:
    window = default_window(rate, share * rate)
    assert window >= 256
    assert window * share >= 8 * (1 - 1e-9)
    assert window == 256 or window / 2 * share < 8


def test_complex_snapshots_are_returned_unchanged() -> None:
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


def test_recording_keeps_single_precision_and_marks_missing_samples() -> None:
    assert Recording(NUMBERS.astype(np.float32)).samples.dtype == np.float32
    assert Recording([[1, 2]]).samples.dtype == np.float64  # type: ignore[arg-type]
    assert Recording(NUMBERS.astype(np.complex64)).samples.dtype == np.complex128
    given_samples = np.array([1.0, np.inf])
    assert_array_equal(Recording(given_samples).samples, [[1.0], [np.nan]])
    assert given_samples[1] == np.inf
    assert np.isnan(Recording(np.array([1.0, complex(0, np.inf)])).samples[1:, 0]).all()


def no_snapshots(message: str, rate: float | None = RATE, **arguments: Any) -> None:
    with pytest.raises(ValueError, match=message):
        Recording(NUMBERS, rate).snapshots(**({"frequency": 100.0} | arguments))


def test_snapshots_with_invalid_arguments_are_refused() -> None:
    no_snapshots(r"below half the rate, 4000 Hz; got 4000 Hz", frequency=4000.0)
    no_snapshots("frequency must be finite and positive; got 0", frequency=0)
    no_snapshots("frequency must be a number", frequency=None)
    no_snapshots("pass rate= in Hz", rate=None)
    no_snapshots("has 50 samples; one window requires 1024: pass a shorter window=")
    no_snapshots("has 10 samples after sample 40; one window requires 20", window=20, start=40)
    no_snapshots("has 0 samples after sample 70", window=20, start=70)
    no_snapshots("window must be at least 2; got 1", window=1)
    no_snapshots("hop must be at least 1; got 0", window=20, hop=0)
    no_snapshots("start must be at least 0; got -1", start=-1)
    with pytest.raises(ValueError, match="if its rows are channels, transpose it"):
        Recording(NUMBERS.T, RATE).snapshots(100.0)
    with pytest.raises(ValueError, match="window and hop must be None"):
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
def test_recording_with_invalid_arguments_is_refused(
    arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Recording(**arguments)


def test_recording_of_text_is_refused() -> None:
    with pytest.raises(
        TypeError, match="samples must hold numbers, NaN for a missing one; got <U1"
    ):
        Recording(np.array(["a", "b"]))


def test_default_window_that_no_recording_fills_is_refused() -> None:
    for rate, frequency in ((1e30, 1000.0), (8000.0, 1e-30)):
        with pytest.raises(
            ValueError, match=r"rate must be at most 1\.34e\+08 times the frequency"
        ):
            default_window(rate, frequency)
