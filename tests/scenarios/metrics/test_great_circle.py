"""Metrics along great circles: laws of the sphere, and studies with elevations or ranges."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from two_unknowns import GivenEstimates, range_estimate, run_of, sphere_estimate

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.sphere import azimuth_elevation, unit_vectors
from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios import Trial, create, gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.experiments.estimator import TrackerEstimator
from arrivals.scenarios.experiments.monte_carlo import monte_carlo
from arrivals.scenarios.metrics import METRICS, RANGE_METRICS, label_switches, matches
from arrivals.scenarios.metrics.distances import distances, tangent_errors
from arrivals.trackers import DirectionEstimate, RangeEstimate, SphereEstimate
from arrivals.typing import Float

SPHERE: Any = {"period": 360.0, "distance": "great_circle"}
MODEL = ArraySnapshot(SensorArray.uca(8, radius=0.4), wavelength=1.0)
SEEDS = st.integers(0, 2**32 - 1)


def directions(rng: np.random.Generator, n: int) -> Float:
    """Return azimuths and elevations, degrees, evenly on the sphere: (n, 2)."""
    return degrees(rng.standard_normal((n, 3)))


def degrees(vectors: Float) -> Float:
    return np.rad2deg(np.stack(azimuth_elevation(vectors), axis=-1))


@given(SEEDS, st.integers(0, 4), st.integers(0, 4))
def test_metrics_are_invariant_under_rotations(seed: int, n_true: int, n_found: int) -> None:
    rng = np.random.default_rng(seed)
    truth, estimate = directions(rng, n_true), directions(rng, n_found)
    turn = Rotation.random(random_state=seed % 2**31)

    def values(t: Float, f: Float) -> list[float]:
        return [gospa(t, f, 60.0, **SPHERE).total, ospa(t, f, 60.0, 2.0, **SPHERE),
                rmse(t, f, 60.0, **SPHERE)]  # fmt: skip

    def turned(points: Float) -> Float:
        return degrees(turn.apply(unit_vectors(*np.deg2rad(points).T))) if len(points) else points

    expected = values(truth, estimate)
    assert values(turned(truth), turned(estimate)) == pytest.approx(expected, abs=1e-9)


@given(SEEDS, st.integers(0, 4), st.integers(0, 4))
def test_metrics_on_the_horizon_are_those_of_the_circle(
    seed: int, n_true: int, n_found: int
) -> None:
    rng = np.random.default_rng(seed)
    truth, estimate = rng.uniform(-400, 400, n_true), rng.uniform(-400, 400, n_found)
    flat_truth = np.stack([truth, 0 * truth], axis=1)
    flat = np.stack([estimate, 0 * estimate], axis=1)
    circle = gospa(truth, estimate, c=30, period=360)
    assert gospa(flat_truth, flat, c=30, **SPHERE).total == pytest.approx(circle.total, abs=1e-9)
    pairs = matches(flat_truth[None], flat[None], 30, **SPHERE)
    assert np.abs(pairs.error[:, 1]).sum() == pytest.approx(circle.distance, abs=1e-9)
    np.testing.assert_allclose(pairs.error[:, 0], 0, atol=1e-9)
    error = tangent_errors(flat_truth[:, None], flat, 360.0)[..., 1]
    wrapped = (estimate - truth[:, None] + 180) % 360 - 180
    np.testing.assert_allclose(np.cos(np.deg2rad(error - wrapped)), 1)  # +180 is -180
    np.testing.assert_allclose(np.abs(error), np.abs(wrapped), atol=1e-9)


@given(SEEDS)
def test_distance_is_the_arc_of_the_dot_product_in_any_unit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth, estimate = directions(rng, 3), directions(rng, 2)
    u, v = (unit_vectors(*np.deg2rad(each).T) for each in (truth, estimate))
    expected = np.arccos(np.clip(u @ v.T, -1, 1))
    radians = distances(np.deg2rad(truth), np.deg2rad(estimate), 2 * np.pi, "great_circle")
    np.testing.assert_allclose(radians, expected, atol=1e-7)
    np.testing.assert_allclose(distances(truth, estimate, 360, "great_circle"), np.rad2deg(radians))


def test_opposite_points_and_poles_have_distances() -> None:
    assert distances([[0, 0]], [[180, 0]], 360, "great_circle") == pytest.approx(180)
    assert distances([[0, 90]], [[77, -90]], 360, "great_circle") == pytest.approx(180)
    assert distances([[0, 90]], [[77, 90]], 360, "great_circle") == pytest.approx(0, abs=1e-12)
    assert not tangent_errors(np.array([40.0, 10.0]), np.array([40.0, 10.0]), 360.0).any()


@given(SEEDS)
def test_small_errors_are_differences_of_elevation_and_of_azimuth_on_its_circle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    estimate = np.array([rng.uniform(-180, 180), rng.uniform(-80, 80)])
    step = rng.normal(0, 1e-4, 2)
    error = tangent_errors(estimate - step, estimate, 360.0)
    expected = [step[1], step[0] * np.cos(np.deg2rad(estimate[1]))]
    np.testing.assert_allclose(error, expected, atol=1e-8)


def test_mean_metrics_average_over_the_steps() -> None:
    truth = np.array([[[0, 60], [np.nan, np.nan]], [[0, 60], [90, 0]]])
    estimate = [[[0, 62]], []]
    found = mean_gospa(list(truth), estimate, c=10, **SPHERE)
    assert (found.total, found.distance, found.missed) == pytest.approx((6, 1, 5))
    assert mean_rmse(list(truth), estimate, c=10, **SPHERE) == pytest.approx(6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"period": None}, "period must be the full turn, 360 or 2π, of great circles; got None"),
        ({"distance": "sphere"}, "distance must be one of 'euclidean', 'great_circle'"),
        ({"truth": [[60.0, 120.0]]}, "truth must have elevations within ±90"),
        ({"truth": [[1.0, 2.0, 3.0]], "estimate": [[1.0, 2.0, 3.0]]}, "have azimuth and elevation"),
        ({"truth": [1.0]}, "must have the same dimension; got 1 and 2"),
    ],
)
def test_invalid_arguments_are_refused_in_one_line(arguments: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {"truth": [[0.0, 1.0]], "estimate": [[0.0, 2.0]], "c": 10} | SPHERE
    with pytest.raises(ValueError, match=message) as caught:
        gospa(**(good | arguments))
    assert "\n" not in str(caught.value)
    with pytest.raises(ValueError, match="azimuth and elevation"):
        matches([[1.0]], [[2.0]], 10, **SPHERE)


# studies


def trial(truth: Any, **second: Any) -> Trial:
    """Return a trial of directions, degrees, with an elevation or a range, m."""
    more: Any = {name: np.asarray(each, dtype=float) for name, each in second.items()}
    if "elevation" in more:
        more["elevation"] = np.deg2rad(more["elevation"])
    none = np.zeros((len(np.asarray(truth)), 8), complex)
    return Trial(none, np.deg2rad(truth), MODEL, BernoulliVonMises(), **more)


def test_study_on_the_sphere_is_scored_in_degrees_of_great_circles() -> None:
    one = trial([[0, 100], [0, np.nan]], elevation=[[85, 0], [85, np.nan]])
    run = run_of(
        [sphere_estimate([90, 100], [85, 2]), sphere_estimate(90, 85, [1])], SphereEstimate
    )
    apart = float(distances([[0, 85]], [[90, 85]], 360, "great_circle")[0, 0])
    assert METRICS["distance"](one, run) == pytest.approx((2 * apart + 2) / 2)
    assert METRICS["rmse"](one, run) == pytest.approx((np.sqrt((apart**2 + 4) / 2) + apart) / 2)
    assert METRICS["ospa"](one, run) == pytest.approx(((apart + 2) / 2 + apart) / 2)
    assert METRICS["cardinality"](one, run) == 0
    assert METRICS["label_switches"](one, run) == 1
    assert METRICS["nees"](one, run) == pytest.approx((2 * apart**2 + 4) / 3 / 2, rel=1e-6)
    assert METRICS["coverage95"](one, run) == pytest.approx(1 / 3)


def test_stated_covariances_on_the_sphere_are_calibrated_with_the_errors() -> None:
    rng, n = np.random.default_rng(0), 4000
    covariance = np.deg2rad(1.0) ** 2 * np.array([[4.0, 0.6], [0.6, 0.25]])
    elevation = np.deg2rad(rng.uniform(-75, 75, n))
    error = rng.multivariate_normal([0, 0], covariance, n)
    azimuth = error[:, 1] / np.cos(elevation)
    one = trial(np.zeros((n, 1)), elevation=np.rad2deg(elevation - error[:, 0])[:, None])
    steps = []
    for az, el in zip(azimuth, elevation, strict=True):
        unit = sphere_estimate(np.rad2deg(az), np.rad2deg(el))
        steps.append(replace(unit, covariance=covariance[None]))
    run = run_of(steps, SphereEstimate)
    assert METRICS["nees"](one, run) == pytest.approx(1.0, abs=0.05)
    assert METRICS["coverage68"](one, run) == pytest.approx(0.68, abs=0.03)


@pytest.mark.parametrize(
    ("second", "estimates", "message"),
    [
        ({"elevation": [[10]]}, [range_estimate(0, 10)], "truth has some, a run of RangeEstimates"),
        ({}, [sphere_estimate(0, 10)], "truth has none, a run of SphereEstimates some"),
    ],
)
def test_elevations_of_truth_or_run_alone_are_refused(
    second: Any, estimates: list[DirectionEstimate], message: str
) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        METRICS["gospa"](trial([[0]], **second), run_of(estimates, type(estimates[0])))
    assert "\n" not in str(caught.value)


def test_range_metrics_are_those_of_detected_sources_at_finite_ranges() -> None:
    one = trial([[0, 40, 70, -70]], range=[[10, 20, np.inf, 5]])
    run = run_of([range_estimate([1, 41, 70], [12, np.inf, 30])], RangeEstimate)
    assert RANGE_METRICS["range_error"](one, run) == pytest.approx(0.2)
    assert RANGE_METRICS["range_found"](one, run) == pytest.approx(1 / 2)
    curvature = (1 / 12 - 1 / 10) / (0.1 / 12)  # errors over their deviations
    assert RANGE_METRICS["range_nees"](one, run) == pytest.approx((1 + curvature**2) / 2)
    assert METRICS["distance"](one, run) == pytest.approx(2)
    assert METRICS["missed"](one, run) == 5
    none = run_of([range_estimate([], [])], RangeEstimate)
    assert all(np.isnan(metric(one, none)) for metric in RANGE_METRICS.values())
    with pytest.raises(ValueError, match="the trial's truth has none"):
        RANGE_METRICS["range_error"](trial([[0]]), run)
    with pytest.raises(ValueError, match="a run of SphereEstimates has none"):
        RANGE_METRICS["range_error"](one, run_of([sphere_estimate(0, 1)], SphereEstimate))


def test_study_takes_range_metrics_by_name_and_reports_why_there_is_none() -> None:
    study = monte_carlo("svalse_fig6", ["cbf"], runs=1, metrics=["gospa", "range_error"])
    with pytest.raises(ValueError, match="truth has none"):
        study.mean("range_error", "cbf")


def test_studies_of_scenes_with_two_unknowns_have_all_metrics() -> None:
    names = ["gospa", "nees", "label_switches", *RANGE_METRICS]
    near = monte_carlo([create("near_field", n_steps=4)], ["svalse"], runs=1, metrics=names)
    assert near.mean("gospa", "svalse") < 1
    assert near.mean("range_error", "svalse") < 0.05
    assert near.mean("range_found", "svalse") == 1
    assert 0 < near.mean("range_nees", "svalse") < 5
    sky = monte_carlo([create("sphere", n_steps=4)], ["svalse"], runs=1, metrics=names[:3])
    assert sky.mean("gospa", "svalse") < 6
    assert sky.mean("nees", "svalse") < 5


def test_labels_that_change_along_a_track_on_the_sphere_are_counted() -> None:
    truth = np.array([[[179, 0]], [[-179, 0]], [[-177, 0]]])
    estimate = np.array([[[180, 1]], [[-180, 1]], [[-178, 1]]])
    pairs = matches(truth, estimate, 5, **SPHERE)
    assert len(pairs.step) == 3
    assert label_switches(pairs, [[4], [4], [5]]) == 1


def test_estimator_scores_azimuth_and_elevation_together() -> None:
    tracker = GivenEstimates(sphere_estimate(90, 85), sphere_estimate(0, 88), kind=SphereEstimate)
    tracker.measurement = MODEL  # type: ignore[attr-defined]
    truth = np.deg2rad([[[0.0, 85.0]], [[0.0, 85.0]]])
    apart = float(distances([[0, 85]], [[90, 85]], 360, "great_circle")[0, 0])
    estimator = TrackerEstimator(tracker).fit([])
    with pytest.raises(ValueError, match="must have the same dimension; got 1 and 2"):
        estimator.score([[0, 1]], [truth[..., 0]])
    assert estimator.score([[0, 1]], [truth]) == pytest.approx(-(apart + 3) / 2)
