"""Tests of missing readings of signal strength: missing is the same as without the sensor."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.motion_models import ConstantVelocity
from arrivals.trackers import AmplitudePrior, create
from arrivals.trackers.rss.pooled_readings import PooledReadings
from arrivals.typing import Float

PLACES = np.array(
    [[0, 0], [10, 0], [20, 0], [0, 10], [20, 10], [0, 20], [10, 20], [20, 20], [11, 9], [4, 15.0]]
)
TRUTH = np.array([[6.0, 13.0], [16.0, 4.0]])
U = db_to_neper([-48.0, -50.0])
SIGMA = float(db_to_neper(1.5))


def readings(seed: int, n_sources: int, n_steps: int = 4) -> Float:
    model = LogNormalRSS(PLACES, SIGMA, r_min=0.2)
    rng = np.random.default_rng(seed)
    theta = np.broadcast_to(TRUTH[:n_sources], (n_steps, n_sources, 2))
    return model.draw(np.broadcast_to(U[:n_sources], theta.shape[:-1]), theta, rng)


def tracker(name: str, sensors: Any, floor: float | None = None, **params: Any) -> Any:
    noise = None if floor is None else float(db_to_neper(floor))
    model = LogNormalRSS(PLACES[sensors], SIGMA, r_min=0.2, log_noise=noise)
    return create(
        name, motion=ConstantVelocity(0.01), measurement=model, P0=np.diag([400.0, 0.1] * 2),
        amplitude=AmplitudePrior(float(db_to_neper(-50.0)), float(db_to_neper(10.0)) ** 2),
        **params,
    )  # fmt: skip


def assert_same(one: Any, other: Any) -> None:
    for name in ("position", "covariance", "log_amplitude", "existence", "label"):
        np.testing.assert_allclose(
            getattr(one, name), getattr(other, name), rtol=1e-4, atol=1e-4, err_msg=name
        )


@pytest.mark.filterwarnings("ignore:the readings support")  # fewer than asked for
@pytest.mark.parametrize("name", ["rss_vb", "rss_ml"])
@pytest.mark.parametrize("params", [{"births": True}, {}, {"n_sources": 1}, {"n_sources": 2}])
@pytest.mark.parametrize("floor", [None, -90.0])
@settings(max_examples=2, deadline=None)
@given(seed=st.integers(0, 99), sensor=st.integers(0, len(PLACES) - 1), K=st.integers(1, 2))
def test_missing_column_equals_the_network_without_the_sensor(
    name: str, params: dict[str, Any], floor: float | None, seed: int, sensor: int, K: int
) -> None:
    K = params.get("n_sources", K)
    z = readings(seed, K)
    others = np.delete(np.arange(len(PLACES)), sensor)
    missing = z.copy()
    missing[:, sensor] = np.nan
    masked = np.ma.array(z, mask=np.isnan(missing))
    expected = tracker(name, others, floor, **params).run(z[:, others])
    every = slice(None)
    assert_same(tracker(name, every, floor, **params).run(missing), expected)
    for run in tracker(name, every, floor, **params).run_batch([masked, missing.tolist()]):
        assert_same(run, expected)
    assert np.isfinite(expected.position[-1, 0]).all()


def test_infinite_masked_and_none_readings_are_missing() -> None:
    z = readings(0, 1)[0]
    results = []
    for gap in (np.nan, np.inf, -np.inf, None):
        one = z.astype(object)
        one[3] = gap
        result = tracker("rss_vb", slice(None), n_sources=1)
        result.update(one)
        results.append(result.estimate)
    for other in results[1:]:
        assert_same(results[0], other)


def test_step_with_few_readings_starts_no_source() -> None:
    z = readings(0, 2)[:, :5]
    result = tracker("rss_vb", slice(5), births=True)
    result.run(z)
    assert len(result.tracks.label) == 1
    z[:, 2:] = np.nan
    assert tracker("rss_vb", slice(5), births=True).run(z).label.size == 0


def test_more_sources_than_sensors_are_refused() -> None:
    with pytest.raises(ValueError, match="n_sources must be at most 10, the number of sensors"):
        tracker("rss_vb", slice(None), n_sources=40)


def test_time_step_that_overflows_leaves_the_belief_unchanged() -> None:
    result = tracker("rss_vb", slice(None), n_sources=1)
    result.update(readings(0, 1)[0])
    x, P, elapsed = result.x, result.P, result.elapsed
    for dt in (1e200, np.nan, np.inf, -1.0):
        with pytest.raises(ValueError, match="dt must be"):
            result.predict(dt=dt)
    assert result.x is x
    assert result.P is P
    assert result.elapsed == elapsed


def test_covariance_grows_while_readings_are_missing() -> None:
    result = tracker("rss_vb", slice(None), births=True)
    result.run(readings(0, 1))
    before = np.trace(result.estimate.covariance[0])
    result.run([None] * 100)
    assert len(result.estimate.label) == 0 or np.trace(result.estimate.covariance[0]) > 100 * before


def one_reading_a_step(z: Float) -> Float:
    alone = np.full((z.size, z.shape[1]), np.nan)
    each = np.arange(z.size)
    alone[each, each % z.shape[1]] = z.ravel()
    return alone


@pytest.mark.parametrize("params", [{"births": True}, {"n_sources": 1}, {}])
def test_readings_that_arrive_one_by_one_are_searched_together(params: dict[str, Any]) -> None:
    z = one_reading_a_step(readings(1, 1))
    run = tracker("rss_vb", slice(None), **params).run(z, dt=0.05)
    assert (run.label[-1] >= 0).sum() == 1
    np.testing.assert_allclose(run.position[-1][0], TRUTH[0], atol=2.5)
    assert np.isnan(run.position[1]).all()


def test_displacement_ages_the_pooled_readings() -> None:
    pool = PooledReadings.none(2)
    first = np.array([1.0, 2.0]), np.array([4.0, 4.0])
    pool = pool.joined(*first, np.zeros((2, 2)), np.zeros(2)).later(3.0)
    np.testing.assert_allclose(pool.aged(np.array([0.0, np.inf])), [4.0, 0.0])
    after = pool.joined(np.array([9.0, 9.0]), np.array([4.0, 0.0]), np.ones((2, 2)), np.zeros(2))
    np.testing.assert_allclose(after.xi, [9.0, 2.0])  # a change of many deviations
    np.testing.assert_allclose(after.age, [0.0, 3.0])


def test_readings_that_no_model_explains_leave_a_finite_likelihood() -> None:
    few = tracker("rss_vb", slice(2), births=True)
    few.update(readings(0, 1)[0, :2])
    assert few.log_likelihood == 0.0
    assert len(few.estimate.label) == 0
