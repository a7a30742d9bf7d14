"""Initial state and result of the Newton solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold, is_angle_manifold
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    SolverSettings,
)
from arrivals.trackers.svalse.newton.batch import BatchRecord, Components
from arrivals.trackers.svalse.newton.candidates import RemovedComponents
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import Chart, ExpectedResponse
from arrivals.trackers.svalse.newton.marginals import ComponentMarginals
from arrivals.trackers.svalse.noise_initialization import (
    NOISE_FLOOR,
    initial_noise,
    noise_from_eigenvalues,
)
from arrivals.typing import Bool, Complex, Float, Int

MAX_LOG_ODDS = 500.0  # bound of the log odds of certain events
MAX_AGE = 3  # steps that a component is tracked without being active
SNR_WEIGHT = 0.3  # of the newest signal-to-noise ratio in the start of the next step
DB = 10 / np.log(10)
MIN_SNR_DB, MAX_SNR_DB = 0.7 * DB, 12 * DB  # at which the noise of the next step may start
NEW_IN_FILL, MIN_FILL = 4, 8  # components that the fill stage may add to the active ones
NO_PRIOR = ComponentPrior(np.zeros(0), np.zeros(0), np.zeros(0), 0.5)


class StepInput:
    """Snapshots of a step, each bin scaled to unit power, and the prior of its components.

    Parameters
    ----------
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
    prior : ComponentPrior or None
    max_components : int
        Components that may be used at once.

    Attributes
    ----------
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
        Of unit power in every bin that has power.
    power : ndarray, shape (n_bins,)
        Mean power of a sensor, before.
    no_power : bool
        True if all data are zero.
    n_tracked : int
        Tracked components.
    age : ndarray of int, shape (n_tracked,)
        Steps since each was last active.
    """

    def __init__(self, Y: Complex, prior: ComponentPrior | None, max_components: int) -> None:
        self.prior = NO_PRIOR if prior is None else prior
        self.power = (Y.real**2 + Y.imag**2).sum(axis=(1, 2)) / (Y.shape[1] * Y.shape[2])
        self.no_power = not self.power.any()
        scale = np.sqrt(np.where(self.power > 0, self.power, 1.0))
        self.Y = Y / scale[:, None, None]
        self.n_tracked = n = min(len(self.prior.mu), max_components)
        age = self.prior.age
        self.age = np.zeros(n, dtype=np.int64) if age is None else age[:n]

    def snr_db(self, manifold: Manifold, settings: SolverSettings) -> float:
        """Return the signal-to-noise ratio at which the noise starts.

        That of the steps before, else that of the settings; if that is None, by the covariance of
        many snapshots or the lags of one snapshot of a line, else 20.
        """
        if self.prior.snr_db is not None:
            return self.prior.snr_db
        if settings.snr_db is not None:
            return settings.snr_db
        M, N = self.Y.shape[1:]
        if M * settings.tempering <= N:  # snapshots enough for a covariance
            return -10 * float(np.log10(noise_from_eigenvalues(self.Y)).mean())
        if N > 1 or not is_angle_manifold(manifold) or manifold.coefficients is not None:
            return 20.0
        return -10 * float(np.log10(initial_noise(self.Y[0, :, 0], manifold.harmonics, None)))


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


def initial_state(
    steps: Sequence[StepInput],
    response: ExpectedResponse,
    settings: SolverSettings,
    n_points: int,
    n_components: int,
) -> SolverState:
    """Return the state in which all tracked components are active, with the initial noise."""
    B, half = len(steps), max(n_components // 2, 1)
    components = tracked_components(steps, response.chart)
    K = np.array([step.n_tracked for step in steps])
    estimate_rho = K == 0
    snr = np.array([step.snr_db(response.manifold, settings) for step in steps])
    nu = np.maximum(10 ** (-snr / 10), response.noise_floor)
    n_active = np.array([np.count_nonzero(step.age == 0) for step in steps])
    tau = np.maximum(1 - nu, NOISE_FLOOR) / np.where(estimate_rho, half, np.maximum(n_active, 1))
    rho = np.array([step.prior.birth for step in steps])
    rho[estimate_rho] = half / max(n_components, 2)
    all_inactive = n_components * np.log1p(-np.minimum(rho, 0.999))
    evaluation = evaluate(
        response,
        np.stack([step.Y for step in steps]),
        components,
        K,
        nu=np.outer(nu, np.ones(response.n_bins)),
        tau=np.outer(tau, response.n_sensors / response.norm2),
        log_prior_inactive=np.where(estimate_rho, all_inactive, 0.0),
    )
    off, zero, nan = np.zeros(B, dtype=np.bool_), np.zeros(B, dtype=np.int64), np.full(B, np.nan)
    removed = RemovedComponents(
        memory=components,
        can_reactivate=np.zeros((B, components.packed.shape[2]), dtype=np.bool_),
        excluded=np.zeros((B, n_points), dtype=np.bool_),
    )
    return SolverState(
        problem=np.arange(B), evaluation=evaluation, saved=evaluation, removed=removed, n_known=K,
        log_odds_new=log_odds(rho), estimate_rho=estimate_rho, filling=~off, finished=off.copy(),
        done=off.copy(), on_trial=off.copy(), estimate_nu=off.copy(),
        may_switch=np.full(B, response.chart.has_curvature), had_final=off.copy(),
        fill_target=np.maximum(n_active + NEW_IN_FILL, MIN_FILL), steps_remaining=zero.copy(),
        tolerance=np.zeros(B), record=np.full(B, -np.inf), before=nan.copy(), rejected=nan.copy(),
        snr_db=snr, iterations=zero.copy(), n_changes=zero.copy(),
    )  # fmt: skip


def tracked_components(steps: Sequence[StepInput], chart: Chart) -> Components:
    """Return the tracked components as they start."""
    L = max(1, *(step.n_tracked for step in steps))
    components = Components.zeros(len(steps), L, chart.layout).with_slots(np.arange(L))
    rho = np.full((len(steps), L), 0.5)
    for i, step in enumerate(steps):
        n = step.n_tracked
        components.point[i, :, :n] = step.prior.mu[:n].T
        components.prior_precision[i, :, :n] = step.prior.kappa[:n].T
        components.kl_constant[i, :n] = chart.prior_constant(
            components.prior_precision[i : i + 1, :, :n]
        )[0]
        if step.prior.curved is not None and chart.has_curvature:
            components.curved[i, :n] = step.prior.curved[:n]
        rho[i, :n] = step.prior.existence[:n]
    components.prior_mean[...] = components.point
    components.covariance[...] = chart.start_covariance(components.prior_precision)
    components.log_odds[...] = log_odds(rho)
    return components


def log_odds(rho: Float) -> Float:
    """Return ln ρ/(1-ρ), within ± `MAX_LOG_ODDS`.

    Examples
    --------
    >>> log_odds(np.array([0.0, 0.5, 1.0]))
    array([-500.,    0.,  500.])
    """
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(rho) - np.log1p(-rho), -MAX_LOG_ODDS, MAX_LOG_ODDS))


def solved_posterior(
    state: SolverState, i: int, step: StepInput, chart: Chart, result: ComponentMarginals
) -> ComponentPosterior:
    """Return the posterior of the i-th row, whose active components have these marginals."""
    evaluation, K, n = state.evaluation, int(state.evaluation.K[i]), int(state.n_known[i])
    slot = evaluation.components.slot[i, :K]
    memory = state.removed.memory.like(state.removed.memory.packed[i : i + 1, :, :n].copy())
    memory.packed[0][:, slot] = evaluation.components.packed[i, :, :K]
    marginal, stated = memory.covariance[0].copy(), memory.covariance[0].copy()
    marginal[:, slot] = result.covariance[i, :, :K]
    stated[:, slot] = result.stated_covariance[i, :, :K]
    amplitude, evidence = np.zeros(n, dtype=np.complex128), np.full(n, -np.inf)
    amplitude[slot] = mean_amplitudes(evaluation.W[i, :, :K], step.power)
    evidence[slot] = result.log_odds[i, :K]
    age = np.ones(n, dtype=np.int64)
    age[: step.n_tracked] = step.age + 1
    age[age > MAX_AGE] = -1
    age[slot] = 0
    newest = -10 * mean(np.log10(evaluation.nu[i]))
    noise, power = evaluation.nu[i] * step.power, evaluation.tau[i] * step.power
    snr_db = (1 - SNR_WEIGHT) * state.snr_db[i] + SNR_WEIGHT * newest
    return ComponentPosterior(
        **chart.densities(memory, marginal, stated),
        active=age == 0,
        age=age,
        amplitude=amplitude,
        evidence=evidence,
        noise=mean(noise),
        power=mean(power),
        iterations=int(state.iterations[i]),
        converged=bool(state.finished[i]),
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
