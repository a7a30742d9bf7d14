"""Kernels of Gaussian beliefs: special updates equal the general one, batches single calls."""

import numpy as np
import pytest

from arrivals.trackers.gaussian.equations import (
    predict_gaussian,
    smooth_gaussian,
    update_gaussian,
    update_leading,
    update_scalar,
)
from arrivals.trackers.gaussian.linalg import inverse, inverse_2x2, symmetric, transposed
from arrivals.typing import Float

N, M = 3, 4
LEADS = [(), (5,), (2, 3)]
every_lead = pytest.mark.parametrize("lead", LEADS)


def covariances(rng: np.random.Generator, lead: tuple[int, ...], n: int = N) -> Float:
    A = rng.normal(size=(*lead, n, n))
    return symmetric(A @ transposed(A) + np.eye(n))


def close(a: Float, b: Float) -> None:
    np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-12)


@every_lead
def test_update_scalar_equals_update_of_the_first_entry(lead: tuple[int, ...]) -> None:
    rng = np.random.default_rng(0)
    x, P = rng.normal(size=(*lead, N)), covariances(rng, lead)
    y, h = rng.normal(size=(2, *lead, M))
    r = np.exp(rng.normal(size=lead))
    H = np.zeros((*lead, M, N))
    H[..., 0] = h
    expected = update_gaussian(x, P, y, H, r[..., None, None] * np.eye(M))
    x, P = update_scalar(x, P, y, h, r)
    close(x, expected.x)
    close(P, expected.P)


@every_lead
def test_update_leading_equals_update_of_the_leading_entries(lead: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    P, A = covariances(rng, lead), rng.normal(size=(*lead, M, 2))
    r = np.exp(rng.normal(size=(*lead, 1, 1)))
    H = np.concatenate([A, np.zeros((*lead, M, N - 2))], axis=-1)
    expected = update_gaussian(np.zeros((*lead, N)), P, np.zeros((*lead, M)), H, r * np.eye(M))
    K, P = update_leading(P, A, r)
    close(K, expected.K)
    close(P, expected.P)


@every_lead
def test_smooth_gaussian_of_a_measured_part_equals_its_update(lead: tuple[int, ...]) -> None:
    rng = np.random.default_rng(2)
    x, P = rng.normal(size=(*lead, N)), covariances(rng, lead)
    y, R = rng.normal(size=(*lead, 2)), covariances(rng, lead, 2)
    expected = update_gaussian(x, P, y, np.eye(2, N), R)
    G = P[..., :2] @ inverse_2x2(P[..., :2, :2])
    dx = expected.x[..., :2] - x[..., :2]
    dP = expected.P[..., :2, :2] - P[..., :2, :2]
    x, P = smooth_gaussian(x, P, G, dx, dP)
    close(x, expected.x)
    close(P, expected.P)


def test_leading_axes_equal_single_calls() -> None:
    rng = np.random.default_rng(3)
    x, P = rng.normal(size=(5, N)), covariances(rng, (5,))
    F, Q, H, R = rng.normal(size=(N, N)), np.eye(N), rng.normal(size=(M, N)), np.eye(M)
    y, missing = rng.normal(size=(5, M)), rng.random((5, M)) < 0.3
    batch = update_gaussian(x, predict_gaussian(P, F, Q), y, H, R, missing)
    for k in range(5):
        one = update_gaussian(x[k], predict_gaussian(P[k], F, Q), y[k], H, R, missing[k])
        for a, b in zip(batch[:8], one[:8], strict=True):
            close(a[k], b)
        close(inverse(P)[k], inverse(P[k]))
