"""Problems of the Newton solver, and the values from which it starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold, is_angle_manifold
from arrivals.trackers.svalse.components import ComponentPrior, SolverSettings
from arrivals.trackers.svalse.newton.batch import BatchRecord, Components
from arrivals.trackers.svalse.newton.expected_response import Chart, ExpectedResponse
from arrivals.trackers.svalse.noise_initialization import (
    NOISE_FLOOR,
    initial_noise,
    noise_from_eigenvalues,
)
from arrivals.typing import Bool, Complex, Float, Int

MAX_LOG_ODDS = 500.0  # bound of the log odds of certain events
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
class InitialValues(BatchRecord):
    """Values from which the solver starts, one problem a row: all tracked components active.

    Attributes
    ----------
    Y : ndarray, shape (B, F, n_sensors, N)
    components : Components
    K : ndarray of int, shape (B,)
    nu, tau : ndarray, shape (B, F)
    log_prior_inactive : ndarray, shape (B,)
        As in `Evaluation`.
    log_odds_new : ndarray, shape (B,)
        Prior log odds of a new component.
    estimate_rho : ndarray of bool, shape (B,)
        True if ρ is estimated, since no component is tracked.
    fill_target : ndarray of int, shape (B,)
        Components at which the fill stage ends.
    snr_db : ndarray, shape (B,)
        Signal-to-noise ratio at which the noise starts.
    """

    Y: Complex
    components: Components
    K: Int
    nu: Float
    tau: Float
    log_prior_inactive: Float
    log_odds_new: Float
    estimate_rho: Bool
    fill_target: Int
    snr_db: Float


def initial_values(
    steps: Sequence[StepInput],
    response: ExpectedResponse,
    settings: SolverSettings,
    n_components: int,
) -> InitialValues:
    """Return the values at the start of each problem."""
    half = max(n_components // 2, 1)
    K = np.array([step.n_tracked for step in steps])
    estimate_rho = K == 0
    snr = np.array([step.snr_db(response.manifold, settings) for step in steps])
    nu = np.maximum(10 ** (-snr / 10), response.noise_floor)
    n_active = np.array([np.count_nonzero(step.age == 0) for step in steps])
    tau = np.maximum(1 - nu, NOISE_FLOOR) / np.where(estimate_rho, half, np.maximum(n_active, 1))
    rho = np.array([step.prior.birth for step in steps])
    rho[estimate_rho] = half / max(n_components, 2)
    all_inactive = n_components * np.log1p(-np.minimum(rho, 0.999))
    return InitialValues(
        Y=steps[0].Y[None] if len(steps) == 1 else np.stack([step.Y for step in steps]),
        components=tracked_components(steps, response.chart),
        K=K,
        nu=nu[:, None] + np.zeros(response.n_bins),
        tau=tau[:, None] * (response.n_sensors / response.norm2[:, 0]),
        log_prior_inactive=np.where(estimate_rho, all_inactive, 0.0),
        log_odds_new=log_odds(rho),
        estimate_rho=estimate_rho,
        fill_target=np.maximum(n_active + NEW_IN_FILL, MIN_FILL),
        snr_db=snr,
    )


def tracked_components(steps: Sequence[StepInput], chart: Chart) -> Components:
    """Return the tracked components as they start."""
    L = max(1, *(step.n_tracked for step in steps))
    components = Components.zeros(len(steps), L, chart.layout)
    components.packed[:, -1] = np.arange(L)  # slots
    point, precision, constant = (
        components.point, components.prior_precision, components.kl_constant
    )  # fmt: skip
    rho = np.full((len(steps), L), 0.5)
    for i, step in enumerate(steps):
        n, prior = step.n_tracked, step.prior
        point[i, :, :n] = prior.mu[:n].T
        precision[i, :, :n] = prior.kappa[:n].T
        constant[i, :n] = chart.prior_constant(precision[i : i + 1, :, :n])[0]
        if prior.curved is not None and chart.has_curvature:
            components.curved[i, :n] = prior.curved[:n]
        rho[i, :n] = prior.existence[:n]
    components.prior_mean[...] = point
    components.covariance[...] = chart.start_covariance(precision)
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
        odds = np.log(rho) - np.log1p(-rho)
    return np.asarray(np.minimum(np.maximum(odds, -MAX_LOG_ODDS), MAX_LOG_ODDS))
