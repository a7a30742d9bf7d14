"""Prior and posterior of the components of VALSE and SVALSE, and their solvers' interface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.motion_models.bernoulli_von_mises import MIN_KAPPA
from arrivals.motion_models.move_stop import MoveStopWalk
from arrivals.motion_models.von_mises import wrap
from arrivals.parameters import FrozenModel
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import count, not_negative, number, positive

Settings = TypeVar("Settings", bound="SolverSettings")
MIN_INFORMATION = 1e-3  # of the data, relative to the prior's, for an update of the modes
MERGE_DISTANCE = float(np.deg2rad(1.5))  # rad of direction, of tracked components


@dataclass(frozen=True, eq=False)
class ComponentPrior:
    """Prior of the components of a step, (65).

    Parameters
    ----------
    mu, kappa : ndarray, shape (n_tracked,)
        Von Mises densities of the angles of the tracked components; rad.
    existence : ndarray, shape (n_tracked,)
        Probability that each is active.
    birth : float
        Probability that a component that was not tracked is active.
    age : ndarray of int, shape (n_tracked,), optional
        Steps since each was last active; 0 for all if None.
    snr_db : float, optional
        Signal-to-noise ratio of the steps before, at which the noise may start.
    noise : ndarray, shape (n_bins,), optional
        Noise variances of the last step, NaN where a bin had no data.
    nuisance : ndarray, shape (n_tracked, n_nuisance), optional
        Densities of the second unknown.
    moments : ndarray, shape (n_tracked, n_moments), optional
        Whole densities of the angles, ⟨exp(jiθ)⟩, i = 0, 1, ..., in place of `mu` and `kappa`.
    n_moments : int
        Number of moments of the posterior densities to return; 0 for von Mises densities only.
    """

    mu: Float
    kappa: Float
    existence: Float
    birth: float
    age: Int | None = None
    snr_db: float | None = None
    noise: Float | None = None
    nuisance: Float | None = None
    moments: Complex | None = None
    n_moments: int = 0


@dataclass(frozen=True, eq=False)
class ComponentPosterior:
    """Posterior of the components of a step, the tracked ones first.

    Parameters
    ----------
    theta : ndarray, shape (n_components,)
        Mean angles, rad.
    resultant : ndarray, shape (n_components,)
        Lengths of the mean of exp(jθ), 1 for a certain angle, 0 for a uniform one, of the stated
        densities: with unknown noise.
    kappa : ndarray, shape (n_components,)
        Concentrations of von Mises densities that approximate those of the angles in the bound:
        all else held.
    active : ndarray of bool, shape (n_components,)
        Active components.
    age : ndarray of int, shape (n_components,)
        Steps since each was active, 0 for those that are; -1 for those no longer tracked.
    amplitude : ndarray, shape (n_components,)
        Posterior means, zero where not active.
    evidence : ndarray, shape (n_components,)
        Log odds that an active component exists, nats.
    noise, power : float
        Variances of the noise of a sensor (58) and of an amplitude (59), means over bins.
    iterations : int
    converged : bool
    snr_db : float, optional
        Signal-to-noise ratio at which the noise of the next step may start.
    bin_noise, nuisance, moments : ndarray, optional
        As in `ComponentPrior`, of all components; None from coordinate ascent on one snapshot of
        a line.
    marginal_kappa : ndarray, shape (n_components,), optional
        Concentrations of the marginal densities, the noise known; those of the bound if None.
    modes : ndarray, shape (3, n_components, 2), optional
        Modes of a walk that may stand still, as in `MoveStopWalk`.
    """

    theta: Float
    resultant: Float
    kappa: Float
    active: Bool
    age: Int
    amplitude: Complex
    evidence: Float
    noise: float
    power: float
    iterations: int
    converged: bool
    snr_db: float | None = None
    bin_noise: Float | None = None
    nuisance: Float | None = None
    moments: Complex | None = None
    marginal_kappa: Float | None = None
    modes: Float | None = None


class Solver(Protocol):
    """Maximization of the ELBO of one step: `NewtonSolver`, `CoordinateSolver` or a user's own."""

    @property
    def max_components(self) -> int | None:
        """Largest number of components; None for the number of sensors."""

    def check(self, manifold: Manifold, n_snapshots: int, n_moments: int) -> None:
        """Raise ValueError if the solver does not support such measurements."""

    def solve(
        self, snapshots: Complex, manifold: Manifold, prior: ComponentPrior | None
    ) -> ComponentPosterior:
        """Return the components in snapshots (n_bins, n_sensors, n_snapshots) of one step."""

    def solve_batch(
        self,
        snapshots: Sequence[Complex],
        manifold: Manifold,
        priors: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Return the components of independent steps of the same sensors, bins and shape."""


@dataclass(frozen=True)
class SolverSettings(FrozenModel):
    """Settings that all solvers share; see `NewtonSolver` for their meaning."""

    tolerance: float = 1e-4
    max_iterations: int = 500
    max_components: int | None = None
    merge: float | None = None
    snr_db: float | None = None
    tempering: float = 1.0
    power_floor: float | None = None
    max_snr_db: float | None = None

    def __post_init__(self) -> None:
        self._set("tolerance", positive)
        self._set("max_iterations", count)
        self._set("max_components", count)
        self._set("merge", not_negative)
        self._set("snr_db", positive)
        self._set("tempering", positive)
        self._set("power_floor", not_negative)
        self._set("max_snr_db", positive)
        if not number("tempering", self.tempering) >= 1:
            raise ValueError(f"tempering must be at least 1; got {self.tempering:g}")

    def _set(self, name: str, checked: Callable[[str, Any], Any]) -> None:
        if getattr(self, name) is not None:
            object.__setattr__(self, name, checked(name, getattr(self, name)))

    def check(self, manifold: Manifold, n_snapshots: int, n_moments: int) -> None:
        """Raise ValueError if the solver does not support such measurements."""

    def converted(self, kind: type[Settings]) -> Settings:
        """Return a solver of that kind with the settings that all solvers share."""
        if isinstance(self, kind):
            return self
        return kind(**{each.name: getattr(self, each.name) for each in fields(SolverSettings)})

    def n_components(self, n_sensors: int) -> int:
        """Return the largest number of components for an array of n_sensors."""
        return min(n_sensors, self.max_components or n_sensors)

    def merge_distance(self, with_prior: bool) -> float:
        """Return the distance, rad, below which components are merged; 0 for never."""
        if self.merge is None:
            return MERGE_DISTANCE if with_prior else 0.0
        return self.merge

    def initial_snr_db(self, prior: ComponentPrior | None) -> float | None:
        """Return the signal-to-noise ratio of the initial noise; None to estimate it."""
        return prior.snr_db if self.snr_db is None and prior is not None else self.snr_db


def drifted(nuisance: Float) -> Float:
    """Return densities (..., n) of a second unknown after a step, on its grid.

    It stays with probability 0.9, and else goes to a neighbour; a trace is anywhere.

    Examples
    --------
    >>> drifted(np.array([0.0, 1.0, 0.0])).round(4)
    array([0.05  , 0.8999, 0.05  ])
    """
    left, right = nuisance[..., :1], nuisance[..., -1:]
    wide = np.concatenate([left, nuisance, right], axis=-1)
    shifted = 0.9 * nuisance + 0.05 * (wide[..., :-2] + wide[..., 2:])
    return np.asarray((1 - 1e-4) * shifted + 1e-4 / nuisance.shape[-1])


class ModeBelief(Protocol):
    """Components with the modes of a walk that may stand still, as `SVALSE` has them."""

    mu: Float
    kappa: Float
    modes: Float

    @property
    def tracked(self) -> Bool:
        """Slots that hold a tracked component."""


def with_modes(
    walk: MoveStopWalk,
    priors: Sequence[ModeBelief],
    posteriors: Sequence[ComponentPosterior],
) -> list[ComponentPosterior]:
    """Return posteriors in which the modes of the walk have been updated, in one array program.

    The data's part of each posterior, relative to its prior, is a measurement of the angle.

    Parameters
    ----------
    walk : MoveStopWalk
    priors : sequence of ModeBelief
        Predicted components, one record for each posterior.
    posteriors : sequence of ComponentPosterior

    Returns
    -------
    list of ComponentPosterior
        With `modes`, and the angles and variances of the mixtures.
    """
    n = [min(int(p.tracked.sum()), len(q.theta)) for p, q in zip(priors, posteriors, strict=True)]
    first = [np.flatnonzero(p.tracked)[:m] for p, m in zip(priors, n, strict=True)]
    mu = np.concatenate([p.mu[on] for p, on in zip(priors, first, strict=True)])
    prior_kappa = np.concatenate([p.kappa[on] for p, on in zip(priors, first, strict=True)])
    prior_variance = 1 / np.maximum(prior_kappa, MIN_KAPPA)
    modes = np.concatenate([p.modes[:, on] for p, on in zip(priors, first, strict=True)], axis=1)
    modes = walk.renewed(modes, prior_variance)
    theta, active = (
        np.concatenate([getattr(q, name)[:m] for q, m in zip(posteriors, n, strict=True)])
        for name in ("theta", "active")
    )
    kappa = np.concatenate([_marginal(q)[:m] for q, m in zip(posteriors, n, strict=True)])
    # D = 1/v - 1/v_p;  R = 1/D;  δ = wrap(θ - μ) R/v: the pseudo-measurement and its variance
    D = kappa - 1 / prior_variance
    informed = active & (MIN_INFORMATION / prior_variance < D)
    R = 1 / np.where(informed, D, 1.0)
    shift, variance, updated = walk.update(modes, wrap(theta - mu) * kappa * R, R)
    modes = np.where(informed[:, None], updated, modes)
    theta = wrap(mu + np.where(informed, shift, 0.0))
    variance = np.where(informed, variance, prior_variance)
    ends = np.cumsum(n)[:-1]
    parts = zip(
        posteriors,
        np.split(theta, ends),
        np.split(variance, ends),
        np.split(modes, ends, axis=1),
        strict=True,
    )
    return [_merged(*part) for part in parts]


def _merged(
    posterior: ComponentPosterior, theta: Float, variance: Float, modes: Float
) -> ComponentPosterior:
    """Return a posterior with other densities of its first components."""
    m = len(theta)
    old_theta, old_kappa = posterior.theta, _marginal(posterior)
    # stated variance: V v_stated/v
    ratio = -2 * np.log(posterior.resultant[:m]) * old_kappa[:m]
    return replace(
        posterior,
        theta=np.concatenate([theta, old_theta[m:]]),
        kappa=np.concatenate([1 / variance, old_kappa[m:]]),
        resultant=np.concatenate([np.exp(-0.5 * variance * ratio), posterior.resultant[m:]]),
        modes=np.concatenate([modes, np.zeros((3, len(old_kappa) - m, 2))], axis=1),
    )


def _marginal(posterior: ComponentPosterior) -> Float:
    """Return the concentrations of the marginal densities."""
    return posterior.kappa if posterior.marginal_kappa is None else posterior.marginal_kappa
