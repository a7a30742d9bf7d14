"""Components of points with a chart: mean responses, and normal priors."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.measurement_models.manifolds.manifold import PointManifold
from arrivals.symmetric import (
    clamped_inverse,
    congruent,
    dot,
    identity,
    inverse,
    log_det,
    times,
    trace_of_product,
)
from arrivals.trackers.svalse.newton.batch import Components, Layout
from arrivals.typing import Bool, Complex, Float

LOG_2PI = float(np.log(2 * np.pi))
LONGEST_STEP = 2 / np.sqrt(12)  # rad rms over the array: 2/M of an angle of M sensors
START_VARIANCE = 3.6 / 12
MAX_VARIANCE = 2.0


class PointChart:
    """Mean responses to normal densities in the chart of a manifold, and normal priors.

    Parameters
    ----------
    manifold : PointManifold

    Attributes
    ----------
    extent : float
        Number of sensors.
    norm2 : ndarray, shape (n_bins, 1)
        ‖a‖²: the number of sensors.
    longest_step, max_variance : float
        Longest Newton step, and largest eigenvalue of a covariance, in units of displacement.
    """

    def __init__(self, manifold: PointManifold) -> None:
        self.manifold, self.n_bins = manifold, manifold.n_bins
        self.n_sensors, self.extent = manifold.n_sensors, float(manifold.n_sensors)
        self.has_curvature = manifold.spike_precision is not None
        self.layout = Layout(manifold.n_unknowns, manifold.point_size, self.has_curvature)
        self.norm2: Float = np.full((self.n_bins, 1), self.extent)
        self.is_linear, self.is_plain = manifold.is_linear, False
        self.longest_step, self.max_variance = LONGEST_STEP, MAX_VARIANCE

    def responses(self, x: Float, s: Float) -> Complex:
        """Return mean responses and their derivatives, (B, F, 1 + d + d(d+1)/2, L, n_sensors)."""
        return self.manifold.responses(x, s)

    def norms(self, x: Float, s: Float) -> Float | None:
        """Return None: ‖a‖² is constant."""
        return None

    def at(self, points: Float) -> tuple[Complex, Float, Float]:
        """Return a (F, G, M) at points (p, G), Σ Re ∂ᵢa* ∂ⱼa (F, d(d+1)/2, G or 1), and ‖a‖²."""
        A, gram = self.manifold.at(points)
        return A, gram, self.norm2

    def move(self, x: Float, step: Float) -> Float:
        """Return the points after a step."""
        return self.manifold.move(x, step)

    def prior(
        self, x: Float, s: Float, mean: Float, precision: Float
    ) -> tuple[Float, Float, Float]:
        """Return ½ (δᵀPδ + tr P'S), (B, L), its gradient, and its curvature P' = (∂δ)ᵀ P ∂δ."""
        delta, slope = self.manifold.offset(x, mean)
        force = times(precision, delta)
        square = dot(delta, force)
        if slope is not None:
            force = (slope * force[..., :, None, :]).sum(axis=-3)
            precision = congruent(slope, precision)
        return 0.5 * (square + trace_of_product(precision, s)), force, precision

    def quadratic(self, x: Float, mean: Float, precision: Float, s: Float | None = None) -> Float:
        """Return ½ (δᵀPδ + tr PS) of points, (..., L)."""
        delta, _ = self.manifold.offset(x, mean)
        square = dot(delta, times(precision, delta))
        return np.asarray(
            0.5 * square if s is None else 0.5 * (square + trace_of_product(precision, s))
        )

    def prior_constant(self, precision: Float) -> Float:
        """Return ½ ln det 2π P⁻¹, (B, L)."""
        return np.asarray(0.5 * (self.layout.n_unknowns * LOG_2PI - log_det(precision)))

    def start_covariance(self, precision: Float) -> Float:
        """Return the covariances at which tracked components start."""
        start = precision + identity(self.layout.n_unknowns) / START_VARIANCE
        return clamped_inverse(start, 1 / MAX_VARIANCE)

    def densities(self, components: Components, marginal: Float, stated: Float) -> dict[str, Any]:
        """Return the densities of a posterior of one problem; covariances (d(d+1)/2, L)."""
        return {
            "theta": components.point[0].T,
            "resultant": np.full(components.point.shape[2], np.nan),
            "kappa": inverse(components.covariance[0]).T,
            "marginal_kappa": inverse(marginal).T,
            "covariance": stated.T,
            "curved": components.curved[0] > 0 if self.has_curvature else None,
        }

    def prior_densities(self, mu: Float, kappa: Float, curved: Bool | None) -> dict[str, Any]:
        """Return those of a posterior that equals its prior."""
        n, d = len(mu), self.layout.n_unknowns
        mu, kappa = mu.reshape(n, self.layout.point_size), kappa.reshape(n, d * (d + 1) // 2)
        return {
            "theta": mu,
            "resultant": np.full(n, np.nan),
            "kappa": kappa,
            "covariance": inverse(kappa.T).T,
            "curved": curved,
        }

    @property
    def wave_precisions(self) -> tuple[float, float]:
        """Prior precisions of the second unknown of plane and of curved waves."""
        spike, slab = self.manifold.spike_precision, self.manifold.slab_precision
        assert spike is not None
        assert slab is not None
        return spike, slab
