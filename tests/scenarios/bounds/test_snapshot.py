"""Cramér-Rao bound of snapshots: numerical Fisher information and published figures."""

from typing import Literal

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios import create
from arrivals.scenarios.bounds.snapshot import (
    capped_distance,
    capped_square,
    line_bound,
    snapshot_bound,
)
from arrivals.scenarios.simulations.line_arrays import LineScenario


@pytest.mark.parametrize("coherence", ["white", "diffuse"])
@pytest.mark.parametrize(
    "array", [SensorArray.ula(9, spacing=0.5), SensorArray.uca(9, radius=0.5)], ids=["line", "uca"]
)
def test_snapshot_bound_is_the_inverse_of_the_joint_fisher_information(
    array: SensorArray, coherence: Literal["white", "diffuse"]
) -> None:
    model = ArraySnapshot(array, wavelength=0.9, noise_coherence=coherence)
    doa, w, noise = np.array([-0.4, 0.5]), np.array([1.0 + 0.2j, -0.6j]), 0.1

    def mean_snapshot(p: np.ndarray) -> np.ndarray:
        z = model.wave(p[:2], p[2:4] + 1j * p[4:])
        return np.concatenate([z.real, z.imag])

    p = np.concatenate([doa, w.real, w.imag])
    h = 1e-6 * np.eye(6)
    slope = np.stack([(mean_snapshot(p + d) - mean_snapshot(p - d)) / 2e-6 for d in h], axis=1)
    information = slope.T @ np.linalg.solve(noise * model.R, slope)  # R of a variance of 1
    expected = np.sqrt(np.linalg.inv(information).diagonal()[:2])
    np.testing.assert_allclose(snapshot_bound(model, doa, w, noise), expected, rtol=1e-5)
    batch = snapshot_bound(model, np.tile(doa, (3, 1)), np.tile(w, (3, 1)), np.full(3, noise))
    np.testing.assert_allclose(batch, np.tile(expected, (3, 1)), rtol=1e-5)


def test_capped_moments_equal_those_of_random_draws() -> None:
    e = 3.0 * np.random.default_rng(0).standard_normal(400_000)
    std = np.array([3.0])
    assert capped_distance(std, 5.0)[0] == pytest.approx(np.minimum(np.abs(e), 5).mean(), rel=5e-3)
    assert capped_square(std, 5.0)[0] == pytest.approx(np.minimum(e**2, 25).mean(), rel=5e-3)


@pytest.mark.parametrize(
    ("name", "snr_db", "expected"),
    [
        ("svalse_fig4", 20.0, 9.2), ("svalse_fig6", 20.0, 3.2),
        ("svalse_scenario1", 0.0, 7.4), ("svalse_scenario1", 20.0, 0.89),
        ("svalse_scenario2", 20.0, 14.0),
    ],
)  # fmt: skip
def test_line_bound_matches_section_12_6(name: str, snr_db: float, expected: float) -> None:
    scenario = create(name, snr_db=snr_db)
    assert isinstance(scenario, LineScenario)
    assert line_bound(scenario, 4).gospa == pytest.approx(expected, rel=0.06)
