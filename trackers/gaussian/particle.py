"""Particle filter."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurements import LARGEST, is_missing, numbers
from arrivals.messages import shown
from arrivals.motion_models.base import MotionModel, gaussian
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import (
    check_finite,
    covariance_matrix,
    measurement_vector,
)
from arrivals.trackers.gaussian.circular import (
    circular_mean,
    difference,
    weighted_covariance,
    wrapped,
)
from arrivals.trackers.gaussian.equations import LOG_2PI, likelihood
from arrivals.trackers.gaussian.filterpy_names.attributes import DeclaredAttributes
from arrivals.trackers.gaussian.linalg import cholesky
from arrivals.trackers.registry import register
from arrivals.typing import Float, Int
from arrivals.validation import (
    count,
    instance,
    no_control,
    probability,
    real,
    shaped,
    time_step,
)


def systematic_resample(weights: ArrayLike, rng: np.random.Generator) -> Int:
    """Draw n indices, index i with a number of copies within 1 of n times its weight.

    Parameters
    ----------
    weights : array_like, shape (n,)
        Weights, not negative, of sum 1.
    rng : numpy.random.Generator
        Random generator; one number is drawn.

    Returns
    -------
    ndarray of int, shape (n,)
        Indices in rising order.

    References
    ----------
    Kitagawa, "Monte Carlo filter and smoother for non-Gaussian nonlinear state space models",
    *J. Comput. Graph. Stat.* 5, 1996.

    Examples
    --------
    >>> systematic_resample([0.5, 0.0, 0.25, 0.25], np.random.default_rng(0))
    array([0, 0, 2, 3])
    """
    edges = np.cumsum(weights, dtype=np.float64)
    points = (rng.random() + np.arange(len(edges))) / len(edges)
    return np.searchsorted(edges[:-1] / edges[-1], points, side="right")


@register("particle")
class Particle(DeclaredAttributes, Tracker):
    """Bootstrap particle filter: states drawn by the motion, weighted by the measurement.

    Parameters
    ----------
    motion : MotionModel
        Motion of the state; its `sample` predicts the particles.
    measurement : MeasurementModel
        Measurement of the state. Real measurements have its Gaussian likelihood; complex snapshots
        its exact `log_likelihood(z, states)`, as in `ArraySnapshot` for states that are directions.
    x : array_like, shape (n,)
        Initial mean.
    P : array_like, shape (n, n)
        Initial covariance.
    n_particles : int
        Number of particles.
    rng : int or numpy.random.Generator
        Random generator, or its seed. A configuration file needs a seed.
    resample_below : float
        Particles are resampled where their effective number, 1/Σw², is below this fraction.

    Attributes
    ----------
    particles : ndarray, shape (n_particles, n)
        States; drawn at the first step after `x` or `P` were assigned.
    weights : ndarray, shape (n_particles,)
        Weights of the particles, of sum 1.
    log_likelihood, likelihood : float
        Log likelihood and likelihood of the last measurement; 0 and 1 if it was missing.

    Raises
    ------
    TypeError
        If a part is not a model, the measurement reads an entry that the state lacks, or a
        measurement is complex and its model has no `log_likelihood`.
    ValueError
        If `x`, `P` or a measurement does not fit, or all particles have likelihood 0.

    Notes
    -----
    The mean of an angle is the direction of the mean vector; `P` is that of differences in
    [-π, π).

    References
    ----------
    Gordon, Salmond, Smith, "Novel approach to nonlinear/non-Gaussian Bayesian state estimation",
    IEE Proc. F 140(2), 1993.

    Examples
    --------
    Direction of a von Mises walk from complex snapshots:

    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.motion_models import VonMisesWalk
    >>> line = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> tracker = Particle(VonMisesWalk(500.0), line, [0.0], [[0.2]], n_particles=500, rng=1)
    >>> run = tracker.run(line.array.steering_vector(np.full(5, 0.3), 1.0))
    >>> run.x[-1].round(1)
    array([0.3])
    """

    def __init__(
        self,
        motion: MotionModel,
        measurement: MeasurementModel,
        x: ArrayLike,
        P: ArrayLike,
        n_particles: int = 1000,
        *,
        rng: int | np.random.Generator,
        resample_below: float = 0.5,
    ) -> None:
        self.motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # any
        instance("measurement", measurement, MeasurementModel)  # type: ignore[type-abstract]  # any
        self.measurement = measurement.for_likelihood(motion.state_names)
        self.x, self.P = self._check_belief(x, P)
        self.n_particles = count("n_particles", n_particles, maximum=10**7)
        self.resample_below = probability("resample_below", resample_below)
        self.rng = rng
        self.particles = np.tile(self.x, (n_particles, 1))
        self.weights = np.full(n_particles, 1 / n_particles)
        self._x, self._P = self.x.copy(), self.P.copy()  # so that the first step draws particles
        self.log_likelihood = 0.0

    @property
    def rng(self) -> int | np.random.Generator:
        """Seed or generator, as passed; assigning another restarts the random numbers."""
        return self._rng

    @rng.setter
    def rng(self, rng: int | np.random.Generator) -> None:
        if rng is None or rng is not getattr(self, "_rng", None):
            seed = rng if isinstance(rng, np.random.Generator) else _seed(rng)
            self._generator = np.random.default_rng(seed)
            self._rng = rng

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Draw each particle from the motion model; `u` must be None or 0."""
        no_control(u)
        dt = time_step(dt)
        with self._generator_unchanged_on_error():
            particles, weights = self._draw_if_assigned()
            self._set_particles(self.motion.sample(particles, self._generator, dt), weights)

    def update(self, z: ArrayLike | None) -> None:
        """Weight the particles by a measurement, (m,) or a complex snapshot; NaN is left out."""
        if is_missing(z):
            self.log_likelihood = 0.0
            return
        with self._generator_unchanged_on_error():
            particles, weights = self._draw_if_assigned()
            # log w_i = log w_i + log p(z | x_i), normalized
            log_weights = _log(weights) + self._log_likelihood(numbers("z", z), particles)
            top = log_weights.max()
            if not np.isfinite(top):
                raise ValueError(
                    "z must have a positive likelihood; got 0 for all particles: increase "
                    "n_particles"
                )
            weights = np.exp(log_weights - top)
            total = weights.sum()
            self._set_particles(particles, weights / total)
        self.log_likelihood = float(top + np.log(total))
        self._resample()

    @contextmanager
    def _generator_unchanged_on_error(self) -> Iterator[None]:
        before = self.generator_state
        try:
            yield
        except Exception:
            self.generator_state = before
            raise

    @property
    def generator_state(self) -> Any:
        """State of the random generator."""
        return self._generator.bit_generator.state

    @generator_state.setter
    def generator_state(self, state: Any) -> None:
        self._generator.bit_generator.state = state

    def _log_likelihood(self, z: ArrayLike, particles: Float) -> Float:
        exact = getattr(self.measurement, "log_likelihood", None)
        if exact is not None and (np.iscomplexobj(z) or self.motion.state_names):
            return np.asarray(exact(z, particles))
        if np.iscomplexobj(z):
            name = type(self.measurement).__name__
            raise TypeError(f"measurement must have log_likelihood where z is complex; got {name}")
        z = measurement_vector(z, self.measurement.dim_z)
        valid = ~np.isnan(z)
        y = self.measurement.residual(z, self.measurement.h(particles))
        return log_normal(y[:, valid], self.measurement.R[np.ix_(valid, valid)])

    def _resample(self) -> None:
        """Resample where the effective number of particles is low; `x` and `P` do not change."""
        if 1 / np.sum(self.weights**2) < self.resample_below * self.n_particles:
            self.particles = self.particles[systematic_resample(self.weights, self._generator)]
            self.weights = np.full(self.n_particles, 1 / self.n_particles)

    def _draw_if_assigned(self) -> tuple[Float, Float]:
        """Return particles and weights, drawn if `x`, `P` or `n_particles` was assigned."""
        n = self.n_particles
        if self.x is self._x and self.P is self._P and len(self.weights) == n:
            return self.particles, self.weights
        x, P = self._check_belief(self.x, self.P)
        particles = x + gaussian(P, (n,), self._generator)
        return wrapped(particles, self.motion.angles), np.full(n, 1 / n)

    def _check_belief(self, x: ArrayLike, P: ArrayLike) -> tuple[Float, Float]:
        n = self.motion.dim_x
        mean = shaped("x", x, n)
        if not (np.abs(mean) < LARGEST).all():
            raise ValueError(f"x must be finite and below {LARGEST:g}; got {mean.tolist()}")
        return mean, covariance_matrix("P", P, n)

    def _set_particles(self, particles: Float, weights: Float) -> None:
        angles = self.motion.angles
        x = circular_mean(particles, weights, angles)
        P = weighted_covariance(difference(particles, x, angles), weights)
        check_finite(x, P)
        self.particles, self.weights = particles, weights
        self.x = self._x = x
        self.P = self._P = P

    @property
    def likelihood(self) -> float:
        """Likelihood of the last measurement, at least the smallest positive float."""
        return likelihood(self.log_likelihood)

    @property
    def estimate(self) -> StateEstimate:
        """Mean and covariance of the particles."""
        return StateEstimate(real("x", self.x).copy(), real("P", self.P).copy())


def _seed(rng: Any) -> int:
    is_whole = isinstance(rng, int | np.integer) and not isinstance(rng, bool | np.timedelta64)
    if not (is_whole and rng >= 0):
        wanted = "a numpy Generator or a whole number that is not negative"
        raise TypeError(f"rng must be {wanted}; got {shown(rng)}")
    return int(rng)


def _log(weights: Float) -> Float:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(weights))


def log_normal(y: Float, R: Float) -> Float:
    """Return ln N(y; 0, R) of vectors (..., m).

    Examples
    --------
    >>> log_normal(np.zeros((1, 2)), np.eye(2)).round(4)
    array([-1.8379])
    """
    _, L, _ = cholesky(R)
    # L⁻¹ y: one inverse, and one product for all vectors
    white = y @ np.linalg.inv(L).T
    log_det = np.log(L.diagonal()).sum()
    return np.asarray(-0.5 * (white * white).sum(-1) - log_det - 0.5 * y.shape[-1] * LOG_2PI)
