"""Walks that may stand still, on points: the scalar form, and mixtures written out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises, MoveStopWalk
from arrivals.symmetric import full, triangle
from arrivals.trackers import SVALSE
from arrivals.trackers.svalse.move_stop_points import (
    PointModes,
    initial,
    mixed,
    predict,
    renewed,
    update,
)
from arrivals.trackers.svalse.point_prediction import step_variance
from arrivals.typing import Float

WALK = MoveStopWalk()
SQUARE = SensorArray(np.stack(np.meshgrid(*[0.5 * np.arange(4)] * 2), axis=-1).reshape(-1, 2))


@given(st.integers(0, 10**6))
def test_one_unknown_is_the_scalar_walk(seed: int) -> None:
    rng = np.random.default_rng(seed)
    variance, Q, R = (10 ** rng.uniform(-4, -1, 3) for _ in range(3))
    scalar, points = WALK.initial(variance), initial(WALK, variance[None])
    for _ in range(4):
        one, other = WALK.predict(scalar, Q), predict(WALK, points, Q[None])
        np.testing.assert_allclose(other.covariance[0], one.variance)
        scalar, points = one.modes, other.modes
        e = rng.normal(0, 0.1, 3)
        one, other = WALK.update(scalar, e, R), update(WALK, points, (e / R)[None], 1 / R[None])
        np.testing.assert_allclose(other.covariance[0], one.variance)
        np.testing.assert_allclose(other.shift[0], one.shift, atol=1e-12)
        np.testing.assert_allclose(other.modes.rows, one.modes, atol=1e-9)
        scalar, points = one.modes, other.modes


def matrices(C: Float) -> Float:
    return np.moveaxis(full(C[:, None]), -1, 0)[0] if C.ndim == 1 else np.moveaxis(full(C), -1, 0)


@given(st.integers(0, 10**6))
def test_update_equals_a_mixture_of_gaussian_updates(seed: int) -> None:
    rng = np.random.default_rng(seed)
    P, R = (
        A @ A.swapaxes(1, 2) + 0.05 * np.eye(2)
        for A in (rng.normal(size=(2, 2, 2)), rng.normal(size=(1, 2, 2)))
    )
    o, w = rng.normal(size=(2, 2)), rng.dirichlet([1.0, 1.0])  # rows are modes
    delta = rng.normal(size=2)
    modes = PointModes(o.T[:, None], triangle(np.moveaxis(P, 0, -1))[:, None], w[None])
    D = np.linalg.inv(R[0])
    new = update(WALK, modes, (D @ delta)[:, None], triangle(D[..., None]))
    # each mode by Kalman's equations, their weights by the likelihoods
    S = P + R
    gain = P @ np.linalg.inv(S)
    mean = o + np.einsum("kij,kj->ki", gain, delta - o)
    cov = P - gain @ P
    quadratic = np.einsum("ki,kij,kj->k", delta - o, np.linalg.inv(S), delta - o)
    log_w = np.log(w) - 0.5 * (np.linalg.slogdet(S)[1] + quadratic)
    w = np.exp(log_w - np.logaddexp.reduce(log_w))
    total = w @ mean
    spread = np.einsum("k,kij->ij", w, cov + np.einsum("ki,kj->kij", mean - total, mean - total))
    np.testing.assert_allclose(new.modes.weight[0], w, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(new.shift[:, 0], total, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(matrices(new.covariance)[0], spread, rtol=1e-6, atol=1e-9)


def test_modes_begin_anew_where_their_mixture_differs() -> None:
    S = np.array([[0.1, 0.2], [0.02, 0.0], [0.1, 0.2]])
    modes = initial(WALK, S)
    other = renewed(WALK, modes, S * [1.0, 3.0])
    np.testing.assert_array_equal(other.covariance[:, 0], modes.covariance[:, 0])
    np.testing.assert_allclose(mixed(other).covariance, S * [1.0, 3.0])


def test_standing_sources_have_smaller_errors_and_deviations() -> None:
    model = ArraySnapshot(SQUARE, 1.0, n_snapshots=5, noise=1.0, unknowns="sphere")
    errors: list[list[float]] = [[], []]
    std: list[list[float]] = [[], []]
    for seed in range(4):
        rng = np.random.default_rng(seed)
        angles = np.full((30, 1), rng.uniform(-3, 3)), np.full((30, 1), rng.uniform(0.3, 1.2))
        w = np.exp(2j * np.pi * rng.random((30, 5, 1)))
        z = model.simulate(angles[0], w, rng, elevation=angles[1])
        for i, still in enumerate((0.1, 0.0)):
            motion = BernoulliVonMises(sigma_doa=np.deg2rad(1.5), still=still)
            run = SVALSE(model, motion).run(z)
            found = run.n_found > 0
            found[:15] = False
            errors[i] += np.abs(run.elevation[found, 0] - angles[1][found, 0]).tolist()
            std[i] += run.covariance[found, 0, 0, 0].tolist()
    assert np.median(errors[0]) < 0.75 * np.median(errors[1])
    assert np.median(std[0]) < 0.75 * np.median(std[1])


def test_step_of_a_concentration_is_that_at_broadside() -> None:
    degrees = np.rad2deg(np.sqrt(step_variance(BernoulliVonMises(), 1.0)))
    assert degrees == pytest.approx(1.5, abs=0.01)
    assert step_variance(BernoulliVonMises(sigma_doa=0.1), 2.0) == pytest.approx(0.02, rel=1e-2)
