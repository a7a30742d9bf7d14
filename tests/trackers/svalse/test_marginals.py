"""Marginal variances, existence with unknown noise, and walks that may stand still."""

from typing import Any

import numpy as np
import pytest
from newton_states import evaluation_of, unit
from scipy.stats import t as student

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.motion_models import BernoulliVonMises
from arrivals.motion_models.bessel import log_i0
from arrivals.scenarios import create, mean_gospa
from arrivals.trackers import SVALSE
from arrivals.trackers.marginal_variances import student_factor
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.marginals import component_covariances, marginals, noise_factor
from arrivals.trackers.svalse.newton.step import newton_step
from arrivals.typing import Float

M = 9
RESPONSE = ExpectedResponse(UniformLineManifold(np.arange(M), step=np.pi, origin=4.0))
THETA, KAPPA = np.array([-1.2, 0.3, 0.9]), np.array([400.0, 0.0, 100.0])
LINE = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0)
STEP = np.deg2rad(1.5)


@pytest.fixture(scope="module")
def solved() -> Evaluation:
    """A fixed snapshot of three sources, two with a prior, after 60 Newton steps."""
    i = np.arange(M)
    y = np.array([1.0, 0.8j, -0.6 + 0.3j]) @ np.exp(1j * np.outer(THETA, i - 4))
    y = y + 0.15 * np.exp(1j * (1.7 * i**2 + 0.4)) * np.cos(i + 0.5)
    components = Components.zeros(1, 3)
    components.mu[0], components.variance[0] = THETA, 0.002
    components.prior_mu[0], components.prior_kappa[0] = [-1.18, 0.0, 0.93], KAPPA
    components.log_odds[0] = np.log([3.0, 1 / 9, 3.0])
    components.kl_constant[0] = np.log(2 * np.pi) + log_i0(KAPPA)
    state = evaluate(
        RESPONSE, unit(y)[None, None, :, None], components, np.array([3]), np.full((1, 1), 0.02),
        np.full((1, 1), 0.4), np.zeros(1),
    )  # fmt: skip
    for _ in range(60):
        state = newton_step(RESPONSE, state, np.array([True]))
    return state


def test_marginals_equal_the_specification(solved: Evaluation) -> None:
    result = marginals(RESPONSE, solved, kl_weight=0.5)
    for name, expected in {
        "covariance": [0.011587, 0.023324, 0.027124],
        "stated_covariance": [0.012723, 0.025762, 0.029720],
    }.items():
        np.testing.assert_allclose(np.sqrt(getattr(result, name)[0, 0]), expected, rtol=1e-4)
    np.testing.assert_allclose(result.log_odds[0], [22.3745, 13.7225, 17.4355], rtol=1e-4)


def test_variances_equal_those_of_the_exact_posterior(solved: Evaluation) -> None:
    """Angles on a grid, amplitudes integrated out, the noise known: within 1 % (Laplace)."""
    nu, tau = float(solved.nu[0, 0]), float(solved.tau[0, 0])
    std = np.sqrt(component_covariances(RESPONSE, solved)[0, 0])
    axes = [
        m + np.linspace(-6, 6, 41) * s for m, s in zip(solved.components.mu[0], std, strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    A = np.exp(1j * (np.arange(M) - 4)[:, None] * grid[:, None, :])
    J = A.conj().swapaxes(1, 2) @ A + nu / tau * np.eye(3)
    h = (A.conj() * solved.Y[0, 0]).sum(axis=1)
    explained = (h.conj() * np.linalg.solve(J, h[..., None])[..., 0]).real.sum(axis=1)
    log_p = explained / nu - np.linalg.slogdet(J)[1]
    log_p = log_p + (KAPPA * np.cos(grid - [-1.18, 0.0, 0.93])).sum(axis=1)
    p = np.exp(log_p - log_p.max())
    p = p / p.sum()
    exact = np.sqrt(p @ (grid - p @ grid) ** 2)
    np.testing.assert_allclose(std, exact, rtol=0.01)
    assert (np.sqrt(solved.components.variance[0]) < exact).all()


def test_unused_slots_change_nothing(solved: Evaluation) -> None:
    components = Components(np.concatenate([solved.components.packed, np.zeros((1, 7, 2))], axis=2))
    larger = evaluate(RESPONSE, solved.Y, components, solved.K, solved.nu, solved.tau, np.zeros(1))
    result, expected = (marginals(RESPONSE, each, 0.5) for each in (larger, solved))
    for name in ("covariance", "stated_covariance", "log_odds"):
        np.testing.assert_allclose(
            getattr(result, name)[..., :3], getattr(expected, name), rtol=1e-9
        )


def test_separated_sources_have_the_variances_of_the_bound() -> None:
    """Far apart and loud, angles are not coupled: N is diagonal, up to the amplitudes."""
    theta = np.array([0.3])
    y = unit(np.exp(1j * theta * (np.arange(M) - 4)))
    components = Components.zeros(1, 1)
    components.mu[0], components.variance[0] = theta, 1e-4
    components.kl_constant[0] = np.log(2 * np.pi)
    state = evaluation_of(RESPONSE, y[None, None, :, None], components, nu=1e-3)
    for _ in range(20):
        state = newton_step(RESPONSE, state, np.array([False]))
    variance = component_covariances(RESPONSE, state)[:, 0]
    np.testing.assert_allclose(variance, state.components.variance, rtol=0.01)


@pytest.mark.parametrize("d", [2.0, 3.0, 4.0, 9.0, 50.0, 1e6])
def test_student_factor_is_the_mean_of_the_squared_ratios(d: float) -> None:
    ratios = student.ppf([0.84, 0.975], d) / [0.994458, 1.959964]
    assert student_factor(np.array([d]))[0] == pytest.approx(ratios.prod(), rel=1e-3)


def test_factor_of_many_equal_bins_tends_to_its_limit(solved: Evaluation) -> None:
    """(d/(d-2))² for many bins of d degrees of freedom each."""
    n_bins, d = 4000, 8.0
    many = evaluate(
        RESPONSE, solved.Y, solved.components, solved.K, solved.nu, solved.tau, np.zeros(1)
    )
    w2 = np.ones((1, n_bins, 3, 1))
    many.nu = np.ones((1, n_bins))
    factor = noise_factor(many, w2, np.full((1, n_bins), d))
    np.testing.assert_allclose(factor, (d / (d - 2)) ** 2, rtol=1e-2)


# -- the walk -----------------------------------------------------------------------------------


def runs_of(motion: BernoulliVonMises, z: Any) -> Any:
    return SVALSE(LINE, motion).run(z)


def stationary(n_steps: int, doa: Float) -> Any:
    rng = np.random.default_rng(2)
    model = LINE.replace(noise=0.01)
    phases = np.exp(2j * np.pi * rng.random((n_steps, len(doa))))
    return model.simulate(np.tile(doa, (n_steps, 1)), phases, rng)


def test_source_that_stands_still_has_two_thirds_of_the_error() -> None:
    doa = np.array([-0.4, 0.5])
    z = stationary(80, doa)
    error = {}
    for still in (0.0, 0.1):
        run = runs_of(BernoulliVonMises(sigma_doa=STEP, still=still), z)
        found = np.sort(run.doa[20:, :2], axis=1)
        error[still] = np.sqrt(np.mean((found - doa) ** 2))
    assert error[0.1] < 0.67 * error[0.0]


def test_walk_that_may_stand_still_follows_a_moving_source() -> None:
    """1° a step: the error is that of the walk that never stops, within a tenth."""
    truth = np.deg2rad(-30 + np.arange(60.0))[:, None]
    rng = np.random.default_rng(0)
    z = LINE.replace(noise=0.01).simulate(truth, np.exp(2j * np.pi * rng.random((60, 1))), rng)
    error = []
    for still in (0.0, 0.1):
        run = runs_of(BernoulliVonMises(sigma_doa=STEP, still=still), z)
        error.append(np.sqrt(np.mean((run.doa[:, :1] - truth) ** 2)))
    assert error[1] < 1.1 * error[0]


def test_stated_deviation_of_several_sources_covers() -> None:
    """Four moving sources at 20 dB: 95 % intervals of the stated deviation."""
    trials = [create("svalse_fig6", n_steps=40).sample(np.random.default_rng(n)) for n in (1, 2)]
    share = []
    for trial in trials:
        run = trial.tracker("svalse").run(trial.measurements)
        for truth, doa, std in zip(trial.truth[5:], run.doa[5:], run.std[5:], strict=True):
            for one in truth[~np.isnan(truth)]:
                nearest = np.nanargmin(np.abs(doa - one))
                if abs(doa[nearest] - one) < np.deg2rad(10):
                    share.append(abs(doa[nearest] - one) < 1.96 * std[nearest])
    assert 0.93 < np.mean(share) < 0.995


@pytest.mark.parametrize("still", [-0.1, 1.0, np.nan])
def test_share_outside_its_range_is_refused(still: float) -> None:
    with pytest.raises(ValueError, match=r"still must lie in \[0, 1\)"):
        BernoulliVonMises(still=still)


def test_whole_densities_need_a_walk_that_does_not_stop() -> None:
    with pytest.raises(ValueError, match=r'still must be 0 where memory is "posterior"; got 0.2'):
        SVALSE(LINE, BernoulliVonMises(still=0.2), memory="posterior")
    assert SVALSE(LINE, memory="posterior").motion.still == 0


def test_assigned_concentration_is_used() -> None:
    """The modes begin anew where they do not have the variance of an assigned belief."""
    tracker = SVALSE(LINE)
    tracker.run(stationary(30, np.array([0.2])))
    tracker.kappa = np.where(tracker.tracked, 25.0, 0.0)
    tracker.predict()
    assert 1 / tracker.kappa[0] > 1 / 25.0


def test_batch_equals_single_runs_with_modes() -> None:
    sequences = [stationary(15, np.array([0.2, -0.6])), stationary(15, np.array([0.9]))]
    for z, run in zip(sequences, SVALSE(LINE).run_batch(sequences), strict=True):
        single = SVALSE(LINE).run(z)
        for name in ("doa", "std", "existence"):
            np.testing.assert_allclose(getattr(run, name), getattr(single, name), rtol=1e-7)


def test_carried_probability_is_better_where_sources_switch() -> None:
    """A Bernoulli filter at 0 dB: 7.6 instead of 9.1 degrees in six runs."""
    trials = [
        create("switch", snr_db=0.0, n_steps=30).sample(np.random.default_rng(n)) for n in range(3)
    ]
    data = [trial.measurements for trial in trials]
    result = []
    for carried in ("active", "probability"):
        runs = trials[0].tracker("svalse", carry_existence=carried).run_batch(data)
        result.append(np.mean([
            mean_gospa(np.rad2deg(t.truth), np.rad2deg(r.doa), c=10.0).total
            for t, r in zip(trials, runs, strict=True)
        ]))  # fmt: skip
    assert result[1] < result[0]


def test_carried_existence_of_another_name_is_refused() -> None:
    with pytest.raises(ValueError, match="carry_existence must be one of 'active', 'probability'"):
        SVALSE(LINE, carry_existence="soft")  # type: ignore[arg-type]
