"""Wiring faults are found and named; recordings without faults have none."""

from pathlib import Path
from textwrap import indent

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from wired_rooms import CIRCLE, LINE, RATE, SQUARE, delayed, inverted, swapped, talk_in_room

import arrivals
from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere, unit_vectors
from arrivals.recordings import Recording
from arrivals.recordings.check import CheckReport, check
from arrivals.typing import Float

TALK = talk_in_room(CIRCLE)
ON_LINE, ON_SQUARE = talk_in_room(LINE, 1), talk_in_room(SQUARE, 2)
ARRAYS = {"circle": (CIRCLE, TALK), "line": (LINE, ON_LINE), "square": (SQUARE, ON_SQUARE)}


def checked(samples: Float, array: SensorArray = CIRCLE) -> CheckReport:
    return check(samples, array, rate=RATE)


def faults(report: CheckReport) -> list[tuple[str, tuple[int, ...]]]:
    return [(fault.kind, fault.channels) for fault in report.faults]


@pytest.mark.parametrize("name", ARRAYS)
def test_check_of_a_right_array_has_no_fault_and_agreement_everywhere(name: str) -> None:
    array, samples = ARRAYS[name]
    report = checked(samples, array)
    assert report.faults == ()
    assert min(each.agreement for each in report.channels) > 0.6
    assert {each.state for each in report.channels} == {"ok"}


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("channel", [0, 2])
def test_inverted_channel_is_named(name: str, channel: int) -> None:
    array, samples = ARRAYS[name]
    report = checked(inverted(samples, channel), array)
    assert faults(report) == [("inverted", (channel + 1,))]
    assert report.channels[channel].agreement < -0.5
    assert f"channel {channel + 1} is inverted" in report.faults[0].text


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize(("channel", "delay"), [(1, 5), (3, 20), (2, -9)])
def test_late_channel_is_named_with_its_delay(name: str, channel: int, delay: int) -> None:
    array, samples = ARRAYS[name]
    report = checked(delayed(samples, channel, delay), array)
    assert faults(report) == [("late", (channel + 1,))]
    words = "late" if delay > 0 else "early"
    assert f"channel {channel + 1} is {abs(delay)} samples {words}" in report.faults[0].text


@pytest.mark.parametrize(("one", "other"), [(0, 1), (1, 4), (3, 5)])
def test_swapped_channels_are_named(one: int, other: int) -> None:
    assert faults(checked(swapped(ON_LINE, one, other), LINE)) == [
        ("swapped", (one + 1, other + 1))
    ]
    fault = checked(swapped(TALK, one, other)).faults[0]
    assert f"channels {one + 1} and {other + 1} are swapped" in fault.text


def test_three_channels_in_another_order_are_one_fault_with_the_right_order() -> None:
    wired = [0, 4, 2, 1, 3, 5, 6]  # the sensors' channels are 2 -> 4, 4 -> 5, 5 -> 2
    recorded = np.empty_like(ON_LINE)
    recorded[:, wired] = ON_LINE
    report = checked(recorded, LINE)
    assert faults(report) == [("swapped", (2, 4, 5))]
    assert "to 5, 2, 4 at these places" in report.faults[0].text


def test_noise_in_place_of_a_channel_does_not_agree() -> None:
    samples = TALK.copy()
    samples[:, 3] = np.std(TALK) * np.random.default_rng(0).standard_normal(len(TALK))
    report = checked(samples)
    assert faults(report) == [("no agreement", (4,))]
    assert abs(report.channels[3].agreement) < 0.2


def test_two_faults_are_both_named() -> None:
    both = inverted(delayed(TALK, 1, 12), 4)
    assert set(faults(checked(both))) == {("inverted", (5,)), ("late", (2,))}
    assert set(faults(checked(inverted(inverted(ON_LINE, 1), 5), LINE))) == {
        ("inverted", (2,)),
        ("inverted", (6,)),
    }


@pytest.mark.parametrize("n_sensors", [3, 4, 8])
@pytest.mark.parametrize("seed", [0, 1])
def test_noise_alone_is_not_tested_and_has_no_fault(n_sensors: int, seed: int) -> None:
    noise = np.random.default_rng(seed).standard_normal((32000, n_sensors))
    report = checked(noise, SensorArray.uca(n_sensors, radius=0.05, speed=343.0))
    assert report.faults == ()
    assert report.notes == ("the wiring was not tested: no source is coherent over the channels",)
    assert {each.state for each in report.channels} == {"not tested"}


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (100.0, "centimetres for metres"),
        (0.4, "inches for centimetres"),
        (0.5, "a diameter for a radius"),
        (0.1, "millimetres for centimetres"),
    ],
)
def test_wrong_lengths_are_a_fault_with_the_unit(factor: float, words: str) -> None:
    report = checked(TALK, SensorArray(factor * CIRCLE.positions, 343.0))
    assert report.scale is not None
    assert report.scale[0] < 1 / factor < 1.15 * report.scale[1]
    assert faults(report) == [("scale", ())]
    assert words in report.faults[0].text


def test_millimetres_for_metres_of_a_short_recording_are_a_fault() -> None:
    assert faults(checked(TALK, SensorArray(1000 * CIRCLE.positions, 343.0))) == [("scale", ())]
    square = talk_in_room(SQUARE, 2, seconds=3.0)
    assert "wrong lengths" in checked(square, SensorArray(100 * SQUARE.positions, 343.0)).notes[0]


def test_wrong_lengths_of_a_line_are_a_note_as_waves_from_its_side_have_no_delays_either() -> None:
    wrong = checked(ON_LINE, SensorArray(100 * LINE.positions, 343.0))
    assert wrong.faults == ()
    assert "waves from its side" in wrong.notes[0]
    rng = np.random.default_rng(0)
    side = rng.standard_normal((32000, 1)) + 0.1 * rng.standard_normal((32000, 8))
    assert checked(side, SensorArray.ula(8, 0.5, speed=343.0)).faults == ()


def test_too_large_lengths_as_of_sources_far_above_are_a_note() -> None:
    report = checked(TALK, SensorArray(2 * CIRCLE.positions, 343.0))
    assert report.faults == ()
    assert "waves from far outside of its plane" in report.notes[0]


def test_waves_from_straight_above_are_no_fault() -> None:
    rng = np.random.default_rng(0)
    samples = rng.standard_normal((32000, 1)) + 0.1 * rng.standard_normal((32000, 6))
    report = checked(samples)
    assert report.faults == ()
    assert "waves from far outside of its plane" in report.notes[0]


def test_tone_on_displaced_sensors_is_no_fault() -> None:
    rng = np.random.default_rng(1)
    positions = CIRCLE.positions + 0.004 * rng.standard_normal((6, 2))
    t = np.arange(32000)[:, None] / RATE
    tone = np.cos(2 * np.pi * 1234.0 * (t + positions @ [0.6, 0.8] / 343.0))
    report = checked(tone + 0.05 * rng.standard_normal(tone.shape))
    assert report.faults == ()
    assert "the wiring was not tested" in report.notes[0]


@pytest.mark.parametrize(("n_sensors", "spacing"), [(8, 1.875), (21, 5.6)])
@pytest.mark.parametrize("n_tones", [3, 9])
def test_tones_that_interfere_over_several_paths_are_no_fault(
    n_sensors: int, spacing: float, n_tones: int
) -> None:
    array, rng = SensorArray.ula(n_sensors, spacing, speed=1489.0), np.random.default_rng(0)
    t = np.arange(15000)[:, None] / 1500.0
    y = 0.3 * rng.standard_normal((15000, n_sensors))
    for f in rng.choice([49, 64, 79, 94, 112, 130, 148, 166, 201, 235], n_tones, replace=False):
        for angle in np.deg2rad([-12.0, 8.0, 20.0]):
            delay = array.positions[:, 0] * np.sin(angle + 0.005 * t) / array.speed
            y += rng.uniform(0.3, 1) * np.sin(2 * np.pi * f * (t + delay) + rng.uniform(0, 6))
    assert check(y, array, rate=1500.0).faults == ()


def test_frequency_of_complex_snapshots_is_that_of_the_recording() -> None:
    array = SensorArray.uca(5, radius=0.35, speed=3e8)
    z = array.steering_vector(np.linspace(0, 6, 400), wavelength=0.7)
    z[:, 3] *= -1
    recording = Recording(z, rate=1e5, frequency=3e8 / 0.7)
    assert faults(check(recording, array)) == [("inverted", (4,))]


@settings(max_examples=3)
@given(st.floats(1e-3, 1e3))
def test_gain_of_all_channels_changes_no_agreement(gain: float) -> None:
    agreements = [
        [each.agreement for each in checked(samples).channels] for samples in (TALK, gain * TALK)
    ]
    assert_allclose(agreements[0], agreements[1], atol=1e-3)


@settings(max_examples=3)
@given(st.permutations(range(6)))
def test_order_of_sensors_and_channels_changes_no_agreement(order: list[int]) -> None:
    array = SensorArray(CIRCLE.positions[order], 343.0)
    permuted = checked(TALK[:, order], array)
    agreement = np.array([each.agreement for each in checked(TALK).channels])
    assert_allclose([each.agreement for each in permuted.channels], agreement[order], atol=0.02)


def test_numbers_are_those_of_the_recording_channels() -> None:
    samples = np.zeros((len(TALK), 8))
    samples[:, 1:7] = inverted(TALK, 2)
    array = SensorArray(CIRCLE.positions, 343.0, channels=range(1, 7))
    report = checked(samples, array)
    assert [each.channel for each in report.channels] == [2, 3, 4, 5, 6, 7]
    assert faults(report) == [("inverted", (4,))]
    recording = Recording(samples[:, 1:7], RATE, array=array)
    assert check(recording).faults == report.faults


def test_wrong_number_of_channels_is_a_fault_with_the_cure() -> None:
    for n_channels, cure in ((8, "add channels = "), (4, "use the array file")):
        report = checked(np.pad(TALK, ((0, 0), (0, 2)))[:, :n_channels])
        assert [fault.kind for fault in report.faults] == ["channel count"]
        text = report.faults[0].text
        assert text.startswith(
            f"the recording has {n_channels} channels, the array 6 sensors: {cure}"
        )
        assert len(report.channels) == n_channels


def test_what_is_unknown_is_not_tested(tmp_path: Path) -> None:
    cases = {
        "an array": check(TALK, rate=RATE),
        "wave speed": check(TALK, SensorArray(CIRCLE.positions), rate=RATE),
        "rate is unknown": check(TALK, CIRCLE),
        "less than 3": checked(TALK[:, :2], SensorArray.ula(2, 0.05, speed=343.0)),
        "frequency": check(TALK[:100] + 0j, CIRCLE),
        "too short": check(TALK[:100], CIRCLE, rate=RATE),
    }
    for words, report in cases.items():
        assert report.faults == ()
        assert len(report.notes) == 1
        assert words in report.notes[0]


def test_invalid_arguments_raise_errors(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="frequency must be None for real samples"):
        check(TALK, CIRCLE, rate=RATE, frequency=100.0)
    with pytest.raises(TypeError, match="rate must be left out"):
        check(Recording(TALK, RATE), CIRCLE, rate=RATE)
    with pytest.raises(TypeError, match="array must be an array file"):
        check(TALK, 3, rate=RATE)  # type: ignore[arg-type]
    with pytest.raises(OSError, match="No such file"):
        arrivals.check(tmp_path / "none.wav")


def test_snapshots_from_many_directions_show_inverted_swapped_and_dead_channels() -> None:
    rng, array = np.random.default_rng(0), SensorArray.uca(7, radius=0.5, speed=343.0)
    azimuth = np.repeat(np.linspace(0, 6, 60), 16)
    z = array.steering_vector(azimuth, 0.7) * np.exp(2j * np.pi * rng.random((960, 1)))
    z = z + 0.1 * (rng.standard_normal(z.shape) + 1j * rng.standard_normal(z.shape))
    dead = z.copy()
    dead[:, 5] = np.exp(2j * np.pi * rng.random(960))
    signs = np.where(np.arange(7) == 3, -1.0, 1.0)
    cases = [
        (z, []),
        (z * signs, [("inverted", (4,))]),
        (z[:, [2, 1, 0, 3, 4, 5, 6]], [("swapped", (1, 3))]),
        (dead, [("no agreement", (6,))]),
    ]
    for samples, expected in cases:
        assert faults(check(samples, array, frequency=490.0)) == expected
    still = array.steering_vector(np.full(900, 1.0), 0.7)
    report = check(still * signs, array, frequency=490.0)
    assert (report.faults, len(report.notes)) == ((), 1)


def test_report_of_the_documentation_is_that_of_a_room() -> None:
    page = Path(__file__).parents[2] / "docs" / "recordings.md"
    samples = inverted(delayed(talk_in_room(CIRCLE, seconds=6.0), 1, 7), 4)
    assert indent(str(checked(samples)), 4 * " ") in page.read_text(encoding="utf-8")


def test_track_warns_of_a_fault_and_not_without() -> None:
    recording = Recording(inverted(TALK, 4), RATE, array=CIRCLE)
    with pytest.warns(UserWarning, match="channel 5 is inverted"):
        arrivals.track(recording, frequencies=[1000.0, 2000.0], tracker="cbf")
    arrivals.track(TALK, CIRCLE, rate=RATE, frequencies=[1000.0, 2000.0], tracker="cbf")


def test_misspelt_argument_is_refused_with_the_right_one() -> None:
    with pytest.raises(TypeError, match="check has no argument 'rat': did you mean rate"):
        check(TALK, CIRCLE, rat=RATE)


@pytest.mark.parametrize(("azimuth", "elevation"), [(150.0, -40.0), (40.0, 80.0), (45.0, 68.0)])
def test_array_in_space_with_one_source_far_from_the_horizon_has_no_fault(
    azimuth: float, elevation: float
) -> None:
    array = SensorArray(0.06 * fibonacci_sphere(12), speed=343.0)
    towards = unit_vectors(*np.deg2rad([azimuth, elevation]))
    rng = np.random.default_rng(0)
    source = np.fft.rfft(rng.standard_normal(16000))
    frequency = np.fft.rfftfreq(16000, 1 / 16000)
    turn = np.exp(2j * np.pi * np.outer(frequency, array.positions @ towards / 343.0))
    samples = np.fft.irfft(source[:, None] * turn, axis=0)
    samples += 0.03 * rng.standard_normal(samples.shape)
    assert check(samples, array, rate=16000.0).faults == ()
