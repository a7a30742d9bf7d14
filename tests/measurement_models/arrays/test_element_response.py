"""Gains of directional and measured elements."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import ElementResponse


@settings(deadline=None)
@given(st.floats(-7, 7), st.integers(0, 1))
def test_gains_interpolate_their_table_with_its_slope(azimuth: float, even: int) -> None:
    gains = np.random.default_rng(5).normal(size=(7 + even, 3, 2)) @ np.array([1, 0.5j])
    response = ElementResponse(gains)
    np.testing.assert_allclose(response(2 * np.pi * np.arange(7 + even) / (7 + even))[0], gains,
                               atol=1e-12)  # fmt: skip
    slope = (response(azimuth + 1e-6) - response(azimuth - 1e-6)) / 2e-6
    np.testing.assert_allclose(response(azimuth, slope=True), slope, atol=1e-6)


def test_first_order_elements_are_omni_plus_cosine() -> None:
    facing, omni = np.array([0.3, 2.0]), np.array([0.5, 1.0])
    result = ElementResponse.first_order(facing, omni)(1.1)[0]
    np.testing.assert_allclose(result, omni + (1 - omni) * np.cos(1.1 - facing), atol=1e-12)


@pytest.mark.parametrize(
    ("gains", "message"),
    [
        (np.ones(3), r"gains must have shape \(n_angles, n_sensors\)"),
        (np.ones((2, 0)), r"got \(2, 0\)"),
        ([[np.nan]], "gains must be finite"),
        ([["loud"]], "gains must be numbers"),
    ],
)
def test_invalid_gains_are_refused(gains: Any, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        ElementResponse(gains)
