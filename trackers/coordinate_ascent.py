"""Coordinate ascent on the ELBO of a line spectrum: the loop of VALSE and of SVALSE's update.

Support, noise and angles are improved in turn until the reconstruction rests. Equation numbers
are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from arrivals.measurement_models.manifolds import Manifold
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.angle_posteriors import (
    AnglePosterior,
    fold,
    mixture,
    nearest_modes,
    quadrature,
    top_mode,
    unfold,
)
from arrivals.trackers.line_spectrum import Fit, Prediction
from arrivals.typing import Complex, Float, Int

PosteriorName = Literal["quadrature", "mixture"]
NOISE_FLOOR = 1e-9  # of the power: keeps a snapshot without noise from a division by zero
CYCLE = 0.2  # of the iterations allowed: a component merged away so often is in a limit cycle


@dataclass(frozen=True)
class CoordinateAscent:
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
        Signal-to-noise ratio from which the noise starts; None estimates it from the lags.
    max_components : int or None
        As many as there are sensors if None.
    descending : bool
        Order of the mixture's factors.
    """

    posterior: PosteriorName = "quadrature"
    tolerance: float = 1e-4
    max_iterations: int = 500
    merge: float = np.deg2rad(1.5)
    snr_db: float | None = 20.0
    max_components: int | None = None
    descending: bool = False

    def fit(self, Y: Complex, manifold: Manifold, prediction: Prediction | None) -> Fit:
        """Fit one snapshot: start, then iterate (sections III and IV, Fig. 3).

        Parameters
        ----------
        Y : ndarray, shape (1, n_sensors, 1)
        manifold : Manifold
        prediction : Prediction or None
            None in a first step and in VALSE: nothing is known.
        """
        step = self.step(Y[0, :, 0], manifold, prediction)
        x, converged = step.start(), False
        while not converged and step.iterations < self.max_iterations and not step.cycles():
            step.iterations += 1
            step.choose_support()
            step.learn_variances()
            step.refine_angles()
            step.merge()
            x_old, x = x, step.reconstruction()
            rests = np.linalg.norm(x - x_old) < self.tolerance * np.linalg.norm(x_old)
            converged = bool(rests or not (x.any() or x_old.any()))
        return step.result(converged)

    def step(self, y: Complex, manifold: Manifold, prediction: Prediction | None) -> Ascent:
        """Return the working state for one snapshot."""
        return Ascent(self, y, manifold, prediction)


class Ascent:
    """The working state of one snapshot: L components, of which `active` are in use.

    Attributes
    ----------
    A : ndarray, shape (L, n_sensors)
        Mean steering vectors â.
    J, C : ndarray, shape (L, L)
        Their products (49), and the covariance of the amplitudes (52); C is zero off the support.
    h, w : ndarray, shape (L,)
        Products with the snapshot (50), and mean amplitudes (53), zero off the support.
    nu, tau : float
        Variances of noise and amplitudes.
    """

    def __init__(
        self,
        settings: CoordinateAscent,
        y: Complex,
        manifold: Manifold,
        prediction: Prediction | None,
    ) -> None:
        self.settings, self.y, self.manifold = settings, y, manifold
        M = len(y)
        L = min(M, settings.max_components or M)
        self.k = manifold.harmonics
        self.degree = max(int(np.abs(self.k).max()), 1)
        self.power = float(np.vdot(y, y).real)
        self.integrate: AnglePosterior = quadrature
        self.first_mode: AnglePosterior = top_mode
        if settings.posterior == "mixture":
            self.integrate = partial(mixture, descending=settings.descending)
            self.first_mode = nearest_modes
        self.learn_rho = prediction is None
        if prediction is None:
            prediction = Prediction(np.zeros(0), np.zeros(0), np.zeros(0), max(L // 2, 1) / L)
        self.n_carried = n = min(len(prediction.mu), L)
        self.prior = np.zeros(L, dtype=np.complex128)  # η of the predicted von Mises densities
        self.prior[:n] = prediction.kappa[:n] * np.exp(1j * prediction.mu[:n])
        self.rho = np.full(L, prediction.birth)
        self.rho[:n] = prediction.existence[:n]
        self.K0 = max(L // 2, 1) if self.learn_rho else int((self.rho == self.rho.max()).sum())
        self.nu = self.first_noise()
        self.tau = max(self.power / M - self.nu, NOISE_FLOOR * self.power / M) / self.K0
        self.A = np.zeros((L, M), dtype=np.complex128)
        self.J = np.zeros((L, L), dtype=np.complex128)
        self.C = np.zeros((L, L), dtype=np.complex128)
        self.h = np.zeros(L, dtype=np.complex128)
        self.w = np.zeros(L, dtype=np.complex128)
        self.z = np.zeros(L, dtype=np.complex128)
        self.g = np.zeros(L)
        self.mean = np.zeros(L, dtype=np.complex128)  # ⟨exp(jθ)⟩, its length the resultant
        self.active = np.zeros(L, dtype=np.bool_)
        self.was_active = np.zeros(L, dtype=np.bool_)
        self.merged = np.zeros(L, dtype=np.int64)  # how often each was merged away
        self.iterations = 0

    # -- start of a step -------------------------------------------------------------------

    def first_noise(self) -> float:
        """Start ν: from the expected signal-to-noise ratio, or from the small eigenvalues."""
        M, snr_db = len(self.y), self.settings.snr_db
        if snr_db is not None:
            return self.power / M * 10 ** (-snr_db / 10)
        lags = autocorrelation(self.y, self.k) / M
        apart = np.subtract.outer(self.k, self.k)
        toeplitz = np.where(apart < 0, lags[np.abs(apart)].conj(), lags[np.abs(apart)])
        smallest = np.linalg.eigvalsh(toeplitz)[: max(M // 4, 1)]
        return max(float(smallest.mean()), NOISE_FLOOR * self.power / M)

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
            if k + 1 == self.K0:
                reference = self.w @ self.A
        return reference

    # -- one iteration ---------------------------------------------------------------------

    def choose_support(self) -> None:
        """Search the support greedily from the empty one: each flip raises the ELBO by its Δ."""
        self.active[:] = False
        self.C[:], self.w[:] = 0, 0
        self.gains_from_empty()
        for _ in range(4 * len(self.w)):
            delta = self.deltas()
            k = int(np.argmax(delta))
            if not delta[k] > 1e-10:
                return
            self.flip(k)

    def gains_from_empty(self) -> None:
        """Reset what `flip` keeps up to date: z = h - J w and g = ν/v."""
        M = len(self.y)
        self.z = self.h.copy()
        self.g = np.full(len(self.w), M + self.nu / self.tau)
        with np.errstate(divide="ignore"):
            self.odds = np.log(self.rho) - np.log1p(-self.rho) - np.log(self.tau)

    def deltas(self) -> Float:
        """Return by how much the ELBO (56) would rise if each component were flipped."""
        v = np.where(self.active, self.C.diagonal().real, self.nu / self.g)
        u = np.where(self.active, self.w, self.z / self.g)
        gain = np.log(v) + (u.real**2 + u.imag**2) / v + self.odds
        delta = np.where(self.active, -gain, gain)
        if self.active.sum() >= len(self.y) - 1:
            delta[~self.active] = -np.inf
        return np.asarray(delta)

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
        r = e.conj() @ self.J / self.nu
        self.C += np.multiply.outer(alpha * e, e.conj())
        self.w += gamma * e
        self.z -= self.nu * gamma * r.conj()
        self.g -= alpha * self.nu * (r.real**2 + r.imag**2)
        np.maximum(self.g, self.nu / self.tau, out=self.g)  # its bound, whatever the rounding
        if self.active[k]:
            self.C[k], self.C[:, k], self.w[k] = 0, 0, 0
        self.active[k] = not self.active[k]

    def learn_variances(self) -> None:
        """Maximise the ELBO over ν and τ, (58) and (59), and over ρ where nothing is predicted."""
        L, K, M = len(self.w), int(self.active.sum()), len(self.y)
        if K > 0:
            explained = 2 * np.vdot(self.h, self.w) - np.vdot(self.w, self.J @ self.w)
            spread = np.vdot(self.C, self.J).real  # tr(J C)
            floor = NOISE_FLOOR * self.power / M
            self.nu = max(float(self.power - explained.real + spread) / M, floor)
            self.tau = float((np.vdot(self.w, self.w) + self.C.trace()).real) / K
        if self.learn_rho:
            self.rho[:] = min(max(K, 1), max(L - 1, 1)) / L if L > 1 else 0.5

    def refine_angles(self) -> None:
        """Update q(θ) of each active component, each on the newest of the others (32)-(33).

        ηₗ = 2/ν [y ŵ*ₗ - Σ (ŵₗ' ŵ*ₗ + Ĉₗ'ₗ) âₗ'], the sum over all others: rows of two products.
        """
        on = np.flatnonzero(self.active)
        w, A = self.w[on], self.A[on]
        others = np.multiply.outer(w.conj(), w)
        np.fill_diagonal(others, 0)
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
        np.fill_diagonal(C, 0)
        return C

    def refresh(self, changed: Int) -> None:
        """Bring J (49) and h (50) up to date for components whose steering vectors changed."""
        conj = self.A[changed].conj()
        rows = conj @ self.A.T
        rows[np.arange(len(changed)), changed] = len(self.y)  # ⟨‖a‖²⟩, not ‖â‖²
        self.J[changed] = rows
        self.J[:, changed] = rows.conj().T
        self.h[changed] = conj @ self.y

    def merge(self) -> None:
        """Switch off every active component whose direction is too near to an earlier one's."""
        on = np.flatnonzero(self.active)
        doa = self.manifold.to_doa(np.angle(self.mean[on]))
        near = np.triu(np.abs(wrap(np.subtract.outer(doa, doa))) < self.settings.merge, 1)
        if near.any():
            for i, row in enumerate(near):
                if self.active[on[i]]:
                    gone = on[row & self.active[on]]
                    self.active[gone] = False
                    self.merged[gone] += 1
            self.solve()
        self.was_active |= self.active

    def cycles(self) -> bool:
        """Tell whether the search keeps reviving what merging removes."""
        return bool(self.merged.max() > CYCLE * self.settings.max_iterations)

    def solve(self) -> None:
        """Compute C (52) and w (53) for the support as it is."""
        on = np.flatnonzero(self.active)
        block = np.ix_(on, on)
        regularised = self.J[block] + self.nu / self.tau * np.eye(len(on))
        self.C[:], self.w[:] = 0, 0
        self.C[block] = self.nu * np.linalg.inv(regularised)
        self.w[on] = self.C[block] @ self.h[on] / self.nu

    def reconstruction(self) -> Complex:
        """Return x̂ = Σ ŵ â."""
        return np.asarray(self.w @ self.A)

    # -- end of a step ---------------------------------------------------------------------

    def elbo(self) -> float:
        """Return the ELBO as a function of the support (56), for the C and w of that support."""
        on = np.flatnonzero(self.active)
        C, h = self.C[np.ix_(on, on)], self.h[on]
        fit = np.vdot(h, C @ h).real / self.nu**2 + np.linalg.slogdet(C)[1]
        prior = np.where(self.active, np.log(self.rho / self.tau), np.log1p(-self.rho)).sum()
        rest = -len(self.y) * np.log(np.pi * self.nu) - self.power / self.nu
        return float(rest + fit + prior)

    def result(self, converged: bool) -> Fit:
        """Return the fit; the evidence of a component is minus the Δ of removing it."""
        self.gains_from_empty()
        with np.errstate(divide="ignore", invalid="ignore"):
            evidence = np.where(self.active, -self.deltas(), -np.inf)
        return Fit(
            theta=np.angle(self.mean),
            resultant=np.minimum(np.abs(self.mean), 1 - 1e-15),
            active=self.active.copy(),
            was_active=self.was_active.copy(),
            amplitude=self.w.copy(),
            evidence=evidence,
            noise=self.nu,
            power=self.tau,
            iterations=self.iterations,
            converged=converged,
        )


def autocorrelation(z: Complex, places: Int) -> Complex:
    """Return the lags Rᵢ = Σ z_{k+i} z*_k, i = 0 .. span, of samples at integer places.

    Examples
    --------
    >>> autocorrelation(np.array([1, 1j]), np.array([0, 2])).round(6) + 0
    array([2.+0.j, 0.+0.j, 0.+1.j])
    """
    span = int(places.max() - places.min())
    line = np.zeros(span + 1, dtype=np.complex128)
    line[places - places.min()] = z
    spectrum = np.fft.fft(line, 1 << int(np.ceil(np.log2(2 * span + 2))))
    return np.asarray(np.fft.ifft(spectrum.real**2 + spectrum.imag**2)[: span + 1])
