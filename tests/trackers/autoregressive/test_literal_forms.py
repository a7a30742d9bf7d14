"""Forms of the regression that the report prints: quotients, means, rows as estimated, Huber."""

from typing import Any

import numpy as np
import pytest
from autoregressive_scenes import (
    DOA,
    INWARDS,
    TWO,
    constant,
    make_tracker,
    rmse_deg,
    snapshots,
    sources,
    symmetric_array,
)
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.trackers import ARKalmanQRDRLS
from arrivals.trackers.autoregressive import RegressionSettings
from arrivals.trackers.autoregressive.regressions import directions_of_rows
from arrivals.typing import Complex, Float

N = 3000
FORMS: tuple[dict[str, Any], ...] = (
    {"angles": "ratio"}, {"pairs": "mean"}, {"pairs": "inner"}, {"rows": "estimated"},
    {"huber": 2.0},
)  # fmt: skip


def directions(rows: Float, distances: tuple[float, ...], **form: Any) -> Float:
    manifold = ArrayManifold(SensorArray.symmetric(distances), 1.0)
    before = np.zeros(rows.shape[:-1])
    return directions_of_rows(manifold.pairs_of(rows), before, manifold, RegressionSettings(**form))


@given(st.floats(-1.2, 1.2), st.floats(0.05, 0.5), st.floats(0.1, 10.0))
def test_all_forms_return_the_direction_of_exact_rows_of_any_scale(
    doa: float, d: float, scale: float
) -> None:
    distances = (d / 2, d)
    rows = scale * ArrayManifold(SensorArray.symmetric(distances), 1.0).real_steering([doa])
    for pairs in ("fit", "mean", "inner"):
        found = directions(rows, distances, pairs=pairs)
        np.testing.assert_allclose(found, [doa], atol=1e-7)
        quotient = directions(rows, distances, pairs=pairs, angles="ratio")
        if d * abs(np.sin(doa)) < 0.249:  # where the arctangent is unique
            np.testing.assert_allclose(quotient, [doa], atol=1e-7)
        elif pairs == "mean" and d * abs(np.sin(doa)) > 0.251:
            assert abs(quotient[0] - doa) > 0.1


def test_mean_is_of_the_directions_of_the_pairs_and_inner_skips_it() -> None:
    phases = np.array([[0.3, 0.5]])
    rows = np.concatenate([np.cos(phases), np.ones((1, 1)), np.sin(phases)], axis=-1)
    each = np.arcsin(phases[0] / (2 * np.pi * np.array([0.25, 0.5])))
    assert directions(rows, (0.25, 0.5), pairs="mean")[0] == pytest.approx(each.mean())
    assert directions(rows, (0.25, 0.5), pairs="inner")[0] == pytest.approx(each[0])


def recordings(measurement: ArraySnapshot, runs: int = 4, doa: Float = DOA) -> list[Complex]:
    return [snapshots(measurement, doa, s, n) for n, s in enumerate(sources(TWO, runs, N))]


def errors(measurement: ArraySnapshot, z: list[Complex], **params: Any) -> float:
    tracker = make_tracker(measurement, doa=DOA + INWARDS, forgetting=0.97, **params)
    return rmse_deg(tracker.run_batch(z), constant(DOA, N), 1500)


def test_fit_has_less_error_than_the_mean_and_that_less_than_the_inner_pair() -> None:
    array = symmetric_array(0.1, 0.5)
    z = recordings(array)
    fit, mean, inner = (errors(array, z, pairs=pairs) for pairs in ("fit", "mean", "inner"))
    assert 1.5 * fit < mean < inner / 1.5


def test_rows_put_back_as_estimated_leave_the_directions_at_a_mixture() -> None:
    array = symmetric_array(0.25, snr_db=30.0)
    z = recordings(array)
    assert errors(array, z) < 0.3 < 3.0 < errors(array, z, rows="estimated")


def test_quotient_loses_a_source_beyond_a_quarter_wavelength() -> None:
    array, doa = symmetric_array(0.5), np.deg2rad([-20.0, 45.0])
    z = recordings(array, 2, doa)

    def error(angles: str) -> float:
        tracker = make_tracker(array, doa=doa, angles=angles)
        return rmse_deg(tracker.run_batch(z), constant(doa, N), 1500)

    assert error("atan2") < 0.5 < 20.0 < error("ratio")


@pytest.mark.parametrize("correction", [True, False])
def test_huber_reduces_the_error_by_outliers_and_costs_little_without(correction: bool) -> None:
    array = symmetric_array(0.25, 0.5, snr_db=15.0)
    z = recordings(array)
    rng = np.random.default_rng(0)
    wild = [
        one + 3.0 * (rng.random((N, 1)) < 0.02) * rng.standard_normal((N, 2 * 5)).view(complex)
        for one in z
    ]
    clean, robust_clean, plain, robust = (
        errors(array, data, correction=correction, huber=huber, adapt_measurement_noise=False)
        for data in (z, wild)
        for huber in (None, 2.0)
    )
    assert robust_clean < 1.1 * clean
    assert robust < 0.8 * plain


def test_huber_states_innovation_variances_an_eighth_too_small_without_outliers() -> None:
    array = symmetric_array(0.25)
    z = snapshots(array, DOA, sources(TWO, 1, N)[0])
    q = []
    for huber in (None, 1.5):
        tracker = make_tracker(array, forgetting=0.99, huber=huber)
        tracker.run(z)
        assert tracker.belief is not None
        q.append(tracker.belief.q[0])
    assert np.abs(q[1] / q[0] - 7 / 8).max() < 0.03


def test_forms_without_a_derivation_state_no_deviation() -> None:
    array = symmetric_array(0.25)
    z = recordings(array, 1)[0][:300]
    assert np.isfinite(make_tracker(array, doa=DOA).run(z).std[-1]).all()
    assert np.isfinite(make_tracker(array, doa=DOA, correction=False).run(z).std[-1]).all()
    for form in FORMS:
        tracker = make_tracker(array, doa=DOA, **form)
        run = tracker.run(z)
        assert np.isnan(run.std).all()
        assert np.isnan(tracker.estimate.std).all()
        assert np.isfinite(run.doa).all()
        assert np.isnan(make_tracker(array, **form).run(z).std).all()  # by acquisition


@pytest.mark.parametrize("form", FORMS)
def test_batch_and_gaps_equal_runs_in_every_form(form: dict[str, Any]) -> None:
    array = symmetric_array(0.25, 0.5)
    z = np.array(recordings(array, 2))[:, :600]
    z[1, 100:140, 0] = np.nan
    z[1, 200:260] = np.nan
    tracker = make_tracker(array, doa=DOA + INWARDS, **form)
    for one, run in zip(z, tracker.run_batch(z), strict=True):
        alone = make_tracker(array, doa=DOA + INWARDS, **form).run(one)
        np.testing.assert_allclose(run.doa, alone.doa, atol=1e-9)
        assert np.isfinite(run.doa).all()


@pytest.mark.parametrize(
    ("form", "cure"),
    [({"pairs": "mean"}, "pairs='fit' resolves"), ({"angles": "ratio"}, "angles='atan2' resolves")],
)
def test_form_that_cannot_resolve_outer_pairs_names_the_general_one(
    form: dict[str, Any], cure: str
) -> None:
    wide = symmetric_array(0.5, 1.0)
    with pytest.raises(ValueError, match=cure):
        make_tracker(wide, doa=DOA, **form)
    tracker = make_tracker(wide, doa=DOA)
    with pytest.raises(ValueError, match=cure):
        tracker.set_params(**{f"regression__{name}": value for name, value in form.items()})
    make_tracker(wide, doa=DOA, **form | {"pairs": "inner"})


def test_circle_has_no_pairs_of_rows() -> None:
    circle = ArraySnapshot(SensorArray.uca(5, radius=0.4), 1.0)
    with pytest.raises(ValueError, match=r"must be a line.*svalse takes any array"):
        ARKalmanQRDRLS(circle, regression=RegressionSettings(angles="ratio"))


@pytest.mark.parametrize("name", ["angles", "pairs", "rows"])
def test_unknown_form_lists_the_known_ones(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} must be one of '.*; got 'none'"):
        RegressionSettings(**{name: "none"})  # type: ignore[arg-type]  # unknown
