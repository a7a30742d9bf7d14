"""Directions, labels and levels of sparse sources, and the units of time."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.trackers import MixtureSettings, Run, WidebandMixture
from arrivals.trackers.wideband.bin_evidence import scan_response
from arrivals.trackers.wideband.direction_grid import DirectionGrid
from arrivals.typing import Complex, Float

ARRAY = SensorArray.uca(6, radius=0.046, speed=343.0)
LINE = SensorArray.ula(8, spacing=0.04, speed=343.0)
FREQUENCIES = np.arange(500.0, 4000.0, 62.5)


def model_of(array: SensorArray, **others: object) -> ArraySnapshot:
    wavelengths = [array.wavelength(f) for f in FREQUENCIES]
    given = {"noise": 1e-3, "n_snapshots": 8, "noise_coherence": "diffuse"} | others
    return ArraySnapshot(array, wavelengths, **given)  # type: ignore[arg-type]


CIRCLE = model_of(ARRAY)


def sparse(doa: Float, rng: np.random.Generator, model: ArraySnapshot = CIRCLE) -> Complex:
    """Return steps of sources whose power is in few bins and snapshots, as that of speech."""
    doa = np.asarray(doa)
    shape = (len(doa), *model.shape[:-1], doa.shape[1])
    level = rng.exponential(size=shape) ** 3 * (rng.random(shape) < 0.4)
    return model.simulate(doa, level * np.exp(2j * np.pi * rng.random(shape)), rng)


def track(model: ArraySnapshot, z: Complex, **others: object) -> Run:
    return WidebandMixture(model, **others).run(z)  # type: ignore[arg-type]


@pytest.mark.parametrize("array", [ARRAY, LINE], ids=["circle", "line"])
def test_two_sources_one_of_which_moves_keep_their_labels(array: SensorArray) -> None:
    t = np.arange(60)
    doa = np.deg2rad(np.stack([np.full(60, 40.0), -50 + t], axis=1))[:45]
    model = model_of(array)
    run = track(model, sparse(doa, np.random.default_rng(0), model))
    assert np.isfinite(run.doa[5:, :2]).all()
    order = np.argsort(-run.doa[5:, :2], axis=1)
    found = np.take_along_axis(run.doa[5:, :2], order, axis=1)
    labels = np.take_along_axis(run.label[5:, :2], order, axis=1)
    assert np.abs(found - doa[5:]).max() < np.deg2rad(4.0)
    assert (labels == labels[0]).all()
    assert len(set(labels[0])) == 2


@pytest.mark.parametrize("noise", ["white", "diffuse"])
def test_noise_alone_is_no_source(noise: str) -> None:
    model = model_of(ARRAY, noise=1.0, noise_coherence=noise)
    silence = np.full((150, 1), np.nan)
    run = track(model, model.simulate(silence, 0.0, np.random.default_rng(1)))
    assert np.isfinite(run.doa).any(axis=1).mean() <= 0.01


@pytest.mark.parametrize(("pause", "kept"), [(14, True), (30, False)])
def test_label_survives_a_pause_of_two_seconds(pause: int, kept: bool) -> None:
    doa = np.full((40 + pause, 1), 0.7)
    doa[20 : 20 + pause] = np.nan
    run = track(CIRCLE, sparse(doa, np.random.default_rng(2)))
    assert np.isnan(run.doa[22 : 20 + pause]).all()
    assert run.label[18, 0] == 0
    assert (run.label[-1, 0] == 0) == kept


@pytest.mark.parametrize("array", [ARRAY, LINE], ids=["circle", "line"])
def test_label_of_a_source_that_pauses_does_not_pass_to_the_next(array: SensorArray) -> None:
    """Three sources in turn, each for ten steps."""
    doa = np.full((30, 3), np.nan)
    for k, angle in enumerate([0.9, -0.8, 0.1]):
        doa[10 * k : 10 * k + 10, k] = angle
    model = model_of(array)
    run = track(model, sparse(doa, np.random.default_rng(16), model))
    assert run.label[[8, 18, 28], 0].tolist() == [0, 1, 2]


def test_amplitude_is_the_root_of_the_mean_power() -> None:
    rng = np.random.default_rng(3)
    level = rng.exponential(size=(30, *CIRCLE.shape[:-1], 1)) ** 2
    z = CIRCLE.simulate(np.full((30, 1), 0.7), level, rng)
    run = track(CIRCLE, z)
    expected = np.sqrt((level[5:] ** 2).mean(axis=(1, 2, 3)))
    ratio_db = 20 * np.log10(np.abs(run.amplitude[5:, 0]) / expected)
    assert np.abs(np.nanmean(ratio_db)) < 0.7
    louder = track(CIRCLE, 10 * z)
    np.testing.assert_allclose(louder.doa, run.doa, atol=1e-5)
    np.testing.assert_allclose(louder.amplitude, 10 * run.amplitude, rtol=1e-4)


def test_unknown_elevation_does_not_bias_the_azimuth() -> None:
    flat = CIRCLE.replace(array=SensorArray(np.pad(ARRAY.positions, ((0, 0), (0, 1))), speed=343.0))
    high = flat.replace(elevation=np.deg2rad([0.0, 30.0, 60.0]))
    rng = np.random.default_rng(4)
    level = rng.exponential(size=(20, *flat.shape[:-1])) ** 3
    a = high.waves.steering(np.array([0.7]))[2, :, :, 0]  # at 60 degrees
    noise = flat.simulate(np.full((20, 1), np.nan), 0.0, rng)
    z = a[:, None] * level[..., None] + noise
    run = track(high, z)
    assert np.abs(np.nanmean(run.doa[3:, 0]) - 0.7) < np.deg2rad(1.5)
    assert np.isnan(run.doa[3:, 1:]).all()


def test_missing_bins_are_left_out() -> None:
    z = sparse(np.full((12, 1), 0.7), np.random.default_rng(5))
    z[:, 20:] = np.nan
    fewer = CIRCLE.replace(wavelength=CIRCLE.wavelengths[:20])
    one, other = track(CIRCLE, z), track(fewer, z[:, :20])
    np.testing.assert_allclose(one.doa, other.doa, atol=1e-6)
    np.testing.assert_allclose(one.existence, other.existence, atol=1e-6)


def test_step_duration_and_dt_are_one_time() -> None:
    z = sparse(np.full((15, 1), 0.7), np.random.default_rng(6))
    one = WidebandMixture(CIRCLE, step_duration=0.064).run(z)
    other = WidebandMixture(CIRCLE, step_duration=1.0).run(z, dt=0.064)
    for name in ("doa", "std", "existence"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-9)


@pytest.mark.parametrize("n_snapshots", [2, 4, 16])
def test_steps_of_other_lengths_find_the_same_sources(n_snapshots: int) -> None:
    """The settings are per second, so that only `step_duration` differs."""
    z = sparse(np.full((40, 2), [0.7, -1.5]), np.random.default_rng(11))
    by_snapshot = np.swapaxes(z, 1, 2).reshape(-1, n_snapshots, *z.shape[1:2], z.shape[3])
    model = CIRCLE.replace(n_snapshots=n_snapshots)
    run = track(model, np.swapaxes(by_snapshot, 1, 2), step_duration=0.016 * n_snapshots)
    found = np.sort(run.doa[len(run.doa) // 3 :, :2], axis=1)
    assert np.isfinite(found).mean() > 0.97
    assert np.nanmax(np.abs(found - [-1.5, 0.7])) < np.deg2rad(6.0)
    assert len(set(run.label[run.label >= 0])) == 2


def test_two_short_predictions_are_one_long_one() -> None:
    z = sparse(np.full((6, 1), 0.7), np.random.default_rng(7))
    one = WidebandMixture(CIRCLE, step_duration=1.0)
    one.run(z, dt=0.128)
    other = WidebandMixture(CIRCLE, step_duration=1.0)
    other.run(z, dt=0.128)
    one.predict(dt=0.5)
    other.predict(dt=0.2)
    other.predict(dt=0.3)
    # the first of them makes the source inactive, which lets it move anywhere
    assert np.abs(one.sources.density - other.sources.density).max() < 0.05
    np.testing.assert_allclose(one.sources.existence, other.sources.existence, atol=1e-9)
    np.testing.assert_allclose(one.sources.age, other.sources.age)


def test_white_noise_of_a_model_is_replaced_unless_diffuse_is_false() -> None:
    white = CIRCLE.replace(noise_coherence="white")
    z = sparse(np.full((6, 1), 0.7), np.random.default_rng(8))
    as_it_is = track(white, z, settings=MixtureSettings(diffuse=False))
    np.testing.assert_array_equal(track(white, z).std, track(CIRCLE, z).std)
    assert not np.array_equal(as_it_is.std, track(CIRCLE, z).std)


def test_stated_deviation_and_existence_cover_the_errors() -> None:
    """Of far sources without echoes the deviation is wide: T is that of rooms."""
    rng = np.random.default_rng(9)
    run = track(CIRCLE, sparse(np.full((200, 1), -2.0), rng))
    z = (run.doa[5:, 0] + 2.0) / run.std[5:, 0]
    assert (np.abs(z) < 1).mean() > 0.65
    assert (run.existence[5:, 0] > 0.95).mean() > 0.95


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"motion": BernoulliVonMises(still=0.1)}, "still must be 0"),
        ({"step_duration": 0.0}, "step_duration must"),
        ({"settings": {"memory": 1.0}}, "settings must"),
    ],
)
def test_bad_parameters_are_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        WidebandMixture(CIRCLE, **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("end", [0.0, 1.0])
@pytest.mark.parametrize("name", ["background", "birth_share", "birth_existence", "min_share"])
def test_shares_and_existence_may_be_zero_or_one(name: str, end: float) -> None:
    z = sparse(np.full((6, 1), 0.7), np.random.default_rng(12))
    run = track(CIRCLE, z, settings=MixtureSettings().replace(**{name: end}))
    has_births = (name, end) not in {("birth_share", 0.0), ("min_share", 1.0)}
    assert run.doa.shape[1] == has_births
    np.testing.assert_allclose(run.doa[2:], 0.7, atol=0.03)


@pytest.mark.parametrize(("p_activate", "p_deactivate"), [(0.0, 1.0), (1.0, 0.0)])
def test_existence_is_a_probability_however_certain_the_motion(
    p_activate: float, p_deactivate: float
) -> None:
    motion = BernoulliVonMises(sigma_doa=0.1, p_activate=p_activate, p_deactivate=p_deactivate)
    z = sparse(np.full((6, 1), 0.7), np.random.default_rng(13))
    run = track(CIRCLE, z, motion=motion, step_duration=1.0)
    assert 0.5 < run.existence[0, 0] < 1


def test_bins_that_come_and_go_need_no_new_responses() -> None:
    z = sparse(np.full((6, 1), 0.7), np.random.default_rng(14))
    z[np.random.default_rng(15).random(z.shape[:2]) < 0.2] = np.nan
    scan_response.cache_clear()
    run = track(CIRCLE, z)
    assert scan_response.cache_info().misses == 1
    assert run.doa[-1, 0] == pytest.approx(0.7, abs=0.03)


def test_settings_change_while_it_runs_and_a_new_grid_starts_anew() -> None:
    tracker = WidebandMixture(CIRCLE)
    tracker.run(sparse(np.full((6, 1), 0.7), np.random.default_rng(10)))
    tracker.set_params(settings__memory=5.0)
    tracker.predict()
    assert tracker.sources.n == 1
    tracker.set_params(settings__grid_step=np.deg2rad(5.0))
    tracker.predict()
    assert tracker.sources.n == 0
    assert len(tracker.grid.doa) == 72


def test_motion_is_per_unit_of_time_and_the_default_per_second() -> None:
    z = sparse(np.full((15, 1), 0.7), np.random.default_rng(12))
    per_step = BernoulliVonMises(sigma_doa=0.05)
    one = WidebandMixture(CIRCLE, per_step, step_duration=0.128)
    other = WidebandMixture(CIRCLE, per_step, step_duration=0.064)
    for tracker in (one, other):
        tracker.run(z)
        tracker.predict()
    np.testing.assert_allclose(one.x, other.x, atol=0.02)
    grid = one.grid
    assert isinstance(grid, DirectionGrid)
    spread = np.eye(len(grid.doa))[10] @ grid.walk(float(per_step.Q(1.0)[0, 0]))
    assert spread @ grid.offset[10] ** 2 == pytest.approx(0.05**2, rel=0.02)
    trial_like = WidebandMixture(CIRCLE, BernoulliVonMises(sigma_doa=np.deg2rad(3.0),
                                 p_activate=0.05, p_deactivate=0.02)).run(z)  # fmt: skip
    np.testing.assert_allclose(trial_like.doa, track(CIRCLE, z).doa, atol=2e-3)
