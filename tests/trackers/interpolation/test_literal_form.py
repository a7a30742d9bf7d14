"""The paper's loop as printed: its recursion, the bias of its index, and what it does not know."""

from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySamples, SensorArray
from arrivals.motion_models import DelayDrift, DelayWalk
from arrivals.scenarios.reproduce.interpolation.trials import SOURCES, draws, final_directions
from arrivals.trackers.interpolation import VARIANTS, InterpolationEKF
from arrivals.typing import Float

TONE = SOURCES["tone"].measurement


def loop_of_section_2_4(y: Float, kappa: float, eps: float, x0: float, P: float) -> float:
    """The paper's loop as printed, in plain numbers, for a tone of 1/4 cycle a sample."""
    omega, delay = np.pi / 2, x0
    for k in range(2, y.shape[1]):  # k = 3 ... M
        c = np.sin(omega * np.array([1 - delay, delay]))  # a and b, once a snapshot
        dc = omega * np.array([-np.cos(omega * (1 - delay)), np.cos(omega * delay)])
        R = eps * (1 + c @ c)
        for j in range(1, y.shape[0]):
            x = y[j - 1, [k - 1, k - 2]]
            H = dc @ x
            K = P * H / (H * P * H + R)
            delay = float(np.clip(delay + K * (y[j, k] - c @ x), -kappa, kappa))
            P = float(P - K * H * P)
    return delay


def test_literal_variant_equals_the_loop_of_section_2_4() -> None:
    scene = SOURCES["tone"]
    made = scene.sample(np.random.default_rng(1))
    tracker = InterpolationEKF(TONE, variant="literal", doa=np.deg2rad(50.0), gate=None)
    x0, P0 = float(tracker.x[0]), float(tracker.P[0, 0])
    expected = loop_of_section_2_4(made.measurements.real[:, ::-1].T, 2.0, 10**-0.5, x0, P0)
    run = tracker.run(made.measurements)
    assert run.x[-1, 0] == pytest.approx(expected, abs=1e-12)
    kappa_cos = 2 * np.cos(run.doa[-1, 0])
    assert run.std[-1, 0] == pytest.approx(np.sqrt(tracker.P[0, 0]) / kappa_cos, rel=0.01)


@pytest.mark.parametrize(
    ("doa", "end"), [(15.0, -14.0), (30.0, 0.0), (45.0, 12.0), (60.0, 21.5), (75.0, 27.8)]
)
def test_literal_index_makes_the_sine_too_small_by_1_over_kappa(doa: float, end: float) -> None:
    assert np.sin(np.deg2rad(doa)) - 1 / 2 == pytest.approx(np.sin(np.deg2rad(end)), abs=2e-3)
    scenario = SOURCES["tone"].replace(doa_deg=doa)
    mean = final_directions(scenario, 40, 0, "literal", doa - 10).mean()
    assert mean == pytest.approx(end, abs=0.4)


def test_frozen_loop_with_the_index_of_equation_4_has_no_bias() -> None:
    scenario = SOURCES["tone"].replace(doa_deg=30.0)
    variant = VARIANTS["literal"].replace(sequential_update="frozen")
    tracker = InterpolationEKF(scenario.measurement, variant=variant, doa=0.35, gate=None)
    ends = [run.doa[-1, 0] for run in tracker.run_batch(draws(scenario, 40, 0))]
    assert np.rad2deg(np.mean(ends)) == pytest.approx(30.0, abs=0.4)


@pytest.mark.parametrize(
    ("settings", "wanted"),
    [
        ({"offsets": (-1, 0, 1, 2)}, r"the taps \(0, 1\)"),
        ({"loading": 0.1}, ".*loading 0; got .* loading 0.1"),
        ({"baselines": (1, 2)}, "baseline 1, forwards"),
        ({"bidirectional": True}, "baseline 1, forwards"),
        ({"joint": "phasor"}, "the delay alone"),
    ],
)
def test_literal_variant_rejects_other_settings(settings: dict[str, Any], wanted: str) -> None:
    with pytest.raises(ValueError, match=f"requires {wanted}.*: use variant 'B'"):
        InterpolationEKF(TONE, variant=VARIANTS["literal"].replace(**settings))


def test_literal_variant_rejects_models_beyond_the_paper() -> None:
    gap = SensorArray(np.array([0.0, 0.5, 1.5]), speed=1.0)
    cases: list[tuple[ArraySamples, Any, str]] = [
        (TONE.replace(array=gap), DelayWalk(), "a uniform line without gaps; got 3 sensors at 4"),
        (TONE, DelayDrift(1e-8), "the delay alone in the state; got DelayDrift"),
        (SOURCES["qpc"].measurement, DelayWalk(), "a flat band or one tone"),
        (TONE.replace(band=(0.2, 0.3)), DelayWalk(), "samples as they are; got band="),
    ]
    for measurement, motion, wanted in cases:
        with pytest.raises(ValueError, match=wanted):
            InterpolationEKF(measurement, motion, variant="literal")
    band = SOURCES["band"]
    tracker = InterpolationEKF(band.measurement, variant="literal", doa=0.2)
    assert np.isfinite(tracker.run(band.sample(np.random.default_rng(0)).measurements).doa).all()
