"""Recursive least squares by QR decomposition, with forgetting and a ridge."""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import numbers
from arrivals.parameters import Configurable
from arrivals.trackers.gaussian.linalg import append_rows, ridge_rows, solve_factor, transposed
from arrivals.typing import Bool, Float
from arrivals.validation import count, positive, real

TINY = np.finfo(np.float64).tiny

# A factor [R | U] is triangular, (..., n_coef + n_rhs, n_coef + n_rhs): RᵀR is the Gram matrix of
# the regressors, R⁻¹U the solution, and the block below U the factor of the residuals.

MAX_SWEEPS, SWEEP_TOLERANCE = 1000, 1e-12  # over the coefficients; relative change in one


def huber_weight(error: ArrayLike, threshold: ArrayLike) -> Float:
    """Return Huber's weights of errors: 1 up to the threshold, then threshold / |error|.

    Examples
    --------
    >>> huber_weight([0.5, -4.0], 1.0)
    array([1.  , 0.25])
    """
    size = np.abs(np.asarray(error, dtype=np.float64))
    return np.asarray(threshold / np.maximum(size, threshold))


class QRDRLS(Configurable):
    r"""Regularized recursive least squares with exponential forgetting, by QR decomposition.

    Minimizes Σ λ^age (y - xᵀW)² + μ |W - target|² for each right-hand side, all with the same
    regressors. A block of samples gives the result of the samples one after the other.

    Parameters
    ----------
    n_coef : int
        Number of regressors.
    n_rhs : int
        Number of right-hand sides.
    forgetting : float
        λ, forgetting factor per sample, in (0, 1].
    ridge : float
        μ, weight of the target; above 0, so that there is a solution from the start.
    target : array_like, shape (..., n_coef, n_rhs), optional
        Solution without data. Zero if None: the leaky form. A target assigned later is approached
        as the old one is forgotten.
    huber : float, optional
        Error beyond which a sample has less weight: the root mean square over its right-hand
        sides, with the solution before its block: the M-estimation of Table I.
    l1 : float or array_like, shape (n_coef,), optional
        Weights γ of the weighted L1 regularization of the same table: `solve` minimizes
        Σ γ_l \|W_l - target_l\| too, of the norms of the rows of W - target.

    Attributes
    ----------
    factor : ndarray, shape (..., n_coef + n_rhs, n_coef + n_rhs)
        Triangular factor [R | U].
    weight : ndarray, shape (...)
        Σ λ^age of the samples.

    Raises
    ------
    ValueError
        If a number is out of range or a shape does not fit.

    Notes
    -----
    Leading axes are independent problems; `target` or the first samples define them.
    Both parts of complex samples are equations for the same real solution. Signs of the rows of
    the factor are arbitrary: compare solutions.

    References
    ----------
    Zhang, Chan, Zhou and Hu, ISCAS 2009, 1193-1196 (regularised QRD-RLS).

    Examples
    --------
    >>> rls = QRDRLS(1, 1, forgetting=1.0, ridge=1e-6)
    >>> rls.update([[1.0], [2.0]], [[3.0], [6.0]])
    >>> rls.solve().round(3)
    array([[3.]])
    """

    def __init__(
        self,
        n_coef: int,
        n_rhs: int = 1,
        *,
        forgetting: float = 0.99,
        ridge: float = 0.01,
        target: ArrayLike | None = None,
        huber: float | None = None,
        l1: ArrayLike | None = None,
    ) -> None:
        self.n_coef, self.n_rhs = count("n_coef", n_coef), count("n_rhs", n_rhs)
        self.forgetting, self.ridge = positive("forgetting", forgetting), positive("ridge", ridge)
        if self.forgetting > 1:
            raise ValueError(f"forgetting must lie in (0, 1]; got {forgetting}")
        self.target, self.huber, self.l1 = target, huber, l1
        if huber is not None:
            positive("huber", huber)
        if l1 is not None:
            self._penalties()
        goal = self._goal()
        # R = √μ I, U = √μ target   (3.1)
        first = ridge_rows(np.full(goal.shape[:-1], self.ridge), goal)
        below = np.zeros((*goal.shape[:-2], self.n_rhs, self.n_coef + self.n_rhs))
        self.factor = np.concatenate([first, below], axis=-2)
        self.weight = np.zeros(goal.shape[:-2])

    @classmethod
    def from_factor(cls, factor: Float, n_coef: int, forgetting: float, ridge: float) -> Self:
        """Return the regression that continues a factor, for `append` and `solve`.

        Parameters
        ----------
        factor : ndarray, shape (..., n_coef, n_coef + n_rhs) or with more rows
        n_coef : int
        forgetting, ridge : float
            As in the class.
        """
        made = cls(n_coef, factor.shape[-1] - n_coef, forgetting=forgetting, ridge=ridge)
        made.factor = factor
        return made

    def update(
        self,
        X: ArrayLike,
        Y: ArrayLike,
        weights: ArrayLike | None = None,
        extra_rows: ArrayLike | None = None,
    ) -> None:
        """Update the factor by a block of samples in the order of time.

        Parameters
        ----------
        X : array_like, shape (..., n_samples, n_coef)
            Regressors. A sample with a missing number, here or in `Y`, has weight 0.
        Y : array_like, shape (..., n_samples, n_rhs)
            Right-hand sides.
        weights : array_like, shape (..., n_samples), optional
            Weights of the squared errors; 1 if None. A sample of weight 0 still ages the others.
        extra_rows : array_like, shape (..., n_rows, n_coef + n_rhs), optional
            Rows [x | y] that are not samples and do not age, such as the Cholesky factor of the
            error covariance of the regressors.

        Raises
        ------
        ValueError
            If shapes do not fit or a weight is negative.
        """
        X, Y = numbers("X", X), numbers("Y", Y)
        n_parts = 2 if np.iscomplexobj(X) or np.iscomplexobj(Y) else 1
        X, Y = self._rows("X", X, self.n_coef, n_parts), self._rows("Y", Y, self.n_rhs, n_parts)
        if X.shape[:-1] != Y.shape[:-1]:
            raise ValueError(f"X and Y must have as many samples; got {X.shape} and {Y.shape}")
        valid: Bool | None = None
        if not np.isfinite(X.sum() + Y.sum()):  # a number is missing, or the sum is too large
            valid = np.asarray(np.isfinite(X).all(axis=-1) & np.isfinite(Y).all(axis=-1))
            X, Y = np.where(valid[..., None], X, 0.0), np.where(valid[..., None], Y, 0.0)
        w, n = self._weights(weights, X.shape[-2], n_parts), X.shape[-2] // n_parts
        if valid is not None:
            w = w * valid
        samples = np.concatenate([X, Y], axis=-1)
        if self.huber is not None:
            w = w * self.robust_weights(samples, self.huber, n_parts)
        # [√λ^n [R | U]; √(w λ^age) [x | y]; extra rows; √(μ (1 - λ^n)) [I | target]]   (3.2)
        age = np.repeat(self.forgetting ** np.arange(n - 1, -1, -1.0), n_parts)
        decay = self.forgetting**n
        rows = [np.sqrt(w * age)[..., None] * samples]
        if extra_rows is not None:
            extra = self._rows("extra_rows", extra_rows, self.n_coef + self.n_rhs, 1)
            if not np.isfinite(extra).all():
                raise ValueError("extra_rows must be finite; got NaN or infinite numbers")
            rows.append(np.broadcast_to(extra, (*X.shape[:-2], *extra.shape[-2:])))
        goal = np.broadcast_to(self._goal(), (*X.shape[:-2], self.n_coef, self.n_rhs))
        rows.append(ridge_rows(np.full(goal.shape[:-1], self.ridge * (1 - decay)), goal))
        self.factor = np.broadcast_to(self.factor, (*X.shape[:-2], *self.factor.shape[-2:]))
        self.append(np.asarray(decay), *rows)
        self.weight = decay * self.weight + (w * age).sum(axis=-1) / n_parts

    def append(self, decay: Float, *rows: Float) -> None:
        """Update the factor by rows that have their weights: the core of `update`.

        Parameters
        ----------
        decay : ndarray, shape (...)
            λ^n, of the squares of the old rows.
        *rows : ndarray, shape (..., n_rows, n_coef + n_rhs)
            Weighted samples [x | y], ridge rows, and others.
        """
        self.factor = append_rows(np.sqrt(decay)[..., None, None] * self.factor, *rows)

    def robust_weights(self, samples: Float, huber: ArrayLike, n_parts: int = 1) -> Float:
        """Return Huber's weights of samples [x | y] by the errors with the present solution.

        Parameters
        ----------
        samples : ndarray, shape (..., n_rows, n_coef + n_rhs)
        huber : array_like, shape (...)
            Thresholds.
        n_parts : int
            Rows of each sample.

        Returns
        -------
        ndarray, shape (..., n_rows)
        """
        X, Y = samples[..., : self.n_coef], samples[..., self.n_coef :]
        error = np.sqrt(n_parts * ((Y - X @ self.solve()) ** 2).mean(axis=-1))
        return huber_weight(error, np.asarray(huber)[..., None])

    def solve(self) -> Float:
        """Return the solution W = R⁻¹ U; with `l1` by sweeps over the coefficients.

        Returns
        -------
        ndarray, shape (..., n_coef, n_rhs)
        """
        W = solve_factor(self.factor, self.n_coef)
        if self.l1 is None:
            return W
        # v_l = W_l - target_l <- (1 - γ_l / 2|b_l|)₊ b_l / G_ll,  b = RᵀU - G W + G_ll v_l
        R = self.factor[..., : self.n_coef, : self.n_coef]
        G, penalty = transposed(R) @ R, self._penalties()
        B, goal = G @ W, np.broadcast_to(self._goal(), W.shape)
        for _ in range(MAX_SWEEPS):
            before = W.copy()
            for n in range(self.n_coef):
                G_n, v = G[..., n, None, :], W[..., n, :] - goal[..., n, :]
                b = B[..., n, :] - (G_n @ W)[..., 0, :] + G_n[..., n] * v
                size = np.sqrt((b * b).sum(axis=-1, keepdims=True))
                kept = np.maximum(size - penalty[n] / 2, 0.0) / np.maximum(size, TINY)
                W[..., n, :] = goal[..., n, :] + kept * b / G_n[..., n]
            if np.abs(W - before).max() <= SWEEP_TOLERANCE * np.abs(W).max():
                break
        return W

    def residual_power(self) -> Float:
        """Return the mean square of the least-squares errors, the penalty of the ridge included.

        Returns
        -------
        ndarray, shape (..., n_rhs)
            NaN before the first sample.
        """
        below = self.factor[..., self.n_coef :, self.n_coef :]
        weight = np.where(self.weight > 0, self.weight, np.nan)
        return np.asarray((below**2).sum(axis=-2) / weight[..., None])

    def _penalties(self) -> Float:
        value = real("l1", 0.0 if self.l1 is None else self.l1)
        if value.shape not in ((), (self.n_coef,)):
            raise ValueError(
                f"l1 must be one number or have shape ({self.n_coef},); got {value.shape}"
            )
        value = np.broadcast_to(value, (self.n_coef,))
        if not ((value >= 0) & (value < np.inf)).all():
            raise ValueError(f"l1 must be finite, not negative; got {self.l1!r}")
        return value

    def _goal(self) -> Float:
        zeros = np.zeros((self.n_coef, self.n_rhs))
        goal = zeros if self.target is None else real("target", self.target)
        if goal.shape[-2:] != zeros.shape:
            raise ValueError(f"target must have shape (..., {self.n_coef}, {self.n_rhs}); "
                             f"got {goal.shape}")  # fmt: skip
        if not np.isfinite(goal).all():
            raise ValueError("target must be finite; got NaN or infinite numbers")
        return goal

    def _weights(self, weights: ArrayLike | None, n_rows: int, n_parts: int) -> Float:
        """Return the weights of the rows, (..., n_rows)."""
        n = n_rows // n_parts
        w = np.ones(n) if weights is None else real("weights", weights)
        if w.shape[-1:] != (n,) or not ((w >= 0) & (w < np.inf)).all():
            raise ValueError(f"weights must be {n} numbers, finite, not negative; got {weights!r}")
        return np.repeat(w, n_parts, axis=-1)

    def _rows(self, name: str, value: ArrayLike, n: int, n_parts: int) -> Float:
        """Return samples as real rows, (..., n_parts n_samples, n)."""
        array = value if isinstance(value, np.ndarray) else numbers(name, value)
        if array.ndim < 2 or array.shape[-1] != n:
            raise ValueError(f"{name} must have shape (..., n_samples, {n}); got {array.shape}")
        if n_parts == 1:
            return real(name, array)
        both = np.stack([array.real, array.imag], axis=-2)
        return real(name, both.reshape(*array.shape[:-2], -1, n))
