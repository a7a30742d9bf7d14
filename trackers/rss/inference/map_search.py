"""Joint maximum of amplitudes and positions by scipy: least squares and BFGS."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import slopes
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.settings import MAPSolver
from arrivals.typing import Float


class MAPEstimate(NamedTuple):
    """Maximum of one problem: u (n_sources,), Np, and θ (n_sources, 2), m."""

    u: Float
    theta: Float
    converged: bool
    iterations: int


def maximize(
    problem: JointPosterior, u: Float, theta: Float, solver: MAPSolver = MAPSolver()
) -> MAPEstimate:
    """Maximize the joint posterior, or the likelihood, from a starting point.

    Parameters
    ----------
    problem : JointPosterior
        Without a batch axis.
    u, theta : ndarray, shape (n_sources,), (n_sources, 2)
        Starting point.
    solver : MAPSolver

    Returns
    -------
    MAPEstimate

    Raises
    ------
    ValueError
        If there are fewer readings than unknowns and no prior.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (7) and section 4: the method called ML.
    """
    problem = problem.at_valid_sensors()
    n = 3 * len(u)
    if not solver.prior and len(problem.W) < n:
        raise ValueError(
            f"readings must be at least {n}, the number of unknowns; got {len(problem.W)}: "
            "use prior=True"
        )
    search = _levenberg_marquardt if solver.method == "lm" else _bfgs
    return search(problem, np.concatenate([u, theta.ravel()]), solver)


def _levenberg_marquardt(problem: JointPosterior, x: Float, solver: MAPSolver) -> MAPEstimate:
    from scipy.optimize import least_squares

    K = len(problem.prior.mu)
    root_W = np.sqrt(problem.W)
    root_prior = np.asarray(np.linalg.cholesky(problem.prior_precision()).T, np.float64)
    centre = np.concatenate([problem.prior.mu, problem.prior.theta.ravel()])

    def residual(x: Float) -> Float:
        u, theta = x[:K], x[K:].reshape(K, 2)
        misfit = root_W * (problem.propagation.levels(u, theta).log_sigma - problem.xi)
        return np.concatenate([misfit, root_prior @ (x - centre)]) if solver.prior else misfit

    def jacobian(x: Float) -> Float:
        levels = problem.propagation.levels(x[:K], x[K:].reshape(K, 2))
        J = root_W[:, None] * slopes(levels, problem.propagation.alpha)
        return np.concatenate([J, root_prior]) if solver.prior else J

    result = least_squares(
        residual, x, jacobian, method="lm", x_scale="jac", xtol=solver.tolerance,
        ftol=solver.tolerance,
    )  # fmt: skip
    return MAPEstimate(
        result.x[:K], result.x[K:].reshape(K, 2), bool(result.success), int(result.nfev)
    )


def _bfgs(problem: JointPosterior, x: Float, solver: MAPSolver) -> MAPEstimate:
    from scipy.optimize import minimize

    K = len(problem.prior.mu)
    if not solver.prior:
        flat = problem.prior._replace(w=0 * problem.prior.w, P=0 * problem.prior.P)
        problem = problem._replace(prior=flat)
    scale = 1 / np.sqrt(np.concatenate([np.full(K, 1.0), np.full(2 * K, 1e-2)]))

    def cost(x: Float) -> tuple[float, Float]:
        u, theta = scale[:K] * x[:K], (scale[K:] * x[K:]).reshape(K, 2)
        return -float(problem.log_posterior(u, theta)), -scale * problem.gradient(u, theta)

    result = minimize(cost, x / scale, jac=True, method="BFGS", options={"gtol": 1e-4})
    x = scale * result.x
    converged = bool(result.success) or result.status == 2  # 2: no lower point along the line
    return MAPEstimate(x[:K], x[K:].reshape(K, 2), converged, int(result.nit))
