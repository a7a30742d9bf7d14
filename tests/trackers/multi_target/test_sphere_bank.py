"""Tracks on the sphere: chart, Kalman steps, zenith and horizon, and peaks_gnn there."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.sphere import (
    azimuth_elevation,
    fibonacci_sphere,
    great_circle,
    unit_vectors,
)
from arrivals.motion_models import ConstantVelocity
from arrivals.trackers import CBF, MVDR, PeaksGNN, SphereEstimate
from arrivals.trackers.multi_target import TrackBank
from arrivals.trackers.multi_target.sphere_bank import SphereBank, moved, offsets
from arrivals.typing import Complex, Float

GRID = 0.5 * np.stack(np.meshgrid(range(4), range(4)), axis=-1).reshape(-1, 2)
FLAT = ArraySnapshot(SensorArray(GRID), 1.0, noise=1e-3, n_snapshots=10, unknowns="sphere")
SPACE = FLAT.replace(array=SensorArray(0.5 * fibonacci_sphere(12)))
MOTION = ConstantVelocity(q=1e-4, n_dims=1)
seeds = st.integers(0, 2**32 - 1)


def pair(seed: int) -> Float:
    u = np.random.default_rng(seed).standard_normal((2, 3))
    return np.asarray(u / np.linalg.norm(u, axis=1, keepdims=True))


@given(seeds)
def test_step_by_the_offset_leads_to_the_other_direction(seed: int) -> None:
    u, v = pair(seed)
    step = offsets(u, v)
    assert step @ u == pytest.approx(0, abs=1e-12)
    assert np.linalg.norm(step) == pytest.approx(great_circle(u, v))
    there, carried = moved(u[None], step[None], step[None, None])
    np.testing.assert_allclose(there[0], v, atol=1e-12)
    # the tangent of a great circle stays its tangent
    np.testing.assert_allclose(carried[0, 0], -offsets(v, u), atol=1e-9)


@given(seeds)
def test_transport_keeps_lengths_and_angles(seed: int) -> None:
    u, v = pair(seed)
    others = np.random.default_rng(seed + 1).standard_normal((2, 3))
    others -= (others @ u)[:, None] * u
    carried = moved(u[None], offsets(u, v)[None], others[None])[1][0]
    np.testing.assert_allclose(carried @ carried.T, others @ others.T, atol=1e-9)
    np.testing.assert_allclose(carried @ v, 0, atol=1e-9)


def test_track_along_the_equator_equals_that_of_one_angle() -> None:
    rng, P = np.random.default_rng(0), np.diag([0.01, 0.001])
    sphere = SphereBank.empty(2, 2).add(unit_vectors([0.3], [0.0]), P)
    circle = TrackBank.empty(2, 2).add(np.array([0.3]), P)
    slot = np.array([0])
    for truth in 0.3 + 0.05 * np.arange(1, 8):
        sphere, circle = sphere.predict(MOTION, 1.0), circle.predict(MOTION, 1.0)
        z = truth + 0.02 * rng.standard_normal()
        circle = circle.update(slot, z - circle.mean[slot, 0], 0.01)
        residual = offsets(sphere.mean[slot, 0], unit_vectors([z], [0.0]))
        sphere = sphere.update(slot, residual, 0.01)
        azimuth, elevation = azimuth_elevation(sphere.mean[0, 0])
        np.testing.assert_allclose([azimuth, elevation], [circle.mean[0, 0], 0], atol=1e-12)
        np.testing.assert_allclose(sphere.covariance, circle.covariance, rtol=1e-12)
        # the velocity points along the equator
        east = [-np.sin(azimuth), np.cos(azimuth), 0.0]
        np.testing.assert_allclose(
            sphere.mean[0, 1], circle.mean[0, 1] * np.array(east), atol=1e-12
        )


@given(seeds)
def test_turned_measurements_turn_the_tracks(seed: int) -> None:
    turn, rng = Rotation.random(rng=np.random.default_rng(seed)), np.random.default_rng(seed)
    bank = SphereBank.empty(1, 2).add(pair(seed)[:1], np.diag([0.01, 0.001]))
    turned = SphereBank.empty(1, 2).add(turn.apply(pair(seed)[:1]), np.diag([0.01, 0.001]))
    for _ in range(3):
        bank, turned = bank.predict(MOTION, 1.0), turned.predict(MOTION, 1.0)
        step = 0.1 * np.cross(bank.mean[:, 0], rng.standard_normal((1, 3)))
        bank = bank.update(np.array([0]), step, 0.01)
        turned = turned.update(np.array([0]), turn.apply(step), 0.01)
    np.testing.assert_allclose(turned.mean[0], turn.apply(bank.mean[0]), atol=1e-9)


def scene(model: ArraySnapshot, azimuth: Float, elevation: Float) -> Complex:
    """Draw snapshots of sources of constant power, (n_steps, n_sources)."""
    rng = np.random.default_rng(3)
    phases = 2 * np.pi * rng.random((len(azimuth), model.n_snapshots, azimuth.shape[1]))
    return model.simulate(azimuth, np.exp(1j * phases), rng, elevation)


@pytest.mark.parametrize("model", [FLAT, SPACE], ids=["plane", "space"])
def test_label_stays_over_the_zenith(model: ArraySnapshot) -> None:
    height = np.deg2rad(np.arange(70.0, 111.0, 2.0))
    truth = unit_vectors(0.4, height)
    azimuth, elevation = (each[:, None] for each in azimuth_elevation(truth))
    run = PeaksGNN(model, max_sources=1).run(scene(model, azimuth, elevation))
    assert set(run.label[1:].ravel()) == {0}
    error = great_circle(unit_vectors(run.doa[1:, 0], run.elevation[1:, 0]), truth[1:])
    assert np.rad2deg(error).max() < 3


def test_two_sources_that_cross_in_azimuth_keep_their_labels() -> None:
    n = 30
    line = 0.5 * np.arange(8)
    wide = FLAT.replace(array=SensorArray(np.stack(np.meshgrid(line, line), -1).reshape(-1, 2)))
    swept = np.linspace(-1.0, 1.0, n)
    azimuth, elevation = np.stack([swept, -swept], axis=1), np.full((n, 2), [0.4, 1.0])
    tracker = PeaksGNN(wide, detector=CBF(wide, max_sources=2), max_sources=4)
    run = tracker.run(scene(wide, azimuth, elevation))
    labels = []
    for source in range(2):
        truth = unit_vectors(azimuth[:, source], elevation[:, source])
        error = great_circle(unit_vectors(run.doa, run.elevation), truth[:, None])
        nearest = np.nanargmin(error[1:], axis=1)
        labels.append(set(run.label[1:][np.arange(n - 1), nearest].tolist()))
    assert sorted(map(len, labels)) == [1, 1]
    assert labels[0] != labels[1]


def test_track_at_the_horizon_of_a_plane_is_mirrored() -> None:
    n = 12
    elevation = np.deg2rad(np.abs(22.0 - 4 * np.arange(n)))[:, None]  # to the horizon and back
    tracker = PeaksGNN(FLAT, max_sources=1)
    run = tracker.run(scene(FLAT, np.full((n, 1), 0.9), elevation))
    assert (run.elevation[1:] >= 0).all()
    assert set(run.label[1:].ravel()) == {0}
    assert np.rad2deg(np.abs(run.elevation[-1] - elevation[-1])).max() < 5
    bank = replace(SphereBank.empty(1, 2), normal=np.array([0.0, 0.0, 1.0]))
    bank = bank.add(unit_vectors([0.9], [0.01]), np.eye(2))
    bank = bank.update(np.array([0]), np.array([[0.0, 0.0, -0.1]]), 1e-9)
    assert bank.mean[0, 0, 2] == pytest.approx(np.sin(0.09), abs=1e-3)
    assert bank.mean[0, 1, 2] >= 0  # a velocity downwards leads up again


def test_stated_covariance_is_round_and_that_of_the_azimuth_grows_with_elevation() -> None:
    tracker = PeaksGNN(FLAT, max_sources=1)
    tracker.run(scene(FLAT, np.full((4, 1), 0.9), np.full((4, 1), 1.2)))
    estimate = tracker.estimate
    assert isinstance(estimate, SphereEstimate)
    variance = estimate.covariance[0, 0, 0]
    np.testing.assert_allclose(estimate.covariance[0], variance * np.eye(2))
    assert estimate.std[0] == pytest.approx(np.sqrt(variance) / np.cos(estimate.elevation[0]))
    np.testing.assert_allclose(tracker.P, estimate.covariance[0, ::-1, ::-1])


def test_gap_widens_a_track_until_it_ends() -> None:
    tracker = PeaksGNN(FLAT, max_sources=1, patience=3)
    z = scene(FLAT, np.full((4, 1), 0.9), np.full((4, 1), 1.2))
    run = tracker.run([*z, None, None, None, None])
    spread = run.covariance[:, 0, 0, 0]
    assert (np.diff(spread[3:7]) > 0).all()
    assert run.n_found.tolist() == [0, 1, 1, 1, 1, 1, 1, 0]


def test_detector_of_one_angle_is_refused() -> None:
    tracker = PeaksGNN(FLAT, detector=MVDR(FLAT.replace(unknowns="azimuth", wavelength=1.1)))
    with pytest.raises(TypeError, match="detector's estimate must be a SphereEstimate"):
        tracker.update(scene(FLAT, np.full((1, 1), 0.9), np.full((1, 1), 1.2))[0])
    with pytest.raises(ValueError, match="SBL requires unknowns='azimuth'; got 'sphere'"):
        PeaksGNN(FLAT, detector="sbl")
