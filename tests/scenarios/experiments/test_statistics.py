"""Standard errors over runs."""

import numpy as np
import pytest

from arrivals.scenarios.experiments.statistics import (
    jackknife,
    paired_difference,
    standard_error,
)

X = np.random.default_rng(0).standard_normal(1000)


def test_jackknife_of_a_mean_is_its_standard_error() -> None:
    mean, error = jackknife(lambda rows: float(X[rows].mean()), len(X))
    assert mean == pytest.approx(X.mean())
    assert error == pytest.approx(standard_error(X), rel=0.4)  # of 25 groups
    assert jackknife(lambda rows: float(X[rows].mean()), 10)[1] == pytest.approx(
        standard_error(X[:10])  # groups of one run: the same formula
    )


def test_error_of_one_run_is_unknown() -> None:
    assert np.isnan(standard_error(X[:1]))
    assert np.isnan(jackknife(lambda rows: 1.0, 1)[1])
    assert np.isnan(paired_difference({0: 1.0}, {0: 2.0}).error)
