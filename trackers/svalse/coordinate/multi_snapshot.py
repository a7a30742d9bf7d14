"""Coordinate ascent on any manifold, over several snapshots and frequencies of a step.

The loop is that of `coordinate_ascent`, which runs it; this is its working state where the array
is no line on a grid, or where a step has several looks. Section numbers are those of the
specification of SVALSE on any array.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.motion_models.bessel import inverse_bessel_ratio
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior
from arrivals.trackers.svalse.coordinate.angle_posterior import fold, quadrature, top_mode, unfold
from arrivals.trackers.svalse.coordinate.circle_posterior import (
    CirclePrior,
    SeriesPrior,
    VonMisesPrior,
    grid_moments,
)
from arrivals.trackers.svalse.coordinate.multi_amplitudes import MultiSnapshotAmplitudes
from arrivals.trackers.svalse.coordinate.support import InitialSupport
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR, noise_floor, power_floor
from arrivals.typing import Complex, Float

if TYPE_CHECKING:
    from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver


class MultiSnapshotAscent(MultiSnapshotAmplitudes):
    """The working state of one step: amplitudes, and the angles of the components.

    Attributes
    ----------
    priors : list of CirclePrior
        Predicted densities, uniform ones of fresh components.
    mean : ndarray, shape (L,)
        ⟨exp(jθ)⟩ of the present densities, of a mirrored angle over its front half.
    nuisance : ndarray, shape (L, n_nuisance)
        Posterior of the second unknown.
    moments : ndarray, shape (L, n_moments)
        ⟨exp(jiθ)⟩, as many as are carried; none if only `mean` is.
    """

    def __init__(
        self,
        settings: CoordinateSolver,
        Y: Complex,
        manifold: Manifold,
        prediction: ComponentPrior | None,
    ) -> None:
        M = Y.shape[1]
        self.n_looks = Y.shape[0] * Y.shape[2]
        L = min(M, settings.max_components or M)
        self.settings, self.manifold = settings, manifold
        self._read_manifold()
        places = InitialSupport.of(prediction, L)
        self.n_moments = 0 if prediction is None else prediction.n_moments
        power = (Y.real**2 + Y.imag**2).sum(axis=(1, 2)) / (M * Y.shape[2])
        nu = self._first_noise(power, places.known)
        left = np.maximum(power - nu, NOISE_FLOOR * power)
        tau = left / places.n_expected * M / self.norms[:, 0]
        super().__init__(Y, places.rho, nu, tau, self.norms[:, 0], settings.tempering)
        self.begin(places)
        self._read_prediction(places.known, L)
        self.power_floor = power_floor(settings.power_floor, self.n_looks)
        self.noise_floor = noise_floor(settings.max_snr_db)

    def _read_manifold(self) -> None:
        """Lay the manifold out for products: rows of G are (bin, sensor) pairs."""
        manifold = self.manifold
        self.k = manifold.harmonics
        self.degree = max(int(np.abs(self.k).max()), 1)
        self.G: Complex | None = None
        if manifold.coefficients is not None:
            self.G = manifold.coefficients.reshape(len(manifold.nuisance_weights), -1, len(self.k))
        norm = manifold.norm_squared()
        self.norm_series: Complex | None = None
        if not isinstance(norm, float):
            self.norms = norm[..., 0].real.mean(axis=0)[:, None]
            if norm.shape[2] > 1:
                self.norm_series = norm
                self.degree = max(self.degree, norm.shape[2] - 1)
        else:
            self.norms = np.full((manifold.n_bins, 1), norm)

    def _first_noise(self, power: Float, prediction: ComponentPrior) -> Float:
        """Start ν from that of the last step, not above half the power; else from the SNR."""
        snr_db = 20.0 if self.settings.snr_db is None else self.settings.snr_db
        start = power * 10 ** (-snr_db / 10)
        automatic = self.settings.snr_db is None and self.n_looks > 1
        if automatic and prediction.noise is not None:
            known = np.minimum(prediction.noise, power / 2)
            start = np.where(np.isnan(known), start, known)
        return np.asarray(np.maximum(start, NOISE_FLOOR * power))

    def _read_prediction(self, prediction: ComponentPrior, L: int) -> None:
        n, mirror = self.n_carried, self.manifold.mirror
        weights = self.manifold.nuisance_weights
        eta = np.zeros(L, dtype=np.complex128)
        eta[:n] = prediction.kappa[:n] * np.exp(1j * prediction.mu[:n])
        self.mean = np.exp(1j * np.angle(eta)) * (np.arange(L) < n)
        self.nuisance = np.tile(weights, (L, 1))
        if prediction.nuisance is not None:
            self.nuisance[:n] = prediction.nuisance[:n]
        self.prior_nuisance = self.nuisance.copy()
        self.moments = np.zeros((L, self.n_moments), dtype=np.complex128)
        self.priors: list[CirclePrior] = [VonMisesPrior(complex(each), mirror) for each in eta]
        if prediction.moments is not None:
            step = (max(self.n_moments - 8, 1) / 7) ** 2
            self.priors[:n] = [SeriesPrior(each, step) for each in prediction.moments[:n]]
        self.plain = len(weights) == 1 and not mirror and self.n_moments == 0

    # -- start (sec. 7) ---------------------------------------------------------------------------

    def start(self) -> Complex:
        """Bring in the components one by one, each on the residual of those before.

        Returns the reconstruction by the first K₀, the first reference of the stopping rule.
        """
        reference = np.zeros_like(self.Y)
        for k in range(len(self.rho)):
            if k < self.n_carried:
                self.place(k, self.point(k))
            else:
                self.find(k, self.Y - self.reconstruction())
            self.refresh(np.array([k]))
            j = self.J[:, :, k]
            Cj = (self.C @ j[..., None])[..., 0]
            self.g[:, k] = self.norm[:, k] + self.nu / self.tau
            self.g[:, k] -= (j.conj() * Cj).sum(axis=1).real / self.nu
            self.Z[:, k] = self.H[:, k] - (self.J[:, k, None] @ self.W)[:, 0]
            self.flip(k)
            if k + 1 == self.n_expected:
                reference = self.reconstruction()
        return reference

    def point(self, k: int) -> Complex:
        """Return the moments of a carried component, taken for a point at its mean."""
        d = self.mean[k] ** np.arange(self.degree + 1)
        return np.asarray(self.nuisance[k][:, None] * d)

    def find(self, k: int, residual: Complex) -> None:
        """Set a fresh component to the density that its residual alone gives, its power known."""
        c = self.spectrum(residual)
        if self.plain:
            moments, self.mean[k] = top_mode(c[0])
            self.place(k, moments[None])
        else:
            self.integrate(k, c)

    def spectrum(self, Z: Complex) -> Complex:
        """Return the coefficients of the amplitudes' exact marginal, (n_nuisance, 2 degree + 1).

        ln q(θ) = Σ_f Σ_n |aᴴz|² / ν(‖a‖² + ν/τ) - N ln(‖a‖² + ν/τ), over T.
        """
        n_points = 1 << int(np.ceil(np.log2(8 * (self.degree + 1))))
        beams = self._on_grid(Z, n_points)  # (S, F, N, n_points)
        energy = (beams.real**2 + beams.imag**2).sum(axis=2)
        norm = self.norms[None] if self.norm_series is None else self._norms_on_grid(n_points)
        total = norm + (self.nu / self.tau)[:, None]
        log_q = energy / (self.nu[:, None] * total) - Z.shape[2] * np.log(total)
        c = np.fft.rfft(log_q.sum(axis=1) / self.temper, axis=1, norm="forward")
        c[:, 1:] *= 2
        return np.asarray(c[:, : 2 * self.degree + 1])

    def _on_grid(self, Z: Complex, n_points: int) -> Complex:
        """Return aᴴz on a grid of angles, (n_nuisance, n_bins, n_snapshots, n_points)."""
        F, M = Z.shape[:2]
        if self.G is None:
            b = np.swapaxes(Z, 1, 2)[None]
        else:
            G = self.G.reshape(len(self.G), F, M, -1).conj()
            b = np.swapaxes(np.swapaxes(G, 2, 3) @ Z, 2, 3)
        # Σ b_k exp(-jkθ): a forward FFT of the coefficients, negative k from the end
        series = np.zeros((*b.shape[:3], n_points), dtype=np.complex128)
        series[..., self.k] = b
        return np.fft.fft(series, axis=-1)

    def _norms_on_grid(self, n_points: int) -> Float:
        assert self.norm_series is not None
        twice = np.fft.irfft(self.norm_series, n_points, axis=2, norm="forward")
        return np.asarray((twice + self.norm_series[..., :1].real) / 2)

    # -- angles (sec. 3) --------------------------------------------------------------------------

    def refine_angles(self) -> None:
        """Update q(θ) of each active component, each on the newest of the others.

        η = 2/Tν [Y ŵ* - Σ (Σₙ ŵ' ŵ* + N Ĉ) â'], the sum over all others.
        """
        on = np.flatnonzero(self.active)
        N = self.Y.shape[2]
        W, C = self.W[:, on], self.C[:, on[:, None], on]
        others = W.conj() @ np.swapaxes(W, 1, 2) + N * np.swapaxes(C, 1, 2)
        strength = np.diagonal(others, axis1=1, axis2=2).real / self.nu[:, None] / self.temper
        others[:, np.arange(len(on)), np.arange(len(on))] = 0
        scale = (2 / (self.temper * self.nu))[:, None, None]
        alone = scale * np.swapaxes(self.Y @ np.swapaxes(W.conj(), 1, 2), 1, 2)
        others = scale * others
        for i, k in enumerate(on):
            eta = alone[:, i] - (others[:, i, None] @ self.A[:, on])[:, 0]
            self.integrate(int(k), self.folded(eta, strength[:, i]))
        self.refresh(on)

    def folded(self, eta: Complex, strength: Float) -> Complex:
        """Return one-sided coefficients of the log likelihood, (n_nuisance, degree + 1)."""
        if self.G is None:
            return fold(eta[0], self.k, self.degree)[None]
        g = eta.conj().ravel() @ self.G  # (S, n_k)
        c = np.zeros((len(g), self.degree + 1), dtype=np.complex128)
        K = len(self.k) // 2
        c[:, : K + 1] = g[:, K:]
        c[:, 1 : K + 1] += g[:, K - 1 :: -1].conj()
        if self.norm_series is not None:
            n = self.norm_series.shape[2]
            c[:, :n] -= np.einsum("f,sfi->si", strength, self.norm_series)
        return c

    def integrate(self, k: int, c: Complex) -> None:
        """Set component k to the posterior of its prior and coefficients c."""
        prior = self.priors[k]
        if self.plain and isinstance(prior, VonMisesPrior):
            c[0, 1] += prior.eta.conjugate()
            moments, self.mean[k] = quadrature(c[0])
            self.place(k, moments[None])
            return
        n = max(self.degree + 1, self.n_moments)
        moments, self.mean[k] = grid_moments(
            c, prior, self.prior_nuisance[k], n, mirror=self.manifold.mirror
        )
        self.nuisance[k] = moments[:, 0].real
        self.moments[k] = moments[:, : self.n_moments].sum(axis=0)
        self.place(k, moments)

    def place(self, k: int, moments: Complex) -> None:
        """Set the mean steering vector, and the mean of its squared norm, by the moments."""
        F, M = self.Y.shape[:2]
        if self.G is None:
            self.A[:, k] = unfold(moments[0], self.k)
            return
        half = moments[:, : len(self.k) // 2 + 1]
        d = np.concatenate([half[:, :0:-1].conj(), half], axis=1)  # k = -K..K
        self.A[:, k] = (self.G @ d[..., None]).sum(axis=0).reshape(F, M)
        if self.norm_series is not None:
            n = self.norm_series.shape[2]
            self.norm[:, k] = np.einsum("sfi,si->f", self.norm_series, moments[:, :n]).real

    # -- the rest of an iteration -----------------------------------------------------------------

    def rests(self, X: Complex, X_old: Complex) -> bool:
        """Tell whether the reconstruction moved by less than the tolerance, bins normalised."""
        power = np.maximum(self.power, 1e-300)[:, None, None]
        moved, size = ((np.abs(x) ** 2 / power).sum() for x in (X - X_old, X_old))
        return bool(moved < self.settings.tolerance**2 * size) or not (X.any() or X_old.any())

    def result(self, converged: bool) -> ComponentPosterior:
        """Return the fit; the amplitude of several looks is the root of their mean power."""
        single = self.Y.shape[0] == self.Y.shape[2] == 1
        resultant = np.minimum(np.abs(self.mean), 1 - 1e-15)
        rms = np.sqrt((np.abs(self.W) ** 2).mean(axis=(0, 2))) + 0j
        return ComponentPosterior(
            theta=np.angle(self.mean),
            resultant=resultant,
            kappa=inverse_bessel_ratio(resultant),
            active=self.active.copy(),
            age=self.age,
            amplitude=self.W[0, :, 0].copy() if single else rms,
            evidence=self.evidence(),
            noise=float(self.nu.mean()),
            power=float(self.tau.mean()),
            iterations=self.iterations,
            converged=converged,
            bin_noise=self.nu.copy(),
            nuisance=self.nuisance.copy(),
            moments=self.moments.copy(),
        )
