"""Posterior bound of positions against the joint Gaussian of all steps, and against estimates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, SensorArray, Station
from arrivals.motion_models import ConstantVelocity
from arrivals.scenarios.bounds import bearing_information, posterior_bound, snapshot_bound
from arrivals.scenarios.simulations import StationsRadio, StationsTrial
from arrivals.trackers.fusion.stations.single_step_bearings import bearings
from arrivals.typing import Float

CIRCLE = ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, n_snapshots=10)
WIDE = CIRCLE.replace(wavelength=(0.9, 1.0, 1.2), n_snapshots=1)
P0 = np.diag([1000.0, 8.0, 1000.0, 8.0]) ** 2
PAIR = (Station(CIRCLE, [0.0, 0.0], 0.3), Station(CIRCLE, [1000.0, 0.0], -2.0))
INFORMATION = 2 * 10 * 8 * (2 * np.pi * 0.65) ** 2 / 2  # of one source of power 1, rad⁻²


def bound(trial: StationsTrial) -> Float:
    drawn = trial.true_stations, trial.truth, trial.power, trial.motion
    return posterior_bound(*drawn, trial.P0)


def size(P: Float) -> Float:
    return np.asarray(np.sqrt(np.trace(P, axis1=-2, axis2=-1)))


def trial_of(**arguments: Any) -> StationsTrial:
    return StationsRadio(**arguments).sample(np.random.default_rng(3))


def test_bearing_information_of_one_source_is_the_snapshot_bound() -> None:
    model = ArraySnapshot(SensorArray.uca(7, 0.5), 1.0, noise=0.3)
    J = bearing_information(model, [0.7], [4.0])
    assert 1 / np.sqrt(J) == pytest.approx(snapshot_bound(model, [0.7], [2.0], 0.3), rel=1e-8)


@pytest.mark.parametrize("model", [CIRCLE, WIDE], ids=["snapshots", "bins"])
def test_bearing_information_is_attained_by_the_directions_of_a_step(model: ArraySnapshot) -> None:
    """Of amplitudes of constant size and random phases, so that the mean is nearly reached."""
    rng, doa, P = np.random.default_rng(0), np.array([0.4, 0.9]), np.array([30.0, 60.0])
    phase = rng.uniform(0, 2 * np.pi, (600, *model.shape[:-1], 2))
    z = model.simulate(np.tile(doa, (600, 1)), np.sqrt(P) * np.exp(1j * phase), rng)
    error = np.array([bearings(model, each, doa)[0] - doa for each in z])
    rms = np.sqrt((error**2).mean(axis=0))
    ratio = rms * np.sqrt(bearing_information(model, doa, P))
    assert ((ratio > 0.95) & (ratio < 1.25)).all(), ratio


def test_bearing_information_ignores_absent_sources() -> None:
    doa = np.array([[0.2, np.nan, 1.5], [np.nan, np.nan, np.nan]])
    power = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]])
    J = bearing_information(CIRCLE, doa, power)
    np.testing.assert_allclose(J[0, [0, 2]], bearing_information(CIRCLE, [0.2, 1.5], [1.0, 3.0]))
    np.testing.assert_array_equal(J[[0, 1, 1, 1], [1, 0, 1, 2]], 0.0)


def test_one_step_is_the_information_matrix_by_hand() -> None:
    """Source at (500, 500): slopes (-1, 1)/1000 and (-1, -1)/1000 from the two stations."""
    truth, power = np.array([[[500.0, 500.0]]]), np.array([[[1.0], [4.0]]])
    slopes = np.array([[-1.0, 1.0], [-1.0, -1.0]]) / 1000
    J = np.diag([1e-6, 1e-6]) + INFORMATION * (
        np.outer(slopes[0], slopes[0]) + 4 * np.outer(slopes[1], slopes[1])
    )
    P = posterior_bound(PAIR, truth, power, ConstantVelocity(0.1), P0)
    np.testing.assert_allclose(P[0, 0], np.linalg.inv(J), rtol=1e-7)


def test_three_steps_are_the_joint_gaussian() -> None:
    motion, n = ConstantVelocity(0.5), 3
    truth = np.array([[[400.0, 300.0]], [[410.0, 305.0]], [[420.0, 309.0]]])
    power = np.array([[[1.0], [2.0]], [[1.1], [np.nan]], [[0.9], [2.2]]])
    J = np.zeros((4 * n, 4 * n))
    J[:4, :4] = np.linalg.inv(P0)
    for t in range(n):
        own = slice(4 * t, 4 * t + 4)
        for s, station in enumerate(PAIR):
            d = truth[t, 0] - station.position
            h = np.array([-d[1], 0, d[0], 0]) / (d @ d)
            J[own, own] += np.nan_to_num(power[t, s, 0]) * INFORMATION * np.outer(h, h)
        if t:
            step = np.zeros((4, 4 * n))
            step[:, 4 * t - 4 : 4 * t], step[:, own] = -motion.F(), np.eye(4)
            J += step.T @ np.linalg.solve(motion.Q(), step)
    last = np.linalg.inv(J)[-4:, -4:][::2, ::2]
    np.testing.assert_allclose(posterior_bound(PAIR, truth, power, motion, P0)[2, 0], last, 1e-6)


@settings(max_examples=10, deadline=None)
@given(st.floats(-10, 30), st.floats(0.1, 20))
def test_bound_falls_with_snr(snr_db: float, more: float) -> None:
    low = size(bound(trial_of(snr_db=snr_db)))
    high = size(bound(trial_of(snr_db=snr_db + more)))
    on = ~np.isnan(low)
    assert (high[on] < low[on]).all()
    assert (high[on] > low[on] * 10 ** (-more / 20) * (1 - 1e-9)).all()  # motion slows the gain


def test_bound_rises_without_a_station_and_with_other_sources() -> None:
    whole, gap = size(bound(trial_of())), size(bound(trial_of(n_missing=1)))
    on = ~np.isnan(whole)
    np.testing.assert_allclose(whole[:20], gap[:20])
    assert (gap[20:40][on[20:40]] > whole[20:40][on[20:40]]).all()
    trial = trial_of()
    alone = posterior_bound(
        trial.true_stations, trial.truth[:, :1], trial.power[..., :1], trial.motion, trial.P0
    )
    assert (size(alone)[:, 0] <= whole[:, 0] * (1 + 1e-9)).all()
    np.testing.assert_array_equal(on, ~np.isnan(trial.truth[..., 0]))


def test_source_that_returns_begins_anew() -> None:
    truth = np.full((3, 1, 2), 500.0)
    truth[1] = np.nan
    P = posterior_bound(PAIR, truth, np.ones((3, 2, 1)), ConstantVelocity(0.1), P0)
    np.testing.assert_allclose(P[2], P[0])
    assert np.isnan(P[1]).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"truth": np.zeros((3, 1))}, "truth and power must have shapes"),
        ({"power": np.ones((3, 1, 1))}, "truth and power must have shapes"),
        ({"stations": (PAIR[0], Station(None, [1.0, 0.0]))}, "stations must have measurement"),
        ({"motion": ConstantVelocity(0.1, n_dims=3)}, "motion must have 2 coordinates; got 3"),
        ({"P0": -np.eye(4)}, "P0 must have no negative eigenvalue"),
    ],
)
def test_posterior_bound_refuses_what_does_not_fit(changes: dict[str, Any], message: str) -> None:
    arguments: dict[str, Any] = {
        "stations": PAIR,
        "truth": np.full((3, 1, 2), 500.0),
        "power": np.ones((3, 2, 1)),
        "motion": ConstantVelocity(0.1),
        "P0": P0,
    }
    with pytest.raises(ValueError, match=f"^{message}"):
        posterior_bound(**arguments | changes)


def test_bearing_information_refuses_shapes_and_coherent_noise() -> None:
    with pytest.raises(ValueError, match=r"^doa and power must have one shape"):
        bearing_information(CIRCLE, [0.1, 0.2], [1.0])
    with pytest.raises(ValueError, match=r"^measurement must have white noise"):
        bearing_information(CIRCLE.replace(noise_coherence="diffuse"), [0.1], [1.0])
