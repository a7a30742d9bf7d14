"""Tests of constants that stand for missing readings."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models.signal_strength.fill_values import fill_values, without
from arrivals.recordings.networks import Network, calibrate, read_network
from arrivals.recordings.networks.tracking import locate_sources
from arrivals.typing import Float

PLACES = np.array([[0, 0], [30, 0], [0, 30], [30, 30], [15, 0], [0, 15], [30, 15.0]])
SOURCE = np.array([11.0, 19.0])


def levels(n_steps: int = 6, seed: int = 0) -> Float:
    distance = np.linalg.norm(PLACES - SOURCE, axis=-1)
    noise = np.random.default_rng(seed).standard_normal((n_steps, len(PLACES)))
    return np.asarray(-40.0 - 20 * np.log10(distance) + noise)


@settings(max_examples=50, deadline=None)
@given(
    fill=st.sampled_from([0.0, 100.0, 1000.0, -110.0, -200.0, -999.0]),
    seed=st.integers(0, 999),
    share=st.floats(0.1, 0.5),
)
def test_fill_value_is_found_and_named(fill: float, seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    rss_db = levels(8, seed)
    assert fill_values(rss_db) == []
    assert fill_values(np.round(rss_db)) == []
    at = rng.random(rss_db.shape) < share
    at.flat[:2] = True
    rss_db[at] = fill
    assert fill_values(rss_db) == [fill]
    np.testing.assert_array_equal(np.isnan(without(rss_db, [fill])), at)


def test_two_fill_values_are_both_found() -> None:
    rss_db = levels()
    rss_db[:, 1], rss_db[:, 2] = 100.0, -200.0
    assert sorted(fill_values(rss_db)) == [-200.0, 100.0]


def test_near_source_at_rest_is_no_fill_value() -> None:
    rss_db = np.round(levels())
    rss_db[:, 3] = -20.0
    assert fill_values(rss_db) == []


@pytest.mark.parametrize("fill", [100.0, -200.0])
def test_readers_take_fill_values_as_missing(tmp_path: Path, fill: float) -> None:
    rss_db = levels()
    rss_db[:, [1, 4]] = fill
    file = tmp_path / "n.npz"
    np.savez(file, rss_db=rss_db, sensor_xy=PLACES)
    with pytest.warns(UserWarning, match=f"{fill:g} dB repeats far from all other readings"):
        locate_sources(read_network(file), n_sources=1)
    result = locate_sources(read_network(file, missing=[fill]), n_sources=1)
    np.testing.assert_allclose(result.position[-1][0], SOURCE, atol=5.0)
    np.savez(file, rss_db=np.where(rss_db == fill, 9999.0, rss_db), sensor_xy=PLACES)
    assert np.isnan(read_network(file, missing=[9999.0]).rss_db).sum() == 12
    np.savez(file, rss_db=0 * rss_db + fill, sensor_xy=PLACES)
    with pytest.raises(ValueError, match="rss_db must have a valid reading"):
        read_network(file, missing=[fill])


def test_calibration_warns_of_fill_values_and_needs_no_noise() -> None:
    truth = np.random.default_rng(0).uniform(1, 29, (40, 1, 2))
    distance = np.linalg.norm(truth - PLACES, axis=-1)
    sensors = np.broadcast_to(PLACES, (*distance.shape, 2))
    rss_db = -40.0 - 25 * np.log10(np.maximum(distance, 0.3))
    room = Network(tuple("abcdefg"), np.arange(40.0), rss_db, sensors, truth)
    fitted = calibrate(room)
    assert fitted.r_min == pytest.approx(0.3)
    assert fitted.alpha == pytest.approx(2.5, abs=0.01)
    assert 0 < fitted.sigma < 0.01
    filled = rss_db.copy()
    filled[:, 6] = 100.0
    with pytest.warns(UserWarning, match="missing=.100."):
        calibrate(Network(room.name, room.time, filled, sensors, truth))


def test_calibration_that_does_not_converge_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    import scipy.optimize

    seen = []

    def least_squares(fun: object, x: Float, jac: object, **_: object) -> object:
        seen.append((jac(x), jac(x)))  # type: ignore[operator]
        seen[0][0].data[:] = np.nan  # as a robust loss may weigh it in place
        assert np.isfinite(jac(x).data).all()  # type: ignore[operator]
        return scipy.optimize.OptimizeResult(x=x, success=False, message="no progress")

    monkeypatch.setattr(scipy.optimize, "least_squares", least_squares)
    truth = np.tile(SOURCE, (6, 1, 1))
    sensors = np.broadcast_to(PLACES, (6, 7, 2))
    still = Network(tuple("abcdefg"), np.arange(6.0), levels(), sensors, truth)
    with pytest.raises(ValueError, match="readings that determine the fit: no progress"):
        calibrate(still)
