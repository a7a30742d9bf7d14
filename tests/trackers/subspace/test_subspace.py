"""The subspace methods against closed forms, each other, and what they cannot do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios import ar_signals, best_assignment_rmse
from arrivals.trackers import ESPRIT, MUSIC, PAST, RootMUSIC, Tracker, create
from arrivals.trackers.beamforming.covariance import smoothed
from arrivals.trackers.subspace.base import Subspaces, fitted
from arrivals.trackers.subspace.esprit import esprit_angles, shifted_pairs
from arrivals.trackers.subspace.music import Scan, music_spectrum
from arrivals.trackers.subspace.past import filled, past_step
from arrivals.trackers.subspace.root_music import null_polynomial, root_music_angles
from arrivals.trackers.subspace.source_number import aic, mdl, number_of_sources
from arrivals.typing import Complex

WAX_KAILATH = [21.2359, 2.1717, 1.4279, 1.0979, 1.0544, 0.9432, 0.7324]
NAMES = ("music", "root_music", "esprit", "past")
LINE = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)
GAPS = ArraySnapshot(SensorArray.ula(9, 0.4, missing=[2, 5]), wavelength=1.0, noise=0.01)
CIRCLE = ArraySnapshot(SensorArray.uca(8, radius=0.6), wavelength=1.0, noise=0.01)
COHERENT = np.deg2rad([-6.0, 9.0])


def incoherent(
    model: ArraySnapshot, doa: list[float], n: int = 60, seed: int = 0
) -> tuple[Complex, Complex]:
    """Snapshots of sources whose phases differ from each to each, and their amplitudes."""
    rng = np.random.default_rng(seed)
    w = np.exp(2j * np.pi * rng.random((n, len(doa))))
    return model.simulate(np.tile(doa, (n, 1)), w, rng), w


def noiseless(model: ArraySnapshot, doa: list[float], n: int = 40) -> Complex:
    rng = np.random.default_rng(1)
    w = rng.standard_normal((n, len(doa), 2)) @ np.array([1, 1j])
    return model.wave(np.tile(doa, (n, 1)), w)


def split(theta: list[float], places: ArrayLike) -> Subspaces:
    """The subspaces of waves with electrical angles θ, noise not there."""
    a = np.exp(1j * np.multiply.outer(places, theta))
    Q = np.linalg.qr(a, mode="complete")[0]
    return Subspaces(Q[:, : len(theta)], Q[:, len(theta) :])


# -- how many sources ----------------------------------------------------------------------------


def test_criteria_give_the_example_of_wax_and_kailath() -> None:
    expected_aic = [1180.8, 100.5, 71.4, 75.5, 86.8, 93.2, 96.0]
    expected_mdl = [590.4, 67.2, 66.9, 80.7, 95.5, 105.2, 110.5]
    np.testing.assert_allclose(aic(WAX_KAILATH, 100), expected_aic, atol=0.1)
    np.testing.assert_allclose(mdl(WAX_KAILATH, 100), expected_mdl, atol=0.1)


@given(st.floats(1e-150, 1e150), st.permutations(WAX_KAILATH))
def test_neither_unit_nor_order_of_the_eigenvalues_matters(
    unit: float, values: list[float]
) -> None:
    scaled = unit * np.array(values)
    np.testing.assert_allclose(mdl(scaled, 100), mdl(WAX_KAILATH, 100), rtol=1e-9)


def test_equal_eigenvalues_are_noise_and_batches_are_single_cases() -> None:
    batch = np.array([[3.0, 3.0, 3.0], [9.0, 3.0, 3.0], [90.0, 40.0, 3.0]])
    for criterion in ("aic", "mdl"):
        found = number_of_sources(batch, 80, criterion)
        np.testing.assert_array_equal(found, [0, 1, 2])
        singles = [number_of_sources(values, 80, criterion) for values in batch]
        np.testing.assert_array_equal(found, singles)


def test_fewer_snapshots_than_sensors_show_fewer_sources_than_snapshots() -> None:
    values = [5.0, 4.0, 0.0, 0.0, 0.0]
    assert np.isinf(mdl(values, 2)[2:]).all()
    assert number_of_sources(values, 1) == 0
    assert number_of_sources([1.0, 1.0, 1e-17, 1e-18], 100) == 2  # rounding is not a third


@pytest.mark.parametrize("values", [[], 3.0, [1.0, np.nan]])
def test_what_are_no_eigenvalues_is_refused(values: object) -> None:
    with pytest.raises(ValueError, match="eigenvalues must be finite"):
        mdl(values, 10)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="n_snapshots must be finite and positive"):
        aic([1.0], 0)
    with pytest.raises(ValueError, match="criterion must be one of 'aic', 'mdl'"):
        number_of_sources([1.0], 5, "bic")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("doa", [[], [0.3], [0.3, -0.5], [0.3, -0.5, 0.9]])
def test_mdl_finds_the_number_of_sources_that_sound(name: str, doa: list[float]) -> None:
    z, _ = incoherent(LINE.replace(noise=0.1), doa, n=120)
    run = create(name, measurement=LINE).run(z)
    assert (run.n_found[60:] == len(doa)).mean() > 0.95
    np.testing.assert_allclose(run.doa[-1, : len(doa)], sorted(doa), atol=0.05)


def test_number_follows_sources_that_come_and_go() -> None:
    doa = np.full((250, 2), [0.4, -0.3])
    doa[50:200, 1] = np.nan
    rng = np.random.default_rng(3)
    z = LINE.simulate(doa, np.exp(2j * np.pi * rng.random((250, 2))), rng)
    n_found = MUSIC(LINE, forgetting=0.9).run(z).n_found
    for steps, number in ((slice(30, 50), 2), (slice(150, 200), 1), (slice(210, 250), 2)):
        assert (n_found[steps] == number).mean() > 0.9


# -- kernels -----------------------------------------------------------------------------------


@given(st.lists(st.floats(-3.1, 3.1), min_size=1, max_size=3))
def test_spectrum_is_the_ratio_of_norms_and_one_in_the_noise(theta: list[float]) -> None:
    found = split([0.3, -1.0], np.arange(5))
    A = np.exp(1j * np.outer(theta, np.arange(5)))
    inside = [np.linalg.norm(found.noise.conj().T @ a) ** 2 for a in A]
    expected = 5 / np.maximum(inside, 5e-10)
    np.testing.assert_allclose(music_spectrum(A, found.noise), expected, rtol=1e-6)
    np.testing.assert_allclose(music_spectrum(found.noise.T, found.noise), 1.0)


def test_scan_by_the_smaller_subspace_is_the_spectrum() -> None:
    A = LINE.array.steering_vector(np.linspace(-1.5, 1.5, 91), 1.0)
    rng = np.random.default_rng(0)
    Q = np.linalg.qr(rng.standard_normal((8, 8, 2)) @ np.array([1, 1j]))[0]
    for K in (1, 3, 4, 5, 7):
        scan, found = Scan(LINE.array, 1.0, 91), Subspaces(Q[:, :K], Q[:, K:])
        grid, power = scan.spectrum(found)
        A = LINE.array.steering_vector(grid, 1.0)
        np.testing.assert_allclose(power, music_spectrum(A, found.noise), rtol=1e-9)


@given(st.floats(-3.1, 3.1))
def test_null_polynomial_is_the_null_spectrum_on_the_circle(theta: float) -> None:
    places = np.array([3, 0, 1, 6])  # in any order, with gaps
    rng = np.random.default_rng(4)
    Q = np.linalg.qr(rng.standard_normal((4, 4, 2)) @ np.array([1, 1j]))[0]
    a, E, z = np.exp(1j * theta * places), Q[:, 1:], np.exp(1j * theta)
    expected = np.linalg.norm(E.conj().T @ a) ** 2
    value = np.polyval(null_polynomial(E, places), z) / z**6
    assert value == pytest.approx(expected, abs=1e-9)


@settings(max_examples=50)
@given(st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=3, unique=True))
def test_without_noise_roots_and_turns_are_the_angles(theta: list[float]) -> None:
    gaps = np.diff(sorted([*theta, min(theta) + 2 * np.pi]))
    if gaps.min() < 0.2:
        return
    places = np.arange(6)
    found = split(theta, places)
    roots = np.sort(root_music_angles(found.noise, places, len(theta)))
    turns = np.sort(esprit_angles(found.signal, *shifted_pairs(places, 1)))
    np.testing.assert_allclose(roots, sorted(theta), atol=1e-6)
    np.testing.assert_allclose(turns, sorted(theta), atol=1e-9)


def test_kernels_take_batches() -> None:
    angles = [[0.3, -1.0], [2.0, 0.5]]
    found = [split(theta, np.arange(5)) for theta in angles]
    noise, signal = np.stack([f.noise for f in found]), np.stack([f.signal for f in found])
    A = np.exp(1j * np.outer([0.1, 0.2, 0.3], np.arange(5)))
    first, second = shifted_pairs(np.arange(5), 1)
    for k in range(2):
        one = root_music_angles(noise[k], range(5), 2)
        np.testing.assert_allclose(root_music_angles(noise, range(5), 2)[k], one)
        np.testing.assert_allclose(
            esprit_angles(signal, first, second)[k], esprit_angles(signal[k], first, second)
        )
        np.testing.assert_allclose(music_spectrum(A, noise)[k], music_spectrum(A, noise[k]))


def test_roots_are_where_a_fine_scan_has_its_peaks() -> None:
    z, _ = incoherent(LINE, [0.2, 0.5], n=80)
    doa = RootMUSIC(LINE, 2).run(z).doa[-1]
    fine = MUSIC(LINE, 2, n_directions=20001).run(z).doa[-1]
    np.testing.assert_allclose(doa, fine, atol=2e-3)  # the zeros lie off the circle


def test_fewer_visible_roots_than_sources_leave_nan() -> None:
    found = split([0.2, 2.5], np.arange(3))
    roots = root_music_angles(found.noise, range(3), 2, largest=np.pi / 2)
    assert roots[0] == pytest.approx(0.2)
    assert np.isnan(roots[1])


def past_as_printed(y: Complex, K: int, beta: float) -> Complex:
    """The listing, in plain loops."""
    W, P = np.eye(y.shape[1], K, dtype=complex), np.eye(K, dtype=complex)
    for sample in y:
        z = W.conj().T @ sample
        h = P @ z
        g = h / (beta + np.vdot(z, h))
        P = (P - np.outer(g, h.conj())) / beta
        P = (P + P.conj().T) / 2
        W = W + np.outer(sample - W @ z, g.conj())
    return W


def test_past_step_is_the_listing_and_takes_batches() -> None:
    ys = np.stack([incoherent(LINE, [0.3, -0.5], seed=seed)[0] for seed in (0, 1)])
    W = np.broadcast_to(np.eye(8, 2, dtype=complex), (2, 8, 2))
    P = np.broadcast_to(np.eye(2, dtype=complex), (2, 2, 2))
    for k in range(ys.shape[1]):
        W, P = past_step(W, P, ys[:, k], 0.95)
    for run in range(2):
        np.testing.assert_allclose(W[run], past_as_printed(ys[run], 2, 0.95), atol=1e-10)


def test_past_finds_the_eigenvectors() -> None:
    z, _ = incoherent(LINE, [0.3, -0.5], n=400)
    tracker = PAST(LINE, 2, forgetting=0.99)
    tracker.run(z)
    w = 0.99 ** np.arange(len(z))[::-1]
    U = np.linalg.eigh((w[:, None] * z).T @ z.conj())[1][:, -2:]
    Q = np.linalg.qr(tracker.W)[0]
    cosines = np.linalg.svd(U.conj().T @ Q)[1]
    assert cosines.min() > 1 - 1e-5


def test_past_fills_in_a_missing_sensor() -> None:
    W = np.linalg.qr(LINE.array.steering_vector([0.3, -0.5], 1.0).T)[0]
    y = LINE.wave([0.3, -0.5], [1.0, 2j])
    torn = y.copy()
    torn[[2, 6]] = np.nan
    np.testing.assert_allclose(filled(W, torn), y, atol=1e-12)


def test_past_survives_long_silence_and_a_direction_that_nothing_excites() -> None:
    one = LINE.wave([0.3], [1.0])
    tracker = PAST(LINE, 2, interval=100)
    tracker.run([one] * 100)
    tracker.predict(dt=1e6)
    tracker.run([np.zeros(8)] * 100)
    tracker.run([one] * 30000)
    assert np.isfinite(tracker.inverse).all()
    assert np.abs(tracker.estimate.doa - 0.3).min() < 1e-6


@pytest.mark.parametrize("unit", [1e-120, 1e-5, 1e100])
@pytest.mark.parametrize("name", NAMES)
def test_the_unit_of_the_samples_does_not_matter(name: str, unit: float) -> None:
    z, _ = incoherent(LINE, [0.2, 0.5])
    plain, scaled = (create(name, measurement=LINE).run(y) for y in (z, unit * z))
    np.testing.assert_array_equal(scaled.n_found, plain.n_found)
    np.testing.assert_allclose(scaled.doa, plain.doa, atol=1e-8)


# -- trackers ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("model", [LINE, GAPS], ids=["line", "gaps"])
def test_directions_without_noise_are_exact(name: str, model: ArraySnapshot) -> None:
    run = create(name, measurement=model, n_sources=3).run(noiseless(model, [0.9, -0.5, 0.1], 600))
    atol = {"music": 2e-4, "past": 1e-6}.get(name, 1e-7)
    np.testing.assert_allclose(run.doa[-1], [-0.5, 0.1, 0.9], atol=atol)


@pytest.mark.parametrize("name", NAMES)
def test_amplitudes_are_those_of_the_last_snapshot(name: str) -> None:
    z, w = incoherent(LINE.replace(noise=1e-6), [-0.5, 0.1])
    run = create(name, measurement=LINE, n_sources=2).run(z)
    np.testing.assert_allclose(run.amplitude[-1], w[-1], atol=0.02)
    np.testing.assert_array_equal(run.label[-1], [-1, -1])


def test_fit_is_least_squares_and_shares_between_equal_waves() -> None:
    z, _ = incoherent(LINE, [0.3], n=1)
    A = LINE.array.steering_vector([0.3, -0.2], 1.0)
    expected = np.linalg.lstsq(A.T, z[0], rcond=None)[0]
    np.testing.assert_allclose(fitted(A, z[0]), expected, atol=1e-10)
    one, other = fitted(A[[0, 0]], z[0])
    assert abs(one - other) < 1e-3


@pytest.mark.parametrize("tracker", [MUSIC(CIRCLE), PAST(CIRCLE, 3, method="music")])
def test_azimuths_on_the_full_circle(tracker: Tracker) -> None:
    z, _ = incoherent(CIRCLE, [-3.1, 0.4, 2.0], n=300)
    np.testing.assert_allclose(tracker.run(z).doa[-1, :3], [-3.1, 0.4, 2.0], atol=0.01)


@pytest.mark.parametrize("name", NAMES)
def test_sensors_that_fail_are_left_out(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3], n=500)
    rng = np.random.default_rng(9)
    torn = np.where(rng.random(z.shape) < 0.1, np.nan, z)
    torn[200:, 3] = np.nan
    doa = create(name, measurement=LINE, n_sources=2).run(torn).doa
    np.testing.assert_allclose(doa[-200:], np.tile([-0.4, 0.3], (200, 1)), atol=0.05)


@pytest.mark.parametrize("name", NAMES)
def test_too_few_sensors_left_find_what_they_can(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3])
    z[:, 2:] = np.nan
    assert (create(name, measurement=LINE, n_sources=3).run(z).n_found <= 1).all()
    z[:, 1:] = np.nan
    assert (create(name, measurement=LINE, n_sources=3).run(z).n_found == 0).all()


@pytest.mark.parametrize("name", NAMES)
def test_directions_are_looked_for_each_interval_and_stay_until_then(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3])
    each = create(name, measurement=LINE, n_sources=2).run(z)
    held = create(name, measurement=LINE, n_sources=2, interval=20).run(z)
    assert held.n_found[:19].max() == 0
    np.testing.assert_array_equal(held.doa[19:39], np.tile(each.doa[19], (20, 1)))
    np.testing.assert_array_equal(held.doa[-1], each.doa[-1])


def test_power_is_the_spectrum_of_now() -> None:
    tracker = MUSIC(LINE, 1, n_directions=181)
    assert np.isnan(tracker.power).all()
    tracker.run(incoherent(LINE, [0.5])[0])
    assert tracker.doa_grid[tracker.power.argmax()] == pytest.approx(0.5, abs=0.02)
    tracker.predict(dt=1e6)
    assert np.isnan(tracker.power).all()


def test_a_changed_number_of_sources_starts_past_anew() -> None:
    tracker = PAST(LINE, 1)
    tracker.run(incoherent(LINE, [-0.4, 0.3])[0])
    tracker.set_params(n_sources=2)
    tracker.run(incoherent(LINE, [-0.4, 0.3])[0])
    np.testing.assert_allclose(tracker.estimate.doa, [-0.4, 0.3], atol=0.02)


# -- coherent sources ----------------------------------------------------------------------------


def coherent(model: ArraySnapshot) -> Complex:
    """A source and its echo: amplitudes in a fixed ratio."""
    rng = np.random.default_rng(2)
    s = np.exp(2j * np.pi * rng.random((100, 1)))
    return model.simulate(np.tile(COHERENT, (100, 1)), s * [1.0, 0.8j], rng)


@pytest.mark.parametrize("name", ["music", "root_music", "esprit"])
def test_an_echo_is_told_apart_only_with_smoothing(name: str) -> None:
    z = coherent(LINE)
    raw = create(name, measurement=LINE, n_sources=2).run(z).doa[-1]
    smooth = create(name, measurement=LINE, n_sources=2, smoothing=6, backward=True)
    np.testing.assert_allclose(smooth.run(z).doa[-1], COHERENT, atol=0.01)
    assert not np.allclose(raw, COHERENT, atol=0.05)
    assert create(name, measurement=LINE).run(z).n_found[-1] == 1
    assert create(name, measurement=LINE, smoothing=6).run(z).n_found[-1] == 2


def test_smoothing_takes_the_sensors_in_their_order_on_the_line() -> None:
    order = np.array([3, 0, 5, 1, 7, 2, 6, 4])
    shuffled = LINE.replace(array=SensorArray(LINE.array.positions[order]))
    z = coherent(LINE)
    straight, mixed = (
        ESPRIT(model, 2, smoothing=5).run(y).doa[-1]
        for model, y in ((LINE, z), (shuffled, z[:, order]))
    )
    np.testing.assert_allclose(mixed, straight, atol=1e-9)


def test_smoothed_is_the_mean_over_subarrays_and_keeps_white_noise_white() -> None:
    rng = np.random.default_rng(0)
    y = rng.standard_normal((2, 30, 5, 2)) @ np.array([1, 1j])
    R = np.swapaxes(y, -1, -2) @ y.conj()
    expected = sum(
        np.swapaxes(y[..., s : s + 3], -1, -2) @ y[..., s : s + 3].conj() for s in range(3)
    )
    np.testing.assert_allclose(smoothed(R, 3), expected / 3)
    white = smoothed(np.eye(5, dtype=complex), 3, backward=True)
    np.testing.assert_allclose(white, np.eye(3, dtype=complex))
    both = smoothed(R, 4, backward=True)
    np.testing.assert_allclose(both, both.conj()[..., ::-1, ::-1])
    with pytest.raises(ValueError, match="length must be at most n_sensors, 5; got 6"):
        smoothed(R, 6)


# -- golden figures ------------------------------------------------------------------------------


def test_pair_at_30_db_has_the_specifications_errors() -> None:
    """Spec, section 7: 0.26° by ESPRIT and by PAST, λ .95, the median of 40 runs."""
    model = ArraySnapshot(SensorArray.symmetric([0.25]), wavelength=1.0, noise=1e-3)
    rng = np.random.default_rng(0)
    doa = np.tile(np.deg2rad([-20.0, 30.0]), (3000, 1))
    s = ar_signals([[0.772, -0.45], [0.96, -0.77]], [0.571, 0.287], 3000, rng)
    z = model.simulate(doa, s, rng)
    for name in ("esprit", "past", "root_music"):
        tracker = create(name, measurement=model, n_sources=2, forgetting=0.95, interval=30)
        found = tracker.run(z).doa[1529::30]
        error = np.rad2deg(best_assignment_rmse(doa[1529::30], found))
        assert 0.2 < error < 0.33


# -- what is refused -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_as_many_sources_as_sensors_are_refused_with_the_limit(name: str) -> None:
    model = ArraySnapshot(SensorArray.ula(3, 0.5), wavelength=1.0)
    create(name, measurement=model, n_sources=2)
    for n_sources in (3, 4):
        with pytest.raises(ValueError, match=f"n_sources must be at most 2: .* got {n_sources}"):
            create(name, measurement=model, n_sources=n_sources)
    with pytest.raises(ValueError, match="n_sources must be at most 0"):
        create("music", measurement=ArraySnapshot(SensorArray(np.zeros((1, 1))), wavelength=1.0))


@pytest.mark.parametrize("name", ["root_music", "esprit", "past"])
def test_an_array_that_is_no_grid_line_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="needs a line of sensors on a uniform grid"):
        create(name, measurement=CIRCLE)
    wide = ArraySnapshot(SensorArray.ula(4, 0.6), wavelength=1.0)
    with pytest.raises(ValueError, match="alias limit"):
        create(name, measurement=wide)


def test_esprit_says_how_many_pairs_there_are() -> None:
    sparse = ArraySnapshot(SensorArray(np.array([0.0, 0.5, 2.0, 3.5])), wavelength=1.0)
    with pytest.raises(ValueError, match="ESPRIT no more than 1 on this array of 4; got 2"):
        ESPRIT(sparse, 2)
    RootMUSIC(sparse, 3)


@pytest.mark.parametrize("params", [{"smoothing": 4}, {"backward": True}])
def test_smoothing_is_refused_without_a_uniform_line(params: dict[str, object]) -> None:
    for model in (CIRCLE, GAPS):
        with pytest.raises(ValueError, match="smoothing needs a uniform line without gaps"):
            create("music", measurement=model, **params)
    with pytest.raises(ValueError, match="of at least 9 sensors; this array has 8"):
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
def test_nonsense_is_refused(
    name: str, params: dict[str, object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        create(name, **{"measurement": LINE} | params)


def test_past_refuses_an_unknown_method_and_music_a_backward_that_is_no_bool() -> None:
    with pytest.raises(ValueError, match="method must be one of 'esprit', 'root_music', 'music'"):
        PAST(LINE, method="capon")
    with pytest.raises(TypeError, match="backward must be a bool"):
        MUSIC(LINE, backward=1)  # type: ignore[arg-type]
