"""State of coordinate ascent on any manifold, over several snapshots and frequencies of a step.

`CoordinateSolver` runs the loop. Section numbers are those of the specification of SVALSE on any
array; equation numbers those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.motion_models.bessel import inverse_bessel_ratio
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior
from arrivals.trackers.svalse.coordinate.angle_posterior import (
    AnglePosterior,
    fold,
    mixture,
    quadrature,
    top_mode,
    unfold,
)
from arrivals.trackers.svalse.coordinate.circle_posterior import (
    CirclePrior,
    SeriesPrior,
    VonMisesPrior,
    circle_moments,
)
from arrivals.trackers.svalse.coordinate.multi_amplitudes import MultiSnapshotAmplitudes, inner
from arrivals.trackers.svalse.coordinate.support import InitialSupport
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR, noise_floor, power_floor
from arrivals.typing import Complex, Float

if TYPE_CHECKING:
    from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver


class MultiSnapshotAscent(MultiSnapshotAmplitudes):
    """State of one step: support, amplitudes, variances, and the angles of the components.

    Attributes
    ----------
    eta : ndarray, shape (L,)
        Parameters κ exp(jμ) of the predicted von Mises densities; 0 for a new component.
    priors : list of CirclePrior
        Predicted densities of the angles, uniform ones of new components.
    mean : ndarray, shape (L,)
        ⟨exp(jθ)⟩ of the present densities, over the front half of the circle where θ and π - θ are
        the same direction.
    nuisance : ndarray, shape (L, n_nuisance)
        Posterior of the second unknown.
    moments : ndarray, shape (L, n_moments)
        ⟨exp(jiθ)⟩, as many as are tracked; none if only `mean` is.
    """

    def __init__(
        self,
        settings: CoordinateSolver,
        Y: Complex,
        manifold: AngleManifold,
        prior: ComponentPrior | None,
    ) -> None:
        M = Y.shape[1]
        self.settings, self.manifold = settings, manifold
        self._read_manifold()
        initial = InitialSupport.from_prior(
            prior, settings.n_components(M), settings.first_existence
        )
        self.n_moments = 0 if prior is None else prior.n_moments
        power = (Y.real**2 + Y.imag**2).sum(axis=(1, 2)) / (M * Y.shape[2])
        nu = self.initial_noise(Y, power, prior)
        signal = np.maximum(power - nu, NOISE_FLOOR * power)
        tau = signal / initial.n_expected * M / self.norms[:, 0]
        super().__init__(Y, initial, nu, tau, self.norms[:, 0], settings.tempering)
        self._read_prior(initial.prior)
        self.posterior: AnglePosterior = quadrature
        if settings.posterior == "mixture":
            descending = prior is None if settings.descending is None else settings.descending
            self.posterior = partial(mixture, descending=descending)
        self.power_floor = power_floor(settings.power_floor, Y.shape[0] * Y.shape[2])
        self.noise_floor = noise_floor(settings.max_snr_db)

    def _read_manifold(self) -> None:
        """Arrange the manifold for products: rows of G are (bin, sensor) pairs."""
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

    def initial_noise(self, Y: Complex, power: Float, prior: ComponentPrior | None) -> Float:
        """Return ν of the last step, at most half the power; or that of the expected SNR."""
        snr_db = 20.0 if self.settings.snr_db is None else self.settings.snr_db
        nu = power * 10 ** (-snr_db / 10)
        automatic = self.settings.snr_db is None and Y.shape[0] * Y.shape[2] > 1
        if automatic and prior is not None and prior.noise is not None:
            last = np.minimum(prior.noise, power / 2)
            nu = np.where(np.isnan(last), nu, last)
        return np.asarray(np.maximum(nu, NOISE_FLOOR * power))

    def _read_prior(self, prior: ComponentPrior) -> None:
        n, L, n_moments = self.n_tracked, len(self.rho), self.n_moments
        weights, ambiguous = self.manifold.nuisance_weights, self.manifold.front_back_ambiguous
        self.eta = np.zeros(L, dtype=np.complex128)
        self.eta[:n] = prior.kappa[:n] * np.exp(1j * prior.mu[:n])
        self.mean = np.exp(1j * np.angle(self.eta)) * (np.arange(L) < n)
        self.nuisance = np.tile(weights, (L, 1))
        if prior.nuisance is not None:
            self.nuisance[:n] = prior.nuisance[:n]
        self.prior_nuisance = self.nuisance.copy()
        self.moments = np.zeros((L, n_moments), dtype=np.complex128)
        self.priors: list[CirclePrior] = [
            VonMisesPrior(complex(eta), ambiguous) for eta in self.eta
        ]
        if prior.moments is not None:
            step = (max(n_moments - 8, 1) / 7) ** 2
            self.priors[:n] = [SeriesPrior(moments, step) for moments in prior.moments[:n]]
        # one unknown angle whose prior is a von Mises density
        self.is_simple = len(weights) == 1 and not ambiguous and n_moments == 0

    # -- initialization (sec. 7) ------------------------------------------------------------------

    def initialize(self) -> Complex:
        """Add the components one by one, each by the residual of those before, (66)-(68).

        Returns the reconstruction by the first K₀, the first reference of the stopping rule.
        """
        reference = np.zeros_like(self.Y)
        for k in range(len(self.rho)):
            if k < self.n_tracked:
                # a point at the predicted mean
                powers = self.mean[k] ** np.arange(self.degree + 1)
                self.set_response(k, self.nuisance[k][:, None] * powers)
            else:
                self.initialize_component(k, self.Y - self.reconstruction())
            self.refresh(np.array([k]))
            j = self.J[:, :, k]
            Cj = (self.C @ j[..., None])[..., 0]
            self.g[:, k] = self.norm[:, k] + self.nu / self.tau
            self.g[:, k] -= (j.conj() * Cj).sum(axis=1).real / self.nu
            self.Z[:, k] = self.H[:, k] - (self.J[:, k, None] @ self.W)[:, 0]
            self.flip(k)
            if k + 1 == max(int(self.n_expected), 1):
                reference = self.reconstruction()
        return reference

    def initialize_component(self, k: int, residual: Complex) -> None:
        """Set a new component to the density given its residual, with known power."""
        c = self.spectrum(residual)
        if self.is_simple:
            moments, self.mean[k] = top_mode(c[0])
            self.set_response(k, moments[None])
        else:
            self.update_angle(k, c)

    def spectrum(self, Z: Complex) -> Complex:
        """Return the coefficients of the amplitudes' exact marginal, (n_nuisance, 2 degree + 1).

        ln q(θ) = Σ_f Σ_n |aᴴz|² / ν(‖a‖² + ν/τ) - N ln(‖a‖² + ν/τ), over T.
        """
        n_points = 1 << int(np.ceil(np.log2(8 * (self.degree + 1))))
        beams = self._beams_on_grid(Z, n_points)  # (S, F, N, n_points)
        energy = (beams.real**2 + beams.imag**2).sum(axis=2)
        norm = self.norms[None] if self.norm_series is None else self._norms_on_grid(n_points)
        total = norm + (self.nu / self.tau)[:, None]
        log_q = energy / (self.nu[:, None] * total) - Z.shape[2] * np.log(total)
        c = np.fft.rfft(log_q.sum(axis=1) / self.tempering, axis=1, norm="forward")
        c[:, 1:] *= 2
        return np.asarray(c[:, : 2 * self.degree + 1])

    def _beams_on_grid(self, Z: Complex, n_points: int) -> Complex:
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

    def update_angles(self) -> None:
        """Update q(θ) of each active component, given the present densities of the others.

        η = 2/Tν [Y ŵ* - Σ (Σₙ ŵ' ŵ* + N Ĉ) â'], the sum over all others   (33).
        """
        on = np.flatnonzero(self.active)
        N = self.Y.shape[2]
        W, C = self.W[:, on], self.C[:, on[:, None], on]
        products = W.conj() @ np.swapaxes(W, 1, 2) + N * np.swapaxes(C, 1, 2)
        energy = np.diagonal(products, axis1=1, axis2=2).real / self.nu[:, None] / self.tempering
        products[:, np.arange(len(on)), np.arange(len(on))] = 0
        scale = (2 / (self.tempering * self.nu))[:, None, None]
        data = scale * np.swapaxes(self.Y @ np.swapaxes(W.conj(), 1, 2), 1, 2)
        products = scale * products
        for i, k in enumerate(on):
            eta = data[:, i] - (products[:, i, None] @ self.A[:, on])[:, 0]
            self.update_angle(int(k), self.log_likelihood(eta, energy[:, i]))
        self.refresh(on)

    def log_likelihood(self, eta: Complex, energy: Float) -> Complex:
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
            c[:, :n] -= np.einsum("f,sfi->si", energy, self.norm_series)
        return c

    def update_angle(self, k: int, c: Complex) -> None:
        """Set component k to the posterior of its prior and coefficients c   (32)."""
        if self.is_simple:
            c[0, 1] += self.eta[k].conj()
            moments, self.mean[k] = self.posterior(c[0])
            self.set_response(k, moments[None])
            return
        moments, self.mean[k] = circle_moments(
            c,
            self.priors[k],
            self.prior_nuisance[k],
            max(self.degree + 1, self.n_moments),
            front_only=self.manifold.front_back_ambiguous,
        )
        self.nuisance[k] = moments[:, 0].real
        self.moments[k] = moments[:, : self.n_moments].sum(axis=0)
        self.set_response(k, moments)

    def set_response(self, k: int, moments: Complex) -> None:
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

    # -- end of an iteration ----------------------------------------------------------------------

    def has_converged(self, X: Complex, X_old: Complex) -> bool:
        """Return True if the reconstruction changed by less than the tolerance, bins normalised."""
        change, weight = X - X_old, 1 / np.maximum(self.power, 1e-300)
        limit = self.settings.tolerance**2 * (inner(X_old, X_old) @ weight)
        return bool(inner(change, change) @ weight < limit) or not (X.any() or X_old.any())

    def result(self, converged: bool) -> ComponentPosterior:
        """Return the posterior; the amplitude over several snapshots is the root mean power."""
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
