"""A component of one angle: mean responses of wrapped normal densities, and von Mises priors."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.motion_models.bessel import bessel_ratio, log_i0
from arrivals.trackers.svalse.newton.batch import ONE_ANGLE, Components
from arrivals.typing import Bool, Complex, Float

LOG_2PI = float(np.log(2 * np.pi))
MAX_ANGLE_VARIANCE = 0.3  # rad²: of a wider one the wrapped density is not normal


class AngleChart:
    """Mean steering vectors of wrapped normal angles, â = G ⟨d⟩ with ⟨d_k⟩ = exp(jkμ - k²s/2).

    Parameters
    ----------
    manifold : AngleManifold
        Without a second parameter.

    Attributes
    ----------
    extent : float
        Sensors of the filled line that resolves as well.
    norm2 : ndarray, shape (n_bins, 1)
        ‖a(θ)‖², the mean over all angles where it changes.
    longest_step, max_variance : float
        Longest Newton step, rad, and largest variance, rad².

    Examples
    --------
    >>> from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
    >>> chart = AngleChart(UniformLineManifold(np.arange(3), step=np.pi, origin=1.0))
    >>> chart.responses(np.zeros((1, 1, 1)), np.full((1, 1, 1), 0.2))[0, 0, 0].real.round(4)
    array([[0.9048, 1.    , 0.9048]])
    """

    layout = ONE_ANGLE
    has_curvature = False

    def __init__(self, manifold: AngleManifold) -> None:
        self.manifold, self.n_bins = manifold, manifold.n_bins
        self.n_sensors = manifold.n_sensors
        k = manifold.harmonics.astype(np.float64)
        self.jk, self.half_k2 = 1j * k, k * k / 2
        self.paired = bool((k == -k[::-1]).all())  # k and -k: ⟨d⟩ of one is the other's conjugate
        self.first = len(k) // 2 if self.paired else 0
        self.factors = np.stack([np.ones(len(k)), 1j * k, -k * k])[:, None]
        self.G: Complex | None = None
        weight = np.ones(len(k))
        if manifold.coefficients is not None:
            self.G = manifold.coefficients[0].reshape(-1, len(k)).T.copy()  # (n_k, F M)
            weight = (np.abs(self.G) ** 2).sum(axis=1)
        weight /= weight.sum()
        self.extent = float(np.sqrt(12 * float(weight @ (k - weight @ k) ** 2) + 1))
        norm = manifold.norm_squared()
        one = np.full((self.n_bins, 1), norm) if isinstance(norm, float) else norm[0, :, :1].real
        self.norm2: Float = np.asarray(one)
        self.series: Complex | None = None
        if not isinstance(norm, float) and norm.shape[2] > 1:
            self.series = norm[0].T.copy()  # (n_i, F)
            i = np.arange(norm.shape[2])
            self.ji, self.half_i2 = 1j * i, i * i / 2
            self.halves = np.stack([np.ones(len(i)), 0.5j * i, -0.5 * i * i])[:, None]
        self.longest_step = 2 / self.extent
        self.max_variance = MAX_ANGLE_VARIANCE
        self.start_variance = min(3.6 / self.extent**2, MAX_ANGLE_VARIANCE)
        self.is_linear = self.G is None
        self.is_plain = manifold.coefficients is None

    def responses(self, x: Float, s: Float) -> Complex:
        """Return â, ∂â/∂μ and ∂²â/∂μ² = 2 ∂â/∂s of angles (B, 1, L): (B, F, 3, L, n_sensors)."""
        jk, half_k2 = self.jk[self.first :], self.half_k2[self.first :]
        d = np.exp(x[:, 0, :, None] * jk - s[:, 0, :, None] * half_k2)
        if self.paired:
            d = np.concatenate([d[..., :0:-1].conj(), d], axis=-1)
        d = d[:, None] * self.factors
        if self.G is None:
            return d[:, None]
        a = (d @ self.G).reshape(*d.shape[:3], self.n_bins, self.n_sensors)
        return np.ascontiguousarray(np.moveaxis(a, 3, 1))

    def norms(self, x: Float, s: Float) -> Float | None:
        """Return ⟨‖a‖²⟩, half its first and second derivatives, (B, F, 3, L); None if constant."""
        if self.series is None:
            return None
        d = np.exp(x[:, 0, :, None] * self.ji - s[:, 0, :, None] * self.half_i2)
        n = (d[:, None] * self.halves) @ self.series
        return np.asarray(np.moveaxis(n.real, 3, 1))

    def at(self, points: Float) -> tuple[Complex, Float, Float]:
        """Return a(θ) (F, G, M) of angles (1, G), ‖∂a/∂θ‖² (F, 1, G) or less, and ‖a‖²."""
        d = np.exp(points[0, :, None] * self.jk)
        if self.G is None:
            return d[None], np.full((1, 1, 1), 2 * float(self.half_k2.sum())), self.norm2
        A, T = (
            np.moveaxis((x @ self.G).reshape(len(d), self.n_bins, -1), 0, 1)
            for x in (d, d * self.jk)
        )
        norm2 = self.norm2 if self.series is None else (np.abs(A) ** 2).sum(axis=2)
        return np.ascontiguousarray(A), (np.abs(T) ** 2).sum(axis=2)[:, None], norm2

    def move(self, x: Float, step: Float) -> Float:
        """Return the angles after a step."""
        return np.asarray(x + step)

    def prior(
        self, x: Float, s: Float, mean: Float, precision: Float
    ) -> tuple[Float, Float, Float]:
        """Return -κ exp(-s/2) cos(μ-μₚ), (B, L), and its derivatives, (B, 1, L)."""
        phasor = precision * np.exp(1j * (x - mean) - 0.5 * s)
        return -phasor[:, 0].real, phasor.imag, phasor.real

    def prior_constant(self, precision: Float) -> Float:
        """Return ln 2π I₀(κ), (B, L)."""
        return np.asarray(LOG_2PI + log_i0(precision[:, 0]))

    def start_covariance(self, precision: Float) -> Float:
        """Return the variances at which tracked components start."""
        return np.asarray(1 / np.maximum(precision, 1 / self.start_variance))

    def densities(self, components: Components, marginal: Float, stated: Float) -> dict[str, Any]:
        """Return the densities of a posterior of one problem; variances (1, L)."""
        return {
            "theta": self.front_angles(components.mu[0]),
            "resultant": np.exp(-stated[0] / 2),
            "kappa": 1 / components.variance[0],
            "marginal_kappa": 1 / marginal[0],
        }

    def prior_densities(self, mu: Float, kappa: Float, curved: Bool | None) -> dict[str, Any]:
        """Return those of a posterior that equals its prior."""
        return {"theta": mu, "resultant": bessel_ratio(kappa), "kappa": kappa}

    def front_angles(self, mu: Float) -> Float:
        """Return the angles within ±π, of two with one direction the front one."""
        theta = np.angle(np.exp(1j * mu))
        manifold = self.manifold
        return manifold.from_doa(manifold.to_doa(theta)) if manifold.front_back_ambiguous else theta
