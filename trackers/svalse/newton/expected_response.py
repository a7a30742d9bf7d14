"""Mean responses of an array to uncertain angles, and their products."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.trackers.svalse.noise_initialization import NOISE_FLOOR
from arrivals.typing import Bool, Complex, Float

Array = TypeVar("Array", Float, Complex)


class ExpectedResponse:
    """Mean steering vectors of wrapped normal angles, â = G ⟨d⟩ with ⟨d_k⟩ = exp(jkμ - k²s/2).

    Parameters
    ----------
    manifold : AngleManifold
        Without a second parameter.
    temper : float
        Number of snapshots that count as one: divides the evidence of each.
    power_floor : float
        Smallest power of a source, in units of the noise of one snapshot after beamforming.
    noise_floor : float
        Smallest noise, as a share of the power.

    Attributes
    ----------
    extent : float
        Sensors of the filled line that resolves as well: 1/extent is the scale of its beam.
    norm2 : ndarray, shape (n_bins, 1)
        ‖a(θ)‖², the mean over all angles where it changes.

    Examples
    --------
    >>> from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
    >>> response = ExpectedResponse(UniformLineManifold(np.arange(3), step=np.pi, origin=1.0))
    >>> response(np.zeros((1, 1)), np.full((1, 1), 0.2))[0, 0, 0].real.round(4)
    array([[0.9048, 1.    , 0.9048]])
    >>> round(float(response.extent), 6)
    3.0
    """

    def __init__(
        self,
        manifold: AngleManifold,
        tempering: float = 1.0,
        power_floor: float = 0.0,
        noise_floor: float = NOISE_FLOOR,
    ) -> None:
        self.manifold, self.tempering = manifold, tempering
        self.power_floor, self.noise_floor = power_floor, noise_floor
        self.n_sensors, self.n_bins = manifold.n_sensors, manifold.n_bins
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
        self.extent = np.sqrt(12 * float(weight @ (k - weight @ k) ** 2) + 1)
        norm = manifold.norm_squared()
        one = np.full((self.n_bins, 1), norm) if isinstance(norm, float) else norm[0, :, :1].real
        self.norm2: Float = np.asarray(one)
        self.series: Complex | None = None
        if not isinstance(norm, float) and norm.shape[2] > 1:
            self.series = norm[0].T.copy()  # (n_i, F)
            i = np.arange(norm.shape[2])
            self.ji, self.half_i2 = 1j * i, i * i / 2
            self.halves = np.stack([np.ones(len(i)), 0.5j * i, -0.5 * i * i])[:, None]

    def __call__(self, mu: Float, s: Float) -> Complex:
        """Return â, ∂â/∂μ and ∂²â/∂μ² = 2 ∂â/∂s for angles (B, L): (B, F, 3, L, n_sensors)."""
        jk, half_k2 = self.jk[self.first :], self.half_k2[self.first :]
        d = np.exp(mu[..., None] * jk - s[..., None] * half_k2)
        if self.paired:
            d = np.concatenate([d[..., :0:-1].conj(), d], axis=-1)
        d = d[:, None] * self.factors
        if self.G is None:
            return d[:, None]
        a = (d @ self.G).reshape(*d.shape[:3], self.n_bins, self.n_sensors)
        return np.ascontiguousarray(np.moveaxis(a, 3, 1))

    def norms(self, mu: Float, s: Float) -> Float:
        """Return ⟨‖a‖²⟩, and half its first and second derivatives in μ, (B, F, 3, L)."""
        assert self.series is not None
        d = np.exp(mu[..., None] * self.ji - s[..., None] * self.half_i2)
        n = (d[:, None] * self.halves) @ self.series
        return np.asarray(np.moveaxis(n.real, 3, 1))

    def products(
        self, Y: Complex, mu: Float, s: Float, used: Bool | None
    ) -> tuple[Complex, Complex, Complex, Float]:
        """Return A, X, h and the loss of ‖a‖² of an `Evaluation`; `used` only if not all are.

        X holds âᴴâ, (∂â)ᴴâ, (∂²â)ᴴâ, and (∂â)ᴴ∂â where it is not -(∂²â)ᴴâ.
        """
        stack = self(mu, s)
        if used is not None:
            stack = stack * used[:, None, None, :, None]
        B, F, _, L, M = stack.shape
        A = stack[:, :, 0]
        conj = stack.reshape(B, F, 3 * L, M).conj()
        X = (conj @ A.swapaxes(2, 3)).reshape(B, F, 3, L, L)
        h = (conj @ Y).reshape(B, F, 3, L, Y.shape[3])
        if self.G is not None:
            T = stack[:, :, 1]
            X = np.concatenate([X, (T.conj() @ T.swapaxes(2, 3))[:, :, None]], axis=2)
        own = diagonals(X)
        size = own[:, :, 0].real.copy()
        own[...] = 0
        if self.series is None:
            own[:, :, 0] = self.norm2 if used is None else self.norm2 * used[:, None]
        else:
            norms = self.norms(mu, s)
            own[:, :, :3] = norms if used is None else norms * used[:, None, None]
        return A, X, h, own[:, :, 0].real - size

    def at(self, theta: Float) -> tuple[Complex, Float | float, Float]:
        """Return a(θ) (F, n, n_sensors), ‖∂a/∂θ‖² and ‖a‖², (F, n) or less, at known angles."""
        d = np.exp(theta[:, None] * self.jk)
        if self.G is None:
            return d[None], 2 * float(self.half_k2.sum()), self.norm2
        A, T = (
            np.moveaxis((x @ self.G).reshape(len(d), self.n_bins, -1), 0, 1)
            for x in (d, d * self.jk)
        )
        norm2 = self.norm2 if self.series is None else (np.abs(A) ** 2).sum(axis=2)
        return np.ascontiguousarray(A), (np.abs(T) ** 2).sum(axis=2), norm2

    def total(self, x: Float) -> Float:
        """Return the sum over bins (B, F, ...) of their evidence, tempered."""
        x = x[:, 0] if x.shape[1] == 1 else x.sum(axis=1)
        return x if self.tempering == 1 else x / self.tempering


def diagonals(X: Array) -> Array:
    """Return the diagonals (..., L) of contiguous matrices (..., L, L), to be read and written."""
    L = X.shape[-1]
    return X.reshape(*X.shape[:-2], L * L)[..., :: L + 1]


def over_snapshots(x: Array) -> Array:
    """Return the sum over the last axis, of snapshots.

    Examples
    --------
    >>> over_snapshots(np.ones((2, 3)))
    array([3., 3.])
    """
    return x[..., 0] if x.shape[-1] == 1 else x.sum(axis=-1)
