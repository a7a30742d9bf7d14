"""Subspace trackers: accuracy, missing data, coherent sources, invalid arguments."""

import numpy as np
import pytest
from subspace_scenes import CIRCLE, GAPS, LINE, NAMES, incoherent, noiseless

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios import ar_signals, best_assignment_rmse
from arrivals.trackers import ESPRIT, MUSIC, PAST, RootMUSIC, Tracker, create
from arrivals.typing import Complex

COHERENT = np.deg2rad([-6.0, 9.0])

# accuracy and missing data


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("model", [LINE, GAPS], ids=["line", "gaps"])
def test_directions_without_noise_are_exact(name: str, model: ArraySnapshot) -> None:
    run = create(name, measurement=model, n_sources=3).run(noiseless(model, [0.9, -0.5, 0.1], 600))
    atol = {"music": 2e-4, "past": 1e-6}.get(name, 1e-7)
    np.testing.assert_allclose(run.doa[-1], [-0.5, 0.1, 0.9], atol=atol)


@pytest.mark.parametrize("name", NAMES)
def test_amplitudes_fit_the_last_snapshot(name: str) -> None:
    z, w = incoherent(LINE.replace(noise=1e-6), [-0.5, 0.1])
    run = create(name, measurement=LINE, n_sources=2).run(z)
    np.testing.assert_allclose(run.amplitude[-1], w[-1], atol=0.02)
    np.testing.assert_array_equal(run.label[-1], [-1, -1])


@pytest.mark.parametrize("tracker", [MUSIC(CIRCLE), PAST(CIRCLE, 3, method="music")])
def test_azimuths_of_a_planar_array_cover_the_full_circle(tracker: Tracker) -> None:
    z, _ = incoherent(CIRCLE, [-3.1, 0.4, 2.0], n=300)
    np.testing.assert_allclose(tracker.run(z).doa[-1, :3], [-3.1, 0.4, 2.0], atol=0.01)


@pytest.mark.parametrize("name", NAMES)
def test_failed_sensors_are_left_out(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3], n=500)
    rng = np.random.default_rng(9)
    damaged = np.where(rng.random(z.shape) < 0.1, np.nan, z)
    damaged[200:, 3] = np.nan
    doa = create(name, measurement=LINE, n_sources=2).run(damaged).doa
    np.testing.assert_allclose(doa[-200:], np.tile([-0.4, 0.3], (200, 1)), atol=0.05)


@pytest.mark.parametrize("name", NAMES)
def test_number_of_directions_is_limited_by_the_valid_sensors(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3])
    z[:, 2:] = np.nan
    assert (create(name, measurement=LINE, n_sources=3).run(z).n_found <= 1).all()
    z[:, 1:] = np.nan
    assert (create(name, measurement=LINE, n_sources=3).run(z).n_found == 0).all()


@pytest.mark.parametrize("name", NAMES)
def test_reset_returns_to_the_state_after_construction(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3])
    tracker = create(name, measurement=LINE)
    first = tracker.run(z)
    tracker.reset()  # type: ignore[attr-defined]  # of direction trackers
    assert tracker.estimate.n_found == 0
    np.testing.assert_array_equal(tracker.run(z).doa, first.doa)


@pytest.mark.parametrize("name", NAMES)
def test_directions_change_at_every_interval_only(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3])
    each = create(name, measurement=LINE, n_sources=2).run(z)
    held = create(name, measurement=LINE, n_sources=2, interval=20).run(z)
    assert held.n_found[:19].max() == 0
    np.testing.assert_array_equal(held.doa[19:39], np.tile(each.doa[19], (20, 1)))
    np.testing.assert_array_equal(held.doa[-1], each.doa[-1])


def test_power_is_the_present_spectrum() -> None:
    tracker = MUSIC(LINE, 1, n_directions=181)
    assert np.isnan(tracker.power).all()
    tracker.run(incoherent(LINE, [0.5])[0])
    assert tracker.doa_grid[tracker.power.argmax()] == pytest.approx(0.5, abs=0.02)
    tracker.predict(dt=1e6)
    assert np.isnan(tracker.power).all()


def test_past_restarts_after_a_change_of_the_number_of_sources() -> None:
    tracker = PAST(LINE, 1)
    tracker.run(incoherent(LINE, [-0.4, 0.3])[0])
    tracker.set_params(n_sources=2)
    tracker.run(incoherent(LINE, [-0.4, 0.3])[0])
    np.testing.assert_allclose(tracker.estimate.doa, [-0.4, 0.3], atol=0.02)


# coherent sources


def coherent(model: ArraySnapshot) -> Complex:
    """Return snapshots of a source and its echo, with amplitudes in a fixed ratio."""
    rng = np.random.default_rng(2)
    s = np.exp(2j * np.pi * rng.random((100, 1)))
    return model.simulate(np.tile(COHERENT, (100, 1)), s * [1.0, 0.8j], rng)


@pytest.mark.parametrize("name", ["music", "root_music", "esprit"])
def test_coherent_sources_are_resolved_only_with_smoothing(name: str) -> None:
    z = coherent(LINE)
    raw = create(name, measurement=LINE, n_sources=2).run(z).doa[-1]
    smooth = create(name, measurement=LINE, n_sources=2, smoothing=6, backward=True)
    np.testing.assert_allclose(smooth.run(z).doa[-1], COHERENT, atol=0.01)
    assert not np.allclose(raw, COHERENT, atol=0.05)
    assert create(name, measurement=LINE).run(z).n_found[-1] == 1
    assert create(name, measurement=LINE, smoothing=6).run(z).n_found[-1] == 2


def test_smoothing_does_not_depend_on_the_order_of_sensors() -> None:
    order = np.array([3, 0, 5, 1, 7, 2, 6, 4])
    shuffled = LINE.replace(array=SensorArray(LINE.array.positions[order]))
    z = coherent(LINE)
    straight, mixed = (
        ESPRIT(model, 2, smoothing=5).run(y).doa[-1]
        for model, y in ((LINE, z), (shuffled, z[:, order]))
    )
    np.testing.assert_allclose(mixed, straight, atol=1e-9)


# figures of the specification


def test_errors_at_30_db_equal_the_specification() -> None:
    """Specification, section 7: median of 40 runs 0.26° by ESPRIT and by PAST, λ 0.95."""
    model = ArraySnapshot(SensorArray.symmetric([0.25]), wavelength=1.0, noise=1e-3)
    rng = np.random.default_rng(0)
    doa = np.tile(np.deg2rad([-20.0, 30.0]), (3000, 1))
    s = ar_signals([[0.772, -0.45], [0.96, -0.77]], [0.571, 0.287], 3000, rng)
    z = model.simulate(doa, s, rng)
    for name in ("esprit", "past", "root_music"):
        tracker = create(name, measurement=model, n_sources=2, forgetting=0.95, interval=30)
        estimate = tracker.run(z).doa[1529::30]
        error = np.rad2deg(best_assignment_rmse(doa[1529::30], estimate))
        assert 0.2 < error < 0.33


# invalid arguments


@pytest.mark.parametrize("name", NAMES)
def test_too_many_sources_are_refused_with_the_maximum(name: str) -> None:
    model = ArraySnapshot(SensorArray.ula(3, 0.5), wavelength=1.0)
    create(name, measurement=model, n_sources=2)
    for n_sources in (3, 4):
        with pytest.raises(ValueError, match=f"n_sources must be at most 2 for .* got {n_sources}"):
            create(name, measurement=model, n_sources=n_sources)
    with pytest.raises(ValueError, match="n_sources must be at most 0"):
        create("music", measurement=ArraySnapshot(SensorArray(np.zeros((1, 1))), wavelength=1.0))


@pytest.mark.parametrize("name", ["root_music", "esprit", "past"])
def test_array_without_uniform_grid_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="requires a line of sensors on a uniform grid"):
        create(name, measurement=CIRCLE)
    wide = ArraySnapshot(SensorArray.ula(4, 0.6), wavelength=1.0)
    with pytest.raises(ValueError, match=r"wavelength must be at least 1\.2 m"):
        create(name, measurement=wide)


def test_esprit_refuses_more_sources_than_pairs() -> None:
    sparse = ArraySnapshot(SensorArray(np.array([0.0, 0.5, 2.0, 3.5])), wavelength=1.0)
    with pytest.raises(ValueError, match="at most 1 for ESPRIT on this array of 4 sensors; got 2"):
        ESPRIT(sparse, 2)
    RootMUSIC(sparse, 3)


@pytest.mark.parametrize("params", [{"smoothing": 4}, {"backward": True}])
def test_smoothing_is_refused_without_a_uniform_line(params: dict[str, object]) -> None:
    for model in (CIRCLE, GAPS):
        with pytest.raises(ValueError, match="smoothing requires a uniform line without gaps"):
            create("music", measurement=model, **params)
    with pytest.raises(ValueError, match="of at least 9 sensors; got 8"):
        MUSIC(LINE, smoothing=9)
    with pytest.raises(ValueError, match="n_sources must be at most 3"):
        MUSIC(LINE, 4, smoothing=4)


@pytest.mark.parametrize(
    ("params", "error", "message"),
    [
        ({"n_sources": 0}, ValueError, "n_sources must be at least 1"),
        ({"n_sources": 1.5}, TypeError, "n_sources must be a whole number"),
        ({"n_sources": "bic"}, ValueError, "n_sources must be one of 'aic', 'mdl'"),
        ({"max_sources": 0}, ValueError, "max_sources must be at least 1"),
        ({"forgetting": 1.5}, ValueError, r"forgetting must lie in \[0, 1\]"),
        ({"interval": 0}, ValueError, "interval must be at least 1"),
        ({"measurement": 3}, TypeError, "measurement must be an ArraySnapshot"),
    ],
)
@pytest.mark.parametrize("name", NAMES)
def test_invalid_parameters_are_refused(
    name: str, params: dict[str, object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        create(name, **{"measurement": LINE} | params)


def test_invalid_method_and_backward_are_refused() -> None:
    with pytest.raises(ValueError, match="method must be one of 'esprit', 'root_music', 'music'"):
        PAST(LINE, method="capon")
    with pytest.raises(TypeError, match="backward must be a bool"):
        MUSIC(LINE, backward=1)  # type: ignore[arg-type]
