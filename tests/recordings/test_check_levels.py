"""ChannelLevels of channels: offset, silence, clipping, twins, hum."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from arrivals.recordings.check import check
from arrivals.recordings.check.levels import MAX_NUMBERS, ChannelLevels, clipped_share, level_blocks
from arrivals.typing import Float

NOISE = np.random.default_rng(0).standard_normal((20000, 4))


def kinds(samples: Float, rate: float = 8000.0) -> list[tuple[str, tuple[int, ...]]]:
    return [(fault.kind, fault.channels) for fault in check(samples, rate=rate).faults]


@given(st.lists(st.floats(1e-3, 1e3), min_size=4, max_size=4), st.floats(-5, 5))
def test_levels_scale_with_each_gain_and_shift_with_an_offset(gain: list[float], c: float) -> None:
    gains, before = np.array(gain), ChannelLevels.of(NOISE[None])
    after = ChannelLevels.of((gains * NOISE + c)[None])
    assert_allclose(after.rms, gains * before.rms, rtol=1e-6)
    assert_allclose(after.offset, gains * before.offset + c, atol=1e-9)


@given(st.permutations(range(4)))
def test_levels_follow_the_order_of_channels(order: list[int]) -> None:
    samples = NOISE * [1, 2, 3, 4]
    assert_allclose(
        ChannelLevels.of(samples[None, :, order]).rms, ChannelLevels.of(samples[None]).rms[order]
    )


def test_silent_and_identical_channels_are_faults() -> None:
    samples = NOISE.copy()
    samples[:, 1], samples[:, 3] = 0.25, samples[:, 2]
    assert kinds(samples) == [("silent", (2,)), ("identical", (3, 4))]


def test_weak_and_missing_channels_are_noted() -> None:
    samples = NOISE * [1.0, 0.1, 1.0, 1.0]
    samples[:5000, 3] = np.nan
    report = check(samples, rate=8000.0)
    assert report.faults == ()
    assert report.notes[:2] == (
        "channel 2 is 20 dB weaker than the median of the channels",
        "25 % of channel 4 are missing",
    )


@pytest.mark.parametrize("level", [0.999, 0.3])
@pytest.mark.parametrize("scale", [1.0, 32767.0])
def test_clipped_channels_are_a_fault_with_the_level(level: float, scale: float) -> None:
    samples = NOISE / 6
    samples[:, 0] = np.clip(samples[:, 0] * 6 * level, -level, level)
    samples = np.round(samples * 32767) / 32767 * scale
    (fault,) = check(samples, rate=8000.0).faults
    assert (fault.kind, fault.channels) == ("clipped", (1,))
    assert f"clipped at {level * scale:.3g}" in fault.text


def test_signals_with_flat_crests_are_not_clipped() -> None:
    t = np.arange(40000) / 8000
    tone = np.round(1000 * np.sin(2 * np.pi * 3.7 * t))  # runs of equal samples at the crest
    few_levels = np.round(2 * NOISE[:, 0])
    silence = np.zeros(40000)
    assert_allclose(clipped_share(np.stack([tone, silence], axis=1)[None]), 0.0)
    assert_allclose(clipped_share(few_levels[None, :, None]), 0.0)


def test_hum_of_one_channel_is_a_fault_and_of_all_a_note() -> None:
    t = np.arange(40000)[:, None] / 8000
    hum = sum(np.cos(2 * np.pi * 50.02 * k * t) / k for k in (1, 2, 3, 4))
    noise = 0.3 * np.tile(NOISE, (2, 1))
    assert kinds(noise + hum * [0, 1.0, 0, 0]) == [("hum", (2,))]
    report = check(noise + hum, rate=8000.0)
    assert report.faults == ()
    assert "mains hum has" in report.notes[0]
    tones = sum(np.cos(2 * np.pi * f * t) for f in (49.0, 79.0, 112.0, 148.0))
    assert check(noise + tones, rate=8000.0).channels[0].hum == 0


def test_long_recordings_are_read_in_part() -> None:
    read: list[int] = []

    def rows(start: int, stop: int) -> Float:
        read.append(stop - start)
        return np.zeros((stop - start, 8))

    blocks = level_blocks(rows, 10**9)
    assert blocks.size <= MAX_NUMBERS
    assert sum(read) * 8 <= MAX_NUMBERS + 8


def test_report_is_a_table_a_dictionary_and_json() -> None:
    samples = NOISE * [1.0, 0.0, 1.0, 1.0]
    report = check(samples, rate=8000.0)
    lines = str(report).splitlines()
    assert lines[0] == "4 channels, 2.5 s, 8000 Hz"
    assert lines[3].split() == ["2", "-", "0", "0.00", "0", "-", "silent"]
    assert lines[-1].startswith("FAULT: channel 2 is silent: ")
    loaded = json.loads(report.to_json())
    assert loaded == report.to_dict()
    assert loaded["channels"][1]["rms_db"] is None
    assert loaded["faults"][0]["channels"] == [2]


def test_rare_flat_tops_are_a_note() -> None:
    samples = np.random.default_rng(0).standard_normal((40000, 2))
    for start in (1000, 2000, 3000):
        samples[start : start + 6, 0] = 5.0
    report = check(samples, rate=8000.0)
    assert report.faults == ()
    assert "channel 1 is clipped in few samples" in report.notes


def test_weak_channel_of_36_db_is_silent_and_of_34_db_noted() -> None:
    noise = np.random.default_rng(0).standard_normal((8000, 6))
    report = check(noise * 10 ** (-np.array([0, 0, 0, 0, 34, 36]) / 20), rate=8000.0)
    assert [(each.kind, each.channels) for each in report.faults] == [("silent", (6,))]
    assert any("channel 5 is 34 dB weaker" in note for note in report.notes)
