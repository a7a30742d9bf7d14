"""AR Kalman filter with QRD-RLS: rows of the table of section 7, and effects of the settings."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from autoregressive_scenes import (
    DOA,
    INWARDS,
    THREE,
    TWO,
    constant,
    make_tracker,
    rmse_deg,
    snapshots,
    sources,
    symmetric_array,
)

from arrivals.measurement_models import ArraySnapshot
from arrivals.motion_models import AutoregressiveSources, yule_walker

ROWS: list[tuple[str, ArraySnapshot, float, dict[str, Any]]] = [
    ("SNR 30, λ .95", symmetric_array(0.25, snr_db=30.0), 0.12, {"forgetting": 0.95}),
    ("SNR 10", symmetric_array(0.25), 0.7, {"forgetting": 0.99}),
    ("SNR 1", symmetric_array(0.25, snr_db=1.0), 2.0, {"forgetting": 0.99}),
    ("M = 3", symmetric_array(0.25, 0.5, 0.75), 0.28, {"forgetting": 0.97}),
    ("d (.5, 4)", symmetric_array(0.5, 4.0), 0.09, {"forgetting": 0.97}),
    ("d (.5, 1.5, 2.5)", symmetric_array(0.5, 1.5, 2.5), 0.09, {"forgetting": 0.97}),
]


@pytest.mark.parametrize(("name", "array", "limit", "params"), ROWS, ids=[row[0] for row in ROWS])
def test_two_static_sources_meet_the_limits_of_section_7(
    name: str, array: ArraySnapshot, limit: float, params: dict[str, Any]
) -> None:
    s = sources(TWO, 8, 6000)
    runs = make_tracker(array, TWO, doa=DOA + INWARDS, **params).run_batch(snapshots(array, DOA, s))
    assert rmse_deg(runs, constant(DOA, 6000), 3000) < limit
    if name in ("SNR 10", "SNR 30, λ .95"):
        result = np.array([run.signals for run in runs])[:, 3000:]
        nmse = (abs(result - s[:, 3000:]) ** 2).mean() / (abs(s[:, 3000:]) ** 2).mean()
        assert 10 * np.log10(nmse) < (-13.0 if name == "SNR 10" else -32.5)
        wrong = np.array([run.coefficients[3000:] for run in runs]) - TWO.coefficient_matrix
        assert np.sqrt((wrong**2).mean()) < 0.03
        assert np.mean([run.noise[-1] for run in runs]) == pytest.approx(array.noise, rel=0.1)


def test_three_sources_on_three_sensors_meet_the_limit_of_section_7() -> None:
    doa, array = np.deg2rad([-35.0, 5.0, 40.0]), symmetric_array(0.5)
    off = np.deg2rad([3.0, -3.0, 3.0])
    tracker = make_tracker(array, THREE, doa=doa + off, forgetting=0.99)
    runs = tracker.run_batch(snapshots(array, doa, sources(THREE, 8, 6000)))
    assert rmse_deg(runs, constant(doa, 6000), 3000) < 0.4


def test_moving_source_in_short_intervals_meets_the_limit_of_section_7() -> None:
    doa = np.deg2rad(np.stack([np.linspace(40, 0, 600), np.full(600, -20.0)], axis=-1))
    array = symmetric_array(0.5, 1.0)
    tracker = make_tracker(array, TWO, doa=doa[0] + INWARDS / 2, interval=3, forgetting=0.9)
    runs = tracker.run_batch(snapshots(array, doa, sources(TWO, 8, 600)))
    assert rmse_deg(runs, doa, 120) < 0.85


def test_inner_iterations_halve_the_lag_behind_a_moving_source() -> None:
    doa = np.deg2rad(np.stack([np.linspace(40, 0, 6000), np.full(6000, -20.0)], axis=-1))
    array, s = symmetric_array(0.25, 0.5, snr_db=30.0), sources(TWO, 2, 6000)
    z, start = snapshots(array, doa, s), doa[0] + INWARDS / 2
    ends = slice(29, None, 30)
    for inner, limit in ((1, 0.65), (4, 0.3)):
        tracker = make_tracker(array, TWO, doa=start, forgetting=0.95, inner=inner)
        wrong = np.rad2deg(np.array([run.doa[ends] for run in tracker.run_batch(z)]) - doa[ends])
        assert np.sqrt((wrong[:, 40:] ** 2).mean()) < limit


# -- effects of the settings -----------------------------------------------------------------------


def test_regression_without_covariance_rows_biases_directions() -> None:
    array, doa = symmetric_array(0.25), constant(DOA, 4500)
    z = snapshots(array, DOA, sources(TWO, 4, 4500))
    plain, right = (
        make_tracker(array, TWO, doa=DOA, forgetting=0.99, correction=on).run_batch(z)
        for on in (False, True)
    )
    assert rmse_deg(plain, doa, 2250) > 2.0 > 0.7 > rmse_deg(right, doa, 2250)


def test_overstated_noise_biases_directions_unless_it_is_estimated() -> None:
    doa, truth = constant(DOA, 6000), symmetric_array(0.25)
    z = snapshots(truth, DOA, sources(TWO, 4, 6000))
    wrong = truth.replace(noise=10 * truth.noise)
    adaptive, constant_r = (
        make_tracker(wrong, TWO, doa=DOA, forgetting=0.99, adapt_measurement_noise=on).run_batch(z)
        for on in (True, False)
    )
    assert rmse_deg(adaptive, doa, 3000) < 0.75
    assert rmse_deg(constant_r, doa, 3000) > 2.0
    assert adaptive[0].noise[-1] == pytest.approx(truth.noise, rel=0.15)


def test_real_sources_are_received_with_half_of_the_noise() -> None:
    real, array = TWO.replace(real_valued=True).scaled(1.0), symmetric_array(0.25)
    s = sources(real, 4, 3000)
    z = snapshots(array, DOA, s)
    assert not s.imag.any()

    def nmse(motion: AutoregressiveSources) -> float:
        runs = make_tracker(array, motion, doa=DOA).run_batch(z)
        result = np.array([run.signals for run in runs])[:, 1500:]
        return float(10 * np.log10((abs(result - s[:, 1500:]) ** 2).mean()))

    assert nmse(TWO) - nmse(real) == pytest.approx(2.8, abs=0.5)


def test_inactive_source_keeps_its_direction_and_has_existence_0() -> None:
    real, array = TWO.replace(real_valued=True).scaled(1.0), symmetric_array(0.25, 0.5)
    s = sources(real, 1, 6000)[0]
    s[3000:4500, 0] = 0.0
    z = snapshots(array, DOA, s)
    params: dict[str, Any] = {"ridge": 5.0, "gate": 0.3, "adapt_process_noise": False}
    run = make_tracker(array, real, doa=DOA + 0.05, **params).run(z)
    wrong = np.abs(np.rad2deg(run.doa - DOA))
    assert wrong[1500:].max() < 3.0
    assert (run.existence[3060:4490, 0] == 0).mean() > 0.95
    assert (run.existence[3060:4490, 1] == 1).mean() > 0.7
    params |= {"gate": 0.0, "ridge": 0.01}
    free = make_tracker(array, real, doa=DOA + 0.05, **params).run(z)
    assert np.abs(np.rad2deg(free.doa - DOA))[3060:4490, 0].max() > 10.0
    assert np.isnan(free.existence).all()


def test_wrong_powers_of_the_model_are_corrected_by_estimates() -> None:
    real, array = TWO.replace(real_valued=True).scaled(1.0), symmetric_array(0.25, 0.5)
    z = snapshots(array, DOA, sources(real, 1, 9000)[0])
    params: dict[str, Any] = {"ridge": 5.0, "gate": 0.3, "adapt_process_noise": False}
    for wrong in (0.1, 10.0):
        tracker = make_tracker(array, real.scaled(wrong), doa=DOA + 0.05, **params)
        run = tracker.run(z)
        assert tracker.power == pytest.approx(1.0, rel=0.7)
        assert np.abs(np.rad2deg(run.doa[6000:] - DOA)).max() < 2.0


def test_r_start_halves_the_error_at_low_noise() -> None:
    doa, array = np.deg2rad([-35.0, 5.0, 40.0]), symmetric_array(0.5, snr_db=30.0)
    start = doa + np.deg2rad([3.0, -3.0, 3.0])
    z = snapshots(array, doa, sources(THREE, 4, 6000))
    slow, fast = (
        make_tracker(array, THREE, doa=start, forgetting=0.99, r_start=r).run_batch(z)
        for r in (0.0, 0.3)
    )
    assert rmse_deg(fast, constant(doa, 6000), 4500) < 0.5 * rmse_deg(
        slow, constant(doa, 6000), 4500
    )


def test_wrong_ar_models_converge_if_sensors_outnumber_sources() -> None:
    z = snapshots(symmetric_array(0.25, snr_db=30.0), DOA, sources(TWO, 2, 6000))
    swapped = AutoregressiveSources([*TWO.coefficients][::-1]).scaled(1.0)
    for motion in (AutoregressiveSources([[0.0, 0.0]] * 2), swapped):
        tracker = make_tracker(symmetric_array(0.25, snr_db=30.0), motion, doa=DOA + INWARDS)
        assert rmse_deg(tracker.run_batch(z), constant(DOA, 6000), 3000) < 0.12


def test_sources_of_different_orders_are_estimated() -> None:
    mixed = AutoregressiveSources([[0.9], [0.96, -0.77]]).scaled(1.0)
    z = snapshots(symmetric_array(0.25, 0.5), DOA, sources(mixed, 2, 6000))
    runs = make_tracker(symmetric_array(0.25, 0.5), mixed, doa=DOA + 0.1).run_batch(z)
    assert rmse_deg(runs, constant(DOA, 6000), 3000) < 0.5
    for run in runs:
        np.testing.assert_allclose(run.coefficients[-1], mixed.coefficient_matrix, atol=0.1)
        assert (np.abs(run.coefficients[:, 0, 1]) < 1e-12).all()


# -- speech, if the recordings are available -------------------------------------------------------


@pytest.mark.skipif("ARRIVALS_DATA" not in os.environ, reason="names the folder of the recordings")
def test_speech_is_tracked_through_its_pauses() -> None:
    from scipy.io import wavfile

    folder = Path(os.environ["ARRIVALS_DATA"]) / "speech"
    both = [wavfile.read(folder / f"synth_count_{way}_8k.wav")[1] for way in ("up", "down")]
    n = min(map(len, both))
    s = np.stack([voice[:n] for voice in both], axis=-1) * 1.0
    s = (s - s.mean(axis=0)) / s.std(axis=0)
    a, q = zip(*(yule_walker(voice, 1) for voice in s.T), strict=True)
    motion = AutoregressiveSources([row.tolist() for row in a], q, real_valued=True)
    doa = np.deg2rad(np.stack([np.linspace(40, 0, n), np.full(n, -20.0)], axis=-1))
    array = symmetric_array(0.25, 0.5)
    tracker = make_tracker(
        array, motion, doa=doa[0] + INWARDS / 2, ar_forgetting=0.99, ridge=5.0, gate=0.3,
        adapt_process_noise=False,
    )  # fmt: skip
    run = tracker.run(snapshots(array, doa, s.astype(complex)))
    assert np.rad2deg(np.sqrt(((run.doa - doa)[3029::30] ** 2).mean())) < 1.14
