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
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior
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
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR, autocorrelation, first_noise
from arrivals.typing import Complex, Int

PosteriorName = Literal["quadrature", "mixture"]


@dataclass(frozen=True)
class CoordinateSolver:
    """Settings of the ascent.

    Parameters
    ----------
    posterior : {"quadrature", "mixture"}
        How the moments of an angle are integrated; "mixture" is the papers' heuristic.
    tolerance : float
        Relative change of the reconstruction at which it rests.
    max_iterations : int
    merge : float
        Two active components nearer than this, rad of direction, become one; 0 for never.
    snr_db : float or None
        Signal-to-noise ratio from which the noise starts. None estimates it from the lags of a
        line; elsewhere it is the noise of the last step for several looks, if it is known, or
        that of 20 dB.
    max_components : int or None
        As many as there are sensors if None.
    descending : bool
        Order of the mixture's factors.
    temper : float
        Looks of a step that count as one.
    power_floor : float or None
        Power, in units of one look's noise after beamforming, below which nothing is a source;
        None is 0 for one look and 3 for several.
    max_snr_db : float or None
        Signal-to-noise ratio beyond which what is left of the data is laid to the model.
    n_moments : int
        Moments of the angles' densities to carry; 0 for von Mises densities.
    """

    posterior: PosteriorName = "quadrature"
    tolerance: float = 1e-4
    max_iterations: int = 500
    merge: float = np.deg2rad(1.5)
    snr_db: float | None = 20.0
    max_components: int | None = None
    descending: bool = False
    temper: float = 1.0
    power_floor: float | None = None
    max_snr_db: float | None = None
    n_moments: int = 0

    def fit(
        self, Y: Complex, manifold: Manifold, prediction: ComponentPrior | None
    ) -> ComponentPosterior:
        """Fit the looks of one step: start, then iterate (sections III and IV, Fig. 3).

        Parameters
        ----------
        Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
        manifold : Manifold
        prediction : Prediction or None
            None in a first step and in VALSE: nothing is known.
        """
        if not Y.any():
            return SILENCE
        if self._for_a_line(Y, manifold):
            return self.iterate(self.step(Y[0, :, 0], manifold, prediction))
        return self.iterate(MultiSnapshotAscent(self, Y, manifold, prediction))

    def iterate(self, step: SingleSnapshotAscent | MultiSnapshotAscent) -> ComponentPosterior:
        """Improve support, variances and angles in turn until the reconstruction rests."""
        x, converged, most = step.start(), False, self.max_iterations
        while not converged and step.iterations < most and not step.cycles(most):
            step.iterations += 1
            step.choose_support()
            step.learn_variances()
            step.learn_odds()
            step.refine_angles()
            step.merge(self.merge)
            x_old, x = x, step.reconstruction()
            converged = step.rests(x, x_old)
        return step.result(converged)

    def fit_batch(
        self,
        Ys: Sequence[Complex],
        manifold: Manifold,
        predictions: Sequence[ComponentPrior | None],
    ) -> list[ComponentPosterior]:
        """Fit independent snapshots of one array, one after the other."""
        return [self.fit(Y, manifold, known) for Y, known in zip(Ys, predictions, strict=True)]

    def _for_a_line(self, Y: Complex, manifold: Manifold) -> bool:
        """Tell whether the short form for one look of a line on a grid serves."""
        plain = not self.power_floor and self.max_snr_db is None and self.n_moments == 0
        line = manifold.coefficients is None and Y.shape[0] == Y.shape[2] == 1
        return plain and line and self.temper == 1

    def step(
        self, y: Complex, manifold: Manifold, prediction: ComponentPrior | None
    ) -> SingleSnapshotAscent:
        """Return the working state for one snapshot."""
        return SingleSnapshotAscent(self, y, manifold, prediction)


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
        nu = first_noise(y, self.k, settings.snr_db)
        tau = max(power - nu, NOISE_FLOOR * power) / places.n_expected
        super().__init__(y, places.rho, nu, tau)
        self.begin(places)
        self.prior, self.mean = np.zeros((2, L), dtype=np.complex128)
        self.prior[:n] = known.kappa[:n] * np.exp(1j * known.mu[:n])
        self.integrate: AnglePosterior = quadrature
        self.first_mode: AnglePosterior = top_mode
        if settings.posterior == "mixture":
            self.integrate = partial(mixture, descending=settings.descending)
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
