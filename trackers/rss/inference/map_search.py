"""The joint maximum of amplitudes and positions: least squares and BFGS, by scipy."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import slopes
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.typing import Bool, Float

Method = Literal["lm", "bfgs"]


class Maximum(NamedTuple):
    """Where the search ended: u (n_sources,), θ (n_sources, 2), and how."""

    u: Float
    theta: Float
    converged: bool
    iterations: int


def maximum(
    problem: JointPosterior,
    u: Float,
    theta: Float,
    method: Method = "lm",
    prior: bool = True,
    tolerance: float = 1e-8,
) -> Maximum:
    """Search the maximum of the joint posterior, or of the likelihood, from a starting point.

    Parameters
    ----------
    problem : Problem
        Without a batch axis.
    u, theta : ndarray, shape (n_sources,), (n_sources, 2)
        Starting point.
    method : {"lm", "bfgs"}
        Levenberg and Marquardt's, or Broyden, Fletcher, Goldfarb and Shanno's; both with
        analytic slopes.
    prior : bool
        Whether the priors count: the maximum of L, [7], or of the likelihood alone.
    tolerance : float
        Relative, of the step and the cost.

    Raises
    ------
    ValueError
        If there are fewer readings than unknowns and no prior.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (7) and section 4: the method called ML.

    Examples
    --------
    See `RSSML`.
    """
    heard = problem.W > 0
    n = 3 * len(u)
    if not prior and heard.sum() < n:
        raise ValueError(
            f"{heard.sum()} readings cannot tell {n} unknowns without a prior: use prior=True"
        )
    field = problem.field._replace(
        sensors=problem.field.sensors[heard],
        log_noise=_of(problem.field.log_noise, heard),
        log_gain=_of(problem.field.log_gain, heard),
    )
    told = problem._replace(field=field, xi=problem.xi[heard], W=problem.W[heard])
    search = _levenberg_marquardt if method == "lm" else _bfgs
    return search(told, np.concatenate([u, theta.ravel()]), prior, tolerance)


def _of(values: float | Float, heard: Bool) -> float | Float:
    return np.asarray(values)[..., heard] if np.ndim(values) else values


def _levenberg_marquardt(
    problem: JointPosterior, x: Float, with_prior: bool, tolerance: float
) -> Maximum:
    from scipy.optimize import least_squares

    K = len(problem.prior.mu)
    root_W, root = np.sqrt(problem.W), _root(problem)
    centre = np.concatenate([problem.prior.mu, problem.prior.theta.ravel()])

    def residual(x: Float) -> Float:
        u, theta = x[:K], x[K:].reshape(K, 2)
        misfit = root_W * (problem.field.levels(u, theta).log_sigma - problem.xi)
        return np.concatenate([misfit, root @ (x - centre)]) if with_prior else misfit

    def jacobian(x: Float) -> Float:
        found = problem.field.levels(x[:K], x[K:].reshape(K, 2))
        J = root_W[:, None] * slopes(found, problem.field.alpha)
        return np.concatenate([J, root]) if with_prior else J

    found = least_squares(
        residual, x, jacobian, method="lm", x_scale="jac", xtol=tolerance, ftol=tolerance
    )
    return Maximum(found.x[:K], found.x[K:].reshape(K, 2), bool(found.success), int(found.nfev))


def _root(problem: JointPosterior) -> Float:
    """Return the transposed Cholesky factor of the priors' precision."""
    return np.asarray(np.linalg.cholesky(problem.prior_precision()).T, np.float64)


def _bfgs(problem: JointPosterior, x: Float, with_prior: bool, tolerance: float) -> Maximum:
    from scipy.optimize import minimize

    K = len(problem.prior.mu)
    if not with_prior:
        nothing = problem.prior._replace(w=0 * problem.prior.w, P=0 * problem.prior.P)
        problem = problem._replace(prior=nothing)
    scale = 1 / np.sqrt(np.concatenate([np.full(K, 1.0), np.full(2 * K, 1e-2)]))

    def cost(x: Float) -> tuple[float, Float]:
        u, theta = scale[:K] * x[:K], (scale[K:] * x[K:]).reshape(K, 2)
        return -float(problem.log_posterior(u, theta)), -scale * problem.gradient(u, theta)

    found = minimize(cost, x / scale, jac=True, method="BFGS", options={"gtol": 1e-4})
    best = scale * found.x
    settled = bool(found.success) or found.status == 2  # 2: no lower point along the line
    return Maximum(best[:K], best[K:].reshape(K, 2), settled, int(found.nit))
