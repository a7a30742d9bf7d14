"""What goes into an engine of VALSE and SVALSE, and what comes out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.typing import Bool, Complex, Float, Int


@dataclass(frozen=True, eq=False)
class ComponentPrior:
    """What is known of the components before the snapshot, (65).

    Parameters
    ----------
    mu, kappa : ndarray, shape (n_carried,)
        Von Mises densities of the angles of the components carried over; rad.
    existence : ndarray, shape (n_carried,)
        Probability that each is active.
    birth : float
        Probability that a component that was not carried is active.
    age : ndarray of int, shape (n_carried,), optional
        Steps since each was last active; 0 for all if None.
    snr_db : float, optional
        Signal-to-noise ratio of the steps before, where the noise may start.
    noise : ndarray, shape (n_bins,), optional
        Noise variances of the last step, NaN where a bin was silent.
    nuisance : ndarray, shape (n_carried, n_nuisance), optional
        Densities of the second unknown.
    moments : ndarray, shape (n_carried, n_moments), optional
        Whole densities of the angles, ⟨exp(jiθ)⟩, i = 0, 1, ..., in place of `mu` and `kappa`.
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


@dataclass(frozen=True, eq=False)
class ComponentPosterior:
    """The components after the snapshot, those carried over first.

    Parameters
    ----------
    theta : ndarray, shape (n_components,)
        Mean angles, rad.
    resultant : ndarray, shape (n_components,)
        Lengths of the mean of exp(jθ): 1 for an angle that is known, 0 for one that is not.
    kappa : ndarray, shape (n_components,)
        Concentrations of von Mises densities that stand for those of the angles.
    active : ndarray of bool, shape (n_components,)
        Components in use at the end.
    age : ndarray of int, shape (n_components,)
        Steps since each was in use, 0 for those that are; -1 for those to be forgotten.
    amplitude : ndarray, shape (n_components,)
        Posterior means, zero where not active.
    evidence : ndarray, shape (n_components,)
        By how much the ELBO would fall if an active component were removed, nats.
    noise, power : float
        Variances of the noise of a sensor (58) and of an amplitude (59), means over bins.
    iterations : int
    converged : bool
    snr_db : float, optional
        Where the noise of the next step may start.
    bin_noise, nuisance, moments : ndarray, optional
        As in `ComponentPrior`, of all components; None from engines for one look of a line.
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


class Solver(Protocol):
    """Maximises the ELBO of one step."""

    def fit(
        self, Y: Complex, manifold: Manifold, prediction: ComponentPrior | None
    ) -> ComponentPosterior:
        """Fit data (n_bins, n_sensors, n_snapshots), with what is known of the components."""

    def fit_batch(
        self,
        Ys: Sequence[Complex],
        manifold: Manifold,
        predictions: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Fit independent snapshots of one array."""
