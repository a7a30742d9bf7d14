"""What the fast engine of VALSE and SVALSE works on: its start, and what comes out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.motion_models.bessel import bessel_ratio, log_i0
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    SolverSettings,
)
from arrivals.trackers.svalse.newton.batch import BatchRecord
from arrivals.trackers.svalse.newton.candidates import LOG_2PI
from arrivals.trackers.svalse.newton.elbo import (
    KL_CONSTANT,
    MU,
    N_FACTS,
    ODDS,
    PLACE,
    PRIOR_KAPPA,
    PRIOR_MU,
    Evaluation,
    S,
    evaluate,
)
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.step import LARGEST_VARIANCE
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR, first_noise, quiet_noise
from arrivals.typing import Bool, Complex, Float, Int

SURE = 500.0  # log odds that stand for certainty
DB = 10 / np.log(10)
NOISIEST_DB, CLEANEST_DB = 0.7 * DB, 12 * DB  # signal-to-noise ratios from which to start
NOTHING = ComponentPrior(np.zeros(0), np.zeros(0), np.zeros(0), 0.5)


class Problem:
    """The looks of a step, each bin scaled to unit power, and what is known of its components.

    Parameters
    ----------
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
    known : Prediction or None
    most : int
        Components that may be used at once.

    Attributes
    ----------
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
        Of unit power in every bin that has power.
    power : ndarray, shape (n_bins,)
        Mean power of a sensor, before.
    silent : bool
        Whether no bin has power.
    n : int
        Components carried over.
    age : ndarray of int, shape (n,)
        Steps since each was last active.
    """

    def __init__(self, Y: Complex, known: ComponentPrior | None, most: int) -> None:
        self.known = NOTHING if known is None else known
        self.power = (Y.real**2 + Y.imag**2).sum(axis=(1, 2)) / (Y.shape[1] * Y.shape[2])
        self.silent = not self.power.any()
        scale = np.sqrt(np.where(self.power > 0, self.power, 1.0))
        self.Y = Y / scale[:, None, None]
        self.n = min(len(self.known.mu), most)
        age = self.known.age
        self.age = np.zeros(self.n, dtype=np.int64) if age is None else age[: self.n]

    def snr_db(self, manifold: Manifold, settings: SolverSettings) -> float:
        """Return the signal-to-noise ratio at which the noise starts.

        That of the steps before, else that of the settings; if that is None, by the covariance of
        many snapshots or, without a prior, the lags of one snapshot of a line, else 20.
        """
        if self.known.snr_db is not None:
            return self.known.snr_db
        if settings.snr_db is not None:
            return settings.snr_db
        M, N = self.Y.shape[1:]
        if M * settings.tempering <= N:  # snapshots enough for a covariance
            return -10 * float(np.log10(quiet_noise(self.Y)).mean())
        if self.known is not NOTHING or manifold.coefficients is not None or N > 1:
            return 20.0
        return -10 * float(np.log10(first_noise(self.Y[0, :, 0], manifold.harmonics, None)))


@dataclass(eq=False)
class SolverState(BatchRecord):
    """The working state of problems that are being solved, one a row.

    Attributes
    ----------
    row : ndarray of int, shape (B,)
        Number of the problem.
    state, saved : State
        As it is, and as it was before the components on trial were added.
    memory : ndarray, shape (B, 7, n_known)
        All components of the step, as they were when they were removed.
    n_known : ndarray of int, shape (B,)
    revivable : ndarray of bool, shape (B, n_carried)
        Carried components that were removed, not merged, and may come back.
    barred : ndarray of bool, shape (B, n_angles)
        Where a merged component was: nothing is born there.
    birth : ndarray, shape (B,)
        Prior log odds of a fresh component.
    free : ndarray of bool, shape (B,)
        Whether ρ is learned, since nothing is carried.
    filling, finished, done, trial, learn : ndarray of bool, shape (B,)
        In the fill stage; final steps taken; at the end; components on trial; variances learned.
    left : ndarray of int, shape (B,)
        Newton steps until the next move.
    tolerance : ndarray, shape (B,)
        Change of F, nats, at which they stop before.
    record, before, rejected : ndarray, shape (B,)
        Of the criterion: the record to beat, its value before the trial; F at the last rejection.
    snr_db : ndarray, shape (B,)
        Where the noise started.
    iterations, moves : ndarray of int, shape (B,)
    """

    row: Int
    state: Evaluation
    saved: Evaluation
    memory: Float
    n_known: Int
    revivable: Bool
    barred: Bool
    birth: Float
    free: Bool
    filling: Bool
    finished: Bool
    done: Bool
    trial: Bool
    learn: Bool
    left: Int
    tolerance: Float
    record: Float
    before: Float
    rejected: Float
    snr_db: Float
    iterations: Int
    moves: Int

    def __len__(self) -> int:
        return len(self.row)


def start(
    problems: Sequence[Problem],
    response: ExpectedResponse,
    settings: SolverSettings,
    n_angles: int,
    most: int,
) -> SolverState:
    """Return the state in which all carried components are active, the noise as it starts."""
    B = len(problems)
    facts = carried(problems, response.extent)
    K = np.array([p.n for p in problems])
    free = K == 0
    snr = np.array([p.snr_db(response.manifold, settings) for p in problems])
    nu = np.maximum(10 ** (-snr / 10), response.noise_floor)
    K_active = np.array([np.count_nonzero(p.age == 0) for p in problems])
    share = np.where(free, max(most // 2, 1), np.maximum(K_active, 1))
    tau = np.maximum(1 - nu, NOISE_FLOOR) / share
    rho = np.array([p.known.birth for p in problems])
    rho[free] = max(most // 2, 1) / max(most, 2)
    rest = np.where(free, most * np.log1p(-np.minimum(rho, 0.999)), 0.0)
    Y = np.stack([p.Y for p in problems])
    tau = np.outer(tau, response.n_sensors / response.norm2)
    nu = np.outer(nu, np.ones(response.n_bins))
    state = evaluate(response, Y, facts, K, nu, tau, rest)
    off, zero, nan = np.zeros(B, dtype=np.bool_), np.zeros(B, dtype=np.int64), np.full(B, np.nan)
    return SolverState(
        row=np.arange(B), state=state, saved=state, memory=facts, n_known=K,
        revivable=np.zeros((B, facts.shape[2]), dtype=np.bool_),
        barred=np.zeros((B, n_angles), dtype=np.bool_),
        birth=log_odds(rho), free=free, filling=~off, finished=off.copy(), done=off.copy(),
        trial=off.copy(), learn=off.copy(), left=zero.copy(), tolerance=np.zeros(B),
        record=np.full(B, -np.inf), before=nan.copy(), rejected=nan.copy(), snr_db=snr,
        iterations=zero.copy(), moves=zero.copy(),
    )  # fmt: skip


def carried(problems: Sequence[Problem], extent: float) -> Float:
    """Return the carried components, (B, 7, L), as they start."""
    L = max(1, *(p.n for p in problems))
    facts = np.zeros((len(problems), N_FACTS, L))
    rho = np.full((len(problems), L), 0.5)
    for i, p in enumerate(problems):
        facts[i, MU, : p.n] = p.known.mu[: p.n]
        facts[i, PRIOR_KAPPA, : p.n] = p.known.kappa[: p.n]
        rho[i, : p.n] = p.known.existence[: p.n]
    kappa = facts[:, PRIOR_KAPPA]
    widest = min(3.6 / extent**2, LARGEST_VARIANCE)
    facts[:, S] = 1 / np.maximum(kappa, 1 / widest)
    facts[:, PRIOR_MU] = facts[:, MU]
    facts[:, ODDS] = log_odds(rho)
    facts[:, KL_CONSTANT] = LOG_2PI + log_i0(kappa)
    facts[:, PLACE] = np.arange(L)
    return facts


def log_odds(rho: Float) -> Float:
    """Return ln ρ/(1-ρ), within bounds that stand for certainty.

    Examples
    --------
    >>> log_odds(np.array([0.0, 0.5, 1.0]))
    array([-500.,    0.,  500.])
    """
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(rho) - np.log1p(-rho), -SURE, SURE))


def result(
    work: SolverState,
    i: int,
    problem: Problem,
    manifold: Manifold,
    gains: Float,
    keep: float,
    max_age: int,
) -> ComponentPosterior:
    """Return the fit of the i-th row, whose components would gain so much by removal."""
    state, K, n = work.state, int(work.state.K[i]), int(work.n_known[i])
    memory = work.memory[i, :, :n].copy()
    place = state.facts[i, PLACE, :K].astype(np.int64)
    memory[:, place] = state.facts[i, :, :K]
    amplitude, evidence = np.zeros(n, dtype=np.complex128), np.full(n, -np.inf)
    amplitude[place] = amplitudes_of(state.W[i, :, :K], problem.power)
    evidence[place] = -gains[i, :K]
    age = np.ones(n, dtype=np.int64)
    age[: problem.n] = problem.age + 1
    age[age > max_age] = -1
    age[place] = 0
    newest = -10 * mean(np.log10(state.nu[i]))
    noise, power = state.nu[i] * problem.power, state.tau[i] * problem.power
    snr_db = (1 - keep) * work.snr_db[i] + keep * newest
    return ComponentPosterior(
        theta=front(manifold, memory[MU]),
        resultant=np.exp(-memory[S] / 2),
        kappa=1 / memory[S],
        active=age == 0,
        age=age,
        amplitude=amplitude,
        evidence=evidence,
        noise=mean(noise),
        power=mean(power),
        iterations=int(work.iterations[i]),
        converged=bool(work.finished[i]),
        snr_db=min(max(float(snr_db), NOISIEST_DB), CLEANEST_DB),
        bin_noise=noise,
    )


def mean(values: Float) -> float:
    """Return the mean over bins: of one or a few, a list is quicker than an array."""
    return float(sum(values.tolist()) / len(values))


def amplitudes_of(W: Complex, power: Float) -> Complex:
    """Return Ŵ (n_bins, L, n_snapshots) of one look, or of several the root of the mean power."""
    W = W * np.sqrt(power)[:, None, None]
    if W.shape[0] == W.shape[2] == 1:
        return np.asarray(W[0, :, 0])
    return np.asarray(np.sqrt((W.real**2 + W.imag**2).mean(axis=(0, 2))) + 0j)


def front(manifold: Manifold, mu: Float) -> Float:
    """Return the angles within ±π, where two stand for one direction that in front."""
    theta = np.angle(np.exp(1j * mu))
    return manifold.from_doa(manifold.to_doa(theta)) if manifold.mirror else theta


def nothing_found(problem: Problem, max_age: int) -> ComponentPosterior:
    """Return the fit of a step that holds no source: what is carried ages, all power is noise."""
    known, n = problem.known, problem.n
    age = problem.age + 1
    return ComponentPosterior(
        theta=known.mu[:n],
        resultant=bessel_ratio(known.kappa[:n]),
        kappa=known.kappa[:n],
        active=np.zeros(n, dtype=np.bool_),
        age=np.where(age > max_age, -1, age),
        amplitude=np.zeros(n, dtype=np.complex128),
        evidence=np.full(n, -np.inf),
        noise=float(problem.power.mean()),
        power=0.0,
        iterations=0,
        converged=True,
        snr_db=known.snr_db,
        bin_noise=None if problem.silent else problem.power,
    )
