"""SBL and SSBL: reference implementation, several snapshots, batches, memory."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios import create
from arrivals.trackers import SBL, SSBL
from arrivals.trackers.sparse_bayes.fixed_point import (
    FixedPointSolver,
    residual_noise,
    spread_powers,
    update_powers,
)
from arrivals.typing import Complex, Float

LINE = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-2)
CIRCLE = ArraySnapshot(SensorArray.uca(9, radius=0.5), wavelength=1.0, noise=1e-2)
GRID = np.deg2rad(np.arange(-90, 90.25, 0.5))


def reference_sbl(A: Complex, y: Complex, gamma: Float) -> tuple[Float, float, int]:
    """Reference implementation: specification, section 11, one snapshot, pseudo-inverse."""
    M, sigma2, smallest, best = len(y), 0.1, np.inf, (gamma, 0.1, 0)
    for n in range(1, 1001):
        Sigma = np.linalg.inv(sigma2 * np.eye(M) + A @ np.diag(gamma) @ A.conj().T)
        numerator = np.abs(A.conj().T @ Sigma @ y) ** 2
        old = gamma
        gamma = gamma * numerator / np.diag(A.conj().T @ Sigma @ A).real
        inner = range(1, len(gamma) - 1)
        top = [i for i in inner if gamma[i - 1] < gamma[i] >= gamma[i + 1]]
        active = A[:, sorted(top, key=lambda i: -gamma[i])[: -(-M // 2)]]
        residual = np.eye(M) - active @ np.linalg.pinv(active)
        sigma2 = np.trace(residual @ np.outer(y, y.conj())).real / (M - -(-M // 2))
        change = np.abs(gamma - old).sum() / gamma.sum()
        if change < smallest:
            smallest, best = change, (gamma, sigma2, n)
        if n >= 15 and change < 1e-3:
            return *best[:2], n
    raise AssertionError("did not converge")


def test_sbl_equals_the_reference_implementation() -> None:
    z = LINE.simulate(np.deg2rad([-31.0, 4.2, 55.0]), [1.0, 0.8j, -0.7], np.random.default_rng(1))
    gamma, sigma2, n = reference_sbl(
        LINE.array.steering_vector(GRID, 1.0).T / 15**0.5, z, np.ones(361)
    )
    tracker = SBL(LINE)
    tracker.update(z)
    np.testing.assert_allclose(tracker.gamma, gamma, atol=1e-8 * gamma.max())
    assert tracker.noise == pytest.approx(sigma2)
    assert tracker.estimate.iterations == n


def test_update_powers_with_known_noise_never_decreases_the_likelihood() -> None:
    """The fixed point minimizes ln det Σ + yᴴΣ⁻¹y, the negative log evidence."""
    z = LINE.simulate(np.deg2rad([-31.0, 4.2]), [1.0, 0.8j], np.random.default_rng(2))
    A = LINE.array.steering_vector(GRID, 1.0) / 15**0.5
    gamma, cost = np.ones((1, 361)), []
    for _ in range(60):
        Sigma = 0.01 * np.eye(15) + (A.T * gamma[0]) @ A.conj()
        quadratic = np.vdot(z, np.linalg.solve(Sigma, z)).real
        cost.append(np.linalg.slogdet(Sigma)[1] + quadratic)
        gamma = update_powers(A, z[None, :, None], gamma, np.array([0.01]))
    assert cost[-1] < cost[0] - 10
    assert np.diff(cost).max() < 1e-6


@pytest.mark.parametrize("model", [LINE, CIRCLE])
def test_sbl_of_a_repeated_snapshot_equals_that_of_one(model: ArraySnapshot) -> None:
    z = model.simulate([-0.4, 0.9], [1.0, 0.8j], np.random.default_rng(3))
    one, two = SBL(model), SBL(model)
    one.update(z)
    two.update(np.stack([z, z]))
    np.testing.assert_allclose(two.gamma, one.gamma, atol=1e-9)
    assert two.noise == pytest.approx(one.noise)


def test_sbl_of_several_snapshots_detects_weak_sources() -> None:
    rng = np.random.default_rng(4)
    doa = np.deg2rad([-20.0, 10.0])
    phases = np.exp(2j * np.pi * rng.random((40, 2)))
    model = LINE.replace(noise=1.0)
    z = model.simulate(np.tile(doa, (40, 1)), phases * [1.0, 0.5], rng)
    tracker = SBL(model, max_sources=2)
    tracker.update(z)
    assert np.sort(tracker.estimate.doa) == pytest.approx(doa, abs=np.deg2rad(1.6))


def test_sbl_leaves_out_missing_rows_and_failed_sensors() -> None:
    z = LINE.simulate(np.full((3, 1), 0.3), 1.0, np.random.default_rng(5))
    damaged = z.copy()
    damaged[1] = np.nan
    tracker, other = SBL(LINE), SBL(LINE)
    tracker.update(damaged)
    other.update(z[[0, 2]])
    np.testing.assert_array_equal(tracker.gamma, other.gamma)
    damaged[0, 4] = np.nan
    tracker.update(damaged)
    assert tracker.estimate.doa[0] == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("kind", [SBL, SSBL])
def test_run_batch_equals_single_runs_bit_by_bit(kind: type[SBL]) -> None:
    trials = [create("svalse_fig6", n_steps=n).sample(np.random.default_rng(n)) for n in (3, 5, 4)]
    batch = [trial.measurements.copy() for trial in trials]
    batch[1][2, 3] = np.nan
    batch[2][1] = np.nan
    runs = kind(LINE).run_batch(batch)
    for run, z in zip(runs, batch, strict=True):
        single = kind(LINE).run(z)
        np.testing.assert_array_equal(run.doa, single.doa)
        np.testing.assert_array_equal(run.noise, single.noise)
        np.testing.assert_array_equal(run.iterations, single.iterations)


def test_ssbl_starts_from_the_last_step_with_data() -> None:
    z = LINE.simulate(np.full((2, 1), 0.3), 1.0, np.random.default_rng(6))
    tracker, first = SSBL(LINE), SBL(LINE)
    tracker.predict()
    tracker.update(z[0])
    first.update(z[0])
    np.testing.assert_array_equal(tracker.gamma, first.gamma)
    for z_empty in (None, np.zeros(15), np.nan * np.zeros(15)):
        tracker.predict()
        tracker.update(z_empty)
        assert tracker.estimate.n_found == 0
    tracker.predict()
    np.testing.assert_array_equal(tracker.start, spread_powers(first.gamma, 2, 0.04, 1e-3, False))
    other = tracker.set_params(n_directions=91)
    other.update(z[1])
    assert other.gamma.shape == (91,)


def test_spread_powers_wraps_on_a_circle_only() -> None:
    spike = np.eye(1, 8)[0]
    np.testing.assert_allclose(spread_powers(spike, 1, 1.0, 1e-3, True)[[-1, 0, 1]], 1.001)
    assert spread_powers(spike, 1, 1.0, 1e-3, False)[-1] == pytest.approx(1e-3)


def test_residual_noise_is_the_power_outside_the_peaks() -> None:
    A = np.eye(6, dtype=np.complex128)
    gamma = np.array([[0.0, 3.0, 0.0, 2.0, 0.0, 0.0]])  # two peaks; three are allowed
    Y = np.array([1.0, 2.0, 2.0, 5.0, 0.0, 0.0])[None, :, None]
    assert residual_noise(A, Y, gamma, circular=False) == pytest.approx([(1 + 4) / 3])


def test_sbl_with_too_few_iterations_reports_no_convergence() -> None:
    z = LINE.simulate([0.3], 1.0, np.random.default_rng(7))
    A = LINE.array.steering_vector(GRID, 1.0) / 15**0.5
    powers = FixedPointSolver(max_iterations=3).solve(A, z[None, :, None], np.ones((1, 361)), 0.1)
    assert not powers.converged[0]
    assert powers.iterations[0] == 3
    tracker = SBL(LINE).set_params(solver__max_iterations=3)
    tracker.update(z)
    assert not tracker.estimate.converged


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"n_directions": 2}, "n_directions must be at least 3"),
        ({"threshold": 2.0}, r"threshold must lie in \[0, 1\]"),
        ({"initial_noise": 0.0}, "initial_noise must be finite and positive"),
        ({"max_sources": 0}, "max_sources must be at least 1"),
    ],
)
def test_invalid_parameters_are_refused(params: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SBL(LINE, **params)  # type: ignore[arg-type]  # on purpose


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"tolerance": 0.0}, "tolerance must be finite and positive"),
        ({"max_iterations": 0}, "max_iterations must be at least 1"),
    ],
)
def test_solver_refuses_invalid_settings(params: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FixedPointSolver(**params)  # type: ignore[arg-type]  # on purpose


def test_old_settings_of_the_iteration_are_refused_with_the_new_names() -> None:
    with pytest.raises(TypeError, match="it is now 'max_iterations' of 'solver'"):
        SSBL(LINE, max_iterations=3)  # type: ignore[call-arg]  # on purpose
    with pytest.raises(TypeError, match="'reach': it is now called 'n_neighbours'"):
        SSBL(LINE, reach=3)  # type: ignore[call-arg]  # on purpose
