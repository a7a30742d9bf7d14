"""Frames of several frequencies and windows a step, from recordings and streams."""

import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from recording_files import RATE

from arrivals.recordings import Recording, frame_recording, frame_stream
from arrivals.recordings import narrowband as narrowband_module
from arrivals.recordings.framing import frequencies_in
from arrivals.recordings.narrowband import WindowedSpectrum, default_window
from arrivals.typing import Complex, Float

NOISE = np.random.default_rng(5).standard_normal((3000, 3))


def windowed_sums(x: Float, frequencies: Any, window: int, hop: int, first: int) -> Complex:
    """Return 2 / Σ w · Σ w(k) x(s + k) exp(-j 2π f (first + s + k) / rate), term by term."""
    w = np.sin(np.pi * np.arange(window) / window) ** 2
    starts = range(0, len(x) - window + 1, hop)
    k = np.arange(window)
    tones = [np.exp(-2j * np.pi * np.multiply.outer(frequencies, first + s + k) / RATE)
             for s in starts]  # fmt: skip
    pieces = [2 / w.sum() * (w * tone) @ x[s : s + window]
              for s, tone in zip(starts, tones, strict=True)]  # fmt: skip
    return np.array(pieces).reshape(-1, len(frequencies), x.shape[1])


@settings(deadline=None)
@given(st.integers(4, 70), st.integers(1, 90), st.integers(0, 1000), st.data())
def test_bins_of_the_window_and_frequencies_between_equal_the_sums(
    window: int, hop: int, first: int, data: Any
) -> None:
    bins = [k * RATE / window for k in range(1, (window + 1) // 2)]
    between = st.lists(st.floats(1.0, 3999.0), max_size=4)
    frequencies = data.draw(st.permutations([*bins, *data.draw(between)]))
    x = NOISE[: data.draw(st.integers(0, 300))]
    y = WindowedSpectrum(RATE, frequencies, window).amplitudes(x, hop, first)
    assert_allclose(y, windowed_sums(x, frequencies, window, hop, first), atol=1e-12)


@pytest.mark.parametrize("shift", [0.0, 1.7])
def test_missing_sample_affects_the_bins_of_its_channel_and_windows_only(shift: float) -> None:
    frequencies = np.arange(1, 20) * RATE / 256 + shift
    damaged = NOISE.copy()
    damaged[300, 1], damaged[1000, 2] = np.nan, np.inf
    spectrum = WindowedSpectrum(RATE, frequencies.tolist(), 256)
    y, whole = spectrum.amplitudes(damaged, 256), spectrum.amplitudes(NOISE, 256)
    missing = np.isnan(y)
    assert_array_equal(np.argwhere(missing.all(axis=1)), [[1, 1], [3, 2]])
    assert missing.sum() == 2 * 19
    assert_allclose(y[~missing], whole[~missing], atol=1e-14)


@pytest.mark.parametrize("hop", [64, 100, 1000])
def test_amplitudes_do_not_depend_on_the_block_size(
    hop: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    frequencies = [440.0, 500.0, 7 * RATE / 100, 901.0, 1000.5]
    at_once = WindowedSpectrum(RATE, frequencies, 100).amplitudes(NOISE, hop)
    monkeypatch.setattr(narrowband_module, "MAX_BLOCK", 400)  # two tones, one window
    pieces = WindowedSpectrum(RATE, frequencies, 100).amplitudes(NOISE, hop)
    assert_allclose(pieces, at_once, atol=1e-13)


@pytest.mark.parametrize("spacing", [RATE / 128, 71.3])
def test_frames_of_a_stream_equal_those_of_the_recording(spacing: float) -> None:
    frequencies = (spacing * np.arange(2, 30)).tolist()
    settings = {"window": 128, "hop": 50, "n_snapshots": 4}
    frames = frame_recording(Recording(NOISE, RATE), frequencies, **settings)
    source = io.BytesIO(NOISE.astype("<f8").tobytes())
    live = list(frame_stream(source, 3, frequencies, rate=RATE, dtype="float64", **settings))
    assert frames.values.shape == (14, 28, 4, 3)
    assert_allclose([z for _, z in live], frames.values, atol=1e-14)
    assert_allclose([time for time, _ in live], frames.time)


def test_snapshots_of_several_frequencies_are_those_of_each() -> None:
    recording = Recording(NOISE, RATE)
    several = recording.snapshots([500.0, 613.0], window=256, hop=99, start=7)
    assert several.frequency == (500.0, 613.0)
    for i, each in enumerate(several.frequency):
        one = recording.snapshots(each, window=256, hop=99, start=7)
        assert_allclose(several.values[:, i], one.values, atol=1e-14)
        assert_array_equal(several.time, one.time)
    assert recording.snapshots([600.0]).values.shape == (11, 1, 3)
    with pytest.raises(ValueError, match="frequencies must be one for a recording of complex"):
        Recording(NOISE + 0j).snapshots([500.0, 613.0])


@given(st.floats(1.0, 3000.0), st.floats(1.0, 900.0), st.none() | st.integers(2, 2000))
def test_frequencies_in_a_band_are_all_bins_of_the_window(
    low: float, width: float, window: int | None
) -> None:
    n = default_window(RATE, low) if window is None else window
    frequencies = np.array(frequencies_in((low, low + width), RATE, window))
    bins = np.arange(n // 2 + 1) * RATE / n
    inside = bins[(bins >= low) & (bins <= low + width)]
    expected = inside if len(inside) else [low + width / 2]
    assert_allclose(frequencies, expected)
