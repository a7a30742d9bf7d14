"""Base of responses whose phases are linear in the unknowns only near a point."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.points import PointResponse
from arrivals.symmetric import PAIRS
from arrivals.typing import Complex, Float

HALVES = np.array([0.5, 1.0, 0.5])[:, None, None]  # of the elements 11, 12, 22 in ½ Σ Sᵢⱼ


@dataclass(frozen=True, eq=False)
class LocalManifold(PointResponse):
    """A response with derivatives Z = ∂ ln a and H = ∂∂ ln a that change from point to point.

    The mean over N(x, S) is that of the second-order expansion of ln a,
    ⟨a⟩ = a exp(½ Σ Sᵢⱼ (Zᵢ Zⱼ + Hᵢⱼ)).

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`.
    """

    @abstractmethod
    def expansion(self, x: Float) -> tuple[Complex, Complex, Complex]:
        """Return a (..., F, L, M) at points (..., p, L), Z (..., F, d, L, M) and H.

        H (..., F, d(d+1)/2, L, M) has the second derivatives 11, 12, 22.
        """

    def damping_slope(self, Z: Complex, S: Float) -> Complex | float:
        """Return ½ Σ Sᵢⱼ ∂ₖHᵢⱼ (..., F, d, L, M), S (..., 1, d(d+1)/2, L, 1): zero if left out."""
        return 0.0

    def responses(self, x: Float, covariance: Float) -> Complex:
        """Return the mean responses and their derivatives: (B, F, 1+d+d(d+1)/2, L, M)."""
        a, Z, H = self.expansion(x)
        S, d = covariance[..., None, :, :, None], Z.shape[-3]
        rows = np.empty((*a.shape[:-2], 1 + d + H.shape[-3], *a.shape[-2:]), dtype=np.complex128)
        mean, second = rows[..., :1, :, :], rows[..., 1 + d :, :, :]
        # ∂ᵢⱼ⟨a⟩ = (Zᵢ Zⱼ + Hᵢⱼ) ⟨a⟩,  ⟨a⟩ = a exp(½ Σ Sᵢⱼ (Zᵢ Zⱼ + Hᵢⱼ))
        if d == 1:
            np.multiply(Z, Z, out=second)
            bent = S * Z * H
            weight = 0.5 * S
        else:
            np.multiply(Z[..., :1, :, :], Z, out=second[..., :2, :, :])
            np.multiply(Z[..., 1:, :, :], Z[..., 1:, :, :], out=second[..., 2:, :, :])
            one, two = (
                (each * Z).sum(axis=-3, keepdims=True)
                for each in (S[..., :2, :, :], S[..., 1:, :, :])
            )
            bent = one * H[..., :2, :, :] + two * H[..., 1:, :, :]
            weight = HALVES * S
        second += H
        exponent = (weight * second).sum(axis=-3)
        np.minimum(exponent.real, 0.0, out=exponent.real)  # of a wide S the expansion is not valid
        mean[..., 0, :, :] = a * np.exp(exponent)
        # ∂ₖ ln ⟨a⟩ = Zₖ + Σ Sᵢⱼ Zᵢ Hⱼₖ + ½ Σ Sᵢⱼ ∂ₖHᵢⱼ
        slopes = Z + bent
        slopes += self.damping_slope(Z, S)
        np.multiply(slopes, mean, out=rows[..., 1 : 1 + d, :, :])
        second *= mean
        return rows

    def at(self, x: Float) -> tuple[Complex, Float]:
        """Return a(x) (F, G, M) of points (p, G), and Σₘ |a|² Re Zᵢ* Zⱼ (F, d(d+1)/2, G)."""
        a, Z, _ = self.expansion(x)
        Z = a[..., None, :, :] * Z
        pairs = PAIRS[Z.shape[-3]]
        gram = [(Z[:, i].conj() * Z[:, j]).real.sum(axis=-1) for i, j in pairs]
        return a, np.stack(gram, axis=1)
