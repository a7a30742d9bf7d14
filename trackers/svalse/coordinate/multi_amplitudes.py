"""Bernoulli-Gaussian amplitudes of components that several snapshots share.

Data have n_bins frequencies and n_snapshots snapshots. Support and angles are common; amplitudes
are free; the variances of noise and amplitudes are those of a bin. Equation numbers are those of
Park, Meyer and Gerstoft, JASA 153(1), 2023, summed over bins and snapshots.
"""

from __future__ import annotations

import numpy as np

from arrivals.trackers.svalse.coordinate.support import GreedySupport, InitialSupport
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR
from arrivals.typing import Complex, Float, Int


class MultiSnapshotAmplitudes(GreedySupport):
    """Support, amplitudes and variances of L components with given mean steering vectors.

    Attributes
    ----------
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
    A : ndarray, shape (n_bins, L, n_sensors)
        Mean steering vectors â.
    J, H : ndarray, shapes (n_bins, L, L), (n_bins, L, n_snapshots)
        Their products with each other (49), the diagonal ⟨‖a‖²⟩, and with the data (50).
    norm : ndarray, shape (n_bins, L)
        ⟨‖a‖²⟩ of each component.
    C, W : ndarray, shapes (n_bins, L, L), (n_bins, L, n_snapshots)
        Covariances (52), the same for every snapshot, and means (53), zero off the support.
    Z, g : ndarray, shapes of W and norm
        H - J W, and ν/v of each component that would be added; kept up to date by `flip`.
    nu, tau : ndarray, shape (n_bins,)
        Variances of noise and of active amplitudes.
    tempering : float
        Snapshots that count as one: divides the evidence of each.
    power_floor : float
        Minimum power of a source, in units of the noise of one snapshot after beamforming.
    noise_floor : float
        Minimum noise, as a fraction of the power.
    """

    power_floor = 0.0
    noise_floor = NOISE_FLOOR

    def __init__(
        self,
        Y: Complex,
        initial: InitialSupport,
        nu: Float,
        tau: Float,
        norm: Float,
        tempering: float = 1.0,
    ) -> None:
        super().__init__(initial)
        F, M, N = Y.shape
        L = len(initial.rho)
        self.Y, self.nu, self.tau, self.tempering = Y, nu, tau, tempering
        self.power = (Y.real**2 + Y.imag**2).sum(axis=(1, 2))
        self.A = np.zeros((F, L, M), dtype=np.complex128)
        self.J, self.C = np.zeros((2, F, L, L), dtype=np.complex128)
        self.H, self.W, self.Z = np.zeros((3, F, L, N), dtype=np.complex128)
        self.g = np.zeros((F, L))
        self.norm = np.repeat(norm[:, None], L, axis=1)
        self.mean_norm = norm

    def refresh(self, changed: Int) -> None:
        """Recompute J (49) and H (50) of components whose steering vectors changed."""
        conj = self.A[:, changed].conj()
        rows = conj @ self.A.swapaxes(1, 2)
        rows[:, np.arange(len(changed)), changed] = self.norm[:, changed]  # ⟨‖a‖²⟩, not ‖â‖²
        self.J[:, changed] = rows
        self.J[:, :, changed] = rows.conj().swapaxes(1, 2)
        self.H[:, changed] = conj @ self.Y

    def clear(self) -> None:
        """Set the amplitudes of all components to zero."""
        self.C[:], self.W[:] = 0, 0

    def reset_gains(self) -> None:
        """Recompute the quantities that `flip` updates: Z = H - J W and g = ν/v, for zero W."""
        self.Z[:] = self.H
        np.add(self.norm, (self.nu / self.tau)[:, None], out=self.g)
        with np.errstate(divide="ignore"):
            log_odds = np.log(self.rho) - np.log1p(-self.rho)
        # ln τ once per bin and snapshot
        self.log_odds = log_odds - self.Y.shape[2] * np.log(self.tau).sum() / self.tempering

    def gains(self) -> Float:
        """Return by how much the ELBO (56) would rise if each component were flipped, Δ."""
        v = self.nu[:, None] / self.g  # of an addition
        U = self.Z / self.g[..., None]
        np.copyto(v, np.diagonal(self.C, axis1=1, axis2=2).real, where=self.active)
        np.copyto(U, self.W, where=self.active[:, None])
        energy = (U.real**2 + U.imag**2).sum(axis=2)
        fit = self.Y.shape[2] * np.log(v) + energy / v
        gain = fit.sum(axis=0) / self.tempering + self.log_odds
        if np.count_nonzero(self.active) >= self.Y.shape[1] - 1:
            gain[~self.active] = -np.inf
        return np.asarray(np.negative(gain, out=gain, where=self.active))

    def flip(self, k: int) -> None:
        """Add component k to the support or remove it: a rank-one change of C and W in each bin."""
        if self.active[k]:
            pivot = self.C[:, k, k].real
            e, alpha, gamma = self.C[:, :, k] / pivot[:, None], -pivot, -self.W[:, k]
        else:
            e = (self.C @ self.J[:, :, k, None])[..., 0] / -self.nu[:, None]
            e[:, k] = 1.0
            alpha = self.nu / self.g[:, k]
            gamma = self.Z[:, k] / self.g[:, k, None]
        r = (e.conj()[:, None] @ self.J)[:, 0]
        self.C += (alpha[:, None] * e)[:, :, None] * e.conj()[:, None]
        self.W += e[:, :, None] * gamma[:, None]
        self.Z -= r.conj()[:, :, None] * gamma[:, None]
        self.g -= (alpha / self.nu)[:, None] * (r.real**2 + r.imag**2)
        # ν/τ is the lower bound of g: rounding must not cross it
        np.maximum(self.g, (self.nu / self.tau)[:, None], out=self.g)
        if self.active[k]:
            self.C[:, k], self.C[:, :, k], self.W[:, k] = 0, 0, 0
        self.active[k] = not self.active[k]

    def update_amplitudes(self) -> None:
        """Compute C (52) and W (53) for the present support."""
        on = np.flatnonzero(self.active)
        block = (slice(None), on[:, None], on)
        nu = self.nu[:, None, None]
        ridge = (self.nu / self.tau)[:, None, None] * np.eye(len(on))
        self.clear()
        # C = ν (J + ν/τ I)⁻¹   (52)
        self.C[block] = nu * np.linalg.inv(self.J[block] + ridge)
        # W = C H / ν   (53)
        self.W[:, on] = self.C[block] @ self.H[:, on] / nu

    def update_variances(self) -> None:
        """Maximise the ELBO over ν (58) and τ (59) of each bin, above their floors."""
        M, N = self.Y.shape[1:]
        K = np.count_nonzero(self.active)
        if K == 0:
            self.nu = self.power / (M * N)
            return
        # ν = [‖Y‖² - 2 Re tr(Hᴴ W) + tr(Wᴴ J W) + N tr(J C)] / M N   (58)
        explained = inner(self.W, 2 * self.H - self.J @ self.W)
        spread = N * inner(self.C, self.J)
        floor = self.noise_floor * self.power / (M * N)
        self.nu = np.maximum((self.power - explained + spread) / (M * N), floor)
        # τ = [‖W‖² + N tr C] / N K   (59)
        energy = inner(self.W, self.W) + N * np.einsum("fii->f", self.C).real
        self.tau = np.maximum(energy / (N * K), self.power_floor * self.nu / self.mean_norm)

    def reconstruction(self) -> Complex:
        """Return X̂ = Σ â ŵ, (n_bins, n_sensors, n_snapshots)."""
        return np.asarray(self.A.swapaxes(1, 2) @ self.W)

    def elbo(self) -> float:
        """Return the ELBO as a function of the support (56), for the C and W of that support."""
        on = np.flatnonzero(self.active)
        M, N = self.Y.shape[1:]
        C, H = self.C[:, on[:, None], on], self.H[:, on]
        fit = inner(H, C @ H) / self.nu**2 + N * np.linalg.slogdet(C)[1]
        noise = -M * N * np.log(np.pi * self.nu) - self.power / self.nu
        bins = (fit + noise - N * len(on) * np.log(self.tau)).sum() / self.tempering
        return float(bins + np.where(self.active, np.log(self.rho), np.log1p(-self.rho)).sum())


def inner(a: Complex, b: Complex) -> Float:
    """Return Re tr(aᴴ b) of each bin."""
    F = len(a)
    return np.asarray((a.conj().reshape(F, 1, -1) @ b.reshape(F, -1, 1)).real[:, 0, 0])
