"""Interacting multiple models: several filters, and the probability that each is right."""

from __future__ import annotations

import copy
import math
import sys
from collections.abc import Sequence
from typing import Any, Protocol, Self, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.base import Tracker, is_missing
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.circular import Angles, add, difference, spread
from arrivals.trackers.gaussian.equations import likelihood
from arrivals.trackers.registry import register
from arrivals.typing import Float
from arrivals.validation import shaped

TINY = sys.float_info.min


@runtime_checkable
class Filter(Protocol):
    """What can serve inside an `IMM`: trackers of ours, filters of filterpy, and one's own."""

    x: Any
    P: Any

    @property
    def likelihood(self) -> float:
        """Likelihood of the last measurement."""

    def predict(self, u: Any = None) -> Any:
        """Move the belief; the first argument is the control input."""

    def update(self, z: Any) -> Any:
        """Correct the belief."""


@register("imm")
class IMM(Tracker):
    """The interacting-multiple-model filter, over any filters with the same state.

    Parameters
    ----------
    filters : sequence of Filter
        At least two; the tracker moves them. Their states have the same entries.
    mu : array_like, shape (n_filters,)
        Probability of each at first; brought to sum 1.
    M : array_like, shape (n_filters, n_filters)
        Probabilities to go from model i (row) to model j in a step.
    angles : tuple of int, optional
        Entries of the state that are angles; those that the members' motion models name if None.

    Attributes
    ----------
    mu : ndarray, shape (n_filters,)
        Probabilities of the models: predicted ones after `predict`.
    cbar, omega : ndarray, shapes (n_filters,), (n_filters, n_filters)
        Predicted and mixing probabilities of the last `predict`.
    x_prior, P_prior, x_post, P_post : ndarray
        The mixed belief after the last `predict` and the last `update`.
    likelihood : ndarray, shape (n_filters,)
        Of the last measurement, by model.
    log_likelihood : float
        Of the last measurement, by the mixture.

    Raises
    ------
    TypeError
        If a member lacks one of x, P, likelihood, predict, update.
    ValueError
        If sizes differ, or `mu` or a row of `M` are no probabilities.

    Notes
    -----
    Attributes are called as in `filterpy.kalman.IMMEstimator`, and after each update the numbers
    are the same, with these exceptions: angles are averaged on the circle; models are weighed in
    the log domain; a missed measurement leaves the predicted probabilities as they are; a second
    update without a `predict` is no second transition. After `predict`, `x` and `P` are mixed by
    the predicted probabilities, where filterpy takes those before the step.

    References
    ----------
    Blom and Bar-Shalom, "The interacting multiple model algorithm for systems with Markovian
    switching coefficients", IEEE TAC 33(8), 1988.

    Examples
    --------
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> from arrivals.motion_models import RandomWalk
    >>> from arrivals.trackers.gaussian.kalman import Kalman
    >>> seen = LinearMeasurement([[1.0]], [[0.01]])
    >>> calm, wild = (Kalman(RandomWalk(q, 1), seen, [0.0], [[1.0]]) for q in (1e-4, 1.0))
    >>> tracker = IMM([calm, wild], mu=[0.5, 0.5], M=[[0.95, 0.05], [0.05, 0.95]])
    >>> _ = tracker.run([[0.0], [0.0], [0.1]])
    >>> bool(tracker.mu[0] > 0.7)
    True
    >>> _ = tracker.run([[2.0]])
    >>> bool(tracker.mu[1] > 0.9)
    True
    """

    def __init__(
        self,
        filters: Sequence[Filter],
        mu: ArrayLike,
        M: ArrayLike,
        angles: Angles | None = None,
    ) -> None:
        self.filters, self.N = filters, len(filters)
        _check_members(filters)
        self.mu = _probabilities("mu", shaped("mu", mu, self.N))
        self.M = _probabilities("M", shaped("M", M, self.N, self.N))
        self.angles = angles
        self.omega, self.cbar = np.zeros((self.N, self.N)), self.mu @ self.M
        self.likelihood = np.ones(self.N)
        self.log_likelihood = 0.0
        self._combine()
        self.x_prior, self.P_prior = self.x.copy(), self.P.copy()
        self.x_post, self.P_post = self.x.copy(), self.P.copy()

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Mix the members' beliefs, each by the odds of having come from there, and move them.

        `dt` goes to our trackers; filterpy's filters know the length of their own step.
        """
        cbar = self.mu.dot(self.M)
        omega = self.M * self.mu[:, None] / np.maximum(cbar, TINY)
        x, P = mixture(*self._members(), omega.T, self._circular())
        before = [dict(vars(member)) for member in self.filters]
        try:
            for i, member in enumerate(self.filters):
                _hold(member, x[i], P[i])
                _predict(member, u, dt)
        except Exception:
            _restore(self.filters, before)
            raise
        self.mu = self.cbar = cbar
        self.omega = omega
        self._combine()
        self.x_prior, self.P_prior = self.x.copy(), self.P.copy()

    def update(self, z: ArrayLike | None) -> None:
        """Correct each member, and weigh it by how well it foretold the measurement."""
        gap = is_missing(z)
        before = [dict(vars(member)) for member in self.filters]
        try:
            for member in self.filters:
                member.update(None if gap else z)
        except Exception:
            _restore(self.filters, before)
            raise
        if gap:
            self.likelihood, self.log_likelihood = np.ones(self.N), 0.0
        else:
            self._weigh()
        self.x_post, self.P_post = self.x.copy(), self.P.copy()

    def _weigh(self) -> None:
        """Set μ ∝ c̄ Λ, in the log domain."""
        logs = [_log_likelihood(member) for member in self.filters]
        priors = [math.log(p) if p > 0 else -math.inf for p in self.mu.tolist()]
        odds = [log + prior for log, prior in zip(logs, priors, strict=True)]
        top = max(odds)
        weights = [math.exp(each - top) for each in odds]
        total = sum(weights)
        self.mu = np.array([weight / total for weight in weights])
        self.log_likelihood = top + math.log(total)
        self.likelihood = np.array([likelihood(log) for log in logs])
        self._combine()

    def _combine(self) -> None:
        x, P = mixture(*self._members(), self.mu, self._circular())
        self.x, self.P = x.reshape(np.shape(self.filters[0].x)), P

    def _members(self) -> tuple[Float, Float]:
        means = np.array([member.x for member in self.filters], dtype=np.float64)
        covariances = np.array([member.P for member in self.filters], dtype=np.float64)
        return means.reshape(self.N, -1), covariances

    def _circular(self) -> Angles:
        if self.angles is not None:
            return self.angles
        motions = [getattr(member, "motion", None) for member in self.filters]
        return tuple(sorted({entry for motion in motions for entry in _angles(motion)}))

    @property
    def estimate(self) -> StateEstimate:
        """Mean and covariance of the mixture."""
        return StateEstimate(self.x.ravel(), self.P)

    def __sklearn_clone__(self) -> Self:
        return copy.deepcopy(self)  # the members' beliefs are among its parameters


def mixture(
    means: Float, covariances: Float, weights: Float, angles: Angles = ()
) -> tuple[Float, Float]:
    """Return means and covariances of Gaussian mixtures of the same m parts.

    x = Σ wᵢ xᵢ, P = Σ wᵢ (Pᵢ + (xᵢ-x)(xᵢ-x)ᵀ), in the tangent space at the part that weighs most.

    Parameters
    ----------
    means : ndarray, shape (m, n)
    covariances : ndarray, shape (m, n, n)
    weights : ndarray, shape (..., m)
        Of each mixture.
    angles : tuple of int
        Entries that are angles.

    Returns
    -------
    means, covariances : ndarray, shapes (..., n), (..., n, n)

    Examples
    --------
    >>> x, P = mixture(np.array([[3.0], [-3.0]]), np.ones((2, 1, 1)), np.array([0.5, 0.5]), (0,))
    >>> x.round(4), P.round(4)
    (array([-3.1416]), array([[1.02]]))
    """
    m, n = means.shape
    heaviest = weights.reshape(-1, m).sum(axis=0).argmax() if angles else 0
    origin = means[heaviest]
    steps = difference(means, origin, angles)
    shift = weights.dot(steps)
    within = weights.dot(covariances.reshape(m, n * n)).reshape(*shift.shape, n)
    between = spread(steps - shift[..., None, :], weights)
    return add(origin, shift, angles), within + between


def _check_members(filters: Sequence[Filter]) -> None:
    if len(filters) < 2:
        raise ValueError(f"filters must hold two filters at least; got {len(filters)}")
    for member in filters:
        if not isinstance(member, Filter):
            wanted = ("x", "P", "predict", "update", "likelihood")
            lacks = [name for name in wanted if not hasattr(member, name)]
            raise TypeError(
                f"a member must have x, P, predict(u), update(z), likelihood; "
                f"{type(member).__name__} lacks {', '.join(lacks)}"
            )
    shapes = [np.shape(member.x) for member in filters]
    if len(set(shapes)) != 1:
        raise ValueError(f"the members' x must have one shape; got {shapes}")


def _probabilities(name: str, values: Float) -> Float:
    """Return values whose last axis is brought to sum 1, those that do untouched."""
    totals = values.sum(axis=-1, keepdims=True)
    if not ((values >= 0).all() and (totals > 0).all()):
        raise ValueError(f"{name} must hold probabilities; got {values.tolist()}")
    if name == "M" and np.abs(totals - 1).max() > 1e-6:
        raise ValueError(f"the rows of M must have sum 1; got {totals.ravel().tolist()}")
    return values if np.abs(totals - 1).max() < 1e-12 else values / totals


def _hold(member: Filter, x: Float, P: Float) -> None:
    if isinstance(member, GaussianFilter):
        member.set_belief(x, P)  # without the checks of a belief that a user assigned
    else:
        member.x, member.P = x.reshape(np.shape(member.x)), P


def _predict(member: Filter, u: ArrayLike | None, dt: float) -> None:
    if isinstance(member, Tracker):
        member.predict(u, dt=dt)
    elif dt != 1:
        raise ValueError(f"{type(member).__name__} keeps the length of its own step; got dt={dt}")
    elif u is None:
        member.predict()
    else:
        member.predict(u)


def _log_likelihood(member: Filter) -> float:
    log = getattr(member, "log_likelihood", None)
    return float(np.log(member.likelihood) if log is None else log)


def _angles(motion: object) -> Angles:
    return cast(Angles, getattr(motion, "angles", ()))


def _restore(members: Sequence[Filter], before: list[dict[str, Any]]) -> None:
    for member, attributes in zip(members, before, strict=True):
        vars(member).clear()
        vars(member).update(attributes)
