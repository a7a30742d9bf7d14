"""Recursive least squares by QR decomposition, with forgetting and a ridge."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import numbers
from arrivals.parameters import Configurable
from arrivals.typing import Bool, Float
from arrivals.validation import count, positive, real

# A factor [R | U] is triangular, (..., n_coef + n_rhs, n_coef + n_rhs): RᵀR is the Gram matrix of
# the regressors, R⁻¹U the solution, and the block below U the factor of the residuals.


def append_rows(factor: Float, *rows: Float) -> Float:
    """Return the triangular factor of a factor with more rows, (..., n, n).

    Examples
    --------
    >>> np.abs(append_rows(np.zeros((1, 1)), np.array([[3.0], [4.0]]))).round(12)
    array([[5.]])
    """
    stack = np.concatenate([factor, *rows], axis=-2)
    return np.asarray(np.linalg.qr(stack, mode="r"))


def solve_factor(factor: Float, n_coef: int) -> Float:
    """Return W = R⁻¹U of a factor: (..., n_coef, n_rhs)."""
    R, U = factor[..., :n_coef, :n_coef], factor[..., :n_coef, n_coef:]
    return np.asarray(np.linalg.solve(R, U))


def ridge_rows(weight: ArrayLike, target: Float) -> Float:
    """Return the rows √weight [I | target], (..., n_coef, n_coef + n_rhs).

    Parameters
    ----------
    weight : array_like, shape (..., n_coef)
        One number for each coefficient.
    target : ndarray, shape (..., n_coef, n_rhs)
        Solution without data.
    """
    n = target.shape[-2]
    root = np.sqrt(np.asarray(weight, dtype=np.float64))[..., None]
    rows = np.empty((*target.shape[:-1], n + target.shape[-1]))
    rows[..., :n], rows[..., n:] = root * np.eye(n), root * target
    return rows


def forgetting_weights(valid: Float, forgetting: float) -> tuple[Float, Float]:
    """Return √λ^age of samples (..., n) and λ^n, counting only valid samples (1, not 0).

    Examples
    --------
    >>> forgetting_weights(np.array([1.0, 0.0, 1.0]), 0.25)
    (array([0.5, 0. , 1. ]), array(0.0625))
    """
    until = np.cumsum(valid, axis=-1)
    n = until[..., -1:]
    return valid * forgetting ** ((n - until) / 2), np.asarray(forgetting ** n[..., 0])


def huber_weight(error: ArrayLike, threshold: float) -> Float:
    """Return Huber's weights of errors: 1 up to the threshold, then threshold / |error|.

    Examples
    --------
    >>> huber_weight([0.5, -4.0], 1.0)
    array([1.  , 0.25])
    """
    size = np.abs(np.asarray(error, dtype=np.float64))
    return np.asarray(threshold / np.maximum(size, threshold))


class QRDRLS(Configurable):
    """Regularized recursive least squares with exponential forgetting, by QR decomposition.

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
        sides, with the solution before its block.

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
    ) -> None:
        self.n_coef, self.n_rhs = count("n_coef", n_coef), count("n_rhs", n_rhs)
        self.forgetting, self.ridge = positive("forgetting", forgetting), positive("ridge", ridge)
        if self.forgetting > 1:
            raise ValueError(f"forgetting must lie in (0, 1]; got {forgetting}")
        self.target, self.huber = target, huber
        if huber is not None:
            positive("huber", huber)
        goal = self._goal()
        # R = √μ I, U = √μ target   (3.1)
        first = ridge_rows(np.full(goal.shape[:-1], self.ridge), goal)
        below = np.zeros((*goal.shape[:-2], self.n_rhs, self.n_coef + self.n_rhs))
        self.factor = np.concatenate([first, below], axis=-2)
        self.weight = np.zeros(goal.shape[:-2])

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
        w, n = self._weights(weights, X, Y, n_parts), X.shape[-2] // n_parts
        if valid is not None:
            w = w * valid
        # [√λ^n [R | U]; √(w λ^age) [x | y]; √(μ (1 - λ^n)) [I | target]]   (3.2)
        age = np.repeat(self.forgetting ** np.arange(n - 1, -1, -1.0), n_parts)
        decay = self.forgetting**n
        data = np.sqrt(w * age)[..., None] * np.concatenate([X, Y], axis=-1)
        goal = np.broadcast_to(self._goal(), (*X.shape[:-2], self.n_coef, self.n_rhs))
        rows = [data, ridge_rows(np.full(goal.shape[:-1], self.ridge * (1 - decay)), goal)]
        if extra_rows is not None:
            extra = self._rows("extra_rows", extra_rows, self.n_coef + self.n_rhs, 1)
            if not np.isfinite(extra).all():
                raise ValueError("extra_rows must be finite; got NaN or infinite numbers")
            rows.append(np.broadcast_to(extra, (*X.shape[:-2], *extra.shape[-2:])))
        old = np.broadcast_to(self.factor, (*X.shape[:-2], *self.factor.shape[-2:]))
        self.factor = append_rows(np.sqrt(decay) * old, *rows)
        self.weight = decay * self.weight + (w * age).sum(axis=-1) / n_parts

    def solve(self) -> Float:
        """Return the solution W = R⁻¹ U.

        Returns
        -------
        ndarray, shape (..., n_coef, n_rhs)
        """
        return solve_factor(self.factor, self.n_coef)

    def residual_power(self) -> Float:
        """Return the mean square of the errors, the penalty of the ridge included.

        Returns
        -------
        ndarray, shape (..., n_rhs)
            NaN before the first sample.
        """
        below = self.factor[..., self.n_coef :, self.n_coef :]
        weight = np.where(self.weight > 0, self.weight, np.nan)
        return np.asarray((below**2).sum(axis=-2) / weight[..., None])

    def _goal(self) -> Float:
        zeros = np.zeros((self.n_coef, self.n_rhs))
        goal = zeros if self.target is None else real("target", self.target)
        if goal.shape[-2:] != zeros.shape:
            raise ValueError(f"target must have shape (..., {self.n_coef}, {self.n_rhs}); "
                             f"got {goal.shape}")  # fmt: skip
        if not np.isfinite(goal).all():
            raise ValueError("target must be finite; got NaN or infinite numbers")
        return goal

    def _weights(self, weights: ArrayLike | None, X: Float, Y: Float, n_parts: int) -> Float:
        """Return the weights of the rows, (..., n_parts n_samples), with those of Huber."""
        n = X.shape[-2] // n_parts
        w = np.ones(n) if weights is None else real("weights", weights)
        if w.shape[-1:] != (n,) or not ((w >= 0) & (w < np.inf)).all():
            raise ValueError(f"weights must be {n} numbers, finite, not negative; got {weights!r}")
        w = np.repeat(w, n_parts, axis=-1)
        if self.huber is None:
            return w
        error = np.sqrt(n_parts * ((Y - X @ self.solve()) ** 2).mean(axis=-1))
        return np.asarray(w * huber_weight(error, self.huber))

    def _rows(self, name: str, value: ArrayLike, n: int, n_parts: int) -> Float:
        """Return samples as real rows, (..., n_parts n_samples, n)."""
        array = value if isinstance(value, np.ndarray) else numbers(name, value)
        if array.ndim < 2 or array.shape[-1] != n:
            raise ValueError(f"{name} must have shape (..., n_samples, {n}); got {array.shape}")
        if n_parts == 1:
            return real(name, array)
        both = np.stack([array.real, array.imag], axis=-2)
        return real(name, both.reshape(*array.shape[:-2], -1, n))
