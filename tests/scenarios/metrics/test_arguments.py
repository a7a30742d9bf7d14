"""Arguments of metrics and bounds that are missing, endless or of the wrong shape."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, LogNormalRSS, SensorArray
from arrivals.scenarios import best_assignment_rmse, gospa, mean_gospa, nmse, ospa, rmse, sdr
from arrivals.scenarios.bounds.detection import exact_detection, network_detection
from arrivals.scenarios.bounds.signal_strength import rss_bound
from arrivals.scenarios.bounds.snapshot import snapshot_bound
from arrivals.scenarios.experiments.statistics import bootstrap_interval
from arrivals.scenarios.metrics.assignment import matches
from arrivals.scenarios.metrics.consistency import (
    circular_nees,
    coverage,
    position_coverage,
    position_nees,
)
from arrivals.scenarios.metrics.position_errors import assign, huber, scores
from arrivals.typing import Float

NONE = np.zeros(0)
EYE = np.eye(2)[None]
LINE = ArraySnapshot(SensorArray.ula(4, spacing=0.5), wavelength=1.0)
NETWORK = LogNormalRSS([[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]])


def test_empty_sets_have_no_error() -> None:
    assert gospa(NONE, NONE, c=10.0).total == ospa(NONE, NONE, c=10.0) == 0.0
    assert rmse(NONE, [1.0], c=10.0) == 0.0
    assert gospa([np.nan], NONE, c=10.0).total == 0.0
    assert len(matches(np.zeros((2, 0)), np.zeros((2, 3)), c=1.0).error) == 0


@pytest.mark.parametrize(
    "value",
    [
        circular_nees(NONE, NONE),
        coverage(NONE, NONE),
        position_nees(np.zeros((0, 2)), np.zeros((0, 2, 2))),
        position_coverage(np.zeros((0, 2)), np.zeros((0, 2, 2))),
        *bootstrap_interval(NONE),
        *bootstrap_interval(np.array([1.0, np.nan, 2.0])),
    ],
)
def test_no_errors_have_no_average(value: float) -> None:
    assert np.isnan(value)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: circular_nees([np.nan], [1.0]), "error must be finite"),
        (lambda: coverage([np.inf], [1.0]), "error must be finite"),
        (lambda: coverage([0.1], [1.0], level=np.nan), "level must lie in"),
        (lambda: position_nees([[np.nan, 0.0]], EYE), "error must be finite"),
        (lambda: position_coverage([[1e200, 0.0]], EYE), "error must be finite"),
        (lambda: gospa([1e200], [0.0], c=10.0), "truth must be finite"),
        (lambda: gospa([1.0], [2.0], c=1e100, p=2.0), "p must be finite and at least 1"),
        (lambda: gospa([1.0], [2.0], c=10.0, alpha=1e-300), "alpha must be from"),
        (lambda: mean_gospa([], [], c=10.0), "truth and estimate must have the same number"),
        (lambda: matches([[np.inf]], [[1.0]], c=1.0), "truth and estimate must be finite"),
        (lambda: best_assignment_rmse([[1e200]], [[1.0]]), "truth and estimate must be finite"),
        (lambda: huber([]), "errors must be finite, at least one"),
        (lambda: assign(np.zeros((0, 2)), [[1.0, 2.0]]), "theta and truth must have shapes"),
        (lambda: scores(EYE, EYE, [[1.0]], [[1.0, 1.0]]), "u must have shape"),
        (lambda: nmse([[1.0]], [[np.nan]]), "estimate must be finite"),
        (lambda: sdr([[1e-200]], [[1.0]]), "truth must be nonzero"),
        (lambda: exact_detection(1.5, 10, 1.0), "false_alarm must lie in"),
        (lambda: exact_detection(0.1, 0, 1.0), "n_snapshots must be finite and at least 1"),
        (lambda: network_detection(0.1, [1.0, 2.0], [1.0, -1.0]), "snr must be finite"),
        (
            lambda: network_detection(0.1, [1.0, 2.0], [1.0] * 3),
            "false_alarm, weights, snr must have shapes",
        ),
        (lambda: snapshot_bound(LINE, 0.1, [1.0], 0.1), "doa and amplitude must have shape"),
        (lambda: snapshot_bound(LINE, [0.1], [1.0], -0.1), "noise must be finite and not"),
        (lambda: rss_bound(NETWORK, [9.0], [[np.nan, 1.0]]), "theta must be finite"),
        (lambda: rss_bound(NETWORK, [9.0], [1.0, 2.0]), "u and theta must have shapes"),
    ],
)
def test_error_that_is_none_is_refused_in_one_line(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}.*$"):
        call()


def test_bound_with_a_prior_is_lower() -> None:
    def std(**prior: Any) -> Float:
        return rss_bound(NETWORK, [9.2], [[10.0, 25.0]], **prior).position

    assert std(v0=0.1, P0=np.eye(2)) < std(P0=np.eye(2)) < std()
    assert std(P0=[np.eye(2)]) == std(P0=np.eye(2))


def test_masked_truth_is_not_read_as_numbers() -> None:
    masked = np.ma.array([1.0, 99.0], mask=[False, True])
    with pytest.raises(ValueError, match="truth must not be masked"):
        gospa(masked, [1.0], c=10.0)
