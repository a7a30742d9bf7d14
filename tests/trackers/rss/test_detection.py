"""Tests of detection: best places over rooms and seeds, sensors on a line, relocation."""

from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.motion_models import ConstantVelocity
from arrivals.trackers import AmplitudePrior, create
from arrivals.trackers.rss.mirror import Line
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior, best_amplitudes
from arrivals.typing import Float

DB = float(db_to_neper(1.0))


def tracker(places: Float, size: float, name: str = "rss_vb", **params: Any) -> Any:
    return create(
        name, motion=ConstantVelocity(1e-6 * size**2),
        measurement=LogNormalRSS(places, 1.5 * DB, r_min=size / 100),
        P0=np.diag([size**2, (0.01 * size) ** 2] * 2),
        amplitude=AmplitudePrior(-45 * DB, (10 * DB) ** 2), **params,
    )  # fmt: skip


def levels(places: Float, source: Float, n_steps: int, rng: np.random.Generator) -> Float:
    distance = np.linalg.norm(places - source, axis=-1)
    noise = rng.standard_normal((n_steps, len(places)))
    return db_to_neper(-50.0 - 20 * np.log10(distance) + noise)


@pytest.mark.parametrize("size", [5.0, 500.0])
@pytest.mark.parametrize("params", [{"n_sources": 1}, {"births": True}])
def test_detection_finds_the_place_in_rooms_of_any_size(size: float, params: Any) -> None:
    for seed in range(6):
        rng = np.random.default_rng([seed, 3])
        corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1.0]])
        places = size * np.concatenate([corners, rng.uniform(0.1, 0.9, (1 + seed, 2))])
        source = size * rng.uniform(0.1, 0.9, 2)
        run = tracker(places, size, **params).run(levels(places, source, 5, rng))
        position = run.position[-1][run.label[-1] >= 0]
        assert len(position) == 1
        assert np.linalg.norm(position[0] - source) < size / 4


def test_best_amplitudes_equal_a_fine_search() -> None:
    rng = np.random.default_rng(0)
    new = NewSourcePrior(mu=1.0, v=1.4, centre=np.zeros(2), std=1.0, step=1.0)
    xi, W, loss = rng.normal(0, 1, 6), np.full(6, 30.0), rng.uniform(0, 3, (5, 6))
    fine = np.linspace(-4, 6, 20_001)
    for floor in (np.full(6, -np.inf), rng.normal(-1, 1, 6)):
        u, cost = best_amplitudes(xi, W, floor, loss, new)
        for k in range(5):
            r = xi - 0.5 * np.logaddexp(2 * floor, 2 * (fine[:, None] - loss[k]))
            expected = (r * r) @ W + (fine - new.mu) ** 2 / new.v
            assert cost[k] <= expected.min() + 1e-2
            assert u[k] == pytest.approx(fine[expected.argmin()], abs=1e-2)


@pytest.mark.parametrize("params", [{"n_sources": 1}, {"births": True}])
@pytest.mark.parametrize("name", ["rss_vb", "rss_ml"])
def test_sensors_on_a_line_warn_and_the_covariance_contains_the_mirror_image(
    params: dict[str, Any], name: str
) -> None:
    rng = np.random.default_rng(5)
    angle = 0.6
    along, across = np.array([np.cos(angle), np.sin(angle)]), [-np.sin(angle), np.cos(angle)]
    places = 40.0 + np.arange(0.0, 50.0, 10.0)[:, None] * along
    sides = np.array([[1.0], [-1.0]]) * 8.0 * np.array(across) + 40.0 + 22.0 * along
    result = tracker(places, 50.0, name, **params)
    z = levels(places, sides[0], 6, rng)
    with pytest.warns(UserWarning, match="mirror image"):
        result.run(z)
    estimate = result.estimate
    P = np.linalg.inv(estimate.covariance[0])
    for side in sides:
        step = side - estimate.position[0]
        assert step @ P @ step < 9.0
    with_them = [result.run_batch([z[:2]])[0].covariance[-1, 0], result.run(z[:2]).covariance[-1]]
    np.testing.assert_allclose(with_them[0], np.reshape(with_them[1], (-1, 2, 2))[0])


def test_reading_off_the_line_resolves_the_mirror_image() -> None:
    places = np.array([[0, 0], [10, 0], [20, 0], [30, 0], [40, 0], [20, 15.0]])
    z = levels(places, np.array([22.0, 8.0]), 6, np.random.default_rng(0))
    z[0, 5] = np.nan
    result = tracker(places, 50.0, n_sources=1)
    with pytest.warns(UserWarning, match="mirror image"):
        result.update(z[0])
    assert result.estimate.covariance[0, 1, 1] > 36.0
    result.run(z[1:])
    assert result.estimate.covariance[0, 1, 1] < 9.0
    np.testing.assert_allclose(result.estimate.position[0], [22.0, 8.0], atol=4.0)


def test_lines_are_found_in_any_coordinates() -> None:
    places = np.array([[5e5, 4.9e6]]) + np.arange(4.0)[:, None] * [3.0, 4.0]
    line = Line.through(places)
    assert line is not None
    np.testing.assert_allclose(line.normal, [-0.8, 0.6], atol=1e-6)
    assert line.contains(places[:1])
    assert not line.contains(places[:1] + 3.0)
    assert Line.through(places[:1]) is None
