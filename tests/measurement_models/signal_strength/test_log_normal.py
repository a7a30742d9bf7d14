"""The log-normal model of signal strength: slopes, statistics, filters that it runs in, errors."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.differentiate import jacobian
from scipy.special import logsumexp
from scipy.stats import chi, norm

from arrivals.measurement_models import (
    AveragedEnvelope,
    LogGains,
    LogNormalRSS,
    db_to_neper,
    dbm_to_neper,
    neper_to_db,
)
from arrivals.measurement_models.signal_strength.decibels import neper_to_dbm, watt_to_neper
from arrivals.measurement_models.signal_strength.envelope import (
    envelope_moments,
    log_envelope_moments,
    sample_log_envelope,
)
from arrivals.measurement_models.signal_strength.path_loss import doppler_log_gain
from arrivals.motion_models import CombinedMotion, ConstantVelocity, LinearMotion, RandomWalk
from arrivals.trackers import EKF, UKF, Particle
from arrivals.typing import Float

RNG = np.random.default_rng(1)
PLACES = RNG.uniform(-50.0, 50.0, (12, 2))
NOISE = float(db_to_neper(40.0))
GAINS = RNG.normal(0, 0.1, (2, 12))
TWO = LogNormalRSS(
    PLACES, alpha=3.0, log_noise=NOISE, gains=LogGains(RNG.normal(0, 0.3, 12), GAINS), r_min=2.0,
    position=(0, 1), amplitude=2, n_sources=2,
)  # fmt: skip
STATE = np.array([-20.0, 13.0, 9.2, 31.0, -4.0, 9.0])


# units


@given(st.floats(-300, 300))
def test_decibels_and_nepers_are_a_round_trip(level: float) -> None:
    assert neper_to_db(db_to_neper(level)) == pytest.approx(level, abs=1e-9)
    assert neper_to_dbm(dbm_to_neper(level)) == pytest.approx(level, abs=1e-9)


def test_one_decibel_is_as_the_specification_says() -> None:
    assert db_to_neper(1.0) == pytest.approx(0.115129, abs=1e-6)
    assert db_to_neper(80.0) == pytest.approx(9.210340, abs=1e-6)
    assert db_to_neper(3.0) ** 2 == pytest.approx(0.119293, abs=1e-6)
    assert neper_to_dbm(watt_to_neper(1e-3)) == pytest.approx(0.0, abs=1e-12)


# the model


def test_level_is_the_sum_of_powers() -> None:
    u, theta = TWO.sources(STATE)
    R = np.maximum(np.linalg.norm(theta[:, None] - PLACES, axis=-1), 2.0)
    terms = 2 * (u[:, None] + GAINS) - 3.0 * np.log(R)
    expected = (
        0.5 * logsumexp(np.vstack([terms, np.full(12, 2 * NOISE)]), axis=0) + TWO.gains.offsets
    )
    np.testing.assert_allclose(TWO.h(STATE), expected, rtol=1e-13)


def test_jacobian_is_the_slope() -> None:
    def along(x: Float) -> Float:
        return np.moveaxis(TWO.h(np.moveaxis(x, 0, -1)), -1, 0)

    slope = jacobian(along, STATE, tolerances={"rtol": 1e-10, "atol": 1e-10}).df
    np.testing.assert_allclose(TWO.H(STATE), slope, rtol=1e-6, atol=1e-9)


def test_level_has_no_slope_below_the_least_range() -> None:
    near = LogNormalRSS([[0.0, 0.0]], r_min=5.0, position=(0, 1))
    assert (near.H([3.0, 1.0]) == 0).all()
    assert near.h([3.0, 1.0]) == near.h([0.0, 0.0])


@given(arrays(np.float64, (2, 2), elements=st.floats(-300, 300)), st.floats(-3, 3))
def test_shares_sum_to_less_than_one_and_power_shifts_level(theta: Float, rise: float) -> None:
    u = np.array([9.0, 9.5])
    found = TWO.levels(u, theta)
    assert (found.responsibilities.sum(axis=0) < 1).all()
    quiet = TWO.replace(log_noise=None)
    moved = quiet.levels(u + rise, theta).log_sigma - quiet.levels(u, theta).log_sigma
    np.testing.assert_allclose(moved, rise, atol=1e-12)


def test_leading_axes_are_a_batch() -> None:
    states = STATE + RNG.normal(0, 1, (3, 4, 6))
    each = np.array([[TWO.h(x) for x in row] for row in states])
    np.testing.assert_allclose(TWO.h(states), each, rtol=1e-14)
    assert TWO.sample(states, RNG).shape == (3, 4, 12)


def test_nothing_overflows_at_the_ends_of_the_scale() -> None:
    found = TWO.levels([400.0, -400.0], [[0.0, 0.0], [1.0, 1.0]])
    assert np.isfinite(found.log_sigma).all()
    np.testing.assert_allclose(found.responsibilities[0], 1.0)


def test_silence_is_the_noise() -> None:
    found = TWO.replace(gains__paths=0.0).levels(np.zeros(0), np.zeros((0, 2)))
    np.testing.assert_allclose(found.log_sigma, NOISE)


def test_doppler_gains_are_those_of_the_specification() -> None:
    for speed, db in ((5.0, 0.25), (15.0, 0.8), (30.0, 1.5)):
        gain = neper_to_db(
            doppler_log_gain([speed, 0.0], [0.0, 0.0], [[9.0, 0.0], [-9.0, 0.0]], 343.0)
        )
        np.testing.assert_allclose(gain, [db, -db], atol=0.1)
    with pytest.raises(ValueError, match="slower than the waves"):
        doppler_log_gain([400.0, 0.0], [0.0, 0.0], PLACES, 343.0)


# the statistic: the table of section 2

# N, E[e]/σ, std[e]/σ, bias of ξ, var ξ · 4N, KS: Gaussian e, N(log σ, 1/4N), exact log moments
TABLE = [
    (1, 0.8862, 0.4633, -0.2886, 1.645, 0.047, 0.150, 0.071),
    (2, 0.9400, 0.3412, -0.1352, 1.290, 0.028, 0.102, 0.049),
    (4, 0.9693, 0.2458, -0.0651, 1.135, 0.018, 0.070, 0.034),
    (8, 0.9845, 0.1754, -0.0319, 1.065, 0.012, 0.049, 0.024),
    (16, 0.9922, 0.1245, -0.0158, 1.032, 0.009, 0.034, 0.017),
    (50, 0.9975, 0.0706, -0.0050, 1.010, 0.005, 0.019, 0.009),
    (100, 0.9988, 0.0500, -0.0025, 1.005, 0.003, 0.013, 0.007),
    (1000, 0.9999, 0.0158, -0.0003, 1.001, 0.001, 0.004, 0.002),
]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"N={row[0]}")
def test_moments_and_distances_are_those_of_section_2(row: tuple[float, ...]) -> None:
    N = int(row[0])
    mean, std = envelope_moments(N)
    bias, variance = log_envelope_moments(N)
    got = [mean, std, bias, variance * 4 * N]
    assert got == pytest.approx(list(row[1:5]), abs=6e-4)
    e = np.linspace(max(1e-6, 1 - 6 / np.sqrt(N)), 1 + 6 / np.sqrt(N), 20001)
    exact = chi.cdf(e * np.sqrt(2 * N), 2 * N)
    gaussians = (norm.cdf(e, mean, std), norm.cdf(np.log(e), 0, np.sqrt(1 / (4 * N))),
                 norm.cdf(np.log(e), bias, np.sqrt(variance)))  # fmt: skip
    far = [np.abs(exact - one).max() for one in gaussians]
    assert far == pytest.approx(list(row[5:]), abs=1.1e-3)


def test_drawn_readings_have_the_exact_moments() -> None:
    bias, variance = log_envelope_moments(8)
    drawn = sample_log_envelope(8, (200_000,), np.random.default_rng(0))
    assert drawn.mean() == pytest.approx(float(bias), abs=5 * np.sqrt(float(variance) / 2e5))
    assert drawn.var() == pytest.approx(float(variance), rel=0.02)


def test_exact_moments_are_in_the_gaussian_interface() -> None:
    exact = TWO.replace(sigma__exact_moments=True, sigma__n_snapshots=4)
    bias, variance = log_envelope_moments(4)
    np.testing.assert_allclose(exact.h(STATE) - TWO.h(STATE), bias)
    np.testing.assert_allclose(exact.R, variance * np.eye(12))
    np.testing.assert_allclose(exact.readings(exact.h(STATE)), TWO.readings(TWO.h(STATE)))


def test_measured_data_bring_their_own_variance() -> None:
    known = TWO.replace(sigma=np.linspace(0.5, 0.9, 12))
    np.testing.assert_allclose(known.variance, np.linspace(0.5, 0.9, 12) ** 2)
    z = known.draw(*TWO.sources(np.tile(STATE, (4000, 1))), np.random.default_rng(0))
    np.testing.assert_allclose(z.std(axis=0), np.linspace(0.5, 0.9, 12), rtol=0.06)


# in filters


WALK = ConstantVelocity(q=0.01)
KNOWN = LogNormalRSS(PLACES, log_amplitude=9.2, log_noise=NOISE)
X, P = np.array([10.0, 1.0, -5.0, 0.5]), np.diag([25.0, 1.0, 25.0, 1.0])


def powers(n_steps: int = 25) -> Float:
    rng = np.random.default_rng(2)
    truth = np.array([12.0, 0.8, -8.0, 0.6]) + np.zeros((n_steps, 4))
    for k in range(1, n_steps):
        truth[k] = WALK.f(truth[k - 1])
    return KNOWN.sample(truth, rng)


def test_filterpys_filters_take_it_and_ours_agree() -> None:
    from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

    ekf = ExtendedKalmanFilter(dim_x=4, dim_z=KNOWN.dim_z)
    ekf.x, ekf.P, ekf.F, ekf.Q, ekf.R = X, P, WALK.F(X), WALK.Q(), KNOWN.R
    points = MerweScaledSigmaPoints(4, alpha=0.5, beta=2.0, kappa=-1.0)
    ukf = UnscentedKalmanFilter(4, KNOWN.dim_z, dt=1.0, fx=WALK.f, hx=KNOWN.h, points=points)
    ukf.x, ukf.P, ukf.Q, ukf.R = X, P, WALK.Q(), KNOWN.R
    mine, other = EKF(WALK, KNOWN, X, P), UKF(WALK, KNOWN, X, P, kappa=-1.0)
    for z in powers():
        for filter_ in (ukf, mine, other):
            filter_.predict()
        ekf.predict()
        ekf.update(z, KNOWN.H, KNOWN.h, residual=KNOWN.residual)
        for filter_ in (ukf, mine, other):
            filter_.update(z)
        np.testing.assert_allclose(mine.x, ekf.x, atol=1e-9)
    end = [12.0 + 24 * 0.8, -8.0 + 24 * 0.6]
    for x in (mine.x, other.x, ukf.x):
        np.testing.assert_allclose(x[::2], end, atol=2.0)


def test_two_sources_with_unknown_powers_run_in_the_ekf_and_the_particle_filter() -> None:
    amplitude = LinearMotion([[1.0]], [[1e-4]], names=["log_amplitude"])
    each = CombinedMotion(RandomWalk(q=0.01), amplitude)
    start = STATE + np.array([2.0, -2.0, 0.1, 2.0, 2.0, -0.1])
    model = TWO.replace(gains__paths=0.0, sigma=0.3)
    z = model.sample(np.tile(STATE, (40, 1)), np.random.default_rng(3))
    z[5, 2], z[7] = np.nan, np.nan
    P0 = np.diag([9.0, 9.0, 0.1] * 2)
    pair = CombinedMotion(each, each, names=())
    for tracker in (EKF(pair, model, start, P0),
                    Particle(pair, model, start, P0, n_particles=3000, rng=1)):  # fmt: skip
        x = tracker.run(z).x[-1]
        np.testing.assert_allclose(x, STATE, atol=4.0)


# what it refuses


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"alpha": 0.0}, "alpha must be finite and positive"),
        ({"alpha": -2.0}, "alpha must be finite and positive"),
        ({"sigma": 0.0}, "sigma must be positive"),
        ({"sigma": [0.5, 0.5]}, r"sigma must be a number or have shape \(12,\); got \(2,\)"),
        ({"log_noise": np.inf}, "log_noise must be finite"),
        ({"gains": LogGains(np.zeros(3))}, r"offsets must have shape \(..., 12\)"),
        ({"gains": LogGains(paths=np.zeros(3))}, r"paths must have shape \(..., 12\)"),
        ({"r_min": 0.0}, "r_min must be finite and positive"),
        ({"position": (0, 0)}, "must be different entries"),
        ({"position": (0, 1, 2)}, "must name two entries"),
        ({"position": (0, 2), "amplitude": 0}, "must be different entries"),
        ({"sensors": [[0.0, 0.0, 0.0]]}, "sensors must have shape"),
    ],
)
def test_nonsense_is_refused(params: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        LogNormalRSS(**{"sensors": PLACES} | params)


def test_invalid_parts_are_refused() -> None:
    with pytest.raises(ValueError, match="n_snapshots must be at least 1"):
        AveragedEnvelope(0)
    with pytest.raises(ValueError, match="offsets must be finite"):
        LogGains([np.nan] * 12)
    with pytest.raises(ValueError, match="paths must be finite"):
        LogGains(paths=np.full(12, np.inf))
    with pytest.raises(ValueError, match="offsets must have at most 1 dimensions"):
        LogGains(np.zeros((2, 12)))


def test_models_of_equal_gains_are_equal() -> None:
    same = TWO.replace(gains=LogGains(TWO.gains.offsets, GAINS.copy()))
    assert (same, hash(same)) == (TWO, hash(TWO))
    assert TWO.replace(gains__offsets=0.0) != TWO
    assert LogNormalRSS.from_dict(TWO.to_dict()) == TWO


def test_former_parameters_are_refused_with_their_new_place() -> None:
    with pytest.raises(TypeError, match="'n_snapshots': it is now 'n_snapshots' of 'sigma'"):
        LogNormalRSS(PLACES, n_snapshots=20)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="'log_gain': it is now 'paths' of 'gains'"):
        LogNormalRSS(PLACES, log_gain=GAINS)  # type: ignore[call-arg]


def test_states_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(ValueError, match=r"pass x.ravel\(\)"):
        TWO.h(STATE[:, None])
    with pytest.raises(ValueError, match=r"states must have shape \(..., 2 n\), n at least 3"):
        TWO.h(STATE[:4])
    with pytest.raises(ValueError, match=r"x must have shape \(n,\); got \(2, 6\)"):
        TWO.H(np.zeros((2, 6)))


@pytest.mark.parametrize("level", [-71.5, 85.0])
def test_readings_in_another_unit_are_told_by_their_size(level: float) -> None:
    with pytest.raises(ValueError, match=r"in neper, within ±40; got .*db_to_neper"):
        TWO.readings(np.full(12, level))


def test_readings_far_below_the_noise_are_in_another_unit_too() -> None:
    z = np.full(12, 6.0)
    z[3] = -20.0
    with pytest.raises(ValueError, match="dB below the noise: readings are in neper"):
        TWO.readings(z)
    with pytest.raises(ValueError, match=r"readings must have shape \(..., 12\)"):
        TWO.readings(z[:5])


def test_equal_numbers_make_equal_models() -> None:
    assert TWO.replace() == TWO
    assert hash(TWO) == hash(TWO.replace())
    assert TWO.replace(alpha=2.0) != TWO
    assert TWO != 3
