"""Sound of microphones: hum, offsets, clicks, dead channels, quantization, gaps."""

import copy
import pickle
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySamples, FlatBand, SensorArray
from arrivals.recordings.sample_stream import band_samples, track_samples
from arrivals.scenarios.simulations.sampled_source import InterpolationTone
from arrivals.trackers import InterpolationEKF
from arrivals.trackers.interpolation import VARIANTS
from arrivals.typing import Float

RATE, BAND, N = 16000.0, (800.0, 3200.0), 1500
TONE = InterpolationTone(n_steps=60)


def line(n_sensors: int = 4) -> SensorArray:
    return SensorArray.ula(n_sensors, spacing=0.04, speed=340.0)


def sound(doa_deg: float, seed: int, array: SensorArray, noise: float = 0.1) -> Float:
    """Draw noise of a band from a direction, exactly delayed, of power 1."""
    rng, f = np.random.default_rng(seed), np.fft.rfftfreq(2 * N, 1 / RATE)
    lag = -array.positions[:, 0] * np.sin(np.deg2rad(doa_deg)) / 340.0
    spectrum = rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))
    spectrum[(f < BAND[0]) | (f > BAND[1])] = 0
    x = np.fft.irfft(spectrum * np.exp(-2j * np.pi * f * lag[:, None]), 2 * N)[:, :N].T
    return np.asarray(x / x.std() + noise * rng.standard_normal(x.shape))


def tracker(array: SensorArray, **params: Any) -> InterpolationEKF:
    return InterpolationEKF(band_samples(array, RATE, BAND, snr_db=20.0), **params)


def hum(frequency: float, amplitude: float) -> Float:
    wave = np.sin(2 * np.pi * frequency * np.arange(N)[:, None] / RATE)
    return np.asarray(amplitude * wave)


def replaced(x: Float, rows: slice, columns: Any, value: float) -> Float:
    x = x.copy()
    x[rows, columns] = value
    return x


DISTURBED: dict[str, Callable[[Float], Float]] = {
    "nothing": lambda x: x,
    "hum": lambda x: x + hum(50.0, 14.0),
    "harmonic": lambda x: x + hum(100.0, 20.0) + hum(150.0, 7.0),
    "offset": lambda x: x + 30.0,
    "offsets": lambda x: x + np.array([5.0, -40.0, 0.3, 11.0]),
    "drift": lambda x: x + np.linspace(-10.0, 30.0, N)[:, None],
    "jump": lambda x: x + 8.0 * (np.arange(N) > 700)[:, None],
    "click": lambda x: replaced(x, slice(600, 604), slice(None), 50.0),
    "loud click": lambda x: replaced(x, slice(900, 903), slice(None), -1e4),
    "one sample": lambda x: replaced(x, slice(700, 701), slice(None), 20.0),
    "click at the start": lambda x: replaced(x, slice(0, 3), slice(None), 60.0),
    "clicks of a channel": lambda x: replaced(x, slice(300, 1200, 150), 2, 40.0),
    "huge": lambda x: replaced(x, slice(600, 601), slice(None), 1e155),
    "gain": lambda x: 1e4 * x,
    "quantized": lambda x: np.round(6.0 * x),
    "quantized with an offset": lambda x: np.round(6.0 * x + 3.3),
    "gap": lambda x: replaced(x, slice(500, 700), slice(None), np.nan),
    "gap of a channel": lambda x: replaced(x, slice(400, 900), 0, np.nan),
    "silence first": lambda x: replaced(x, slice(0, 400), slice(None), 0.0),
}


@pytest.mark.parametrize("kind", DISTURBED)
def test_error_is_within_three_standard_deviations(kind: str) -> None:
    array = line()
    x = [DISTURBED[kind](sound(doa, seed, array)) for seed, doa in enumerate((35.0, -50.0, 10.0))]
    for run, doa in zip(tracker(array).run_batch(x), (35.0, -50.0, 10.0), strict=True):
        error = np.rad2deg(run.doa[-1, 0]) - doa
        assert abs(error) < 3 * np.rad2deg(run.std[-1, 0])
        assert np.rad2deg(run.std[-1, 0]) < 0.5


@pytest.mark.parametrize("variant", list(VARIANTS))
def test_hum_does_not_move_any_variant(variant: Any) -> None:
    if variant in ("phasor", "literal"):
        pytest.skip("a tone, or no filter to a band")
    if variant in ("B", "Bw"):
        variant = VARIANTS[variant].replace(extrapolate=True)
    array = line()
    x = sound(20.0, 3, array)
    ends = []
    for z in (x, x + hum(60.0, 15.0)):
        run = tracker(array, variant=variant, doa=np.deg2rad(15.0)).run_batch([z[:600]])[0]
        ends.append(float(np.rad2deg(run.doa[-1, 0])))
    assert ends[1] == pytest.approx(ends[0], abs=0.02)


def test_without_a_band_samples_are_used_as_they_are() -> None:
    array = line()
    edges = FlatBand(BAND[0] / RATE, BAND[1] / RATE)
    plain = ArraySamples(array, RATE, edges, snr_db=20.0)
    assert plain.band_filter is None
    full = band_samples(array, 2 * BAND[1], (0.0, BAND[1]), snr_db=20.0)
    assert full.band_filter is None
    explicit = plain.replace(band=BAND)
    assert explicit == band_samples(array, RATE, BAND, snr_db=20.0)
    assert InterpolationEKF.from_dict(tracker(array).to_dict()).measurement == explicit
    with pytest.raises(ValueError, match="band must lie"):
        plain.replace(band=(3000.0, 9000.0))


def test_step_run_batch_and_copies_have_equal_results() -> None:
    array = line()
    x = replaced(sound(30.0, 1, array)[:400], slice(200, 203), slice(None), 40.0)
    x[250, 1], x[300:310, 2], x[350] = np.nan, 0.0, np.nan
    by_step, ends = tracker(array), []
    for k, z in enumerate(x):
        if k == 230:
            by_step = pickle.loads(pickle.dumps(copy.deepcopy(by_step)))
        by_step.predict()
        by_step.update(z)
        ends.append(by_step.x[0])
    run, batch = tracker(array).run(x), tracker(array).run_batch([x, x[::-1]])[0]
    recorded = track_samples(tracker(array), x, RATE, every=40)
    np.testing.assert_array_equal(run.x[:, 0], ends)
    np.testing.assert_allclose(batch.x, run.x, atol=1e-12)
    np.testing.assert_allclose(batch.std, run.std, rtol=1e-9)
    np.testing.assert_array_equal(recorded.doa[-1], run.doa[-1])


@pytest.mark.parametrize("start", [0, 250])
def test_dead_channel_is_a_missing_channel_and_reported_once(start: int) -> None:
    array, ends = line(5), []
    for value in (0.0, np.nan):
        x = replaced(sound(35.0, 2, array)[:500], slice(start, None), 3, value)
        made = tracker(array)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            run = made.run(x)
        assert [str(w.message)[:29] for w in caught] == (
            ["only zeros in channel(s) 3, c"] if value == 0 else []
        )
        ends.append((float(run.doa[-1, 0]), float(run.std[-1, 0])))
    assert abs(ends[0][0] - ends[1][0]) < ends[1][1]
    assert ends[0][1] == pytest.approx(ends[1][1], rel=0.05)


def test_zeros_of_quantized_samples_are_samples() -> None:
    """A sixth of these samples is zero; nothing is missing, and no warning is given."""
    array = line()
    x = np.round(2.0 * sound(-30.0, 4, array)[:600])
    assert 0.1 < np.mean(x == 0) < 0.3
    made = tracker(array)
    run = made.run(x)
    assert not made.channels.zero_runs.missing.any()
    assert abs(np.rad2deg(run.doa[-1, 0]) + 30) < 0.5


def test_missing_channel_equals_an_array_without_it() -> None:
    """The first sensor is missing; the others are a line without gaps."""
    x = sound(25.0, 5, line(5))[:300]
    positions = line(5).positions
    rest = SensorArray(positions[:-1], speed=340.0)
    masked = np.ma.array(x, mask=np.isin(np.arange(5), [4]) & np.ones((300, 1), dtype=bool))
    whole = tracker(line(5)).run(masked)
    part = tracker(rest).run(x[:, :-1])
    np.testing.assert_allclose(whole.doa[-1], part.doa[-1], atol=1e-9)
    np.testing.assert_allclose(whole.std[-1], part.std[-1], rtol=0.2)  # correlation as of 5 sensors


@pytest.mark.parametrize("variant", list(VARIANTS))
@pytest.mark.parametrize("exponent", [12, 50, 155, 300])
def test_huge_numbers_do_not_end_the_tracking(variant: Any, exponent: int) -> None:
    z = TONE.sample(np.random.default_rng(0)).measurements
    z[30] *= 10.0**exponent
    z[35, 2] = 10.0**exponent
    run = InterpolationEKF(TONE.measurement, variant=variant, doa=0.95, acquisition=10).run(z)
    assert np.isfinite(run.doa).all()
    end_deg = 21.5 if variant == "literal" else TONE.doa_deg  # an index too high
    assert abs(np.rad2deg(run.doa[-1, 0]) - end_deg) < 3


def test_estimate_widens_in_a_gap_until_it_is_unknown() -> None:
    z = TONE.sample(np.random.default_rng(0)).measurements
    for variant in (VARIANTS["C"], VARIANTS["phasor"]):
        made = InterpolationEKF(TONE.measurement, variant=variant, doa=0.95)
        made.run(z)
        before = float(made.estimate.std[0])
        made.run([None] * 100)
        after = float(made.estimate.std[0])
        assert after > 1.5 * before
        _, P = made.trajectory(np.full((1200, 10), np.nan))
        assert P[-1, 0, 0] == pytest.approx(TONE.measurement.kappa**2 / 3, rel=0.01)


def test_gate_opens_for_a_source_that_stays_elsewhere() -> None:
    """30 dB: after a jump all residuals are beyond the gate, and later used again."""
    at = {doa: InterpolationTone(n_steps=400, doa_deg=doa, snr_db=30.0) for doa in (10.0, 30.0)}
    z = [at[doa].sample(np.random.default_rng(1)).measurements for doa in (10.0, 30.0)]
    model = at[10.0].measurement
    ends = []
    for gate in (None, 5.0):
        made = InterpolationEKF(model, variant="D", doa=0.2, gate=gate)
        run = made.run_batch([np.concatenate([z[0][:100], z[1][:300]])])[0]
        ends.append(np.rad2deg(run.doa[-1, 0]))
    assert abs(ends[1] - 30) < abs(ends[0] - 30) + 5
