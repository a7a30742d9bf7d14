"""Where sources are when nobody knows: found one by one, and counted by the Laplace evidence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import lgamma, log, pi

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import Levels, PropagationModel
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.inference.map_search import maximum
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior, scan
from arrivals.typing import Float, Int

GAIN = 0.1  # least rise of the log evidence that is worth another round


@dataclass(frozen=True, eq=False)
class Candidate:
    """Sources fitted to readings, and how well they explain them.

    Parameters
    ----------
    problem : Problem
        Without a batch axis.
    u : ndarray, shape (n_sources,)
    theta : ndarray, shape (n_sources, 2)
    """

    problem: JointPosterior
    u: Float
    theta: Float

    @cached_property
    def levels(self) -> Levels:
        """What the sources make at the sensors."""
        return self.problem.field.levels(self.u, self.theta)

    @cached_property
    def log_evidence(self) -> float:
        """Laplace's approximation to log p(ξ | K), less the constant of the readings.

        -½q + log p(û, θ̂) + (3K/2) log 2π - ½ log|J|, the priors normalised.
        """
        K, prior = len(self.u), self.problem.prior
        q = float(self.problem.misfit(self.levels))
        if K == 0:
            return -0.5 * q
        J = self.problem.information(self.levels)
        normal = 0.5 * (np.log(prior.w).sum() + np.linalg.slogdet(prior.P)[1].sum())
        square = float(prior.square(self.u, self.theta))
        # the 2π of the densities and of Laplace's integral cancel
        return float(-0.5 * (q + square) + normal - 0.5 * np.linalg.slogdet(J)[1])

    @cached_property
    def log_evidence_of_set(self) -> float:
        """The same with log K!: sources that nothing tells apart may be numbered in any order.

        -inf if two are nearer to each other than the least range. Such a pair is one source; its
        readings say nothing, to second order, of how far apart the two are, and Laplace's
        Gaussian would take that for knowledge not needed.
        """
        _, nearest = neighbours(self.theta)
        if (nearest < self.problem.field.r_min).any():
            return -np.inf
        return self.log_evidence + lgamma(len(self.u) + 1)

    @property
    def log_likelihood(self) -> float:
        """The evidence with the readings' constant, ½ Σ log(W/2π)."""
        W = self.problem.W[self.problem.W > 0]
        return self.log_evidence + 0.5 * float(np.log(W).sum() - len(W) * log(2 * pi))

    def refitted(self) -> Candidate:
        """Return the joint maximum from here."""
        if len(self.u) == 0:
            return self
        found = maximum(self.problem, self.u, self.theta)
        return Candidate(self.problem, found.u, found.theta)

    def part(self, rows: Int) -> Candidate:
        """Return some of the sources, as they are."""
        problem = self.problem._replace(prior=self.problem.prior.take(rows))
        return Candidate(problem, self.u[rows], self.theta[rows])

    def without(self, j: int) -> Candidate:
        """Return the fit without one source, the others refitted."""
        return self.part(np.delete(np.arange(len(self.u)), j)).refitted()

    def enlarged(self, new: NewSourcePrior) -> Candidate:
        """Return the fit with the source added that lowers Σ W r² most, all refitted.

        The lowest few minima over the grid are tried: near a sensor there are several.
        """
        prior = Prior(*(
            np.concatenate(parts) for parts in zip(self.problem.prior, new.prior(1), strict=True)
        ))  # fmt: skip
        problem = self.problem._replace(prior=prior)
        places = scan(self.problem, self.levels.log_sigma, new)
        fits = [Candidate(problem, np.append(self.u, u), np.vstack([self.theta, theta])).refitted()
                for u, theta in places]  # fmt: skip
        return max(fits, key=lambda fit: fit.log_evidence)


def nothing(field: PropagationModel, xi: Float, W: Float) -> Candidate:
    """Return the fit of no source at all."""
    prior = Prior(np.zeros(0), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 2)))
    return Candidate(JointPosterior(field, xi, W, prior), prior.mu, prior.theta)


def grown(
    field: PropagationModel,
    xi: Float,
    W: Float,
    new: NewSourcePrior,
    n: int,
    patience: int | None = None,
) -> list[Candidate]:
    """Return the fits of 0 to n sources, each the last one with a source added.

    With a `patience`, growing ends when that many additions have not raised the evidence.

    Examples
    --------
    >>> from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
    >>> rng = np.random.default_rng(0)
    >>> field = PropagationModel(rng.uniform(-100.0, 100.0, (60, 2)), log_noise=4.6)
    >>> truth = np.array([[-40.0, 10.0], [30.0, 50.0]])
    >>> xi = field.levels(np.array([9.0, 9.2]), truth).log_sigma
    >>> new = NewSourcePrior.among(field.sensors, mu=9.2, v=0.12)
    >>> found = best(grown(field, xi, np.full(60, 200.0), new, 3), new)
    >>> found.theta[np.argsort(found.theta[:, 0])].round(0)
    array([[-40.,  10.],
           [ 30.,  50.]])
    """
    fits = [nothing(field, xi, W)]
    while len(fits) <= n:
        evidence = [fit.log_evidence_of_set for fit in fits]
        if patience is not None and len(fits) - 1 - int(np.argmax(evidence)) >= patience:
            break
        fits.append(fits[-1].enlarged(new))
    return fits


def best(fits: list[Candidate], new: NewSourcePrior) -> Candidate:
    """Return the fit of the largest evidence, then changed as long as that raises it.

    Growing one by one ends in basins where several sources share what is one's, or one has what
    is several's. The changes: drop a source; put one in place of two neighbours; take one out and
    look for it again.
    """
    return _climbed(max(fits, key=lambda fit: fit.log_evidence_of_set), new, same_number=False)


def refined(fit: Candidate, new: NewSourcePrior) -> Candidate:
    """Return a fit of as many sources, changed as long as that raises the evidence."""
    return _climbed(fit, new, same_number=True)


def _climbed(fit: Candidate, new: NewSourcePrior, same_number: bool) -> Candidate:
    while True:
        least = fit.log_evidence_of_set + GAIN
        others = changes(fit, new, same_number)
        better = next((other for other in others if other.log_evidence_of_set > least), None)
        if better is None:
            return fit
        fit = better


def changes(fit: Candidate, new: NewSourcePrior, same_number: bool) -> Iterator[Candidate]:
    """Give fits with one source dropped, two merged, or one looked for again.

    With `same_number`, a source is added for one dropped or merged.
    """
    fewer = [fit.without(j) for j in range(len(fit.u))]
    if not same_number:
        yield from sorted(fewer, key=lambda other: -other.log_evidence_of_set)
    near, _ = neighbours(fit.theta)
    for j, k in sorted({(min(j, k), max(j, k)) for j, k in enumerate(near.tolist())}):
        merged = fewer[k].without(j).enlarged(new)
        yield merged.enlarged(new) if same_number else merged
    yield from (other.enlarged(new) for other in fewer)


def neighbours(theta: Float) -> tuple[Int, Float]:
    """Return for each of some places, (n, 2), the number and distance of the nearest other one.

    Examples
    --------
    >>> neighbours(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]]))
    (array([1, 2, 1]), array([5., 1., 1.]))
    """
    if len(theta) < 2:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    apart = np.linalg.norm(theta[:, None] - theta, axis=-1)
    np.fill_diagonal(apart, np.inf)
    return apart.argmin(axis=1), np.asarray(apart.min(axis=1))
