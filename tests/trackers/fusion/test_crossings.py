"""Crossings of bearings: golden numbers, the posterior, invariances, singular geometry."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from arrivals.measurement_models import Bearing
from arrivals.trackers.fusion.births.crossings import crossing
from arrivals.typing import Float

STATIONS = np.array([[0.0, 0.0], [1000.0, 0.0], [500.0, 900.0]])
ERRORS = np.deg2rad([0.5, -0.3, 0.2])
VARIANCE = np.full(3, np.deg2rad(1.0) ** 2)
BEARINGS = Bearing(STATIONS, 1.0, position=(0, 1))
inside = st.floats(150, 750)


def test_crossing_of_golden_bearings() -> None:
    x, C, e = crossing(STATIONS, BEARINGS.h([400.0, 300.0]) + ERRORS, VARIANCE)
    np.testing.assert_allclose(x, [401.320711, 304.989141], rtol=1e-8)
    expected = [[74.46035477057674, 24.84365884752051], [24.84365884752051, 78.68488303919189]]
    np.testing.assert_allclose(C, expected, rtol=1e-7)
    assert (e * e / VARIANCE).sum() == pytest.approx(0.05950325085615385, rel=1e-7)


@given(inside, st.floats(100, 500))
def test_exact_bearings_cross_at_the_source(x: float, y: float) -> None:
    azimuth = BEARINGS.h([x, y])
    if np.abs(np.sin(azimuth[:, None] - azimuth)).max() > 0.2:
        found, C, e = crossing(STATIONS, azimuth, VARIANCE)
        np.testing.assert_allclose(found, [x, y], atol=1e-6)
        np.testing.assert_allclose(e, 0, atol=1e-9)
        H = BEARINGS.H([x, y])
        np.testing.assert_allclose(C, np.linalg.inv(H.T @ H) * VARIANCE[0], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_crossing_minimizes_the_weighted_squared_residuals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    variance = np.deg2rad(rng.uniform(0.3, 2.0, 3)) ** 2
    source = rng.uniform(250, 600, 2)
    z = BEARINGS.h(source) + np.sqrt(variance) * rng.standard_normal(3)

    def scaled(x: Float) -> Float:
        return np.asarray(BEARINGS.residual(z, BEARINGS.h(x)) / np.sqrt(variance))

    best = least_squares(scaled, source, x_scale=100.0, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    x, _, e = crossing(STATIONS, z, variance, n_steps=8)
    # Gauss-Newton converges linearly: residuals of 1° at 45° leave about 1e-3 of each error
    np.testing.assert_allclose(x, best.x, atol=1e-3)
    assert (e * e / variance).sum() == pytest.approx(2 * best.cost, rel=1e-6)


@given(st.floats(-3, 3), inside, st.floats(150, 500))
def test_turned_map_turns_the_crossing(turn: float, x: float, y: float) -> None:
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    azimuth = BEARINGS.h([x, y]) + ERRORS
    one, C, e = crossing(STATIONS, azimuth, VARIANCE)
    other, turned, same = crossing(STATIONS @ R.T, azimuth + turn, VARIANCE)
    if np.isfinite(one).all() and np.linalg.eigvalsh(C).max() < 1e4:
        np.testing.assert_allclose(other, R @ one, atol=1e-4)
        np.testing.assert_allclose(turned, R @ C @ R.T, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(same, e, atol=1e-8)


def test_station_of_infinite_variance_does_not_count_but_has_a_residual() -> None:
    azimuth = BEARINGS.h([400.0, 300.0]) + ERRORS
    variance = np.array([VARIANCE[0], VARIANCE[1], np.inf])
    x, C, e = crossing(STATIONS, azimuth, variance)
    pair, C_pair, _ = crossing(STATIONS[:2], azimuth[:2], VARIANCE[:2])
    np.testing.assert_allclose(x, pair)
    np.testing.assert_allclose(C, C_pair)
    expected = BEARINGS.residual(azimuth, BEARINGS.h(pair))
    np.testing.assert_allclose(e, expected, atol=1e-12)
    assert abs(e[2]) > 1e-3


def test_batch_of_sets_equals_each_by_itself() -> None:
    rng = np.random.default_rng(0)
    azimuth = BEARINGS.h(rng.uniform(200, 600, (4, 5, 2))) + 0.01 * rng.standard_normal((4, 5, 3))
    variance = np.where(rng.random((4, 5, 3)) < 0.2, np.inf, VARIANCE)
    x, C, e = crossing(STATIONS, azimuth, variance)
    assert (x.shape, C.shape, e.shape) == ((4, 5, 2), (4, 5, 2, 2), (4, 5, 3))
    for index in np.ndindex(4, 5):
        one = crossing(STATIONS, azimuth[index], variance[index])
        for found, expected in zip((x, C, e), one, strict=True):
            np.testing.assert_allclose(found[index], expected, rtol=1e-9)


def test_variance_of_a_position_counts_by_the_squared_range() -> None:
    x, C, _ = crossing(STATIONS, BEARINGS.h([400.0, 300.0]), VARIANCE, position_variance=100.0)
    r2 = ((x - STATIONS) ** 2).sum(axis=1)
    H = BEARINGS.H(x)
    expected = np.linalg.inv(H.T @ np.diag(1 / (VARIANCE + 100 / r2)) @ H)
    np.testing.assert_allclose(C, expected, rtol=1e-6)
    each, same, _ = crossing(
        STATIONS, BEARINGS.h([400.0, 300.0]), VARIANCE, position_variance=[100.0, 100.0, 100.0]
    )
    np.testing.assert_array_equal(same, C)
    np.testing.assert_array_equal(each, x)


@pytest.mark.parametrize(
    ("azimuth", "variance"),
    [
        ([0.3, 0.3, 0.3], VARIANCE),
        ([0.3, 0.3 + np.pi, 0.3], VARIANCE),
        ([0.3, 1.2, 0.9], [VARIANCE[0], np.inf, np.inf]),
        ([0.3, 1.2, 0.9], np.full(3, np.inf)),
        ([0.3, np.nan, 0.9], VARIANCE),
    ],
    ids=["parallel", "antiparallel", "one", "none", "nan"],
)
def test_singular_geometry_is_nan_without_a_warning(azimuth: Float, variance: Float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        x, C, _ = crossing(STATIONS, azimuth, variance)
    assert np.isnan(x).all()
    assert np.isnan(C).all()


def test_singular_set_leaves_the_others_of_a_batch_alone() -> None:
    azimuth = np.stack([BEARINGS.h([400.0, 300.0]), [0.3, 0.3, 0.3]])
    x, _, _ = crossing(STATIONS, azimuth, VARIANCE)
    np.testing.assert_allclose(x[0], [400, 300], atol=1e-6)
    assert np.isnan(x[1]).all()
