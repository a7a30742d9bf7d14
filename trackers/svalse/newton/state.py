"""State of the Newton solver between changes of the support, and its result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.trackers.svalse.components import ComponentPosterior
from arrivals.trackers.svalse.newton.batch import BatchRecord, Components
from arrivals.trackers.svalse.newton.candidates import RemovedComponents
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import Chart, ExpectedResponse
from arrivals.trackers.svalse.newton.marginals import ComponentMarginals, marginals
from arrivals.trackers.svalse.newton.problems import InitialValues, StepInput
from arrivals.typing import Bool, Complex, Float, Int

MAX_AGE = 3  # steps that a component is tracked without being active
SNR_WEIGHT = 0.3  # of the newest signal-to-noise ratio in the start of the next step
DB = 10 / np.log(10)
MIN_SNR_DB, MAX_SNR_DB = 0.7 * DB, 12 * DB  # at which the noise of the next step may start


@dataclass(eq=False)
class SolverState(BatchRecord):
    """Working state of the problems that are being solved, one a row.

    Attributes
    ----------
    problem : ndarray of int, shape (B,)
        Number of the problem.
    evaluation, saved : Evaluation
        The present one, and that before the components on trial were added.
    removed : RemovedComponents
    n_known : ndarray of int, shape (B,)
        Components in the memory of the step.
    log_odds_new : ndarray, shape (B,)
        Prior log odds of a new component.
    estimate_rho : ndarray of bool, shape (B,)
        True if ρ is estimated, since no component is tracked.
    filling, finished, done, on_trial, estimate_nu : ndarray of bool, shape (B,)
        In the fill stage; final steps taken; solved; components on trial; variances updated.
    fill_target : ndarray of int, shape (B,)
        Components at which the fill stage ends.
    may_switch, had_final : ndarray of bool, shape (B,)
        Changes between plane and curved waves are tried; final steps were taken once.
    steps_remaining : ndarray of int, shape (B,)
        Newton steps until the next change of the support.
    tolerance : ndarray, shape (B,)
        Change of F, nats, below which these steps end early.
    record, before, rejected : ndarray, shape (B,)
        Criterion to exceed; that before the trial; F at the last rejection.
    snr_db : ndarray, shape (B,)
        Signal-to-noise ratio at which the noise started.
    iterations, n_changes : ndarray of int, shape (B,)
        Newton steps, and changes of the support.
    """

    problem: Int
    evaluation: Evaluation
    saved: Evaluation
    removed: RemovedComponents
    n_known: Int
    log_odds_new: Float
    estimate_rho: Bool
    filling: Bool
    finished: Bool
    done: Bool
    on_trial: Bool
    estimate_nu: Bool
    fill_target: Int
    may_switch: Bool
    had_final: Bool
    steps_remaining: Int
    tolerance: Float
    record: Float
    before: Float
    rejected: Float
    snr_db: Float
    iterations: Int
    n_changes: Int

    def __len__(self) -> int:
        return len(self.problem)


def initial_state(values: InitialValues, response: ExpectedResponse, n_points: int) -> SolverState:
    """Return the state in which all tracked components are active, with the initial noise."""
    B, components, K = len(values), values.components, values.K
    evaluation = evaluate(
        response, values.Y, components, K, values.nu, values.tau, values.log_prior_inactive
    )
    off, zero, nan = np.zeros(B, dtype=np.bool_), np.zeros(B, dtype=np.int64), np.full(B, np.nan)
    removed = RemovedComponents(
        memory=components,
        can_reactivate=np.zeros((B, components.packed.shape[2]), dtype=np.bool_),
        excluded=np.zeros((B, n_points), dtype=np.bool_),
    )
    return SolverState(
        problem=np.arange(B), evaluation=evaluation, saved=evaluation, removed=removed, n_known=K,
        log_odds_new=values.log_odds_new, estimate_rho=values.estimate_rho, filling=~off,
        finished=off.copy(), done=off.copy(), on_trial=off.copy(), estimate_nu=off.copy(),
        may_switch=np.full(B, response.chart.has_curvature), had_final=off.copy(),
        fill_target=values.fill_target, steps_remaining=zero.copy(),
        tolerance=np.zeros(B), record=np.full(B, -np.inf), before=nan.copy(), rejected=nan.copy(),
        snr_db=values.snr_db, iterations=zero.copy(), n_changes=zero.copy(),
    )  # fmt: skip


def unsolved(state: SolverState) -> SolverState:
    """Return the problems that are not done, without slots that none of them uses."""
    state = state.select(~state.done)
    state.evaluation, state.saved = state.evaluation.trimmed(), state.saved.trimmed()
    return state


@dataclass(eq=False)
class SolverResult:
    """Result of the solver, one problem a row.

    Attributes
    ----------
    components : Components
    K : ndarray of int, shape (B,)
        Components in use.
    W : ndarray, shape (B, F, L, N)
    nu, tau : ndarray, shape (B, F)
        As in `Evaluation`.
    marginals : ComponentMarginals
    memory : Components
        All components of the step, as they were when they were removed.
    n_known : ndarray of int, shape (B,)
        Components in the memory.
    snr_db : ndarray, shape (B,)
        Signal-to-noise ratio at which the noise started.
    iterations : ndarray of int, shape (B,)
        Newton steps.
    finished : ndarray of bool, shape (B,)
        True if the final steps were taken.
    """

    components: Components
    K: Int
    W: Complex
    nu: Float
    tau: Float
    marginals: ComponentMarginals
    memory: Components
    n_known: Int
    snr_db: Float
    iterations: Int
    finished: Bool

    @classmethod
    def of(cls, state: SolverState, response: ExpectedResponse, kl_weight: float) -> SolverResult:
        """Return the result of problems that are done."""
        now = state.evaluation
        return cls(
            now.components, now.K, now.W, now.nu, now.tau, marginals(response, now, kl_weight),
            state.removed.memory, state.n_known, state.snr_db, state.iterations, state.finished,
        )  # fmt: skip


def solved_posterior(
    solved: SolverResult, i: int, step: StepInput, chart: Chart
) -> ComponentPosterior:
    """Return the posterior of the i-th row."""
    K, n = int(solved.K[i]), int(solved.n_known[i])
    slot, result = solved.components.slot[i, :K], solved.marginals
    memory = solved.memory.like(solved.memory.packed[i : i + 1, :, :n].copy())
    memory.packed[0][:, slot] = solved.components.packed[i, :, :K]
    marginal, stated = memory.covariance[0].copy(), memory.covariance[0].copy()
    marginal[:, slot] = result.covariance[i, :, :K]
    stated[:, slot] = result.stated_covariance[i, :, :K]
    amplitude, evidence = np.zeros(n, dtype=np.complex128), np.full(n, -np.inf)
    amplitude[slot] = mean_amplitudes(solved.W[i, :, :K], step.power)
    evidence[slot] = result.log_odds[i, :K]
    age = np.ones(n, dtype=np.int64)
    age[: step.n_tracked] = step.age + 1
    age[age > MAX_AGE] = -1
    age[slot] = 0
    newest = -10 * mean(np.log10(solved.nu[i]))
    noise, power = solved.nu[i] * step.power, solved.tau[i] * step.power
    snr_db = (1 - SNR_WEIGHT) * solved.snr_db[i] + SNR_WEIGHT * newest
    return ComponentPosterior(
        **chart.densities(memory, marginal, stated),
        active=age == 0,
        age=age,
        amplitude=amplitude,
        evidence=evidence,
        noise=mean(noise),
        power=mean(power),
        iterations=int(solved.iterations[i]),
        converged=bool(solved.finished[i]),
        snr_db=min(max(float(snr_db), MIN_SNR_DB), MAX_SNR_DB),
        bin_noise=noise,
    )


def mean(values: Float) -> float:
    """Return the mean over bins: of one or a few, a list is faster than an array."""
    return float(sum(values.tolist()) / len(values))


def mean_amplitudes(W: Complex, power: Float) -> Complex:
    """Return Ŵ (n_bins, L, n_snapshots) of one snapshot, or of several the root mean power."""
    W = W * np.sqrt(power)[:, None, None]
    if W.shape[0] == W.shape[2] == 1:
        return np.asarray(W[0, :, 0])
    return np.asarray(np.sqrt((W.real**2 + W.imag**2).mean(axis=(0, 2))) + 0j)


def inactive_posterior(step: StepInput, chart: Chart) -> ComponentPosterior:
    """Return the posterior of a step without a source: tracked components age, all is noise."""
    prior, n = step.prior, step.n_tracked
    curved = None if prior.curved is None else prior.curved[:n]
    age = step.age + 1
    return ComponentPosterior(
        **chart.prior_densities(prior.mu[:n], prior.kappa[:n], curved),
        active=np.zeros(n, dtype=np.bool_),
        age=np.where(age > MAX_AGE, -1, age),
        amplitude=np.zeros(n, dtype=np.complex128),
        evidence=np.full(n, -np.inf),
        noise=float(step.power.mean()),
        power=0.0,
        iterations=0,
        converged=True,
        snr_db=prior.snr_db,
        bin_noise=None if step.no_power else step.power,
    )
