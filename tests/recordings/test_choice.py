"""Choice of frequencies, windows and tracker from array, rate and spectrum."""

import shlex
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from arrivals.cli.main import run as run_cli
from arrivals.measurement_models import SensorArray
from arrivals.recordings.choice import BandLimits, Choice, MeanSpectrum, TrackOptions, choose
from arrivals.recordings.choice.limits import power_of_two
from arrivals.scenarios.simulations.speech import SHIPPED, voice
from arrivals.typing import Float

CIRCLE = SensorArray.uca(8, radius=0.046, speed=343.0)
WIDE = SensorArray.uca(4, radius=60.0, speed=345.0)  # infrasound
HYDROPHONES = SensorArray.ula(8, spacing=1.875, speed=1489.0)
EMPTY = MeanSpectrum.empty()


def noise(n: int, n_channels: int = 4) -> Float:
    return np.random.default_rng(3).standard_normal((n, n_channels))


@given(st.floats(1e-3, 100.0), st.floats(100.0, 6000.0), st.floats(1.0, 2e5))
def test_limits_scale_with_the_array_and_end_below_half_the_rate(
    spacing: float, speed: float, rate: float
) -> None:
    alias = speed / (2 * spacing)
    array = SensorArray.ula(4, spacing, speed=speed)
    if 0.475 * rate <= max(0.04 * alias, min(300.0, alias / 4)):
        with pytest.raises(ValueError, match="no frequency is usable"):
            BandLimits.of(array, rate)
        return
    limits = BandLimits.of(array, rate)
    assert 0.04 * alias * (1 - 1e-9) <= limits.low <= max(300.0, 0.04 * alias * (1 + 1e-9))
    assert limits.low < limits.high < rate / 2
    assert limits.high <= 1.5 * alias * (1 + 1e-9)
    assert limits.window_duration * limits.low >= 3 * (1 - 1e-9)


@given(st.floats(2.0, 1e9))
def test_power_of_two_is_the_nearest(n: float) -> None:
    window = power_of_two(n)
    assert window & (window - 1) == 0
    assert n / 2**0.5 * (1 - 1e-9) <= window <= n * 2**0.5 * (1 + 1e-9)


def test_wideband_sound_gets_the_mixture_at_all_usable_bins() -> None:
    choice = choose(CIRCLE, 16000.0, MeanSpectrum.of(noise(16000), 16000.0))
    assert (choice.tracker, choice.window, choice.hop) == ("wideband_mixture", 512, 256)
    assert choice.n_snapshots == 4
    assert_allclose(choice.frequencies, np.arange(10, 234) * 31.25)
    assert choice.settings == {}


@pytest.mark.parametrize(("rate", "window"), [(8000, 256), (44100, 1024), (48000, 2048)])
def test_windows_of_speech_are_nearest_32_ms(rate: int, window: int) -> None:
    choice = choose(CIRCLE, rate, EMPTY)
    hop = window // 2
    assert (choice.window, choice.hop) == (window, hop)
    assert abs(choice.n_snapshots * hop / rate - 0.064) <= hop / rate / 2


def test_infrasound_gets_svalse_in_windows_of_three_periods() -> None:
    choice = choose(WIDE, 25.0, MeanSpectrum.of(noise(30_000), 25.0))
    low = min(choice.frequencies)
    assert choice.tracker == "svalse"
    assert choice.window is not None
    assert 2 <= choice.window * low / 25.0 <= 5
    assert choice.settings["solver__tempering"] == 4 * choice.n_snapshots


@pytest.mark.parametrize(
    ("array", "rate", "tones"),
    [
        (HYDROPHONES, 1500.0, [112.0, 148.0, 201.0, 235.0, 338.0]),
        (CIRCLE, 16000.0, [2000.0]),
        (CIRCLE, 48000.0, [1234.5, 2500.0]),
    ],
)
def test_lines_get_svalse_at_their_frequencies(
    array: SensorArray, rate: float, tones: list[float]
) -> None:
    t = np.arange(40_000)[:, None] / rate
    x = noise(40_000) + sum(np.cos(2 * np.pi * f * t + f) for f in tones)
    choice = choose(array, rate, MeanSpectrum.of(x, rate), n_samples=len(x))
    assert_allclose(choice.frequencies, tones, atol=rate / 40_000)
    assert (choice.tracker, choice.band) == ("svalse", None)
    assert choice.window is not None
    assert choice.window >= 8 * rate / min(tones)


def test_lines_that_come_and_go_like_vowels_are_none() -> None:
    rng, t = np.random.default_rng(0), np.arange(4000) / 16000.0
    x = np.concatenate([np.cos(2 * np.pi * np.outer(t, rng.uniform(100, 200) * np.arange(1, 30)))
                        .sum(axis=1) for _ in range(40)])  # fmt: skip
    spectrum = MeanSpectrum.of(x[:, None] + noise(len(x), 1), 16000.0)
    assert choose(CIRCLE, 16000.0, spectrum).tracker == "wideband_mixture"


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_speech_has_no_lines(name: str) -> None:
    choice = choose(CIRCLE, 8000.0, MeanSpectrum.of(voice(name)[:, None], 8000.0))
    assert choice.tracker == "wideband_mixture"


@pytest.mark.parametrize("level", [0.5, 1.0, 4.0])
def test_tones_under_sound_that_comes_and_goes_do_not_hide_it(level: float) -> None:
    t = np.arange(64_000)[:, None] / 16000.0
    bursts = noise(64_000) * (t % 1.0 < 0.3)
    tone = np.cos(2 * np.pi * 1234.5 * t)
    hum = sum(np.cos(2 * np.pi * 50 * k * t + k) / k for k in range(1, 30))
    for steady in (tone, hum):
        x = bursts + level * steady + 0.01 * noise(64_000)
        choice = choose(CIRCLE, 16000.0, MeanSpectrum.of(x, 16000.0))
        assert choice.tracker == "wideband_mixture"
    alone = MeanSpectrum.of(level * tone + 0.01 * noise(64_000), 16000.0)
    assert choose(CIRCLE, 16000.0, alone).tracker == "svalse"


def test_spectrum_of_few_missing_or_silent_samples_has_no_lines() -> None:
    for x in (np.ones((10, 2)), np.zeros((500, 2)), np.full((500, 2), np.nan)):
        assert len(MeanSpectrum.of(x, 1000.0).lines(1.0, 500.0)) == 0
    x = np.cos(2 * np.pi * 100 * np.arange(9000) / 1000.0)[:, None] + 0.1 * noise(9000)
    x[100, 0] = np.nan
    assert_allclose(MeanSpectrum.of(x, 1000.0).lines(1.0, 500.0), [100.0], atol=0.1)


def test_what_is_given_is_kept() -> None:
    settings = {"solver__tempering": 2.0}
    options = TrackOptions("svalse", [440, 880], None, 1024, 300, 5, settings)
    choice = choose(CIRCLE, 16000.0, EMPTY, options)
    assert choice == Choice("", "svalse", (440.0, 880.0), None, 1024, 300, 5, settings)
    options = TrackOptions(band=(500.0, 4000.0), window=256, snapshots=6)
    choice = choose(CIRCLE, 16000.0, EMPTY, options)
    assert (choice.tracker, choice.window, choice.hop) == ("wideband_mixture", 256, 128)
    assert (choice.n_snapshots, choice.band) == (6, (500.0, 4000.0))
    options = TrackOptions(settings={"solver__max_snr_db": 7.0})
    assert choose(WIDE, 25.0, EMPTY, options).settings["solver__max_snr_db"] == 7.0


def test_mixture_at_given_frequencies_gets_its_windows_and_steps() -> None:
    options = TrackOptions("wideband_mixture", np.arange(500.0, 2500.0, 125.0).tolist())
    choice = choose(CIRCLE, 16000.0, EMPTY, options)
    assert (choice.window, choice.hop, choice.n_snapshots) == (512, 256, 4)
    assert choice.frequencies == options.frequencies
    few = TrackOptions("wideband_mixture", 2000.0)
    with pytest.warns(UserWarning, match="less than 8 frequencies; got 1"):
        choose(CIRCLE, 16000.0, EMPTY, few)
    with pytest.warns(UserWarning, match="pass a wider band"):
        choose(CIRCLE, None, None, few)


ANTENNAS = SensorArray.uca(8, radius=0.35, speed=3e8)


def test_complex_samples_of_a_radio_are_reduced_in_steps_of_20_ms() -> None:
    options = TrackOptions(frequencies=433.92e6)
    choice = choose(ANTENNAS, 240e3, None, options, n_samples=960_000)
    assert (choice.tracker, choice.n_snapshots, choice.reduce) == ("svalse", 4800, True)
    assert (choice.settings["solver__tempering"], choice.n_rows(8)) == (1.0, 64)
    assert "--snapshots 4800 --reduce --set" in str(choice)
    assert choose(ANTENNAS, 240e3, None, options, n_samples=24_000).n_snapshots == 1200
    music = TrackOptions("music", frequencies=433.92e6)
    assert (choose(ANTENNAS, 240e3, None, music).n_snapshots, dict(music.settings)) == (4800, {})
    given = TrackOptions("music", frequencies=433.92e6, snapshots=100)
    assert choose(ANTENNAS, 240e3, None, given).n_rows(8) == 100
    given = TrackOptions(frequencies=433.92e6, snapshots=100, reduce=True)
    assert choose(ANTENNAS, 240e3, None, given).n_rows(8) == 64


@pytest.mark.parametrize(("rate", "n"), [(1000.0, 128), (4000.0, 200), (10_000.0, 200)])
def test_complex_snapshots_of_a_low_rate_have_steps_of_up_to_128_ms(rate: float, n: int) -> None:
    choice = choose(ANTENNAS, rate, None, TrackOptions(frequencies=433.92e6))
    assert (choice.n_snapshots, choice.reduce) == (n, False)
    for slow, tracker in ((None, None), (4.0, None), (rate, "svalse")):
        assert choose(ANTENNAS, slow, None, TrackOptions(tracker, 433.92e6)).n_snapshots == 1


@pytest.mark.parametrize(
    ("array", "rate", "spectrum", "options", "message"),
    [
        (SensorArray.ula(4, 1e-4, speed=343.0), 16000.0, EMPTY, {}, "at least 6.86e.04 Hz"),
        (CIRCLE, 500.0, EMPTY, {}, "no frequency is usable.*at least 300 Hz.*less than 237.5 Hz"),
        (SensorArray.uca(4, 0.1), 16000.0, EMPTY, {}, "'speed' is missing"),
        (SensorArray(np.zeros((1, 1)), speed=343.0), 16000.0, EMPTY, {}, "at least 2 sensors"),
        (CIRCLE, None, EMPTY, {}, "real samples require a rate"),
        (CIRCLE, 16000.0, None, {}, "complex snapshots require their frequency"),
        (CIRCLE, 16000.0, None, {"band": (1, 2)}, "a band requires real samples"),
        (CIRCLE, 16000.0, None, {"frequencies": 5, "window": 64}, "window and hop must be None"),
        (CIRCLE, 16000.0, EMPTY, {"band": (1, 9000)}, "half the rate, 8000 Hz; got 1 and 9000"),
        (CIRCLE, 16000.0, EMPTY, {"band": (1, 2, 3)}, "band must have two edges"),
        (CIRCLE, 16000.0, EMPTY, {"frequencies": []}, "at least one; got none"),
        (CIRCLE, 16000.0, EMPTY, {"frequencies": 5, "band": (1, 2)}, "only one of"),
        (CIRCLE, 16000.0, EMPTY, {"window": 1}, "window must be at least 2; got 1"),
        (CIRCLE, 16000.0, EMPTY, {"snapshots": 0}, "snapshots must be at least 1; got 0"),
    ],
)  # fmt: skip
def test_choice_of_unusable_arguments_is_refused(
    array: SensorArray, rate: float | None, spectrum: MeanSpectrum | None,
    options: dict[str, Any], message: str,
) -> None:  # fmt: skip
    with pytest.raises(ValueError, match=message) as error:
        choose(array, rate, spectrum, TrackOptions(**options))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("array", "rate"), [(CIRCLE, 16000.0), (CIRCLE, 44100.0), (WIDE, 25.0), (HYDROPHONES, 1500.0)]
)
@pytest.mark.parametrize("tone", [0.0, 30.0])
def test_choice_given_by_hand_is_the_same(
    array: SensorArray, rate: float, tone: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = BandLimits.of(array, rate)
    t = np.arange(20_000)[:, None] / rate
    x = noise(20_000) + tone * np.cos(2 * np.pi * 0.7 * limits.high * t)
    choice = choose(array, rate, MeanSpectrum.of(x, rate), n_samples=len(x))
    assert (choice.band is None) == (tone > 0)
    seen: list[Any] = []
    monkeypatch.setattr("arrivals.cli.main.track", lambda arguments, bar: seen.append(arguments))
    run_cli(["track", "x.wav", "--array", "a.toml", *shlex.split(str(choice).split(": ")[1])])
    args = seen[0]
    again = choose(array, rate, EMPTY, TrackOptions(
        args.tracker, args.frequencies, args.band, args.window, args.hop, args.snapshots,
        dict(args.set)))  # fmt: skip
    assert_allclose(again.frequencies, choice.frequencies, rtol=1e-9)
    for name in ("tracker", "window", "hop", "n_snapshots", "settings"):
        assert getattr(again, name) == getattr(choice, name)
