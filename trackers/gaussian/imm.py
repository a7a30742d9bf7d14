"""Interacting multiple models: filters of one state, and the probabilities of their models."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import LARGEST, is_missing
from arrivals.messages import shown
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import control_input
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.circular import Angles, mixture
from arrivals.trackers.gaussian.equations import likelihood
from arrivals.trackers.gaussian.filterpy_names.attributes import DeclaredAttributes
from arrivals.trackers.gaussian.particle import Particle
from arrivals.trackers.registry import register
from arrivals.typing import Float
from arrivals.validation import count, items, shaped, time_step

TINY = float(np.finfo(np.float64).tiny)
MEMBERS = ("x", "P", "predict", "update", "likelihood")


@runtime_checkable
class Filter(Protocol):
    """Protocol of the filters of an `IMM`: trackers, filters of filterpy, or a user's own.

    Attributes
    ----------
    x, P : array_like
        Mean (n,) or (n, 1), and covariance (n, n); both can be assigned.
    likelihood : float
        Likelihood of the last measurement.

    Examples
    --------
    >>> from filterpy.kalman import KalmanFilter
    >>> isinstance(KalmanFilter(dim_x=2, dim_z=1), Filter), isinstance("filter", Filter)
    (True, False)
    """

    x: Any
    P: Any

    @property
    def likelihood(self) -> float:
        """Likelihood of the last measurement."""

    def predict(self, u: Any = None) -> Any:
        """Predict the belief; the first argument is the control input."""

    def update(self, z: Any) -> Any:
        """Update the belief by a measurement."""


@register("imm")
class IMM(DeclaredAttributes, Tracker):
    """Interacting-multiple-model filter, over any filters of the same state.

    Parameters
    ----------
    filters : sequence of Filter
        At least two; `predict` and `update` change them. Their states have the same entries.
    mu : array_like, shape (n_filters,)
        Initial probabilities of the models; they are normalized to sum 1.
    M : array_like, shape (n_filters, n_filters)
        Transition probabilities from model i (row) to model j in one step.
    angles : tuple of int, optional
        Entries of the state that are angles; None for those of the filters' motion models.

    Attributes
    ----------
    mu : ndarray, shape (n_filters,)
        Probabilities of the models; predicted ones after `predict`.
    cbar, omega : ndarray, shapes (n_filters,), (n_filters, n_filters)
        Predicted and mixing probabilities of the last `predict`.
    x_prior, P_prior, x_post, P_post : ndarray
        Mixture's belief after the last `predict` and after the last `update`.
    likelihood : ndarray, shape (n_filters,)
        Likelihoods of the last measurement by the models.
    log_likelihood : float
        Log likelihood of the last measurement by the mixture.

    Raises
    ------
    TypeError
        If a filter lacks one of x, P, likelihood, predict, update.
    ValueError
        If sizes differ, or `mu` or a row of `M` does not hold probabilities.

    Notes
    -----
    Attributes have the names of `filterpy.kalman.IMMEstimator`, and after each update the numbers
    are equal, with these exceptions: angles are averaged on the circle; probabilities are computed
    in the log domain; a missing measurement does not change the predicted probabilities; a second
    update without a `predict` does not apply the transition again. After `predict`, `x` and `P`
    are combined by the predicted probabilities; filterpy takes those before the step.

    References
    ----------
    Blom and Bar-Shalom, "The interacting multiple model algorithm for systems with Markovian
    switching coefficients", IEEE TAC 33(8), 1988; equation numbers of Bar-Shalom, Li, Kirubarajan,
    *Estimation with Applications to Tracking and Navigation*, 2001, sec. 11.6.6.

    Examples
    --------
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> from arrivals.motion_models import RandomWalk
    >>> from arrivals.trackers.gaussian.kalman import Kalman
    >>> position = LinearMeasurement([[1.0]], [[0.01]])
    >>> slow, fast = (Kalman(RandomWalk(q, 1), position, [0.0], [[1.0]]) for q in (1e-4, 1.0))
    >>> tracker = IMM([slow, fast], mu=[0.5, 0.5], M=[[0.95, 0.05], [0.05, 0.95]])
    >>> _ = tracker.run([[0.0], [0.0], [0.1]])
    >>> bool(tracker.mu[0] > 0.7)
    True
    """

    def __init__(
        self,
        filters: Sequence[Filter],
        mu: ArrayLike,
        M: ArrayLike,
        angles: Angles | None = None,
    ) -> None:
        self.filters = filters
        self.N = len(filters)
        self.mu, self.M = shaped("mu", mu, self.N), shaped("M", M, self.N, self.N)
        self.angles = angles
        self.omega, self.cbar = np.zeros((self.N, self.N)), self.mu @ self.M
        self.likelihood, self.log_likelihood = np.ones(self.N), 0.0
        self.combine()
        self.x_prior, self.P_prior = self.x_post, self.P_post = self.x.copy(), self.P.copy()

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "filters":
            _check_filters(value)
        elif name in ("mu", "M"):
            shape = (self.N,) if name == "mu" else (self.N, self.N)
            value = _probabilities(name, shaped(name, value, *shape))
        elif name == "angles" and value is not None:
            value = tuple(count("angles", entry, minimum=0) for entry in items("angles", value))
        super().__setattr__(name, value)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Mix the beliefs of the filters, and predict each from its mixed belief.

        Parameters
        ----------
        u : array_like, optional
            Control input.
        dt : float
            Length of the step, for the filters of this library; those of filterpy have their own.
        """
        _, dt = control_input(u), time_step(dt)  # checked before anything changes
        # c_j = Σ_i M_ij mu_i   (11.6.6-8)
        cbar = self.mu.dot(self.M)
        # omega_ij = M_ij mu_i / c_j   (11.6.6-7)
        omega = self.M * self.mu[:, None] / np.maximum(cbar, TINY)
        # x0_j = Σ_i omega_ij x_i,  P0_j = Σ_i omega_ij (P_i + (x_i - x0_j)(x_i - x0_j)')
        x0, P0 = mixture(*self._beliefs(), omega.T, self.state_angles)  # (11.6.6-9), (11.6.6-10)

        def predict_member(j: int, member: Filter) -> None:
            _set_belief(member, x0[j], P0[j])
            _predict(member, u, dt)

        _for_all(self.filters, predict_member)
        vars(self).update(mu=cbar, cbar=cbar, omega=omega)  # without the checks of assignments
        self.combine()
        vars(self).update(x_prior=self.x.copy(), P_prior=self.P.copy())

    def update(self, z: ArrayLike | None) -> None:
        """Update each filter, and its probability by the likelihood of the measurement.

        Parameters
        ----------
        z : array_like
            Measurement; None or NaN where it is missing.
        """
        missing = is_missing(z)
        _for_all(self.filters, lambda j, member: member.update(None if missing else z))
        if missing:
            self.likelihood, self.log_likelihood = np.ones(self.N), 0.0
        else:
            self.update_probabilities()
            self.combine()
        vars(self).update(x_post=self.x.copy(), P_post=self.P.copy())

    def update_probabilities(self) -> None:
        """Set the probabilities of the models to c_j Λ_j / Σ c Λ, in the log domain."""
        # Λ_j = N(y_j; 0, S_j)   (11.6.6-11)
        logs = [_log_likelihood(member) for member in self.filters]
        priors = [math.log(p) if p > 0 else -math.inf for p in self.mu.tolist()]
        # mu_j = c_j Λ_j / c,  c = Σ_j c_j Λ_j   (11.6.6-14), (11.6.6-15)
        odds = [log + prior for log, prior in zip(logs, priors, strict=True)]
        top = max(odds)
        weights = [math.exp(each - top) for each in odds]
        own, total = vars(self), sum(weights)
        own["mu"] = np.array([weight / total for weight in weights])
        own["log_likelihood"] = top + math.log(total)
        own["likelihood"] = np.array([likelihood(log) for log in logs])

    def combine(self) -> None:
        """Set mean and covariance to those of the mixture of the filters."""
        # x = Σ mu_j x_j,  P = Σ mu_j (P_j + (x_j - x)(x_j - x)')   (11.6.6-16), (11.6.6-17)
        x, P = mixture(*self._beliefs(), self.mu, self.state_angles)
        vars(self).update(x=x.reshape(np.shape(self.filters[0].x)), P=P)

    def _beliefs(self) -> tuple[Float, Float]:
        means = np.array([member.x for member in self.filters], dtype=np.float64)
        covariances = np.array([member.P for member in self.filters], dtype=np.float64)
        return means.reshape(self.N, -1), covariances

    @property
    def state_angles(self) -> Angles:
        """Entries of the state that are angles: `angles`, or those of the filters' motions."""
        if self.angles is not None:
            return self.angles
        motions = (getattr(member, "motion", None) for member in self.filters)
        return tuple(sorted(set().union(*(getattr(each, "angles", ()) for each in motions))))

    @property
    def estimate(self) -> StateEstimate:
        """Mean and covariance of the mixture."""
        return StateEstimate(self.x.ravel(), self.P)

    def __sklearn_clone__(self) -> Self:
        return copy.deepcopy(self)  # the filters' beliefs are among its parameters


def _check_filters(filters: Any) -> None:
    if len(items("filters", filters)) < 2:
        raise ValueError(f"filters must have at least two entries; got {len(filters)}")
    for member in filters:
        if not isinstance(member, Filter):
            lacks = [name for name in MEMBERS if not hasattr(member, name)]
            raise TypeError(
                "filters must have x, P, predict(u), update(z), likelihood; "
                f"got {type(member).__name__} without {', '.join(lacks)}"
            )
    shapes = [np.shape(member.x) for member in filters]
    if len(set(shapes)) != 1:
        raise ValueError(f"filters must have x of one shape; got {shapes}")


def _probabilities(name: str, values: Float) -> Float:
    """Return values normalized along the last axis, unchanged where their sum is 1."""
    totals = np.where(values < LARGEST, values, np.inf).sum(axis=-1, keepdims=True)
    if not ((values >= 0).all() and (totals > 0).all() and (totals < np.inf).all()):
        raise ValueError(f"{name} must hold probabilities; got {shown(values)}")
    if name == "M" and np.abs(totals - 1).max() > 1e-6:
        raise ValueError(f"M must have rows of sum 1; got {shown(totals.ravel())}")
    return values if np.abs(totals - 1).max() < 1e-12 else values / totals


def _for_all(filters: Sequence[Filter], step: Callable[[int, Filter], object]) -> None:
    """Call a step of all filters; where one raises, all have their attributes of before."""
    before = [dict(vars(member)) for member in filters]
    random = {id(each): each.generator_state for each in filters if isinstance(each, Particle)}
    try:
        for j, member in enumerate(filters):
            step(j, member)
    except Exception:
        for member, attributes in zip(filters, before, strict=True):
            vars(member).clear()
            vars(member).update(attributes)
            if isinstance(member, Particle):
                member.generator_state = random[id(member)]
        raise


def _set_belief(member: Filter, x: Float, P: Float) -> None:
    if isinstance(member, GaussianFilter):
        member.set_belief(x, P)  # without the checks of a belief that a user assigned
    else:
        member.x, member.P = x.reshape(np.shape(member.x)), P


def _predict(member: Filter, u: ArrayLike | None, dt: float) -> None:
    own_length = getattr(type(member), "own_step_length", not isinstance(member, Tracker))
    if not own_length:
        member.predict(u, dt=dt)  # type: ignore[call-arg]  # a tracker
    elif dt != 1:
        name = type(member).__name__
        raise ValueError(f"dt must be 1 for {name}, which has a step length of its own; got {dt}")
    elif u is None:
        member.predict()
    else:
        member.predict(u)


def _log_likelihood(member: Filter) -> float:
    log = getattr(member, "log_likelihood", None)
    return float(np.log(member.likelihood) if log is None else log)
