"""Fast form of coordinate ascent for one snapshot of a line on a uniform grid.

The state is that of several snapshots; what every iteration repeats works on its single bin and
snapshot. Equation numbers are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.trackers.svalse.coordinate.angle_posterior import (
    AnglePosterior,
    fold,
    nearest_modes,
    top_mode,
    unfold,
)
from arrivals.trackers.svalse.coordinate.multi_snapshot import MultiSnapshotAscent
from arrivals.trackers.svalse.noise_initialization import (
    NOISE_FLOOR,
    autocorrelation,
    initial_noise,
)
from arrivals.typing import Complex, Float, Int

if TYPE_CHECKING:
    from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver


class SingleSnapshotAscent(MultiSnapshotAscent):
    """State of one snapshot of a line: as `MultiSnapshotAscent`, n_bins = n_snapshots = 1.

    Attributes
    ----------
    views : tuple of ndarray, shapes (L, L), (L, L), (L,), (L,), (L,)
        C, J, w, z = h - J w and g of the one snapshot, in the memory of C, J, W, Z and g.
    """

    def __init__(
        self,
        settings: CoordinateSolver,
        Y: Complex,
        manifold: AngleManifold,
        prior: ComponentPrior | None,
    ) -> None:
        super().__init__(settings, Y, manifold, prior)
        self.views = self.C[0], self.J[0], self.W[0, :, 0], self.Z[0, :, 0], self.g[0]

    @staticmethod
    def applies(
        settings: CoordinateSolver,
        Y: Complex,
        manifold: AngleManifold,
        prior: ComponentPrior | None,
    ) -> bool:
        """Return True if data and settings are those of the paper: one snapshot of a line."""
        line = manifold.coefficients is None and Y.shape[0] == Y.shape[2] == 1
        floors = bool(settings.power_floor) or settings.max_snr_db is not None
        von_mises = prior is None or prior.n_moments == 0
        return line and von_mises and not floors and settings.tempering == 1

    def initial_noise(self, Y: Complex, power: Float, prior: ComponentPrior | None) -> Float:
        """Return ν of the expected SNR, or by the small eigenvalues of the lags."""
        return np.array([initial_noise(Y[0, :, 0], self.k, self.settings.initial_snr_db(prior))])

    def initialize_component(self, k: int, residual: Complex) -> None:
        """Set a new component to the top mode of the residual's lags, (66)-(68)."""
        top: AnglePosterior = nearest_modes if self.settings.posterior == "mixture" else top_mode
        nu, tau = self.nu.item(), self.tau.item()
        # η = 2 R / ν (M + ν/τ)
        eta = 2 * autocorrelation(residual[0, :, 0], self.k) / (nu * (len(self.k) + nu / tau))
        moments, self.mean[k] = top(eta.conj())
        self.set_response(k, moments[None])

    def gains(self) -> Float:
        """Return by how much the ELBO (56) would rise if each component were flipped, Δ."""
        C, _, w, z, g = self.views
        v, u = self.nu.item() / g, z / g  # of an addition
        np.copyto(v, C.diagonal().real, where=self.active)
        np.copyto(u, w, where=self.active)
        gain = np.log(v) + (u.real**2 + u.imag**2) / v + self.log_odds
        if np.count_nonzero(self.active) >= len(self.k) - 1:
            gain[~self.active] = -np.inf
        return np.asarray(np.negative(gain, out=gain, where=self.active))

    def flip(self, k: int) -> None:
        """Add component k to the support or remove it: a rank-one change of C and w."""
        C, J, w, z, g = self.views
        nu = self.nu.item()
        if self.active[k]:
            pivot = C[k, k].real
            e, alpha, gamma = C[:, k] / pivot, -pivot, -w[k]
        else:
            e = C @ J[:, k] / -nu
            e[k] = 1.0
            alpha, gamma = nu / g[k], z[k] / g[k]
        r = e.conj() @ J
        C += np.multiply.outer(alpha * e, e.conj())
        w += gamma * e
        z -= gamma * r.conj()
        g -= alpha / nu * (r.real**2 + r.imag**2)
        # ν/τ is the lower bound of g: rounding must not cross it
        np.maximum(g, nu / self.tau.item(), out=g)
        if self.active[k]:
            C[k], C[:, k], w[k] = 0, 0, 0
        self.active[k] = not self.active[k]

    def update_variances(self) -> None:
        """Maximise the ELBO over ν (58) and τ (59); keep both if no component is active."""
        K, M = np.count_nonzero(self.active), len(self.k)
        if K == 0:
            return
        C, J, w, _, _ = self.views
        power, h = self.power.item(), self.H[0, :, 0]
        # ν = [‖y‖² - 2 Re(hᴴ w) + wᴴ J w + tr(J C)] / M   (58)
        misfit = power - np.vdot(w, 2 * h - J @ w).real + np.vdot(C, J).real
        self.nu = np.array([max(misfit, NOISE_FLOOR * power) / M])
        # τ = [‖w‖² + tr C] / K   (59)
        self.tau = np.array([(np.vdot(w, w).real + C.trace().real) / K])

    def update_angles(self) -> None:
        """Update q(θ) of each active component, given the present densities of the others.

        ηₗ = 2/ν [y ŵ*ₗ - Σ (ŵₗ' ŵ*ₗ + Ĉₗ'ₗ) âₗ'], the sum over all others   (33).
        """
        on = np.flatnonzero(self.active)
        w, A = self.W[0, on, 0], self.A[0, on]
        products = np.multiply.outer(w.conj(), w)
        products.flat[:: len(on) + 1] = 0
        products += self.covariances(on).T
        scale = 2 / self.nu.item()
        products *= scale
        data = np.multiply.outer(scale * w.conj(), self.Y[0, :, 0])
        priors = self.eta[on].conj()
        for i, k in enumerate(on):
            c = fold(data[i] - products[i] @ A, self.k, self.degree)
            # (32)
            c[1] += priors[i]
            moments, self.mean[k] = self.posterior(c)
            A[i] = unfold(moments, self.k)
        self.A[0, on] = A
        self.refresh(on)

    def covariances(self, on: Int) -> Complex:
        """Return the covariances of the active amplitudes with each other, zero on the diagonal."""
        C: Complex = self.C[0, on[:, None], on]
        C.flat[:: len(on) + 1] = 0
        return C
