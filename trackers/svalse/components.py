"""Prior and posterior of the components of VALSE and SVALSE, and their solvers' interface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol, TypeVar

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold, is_point_manifold
from arrivals.parameters import FrozenModel
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import count, not_negative, number, positive

Settings = TypeVar("Settings", bound="SolverSettings")
MERGE_DISTANCE = float(np.deg2rad(1.5))  # rad of direction, of tracked components


@dataclass(frozen=True, eq=False)
class ComponentPrior:
    """Prior of the components of a step, (65).

    Parameters
    ----------
    mu, kappa : ndarray, shape (n_tracked,)
        Von Mises densities of the angles of the tracked components; rad. Of a `PointManifold`
        points (n_tracked, point_size) and the upper triangles of precisions.
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
    curved : ndarray of bool, shape (n_tracked,), optional
        Which components are curved waves, of those that are plane or curved; None of plane ones.
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
    curved: Bool | None = None


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
    covariance : ndarray, shape (n_components, d(d+1)/2), optional
        Of a `PointManifold`, in place of `resultant`: upper triangles of the stated covariances;
        `theta` has points (n_components, point_size), `kappa` triangles of precisions.
    curved : ndarray of bool, shape (n_components,), optional
        Which components are curved waves, of those that are plane or curved.
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
    covariance: Float | None = None
    curved: Bool | None = None

    def changed(self, **parts: Any) -> ComponentPosterior:
        """Return the posterior with other parts: `dataclasses.replace`, four times as fast."""
        new = object.__new__(ComponentPosterior)
        new.__dict__.update(self.__dict__, **parts)
        return new


class TrackedComponents(Protocol):
    """Components with the modes of a walk that may stand still, as `SVALSE` has them."""

    mu: Float
    kappa: Float
    modes: Float
    curved: Bool

    @property
    def tracked(self) -> Bool:
        """Slots that hold a tracked component."""


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


def no_components(manifold: Manifold) -> ComponentPosterior:
    """Return the posterior of a step without components."""
    none, no_flag = np.zeros(0), np.zeros(0, dtype=np.bool_)
    points, triangles = none, none
    if is_point_manifold(manifold):
        d = manifold.n_unknowns
        points, triangles = np.zeros((0, manifold.point_size)), np.zeros((0, d * (d + 1) // 2))
    return ComponentPosterior(
        theta=points,
        resultant=none,
        kappa=triangles,
        active=no_flag,
        age=np.zeros(0, dtype=np.int64),
        amplitude=np.zeros(0, dtype=np.complex128),
        evidence=none,
        noise=0.0,
        power=0.0,
        iterations=0,
        converged=True,
    )
