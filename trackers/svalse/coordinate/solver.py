"""Coordinate ascent on the ELBO of a line spectrum: the loop of VALSE and of SVALSE's update.

Support, noise and angles are improved in turn until the reconstruction rests. Equation numbers
are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.motion_models.bessel import inverse_bessel_ratio
from arrivals.trackers.svalse.components import (
    ComponentPosterior,
    ComponentPrior,
    SolverSettings,
)
from arrivals.trackers.svalse.coordinate.angle_posterior import (
    AnglePosterior,
    fold,
    mixture,
    nearest_modes,
    quadrature,
    top_mode,
    unfold,
)
from arrivals.trackers.svalse.coordinate.multi_snapshot import MultiSnapshotAscent
from arrivals.trackers.svalse.coordinate.single_snapshot import Amplitudes
from arrivals.trackers.svalse.coordinate.support import InitialSupport
from arrivals.trackers.svalse.noise_initialization import (
    NOISE_FLOOR,
    autocorrelation,
    initial_noise,
)
from arrivals.typing import Complex, Int
from arrivals.validation import one_of

PosteriorName = Literal["quadrature", "mixture"]


@dataclass(frozen=True)
class CoordinateSolver(SolverSettings):
    """Coordinate ascent on the ELBO: one angle after the other, as in the papers.

    Parameters
    ----------
    tolerance : float
        Relative change of the reconstruction at which the iteration stops; the paper's is 1e-6.
    max_iterations : int
        Largest number of iterations of a step; one that needs more is reported as not converged.
    max_components : int, optional
        Largest number of components; that of the sensors if None.
    merge : float, optional
        Distance, rad of direction, below which the later of two active components is removed; 0
        for never. None is 1.5 degrees for tracked components (SVALSE) and 0 for independent
        snapshots (VALSE).
    snr_db : float, optional
        Signal-to-noise ratio from which the noise starts in every step. None is 20, or the noise
        of the previous step if a step has several snapshots; for one snapshot of a line without a
        prior (VALSE) it is estimated from the lags.
    tempering : float
        Number of snapshots that count as one, at least 1.
    power_floor : float, optional
        Smallest power of a source, in units of the noise of one snapshot after beamforming. None
        is 0 for one snapshot a step and 3 for several.
    max_snr_db : float, optional
        Signal-to-noise ratio that bounds the noise from below: model errors count as noise.
    posterior : {"quadrature", "mixture"}
        Integration of the densities of the angles; "mixture" is the papers' Heuristic 1.
    descending : bool, optional
        Order of the mixture's factors. None is descending without a prior (VALSE) and ascending
        with one (SVALSE).
    """

    posterior: PosteriorName = "quadrature"
    descending: bool | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        one_of("posterior", self.posterior, ("quadrature", "mixture"))

    def check(self, manifold: Manifold, n_snapshots: int, n_moments: int) -> None:
        """Raise ValueError if the mixture does not support such measurements."""
        if self.posterior == "quadrature":
            return
        if n_moments:
            raise ValueError(
                'memory="posterior" requires posterior="quadrature"; got posterior="mixture"'
            )
        if manifold.coefficients is not None:
            raise ValueError(
                'posterior="mixture" requires a line on a uniform grid, at one wavelength'
            )
        if n_snapshots > 1 or len(manifold.nuisance_weights) > 1:
            raise ValueError('posterior="mixture" requires one snapshot a step')

    def solve(
        self, snapshots: Complex, manifold: Manifold, prior: ComponentPrior | None
    ) -> ComponentPosterior:
        """Fit the snapshots of one step: start, then iterate (sections III and IV, Fig. 3).

        Parameters
        ----------
        snapshots : ndarray, shape (n_bins, n_sensors, n_snapshots)
        manifold : Manifold
        prior : ComponentPrior or None
            None in VALSE.
        """
        if not snapshots.any():
            return SILENCE
        merge = self.merge_distance(prior)
        if self._for_a_line(snapshots, manifold, prior):
            return self.iterate(self.step(snapshots[0, :, 0], manifold, prior), merge)
        return self.iterate(MultiSnapshotAscent(self, snapshots, manifold, prior), merge)

    def iterate(
        self, step: SingleSnapshotAscent | MultiSnapshotAscent, merge: float
    ) -> ComponentPosterior:
        """Improve support, variances and angles in turn until the reconstruction rests."""
        x, converged, most = step.start(), False, self.max_iterations
        while not converged and step.iterations < most and not step.cycles(most):
            step.iterations += 1
            step.choose_support()
            step.learn_variances()
            step.learn_odds()
            step.refine_angles()
            step.merge(merge)
            x_old, x = x, step.reconstruction()
            converged = step.rests(x, x_old)
        return step.result(converged)

    def solve_batch(
        self,
        snapshots: Sequence[Complex],
        manifold: Manifold,
        priors: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Fit independent snapshots of one array, one after the other."""
        return [self.solve(Y, manifold, prior) for Y, prior in zip(snapshots, priors, strict=True)]

    def _for_a_line(self, Y: Complex, manifold: Manifold, prior: ComponentPrior | None) -> bool:
        """Tell whether the short form for one look of a line on a grid serves."""
        plain = not self.power_floor and self.max_snr_db is None
        whole = prior is not None and prior.n_moments > 0
        line = manifold.coefficients is None and Y.shape[0] == Y.shape[2] == 1
        return plain and not whole and line and self.tempering == 1

    def step(
        self, y: Complex, manifold: Manifold, prior: ComponentPrior | None
    ) -> SingleSnapshotAscent:
        """Return the working state for one snapshot."""
        return SingleSnapshotAscent(self, y, manifold, prior)


class SingleSnapshotAscent(Amplitudes):
    """The working state of one snapshot: amplitudes, and the angles of the components.

    Attributes
    ----------
    prior : ndarray, shape (L,)
        Parameters η = κ exp(jμ) of the predicted von Mises densities; 0 for a fresh component.
    mean : ndarray, shape (L,)
        ⟨exp(jθ)⟩ of the present ones; its length is the resultant.
    """

    def __init__(
        self,
        settings: CoordinateSolver,
        y: Complex,
        manifold: Manifold,
        prediction: ComponentPrior | None,
    ) -> None:
        M = len(y)
        L = min(M, settings.max_components or M)
        self.settings, self.manifold, self.k = settings, manifold, manifold.harmonics
        self.degree = max(int(np.abs(self.k).max()), 1)
        places = InitialSupport.of(prediction, L)
        known, n = places.known, places.n_carried
        power = float(np.vdot(y, y).real) / M
        nu = initial_noise(y, self.k, settings.initial_snr_db(prediction))
        tau = max(power - nu, NOISE_FLOOR * power) / places.n_expected
        super().__init__(y, places.rho, nu, tau)
        self.begin(places)
        self.prior, self.mean = np.zeros((2, L), dtype=np.complex128)
        self.prior[:n] = known.kappa[:n] * np.exp(1j * known.mu[:n])
        self.integrate: AnglePosterior = quadrature
        self.first_mode: AnglePosterior = top_mode
        if settings.posterior == "mixture":
            descending = settings.descending
            descending = prediction is None if descending is None else descending
            self.integrate = partial(mixture, descending=descending)
            self.first_mode = nearest_modes

    def start(self) -> Complex:
        """Bring in the components one by one, each on the residual of those before (66)-(68).

        Returns the reconstruction by the first K₀, the first reference of the stopping rule.
        """
        reference = np.zeros_like(self.y)
        for k in range(len(self.w)):
            if k < self.n_carried:
                self.mean[k] = np.exp(1j * np.angle(self.prior[k]))
                self.A[k] = np.exp(1j * np.angle(self.prior[k]) * self.k)
            else:
                residual = self.y - self.w[:k] @ self.A[:k]
                lags = autocorrelation(residual, self.k)
                eta = 2 * lags / (self.nu * (len(self.y) + self.nu / self.tau))
                moments, self.mean[k] = self.first_mode(eta.conj())
                self.A[k] = unfold(moments, self.k)
            self.refresh(np.array([k]))
            j = self.J[:, k]
            self.g[k] = len(self.y) + self.nu / self.tau - np.vdot(j, self.C @ j).real / self.nu
            self.z[k] = self.h[k] - self.J[k] @ self.w
            self.flip(k)
            if k + 1 == self.n_expected:
                reference = self.w @ self.A
        return reference

    def refine_angles(self) -> None:
        """Update q(θ) of each active component, each on the newest of the others (32)-(33).

        ηₗ = 2/ν [y ŵ*ₗ - Σ (ŵₗ' ŵ*ₗ + Ĉₗ'ₗ) âₗ'], the sum over all others: rows of two products.
        """
        on = np.flatnonzero(self.active)
        w, A = self.w[on], self.A[on]
        others = np.multiply.outer(w.conj(), w)
        others.flat[:: len(on) + 1] = 0
        others += self.covariances(on).T
        others *= 2 / self.nu
        alone = np.multiply.outer(2 / self.nu * w.conj(), self.y)
        priors = self.prior[on].conj()
        for i in range(len(on)):
            c = fold(alone[i] - others[i] @ A, self.k, self.degree)
            c[1] += priors[i]
            moments, self.mean[on[i]] = self.integrate(c)
            A[i] = unfold(moments, self.k)
        self.A[on] = A
        self.refresh(on)

    def covariances(self, on: Int) -> Complex:
        """Return the covariances of the active amplitudes with each other, zero on the diagonal."""
        C = self.C[on[:, None], on]
        C.flat[:: len(on) + 1] = 0
        return C

    def rests(self, x: Complex, x_old: Complex) -> bool:
        """Tell whether the reconstruction moved by less than the tolerance."""
        rests = np.linalg.norm(x - x_old) < self.settings.tolerance * np.linalg.norm(x_old)
        return bool(rests or not (x.any() or x_old.any()))

    def result(self, converged: bool) -> ComponentPosterior:
        """Return the fit."""
        resultant = np.minimum(np.abs(self.mean), 1 - 1e-15)
        return ComponentPosterior(
            theta=np.angle(self.mean),
            resultant=resultant,
            kappa=inverse_bessel_ratio(resultant),
            active=self.active.copy(),
            age=self.age,
            amplitude=self.w.copy(),
            evidence=self.evidence(),
            noise=self.nu,
            power=self.tau,
            iterations=self.iterations,
            converged=converged,
        )


SILENCE = ComponentPosterior(
    theta=np.zeros(0),
    resultant=np.zeros(0),
    kappa=np.zeros(0),
    active=np.zeros(0, dtype=np.bool_),
    age=np.zeros(0, dtype=np.int64),
    amplitude=np.zeros(0, dtype=np.complex128),
    evidence=np.zeros(0),
    noise=0.0,
    power=0.0,
    iterations=0,
    converged=True,
)
