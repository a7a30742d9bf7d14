"""The particle filter."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel, gaussian
from arrivals.trackers.base import Tracker, is_missing
from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import measurement_vector
from arrivals.trackers.gaussian.circular import (
    circular_mean,
    difference,
    weighted_covariance,
    wrapped,
)
from arrivals.trackers.gaussian.equations import LOG_2PI, likelihood
from arrivals.trackers.gaussian.linalg import cholesky
from arrivals.trackers.registry import register
from arrivals.typing import Float, Int
from arrivals.validation import count, covariance, instance, probability, real, shaped


def systematic_resample(weights: ArrayLike, rng: np.random.Generator) -> Int:
    """Draw as many indices as there are weights, each about n times its weight often.

    Parameters
    ----------
    weights : array_like, shape (n,)
        Not negative, of sum 1.
    rng : numpy.random.Generator
        One number is drawn.

    Returns
    -------
    ndarray of int, shape (n,)
        In rising order.

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
    places = (rng.random() + np.arange(len(edges))) / len(edges)
    return np.searchsorted(edges[:-1] / edges[-1], places, side="right")


@register("particle")
class Particle(Tracker):
    """The bootstrap particle filter: states drawn by the motion, weighed by the measurement.

    Parameters
    ----------
    motion : MotionModel
        Its `sample` moves the particles.
    measurement : MeasurementModel
        Real measurements are weighed by its Gaussian face; complex snapshots by its exact
        `log_likelihood(z, states)`, as `ArraySnapshot` has it for states that are directions.
    x : array_like, shape (n,)
        Mean of the particles at first.
    P : array_like, shape (n, n)
        Their covariance.
    n_particles : int
    rng : int or numpy.random.Generator
        Source of chance, or its seed. A configuration file needs a seed.
    resample_below : float
        Particles are drawn anew where fewer than this share of them count, 1/Σw².

    Attributes
    ----------
    particles : ndarray, shape (n_particles, n)
        States; drawn at the first step after `x` or `P` were assigned.
    weights : ndarray, shape (n_particles,)
        Their weights.
    log_likelihood, likelihood : float
        Of the last measurement; 0 and 1 if it was missed.

    Raises
    ------
    TypeError
        If a part is no model, or complex measurements meet a model without `log_likelihood`.
    ValueError
        If `x`, `P` or a measurement does not fit, or no particle explains a measurement.

    Notes
    -----
    The mean of an angle is the direction of the mean vector; `P` is of the shorter ways round.

    References
    ----------
    Gordon, Salmond, Smith, "Novel approach to nonlinear/non-Gaussian Bayesian state estimation",
    IEE Proc. F 140(2), 1993.

    Examples
    --------
    Raw snapshots, and a von Mises walk:

    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.motion_models import VonMisesWalk
    >>> heard = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> tracker = Particle(VonMisesWalk(500.0), heard, [0.0], [[0.2]], n_particles=500, rng=1)
    >>> run = tracker.run(heard.array.steering_vector(np.full(5, 0.3), 1.0))
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
        self.x, self.P = self._checked(x, P)
        self.n_particles = count("n_particles", n_particles)
        self.resample_below = probability("resample_below", resample_below)
        self.rng = rng
        self.particles = np.tile(self.x, (n_particles, 1))
        self.weights = np.full(n_particles, 1 / n_particles)
        self._x, self._P = self.x.copy(), self.P.copy()  # not those of the particles: draw them
        self.log_likelihood = 0.0

    @property
    def rng(self) -> int | np.random.Generator:
        """Seed or generator, as given; assigning another starts anew from that."""
        return self._rng

    @rng.setter
    def rng(self, rng: int | np.random.Generator) -> None:
        if rng is not getattr(self, "_rng", None):
            self._generator = np.random.default_rng(rng)
            self._rng = rng

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Move each particle by a draw from the motion; `u` must be None or 0."""
        if u is not None and np.any(u):
            raise ValueError("the particle filter takes no control input: put it into the motion")
        particles, weights = self._cloud()
        self._hold(self.motion.sample(particles, self._generator, dt), weights)

    def update(self, z: ArrayLike | None) -> None:
        """Weigh the particles by a measurement, (m,) or a complex snapshot; NaN is left out."""
        if is_missing(z):
            self.log_likelihood = 0.0
            return
        before = self._generator.bit_generator.state
        try:
            particles, weights = self._cloud()
            log_weights = _log(weights) + self._log_likelihood(np.asarray(z), particles)
            top = log_weights.max()
            if not np.isfinite(top):
                raise ValueError("no particle explains the measurement: take more of them")
        except (ValueError, TypeError):
            self._generator.bit_generator.state = before
            raise
        weights = np.exp(log_weights - top)
        total = weights.sum()
        self.log_likelihood = float(top + np.log(total))
        self._hold(particles, weights / total)
        self._resample()

    def _log_likelihood(self, z: ArrayLike, particles: Float) -> Float:
        exact = getattr(self.measurement, "log_likelihood", None)
        if exact is not None and (np.iscomplexobj(z) or self.motion.state_names):
            return np.asarray(exact(z, particles))
        if np.iscomplexobj(z):
            raise TypeError(
                f"complex measurements need a model with log_likelihood; got {self.measurement}"
            )
        z = measurement_vector(z, self.measurement.dim_z)
        heard = ~np.isnan(z)
        y = self.measurement.residual(z, self.measurement.h(particles))
        return log_normal(y[:, heard], self.measurement.R[np.ix_(heard, heard)])

    def _resample(self) -> None:
        """Draw particles anew where few of them count; the mean stays that of the weighted ones."""
        if 1 / np.sum(self.weights**2) < self.resample_below * self.n_particles:
            self.particles = self.particles[systematic_resample(self.weights, self._generator)]
            self.weights = np.full(self.n_particles, 1 / self.n_particles)

    def _cloud(self) -> tuple[Float, Float]:
        """Return particles and weights, drawn now if `x`, `P` or their number was assigned."""
        n = self.n_particles
        if self.x is self._x and self.P is self._P and len(self.weights) == n:
            return self.particles, self.weights
        x, P = self._checked(self.x, self.P)
        drawn = x + gaussian(P, (n,), self._generator)
        return wrapped(drawn, self.motion.angles), np.full(n, 1 / n)

    def _checked(self, x: ArrayLike, P: ArrayLike) -> tuple[Float, Float]:
        n = self.motion.dim_x
        mean = shaped("x", x, n)
        if not np.isfinite(mean).all():
            raise ValueError(f"x must be finite; got {mean.tolist()}")
        return mean, covariance("P", P, n)

    def _hold(self, particles: Float, weights: Float) -> None:
        angles = self.motion.angles
        self.particles, self.weights = particles, weights
        self.x = self._x = circular_mean(particles, weights, angles)
        self.P = self._P = weighted_covariance(difference(particles, self.x, angles), weights)

    @property
    def likelihood(self) -> float:
        """Likelihood of the last measurement, at least the smallest positive float."""
        return likelihood(self.log_likelihood)

    @property
    def estimate(self) -> StateEstimate:
        """Mean and covariance of the particles."""
        return StateEstimate(real("x", self.x).copy(), real("P", self.P).copy())


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
    white = np.linalg.solve(L, y[..., None])[..., 0]
    log_det = np.log(L.diagonal()).sum()
    return np.asarray(-0.5 * (white * white).sum(-1) - log_det - 0.5 * y.shape[-1] * LOG_2PI)
