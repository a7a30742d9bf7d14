"""Bernoulli-Gaussian amplitudes of components whose mean steering vectors are given.

Equation numbers are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

import numpy as np

from arrivals.trackers.svalse.coordinate.support import MergedSupport
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR
from arrivals.typing import Complex, Float, Int


class Amplitudes(MergedSupport):
    """Which of L components are in use, how strong, and how strong the noise is.

    Attributes
    ----------
    A : ndarray, shape (L, n_sensors)
        Mean steering vectors â.
    J, h : ndarray, shapes (L, L), (L,)
        Their products with each other (49), the diagonal M, and with the snapshot (50).
    active : ndarray of bool, shape (L,)
        The support.
    C, w : ndarray, shapes (L, L), (L,)
        Covariance (52) and mean (53) of the amplitudes, zero off the support.
    z, g : ndarray, shape (L,)
        h - J w, and ν/v of each component that would be added; kept up to date by `flip`.
    nu, tau, rho
        Variances of noise and amplitudes, and the prior probabilities of being active, (L,).
    """

    def __init__(self, y: Complex, rho: Float, nu: float, tau: float) -> None:
        L = len(rho)
        self.y, self.rho, self.nu, self.tau = y, rho, nu, tau
        self.power = float(np.vdot(y, y).real)
        self.A = np.zeros((L, len(y)), dtype=np.complex128)
        self.J, self.C = np.zeros((2, L, L), dtype=np.complex128)
        self.h, self.w, self.z = np.zeros((3, L), dtype=np.complex128)
        self.g = np.zeros(L)
        self.active = np.zeros(L, dtype=np.bool_)

    def refresh(self, changed: Int) -> None:
        """Bring J (49) and h (50) up to date for components whose steering vectors changed."""
        conj = self.A[changed].conj()
        rows = conj @ self.A.T
        rows[np.arange(len(changed)), changed] = len(self.y)  # ⟨‖a‖²⟩, not ‖â‖²
        self.J[changed] = rows
        self.J[:, changed] = rows.conj().T
        self.h[changed] = conj @ self.y

    def empty(self) -> None:
        """Set the amplitudes of all components to zero."""
        self.C[:], self.w[:] = 0, 0

    def gains_from_empty(self) -> None:
        """Reset what `flip` keeps up to date: z = h - J w and g = ν/v."""
        M = len(self.y)
        self.z = self.h.copy()
        self.g = np.full(len(self.w), M + self.nu / self.tau)
        with np.errstate(divide="ignore"):
            self.odds = np.log(self.rho) - np.log1p(-self.rho) - np.log(self.tau)

    def deltas(self) -> Float:
        """Return by how much the ELBO (56) would rise if each component were flipped."""
        v, u = self.nu / self.g, self.z / self.g  # of an addition
        np.copyto(v, self.C.diagonal().real, where=self.active)
        np.copyto(u, self.w, where=self.active)
        gain = np.log(v) + (u.real**2 + u.imag**2) / v + self.odds
        if np.count_nonzero(self.active) >= len(self.y) - 1:
            gain[~self.active] = -np.inf
        return np.asarray(np.negative(gain, out=gain, where=self.active))

    def flip(self, k: int) -> None:
        """Add component k to the support or remove it: a rank-one change of C and w."""
        if self.active[k]:
            pivot = self.C[k, k].real
            e, alpha, gamma = self.C[:, k] / pivot, -pivot, -self.w[k]
        else:
            e = self.C @ self.J[:, k] / -self.nu
            e[k] = 1.0
            alpha = self.nu / self.g[k]
            gamma = self.z[k] / self.g[k]
        r = e.conj() @ self.J
        self.C += np.multiply.outer(alpha * e, e.conj())
        self.w += gamma * e
        self.z -= gamma * r.conj()
        self.g -= alpha / self.nu * (r.real**2 + r.imag**2)
        np.maximum(self.g, self.nu / self.tau, out=self.g)  # its bound, whatever the rounding
        if self.active[k]:
            self.C[k], self.C[:, k], self.w[k] = 0, 0, 0
        self.active[k] = not self.active[k]

    def solve(self) -> None:
        """Compute C (52) and w (53) for the support as it is."""
        on = np.flatnonzero(self.active)
        block = np.ix_(on, on)
        regularised = self.J[block] + self.nu / self.tau * np.eye(len(on))
        self.C[:], self.w[:] = 0, 0
        self.C[block] = self.nu * np.linalg.inv(regularised)
        self.w[on] = self.C[block] @ self.h[on] / self.nu

    def learn_variances(self) -> None:
        """Maximise the ELBO over ν and τ, (58) and (59)."""
        K, M = int(self.active.sum()), len(self.y)
        if K > 0:
            explained = 2 * np.vdot(self.h, self.w) - np.vdot(self.w, self.J @ self.w)
            spread = np.vdot(self.C, self.J).real  # tr(J C)
            floor = NOISE_FLOOR * self.power / M
            self.nu = max(float(self.power - explained.real + spread) / M, floor)
            self.tau = float((np.vdot(self.w, self.w) + self.C.trace()).real) / K

    def reconstruction(self) -> Complex:
        """Return x̂ = Σ ŵ â."""
        return np.asarray(self.w @ self.A)

    def elbo(self) -> float:
        """Return the ELBO as a function of the support (56), for the C and w of that support."""
        on = np.flatnonzero(self.active)
        C, h = self.C[np.ix_(on, on)], self.h[on]
        fit = np.vdot(h, C @ h).real / self.nu**2 + np.linalg.slogdet(C)[1]
        prior = np.where(self.active, np.log(self.rho / self.tau), np.log1p(-self.rho)).sum()
        rest = -len(self.y) * np.log(np.pi * self.nu) - self.power / self.nu
        return float(rest + fit + prior)
