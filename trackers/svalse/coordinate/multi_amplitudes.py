"""Bernoulli-Gaussian amplitudes of components that several looks share.

A look is one snapshot at one frequency: n_bins x n_snapshots of them. Support and angles are
common; amplitudes are free; the variances of noise and amplitudes are those of a bin. With one
look these are the `Amplitudes` of a line. Equation numbers in round brackets are those of Park,
Meyer and Gerstoft, JASA 153(1), 2023, summed over looks.
"""

from __future__ import annotations

import numpy as np

from arrivals.trackers.svalse.coordinate.support import MergedSupport
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR
from arrivals.typing import Complex, Float, Int


class MultiSnapshotAmplitudes(MergedSupport):
    """Which of L components are in use, how strong in each look, and how strong the noise is.

    Attributes
    ----------
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
    A : ndarray, shape (n_bins, L, n_sensors)
        Mean steering vectors â.
    J, H : ndarray, shapes (n_bins, L, L), (n_bins, L, n_snapshots)
        Their products with each other (49), the diagonal ⟨‖a‖²⟩, and with the data (50).
    norm : ndarray, shape (n_bins, L)
        ⟨‖a‖²⟩ of each component.
    active : ndarray of bool, shape (L,)
    C, W : ndarray, shapes (n_bins, L, L), (n_bins, L, n_snapshots)
        Covariances (52), the same for every snapshot, and means (53), zero off the support.
    Z, g : ndarray, shapes of W and norm
        H - J W, and ν/v of each component that would be added; kept up to date by `flip`.
    nu, tau : ndarray, shape (n_bins,)
    rho : ndarray, shape (L,)
    temper : float
        Looks that count as one: divides the evidence of each.
    power_floor : float
        Power below which nothing counts as a source, in units of one look's noise after
        beamforming.
    noise_floor : float
        Least noise, as a share of the power.
    """

    power_floor = 0.0
    noise_floor = NOISE_FLOOR

    def __init__(
        self, Y: Complex, rho: Float, nu: Float, tau: Float, norm: Float, temper: float = 1.0
    ) -> None:
        F, M, N = Y.shape
        L = len(rho)
        self.Y, self.rho, self.nu, self.tau, self.temper = Y, rho, nu, tau, temper
        self.power = (Y.real**2 + Y.imag**2).sum(axis=(1, 2))
        self.A = np.zeros((F, L, M), dtype=np.complex128)
        self.J, self.C = np.zeros((2, F, L, L), dtype=np.complex128)
        self.H, self.W, self.Z = np.zeros((3, F, L, N), dtype=np.complex128)
        self.g = np.zeros((F, L))
        self.norm = np.repeat(norm[:, None], L, axis=1)
        self.mean_norm = norm
        self.active = np.zeros(L, dtype=np.bool_)

    def refresh(self, changed: Int) -> None:
        """Bring J (49) and H (50) up to date for components whose steering vectors changed."""
        conj = self.A[:, changed].conj()
        rows = conj @ np.swapaxes(self.A, 1, 2)
        rows[:, np.arange(len(changed)), changed] = self.norm[:, changed]  # ⟨‖a‖²⟩, not ‖â‖²
        self.J[:, changed] = rows
        self.J[:, :, changed] = np.swapaxes(rows.conj(), 1, 2)
        self.H[:, changed] = conj @ self.Y

    def empty(self) -> None:
        """Set the amplitudes of all components to zero."""
        self.C[:], self.W[:] = 0, 0

    def gains_from_empty(self) -> None:
        """Reset what `flip` keeps up to date: Z = H - J W and g = ν/v."""
        self.Z = self.H.copy()
        self.g = self.norm + (self.nu / self.tau)[:, None]
        with np.errstate(divide="ignore"):
            odds = np.log(self.rho) - np.log1p(-self.rho)
        # ln τ once per bin and snapshot
        self.odds = odds - self.Y.shape[2] * np.log(self.tau).sum() / self.temper

    def deltas(self) -> Float:
        """Return by how much the ELBO (56) would rise if each component were flipped."""
        v = self.nu[:, None] / self.g  # of an addition
        U = self.Z / self.g[..., None]
        np.copyto(v, np.diagonal(self.C, axis1=1, axis2=2).real, where=self.active)
        np.copyto(U, self.W, where=self.active[:, None])
        energy = (U.real**2 + U.imag**2).sum(axis=2)
        looks = self.Y.shape[2] * np.log(v) + energy / v
        gain = looks.sum(axis=0) / self.temper + self.odds
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
        # its bound, whatever the rounding
        np.maximum(self.g, (self.nu / self.tau)[:, None], out=self.g)
        if self.active[k]:
            self.C[:, k], self.C[:, :, k], self.W[:, k] = 0, 0, 0
        self.active[k] = not self.active[k]

    def solve(self) -> None:
        """Compute C (52) and W (53) for the support as it is."""
        on = np.flatnonzero(self.active)
        block = (slice(None), on[:, None], on)
        ridge = (self.nu / self.tau)[:, None, None] * np.eye(len(on))
        self.C[:], self.W[:] = 0, 0
        self.C[block] = self.nu[:, None, None] * np.linalg.inv(self.J[block] + ridge)
        self.W[:, on] = self.C[block] @ self.H[:, on] / self.nu[:, None, None]

    def learn_variances(self) -> None:
        """Maximise the ELBO over ν and τ of each bin, (58) and (59), above their floors."""
        M, N = self.Y.shape[1:]
        K = int(self.active.sum())
        floor = self.noise_floor * self.power / (M * N)
        if K == 0:
            self.nu = self.power / (M * N)
            return
        explained = 2 * _inner(self.H, self.W) - _inner(self.W, self.J @ self.W)
        spread = N * _inner(self.C, self.J)  # N tr(J C)
        self.nu = np.maximum((self.power - explained + spread) / (M * N), floor)
        energy = _inner(self.W, self.W) + N * np.trace(self.C, axis1=1, axis2=2).real
        self.tau = np.maximum(energy / (N * K), self.power_floor * self.nu / self.mean_norm)

    def reconstruction(self) -> Complex:
        """Return X̂ = Σ â ŵ, (n_bins, n_sensors, n_snapshots)."""
        on = np.flatnonzero(self.active)
        return np.asarray(np.swapaxes(self.A[:, on], 1, 2) @ self.W[:, on])

    def elbo(self) -> float:
        """Return the ELBO as a function of the support (56), for the C and W of that support."""
        on = np.flatnonzero(self.active)
        M, N = self.Y.shape[1:]
        C, H = self.C[:, on[:, None], on], self.H[:, on]
        fit = _inner(H, C @ H) / self.nu**2 + N * np.linalg.slogdet(C)[1]
        rest = -M * N * np.log(np.pi * self.nu) - self.power / self.nu
        looks = (fit + rest - N * len(on) * np.log(self.tau)).sum() / self.temper
        return float(looks + np.where(self.active, np.log(self.rho), np.log1p(-self.rho)).sum())


def _inner(a: Complex, b: Complex) -> Float:
    """Return Re tr(aᴴ b) of each bin."""
    return np.asarray((a.real * b.real + a.imag * b.imag).sum(axis=(1, 2)))
