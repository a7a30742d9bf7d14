"""Number of sources by the Laplace evidence: forward selection and local search."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import lgamma, log, pi

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import Levels, PropagationModel
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior, marginals
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.inference.solution import Marginals, Solution
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior, grid_search, thinned
from arrivals.typing import Float, Int

MIN_GAIN = 0.1  # of the log evidence by one change of the local search


@dataclass(frozen=True, eq=False)
class Candidate:
    """A set of sources and its evidence.

    Parameters
    ----------
    problem : JointPosterior
        Without a batch axis.
    u : ndarray, shape (n_sources,)
        Log amplitudes, Np.
    theta : ndarray, shape (n_sources, 2)
        Positions, m.
    """

    problem: JointPosterior
    u: Float
    theta: Float

    @cached_property
    def levels(self) -> Levels:
        """Levels of the sources at the sensors."""
        return self.problem.propagation.levels(self.u, self.theta)

    @cached_property
    def log_evidence(self) -> float:
        """Laplace's approximation to log p(ξ | K), without the constant of the readings.

        -½q + log p(û, θ̂) + (3K/2) log 2π - ½ log|J|, with normalised priors.
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
        """The evidence plus log K!, as the numbering of equal sources is arbitrary.

        -inf if two sources are closer to each other than the floor of the range. Such a pair is
        one source: to second order the readings do not depend on their separation, and Laplace's
        Gaussian would count it as a parameter without cost.
        """
        _, distance = nearest_sources(self.theta)
        if (distance < self.problem.propagation.r_min).any():
            return -np.inf
        return self.log_evidence + lgamma(len(self.u) + 1)

    @property
    def log_likelihood(self) -> float:
        """The evidence with the constant of the readings, ½ Σ log(W/2π)."""
        W = self.problem.W[self.problem.W > 0]
        return self.log_evidence + 0.5 * float(np.log(W).sum() - len(W) * log(2 * pi))

    @property
    def solution(self) -> Solution:
        """The sources as a solution with one batch axis."""
        one = np.ones(1)
        moments = Marginals(np.zeros(0), np.zeros((0, 2, 2)))
        if len(self.u):
            moments = marginals(self.problem.information(self.levels))
        L = one * self.problem.log_posterior(self.u, self.theta, self.levels)
        return Solution(
            self.u[None], self.theta[None], Marginals(moments.v[None], moments.Sigma[None]), L, L,
            one * self.log_likelihood, np.zeros(1, dtype=np.int64), one.astype(np.bool_),
        )  # fmt: skip

    def refitted(self) -> Candidate:
        """Return the joint maximum that starts here."""
        if len(self.u) == 0:
            return self
        maximum = maximize(self.problem, self.u, self.theta)
        return Candidate(self.problem, maximum.u, maximum.theta)

    def part(self, rows: Int) -> Candidate:
        """Return some of the sources, unchanged."""
        problem = self.problem._replace(prior=self.problem.prior.select(rows))
        return Candidate(problem, self.u[rows], self.theta[rows])

    def without(self, j: int) -> Candidate:
        """Return the candidate without one source, the others refitted."""
        return self.part(np.delete(np.arange(len(self.u)), j)).refitted()

    def enlarged(self, new: NewSourcePrior) -> Candidate:
        """Return the candidate with the source added that lowers Σ W r² most, all refitted.

        The lowest minima over the grid are all tried: near a sensor there are several. Of very
        many sensors, only the best of them is refitted to all.
        """
        prior = Prior(*(
            np.concatenate(parts) for parts in zip(self.problem.prior, new.prior(1), strict=True)
        ))  # fmt: skip
        problem = self.problem._replace(prior=prior)
        searched = thinned(problem)
        candidates = [
            Candidate(searched, np.append(self.u, u), np.vstack([self.theta, theta])).refitted()
            for u, theta in grid_search(self.problem, self.levels.log_sigma, new)
        ]
        best = max(candidates, key=lambda candidate: candidate.log_evidence)
        return best if searched is problem else Candidate(problem, best.u, best.theta).refitted()

    def thinned(self) -> Candidate:
        """Return the same sources at some of the sensors, the same candidate if at all of them."""
        searched = thinned(self.problem)
        return self if searched is self.problem else Candidate(searched, self.u, self.theta)

    def at_sensors_of(self, other: Candidate) -> Candidate:
        """Return the same sources refitted to the readings of another candidate."""
        problem = other.problem._replace(prior=self.problem.prior)
        return Candidate(problem, self.u, self.theta).refitted()


def no_source(propagation: PropagationModel, xi: Float, W: Float) -> Candidate:
    """Return the candidate without a source, for readings and weights (n_sensors,)."""
    prior = Prior(np.zeros(0), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 2)))
    return Candidate(JointPosterior(propagation, xi, W, prior), prior.mu, prior.theta)


def forward_selection(
    start: Candidate, new: NewSourcePrior, n: int, patience: int | None = None
) -> list[Candidate]:
    """Return candidates of up to n sources, each the previous one with a source added.

    Parameters
    ----------
    start : Candidate
        The first candidate, usually without a source.
    new : NewSourcePrior
    n : int
        Largest number of sources.
    patience : int, optional
        Number of additions in a row without an increase of the evidence that ends the selection;
        no end before n if None.

    Returns
    -------
    list of Candidate

    Examples
    --------
    >>> from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
    >>> rng = np.random.default_rng(0)
    >>> model = PropagationModel(rng.uniform(-100.0, 100.0, (60, 2)), log_noise=4.6)
    >>> truth = np.array([[-40.0, 10.0], [30.0, 50.0]])
    >>> xi = model.levels(np.array([9.0, 9.2]), truth).log_sigma
    >>> new = NewSourcePrior.among(model.sensors, mu=9.2, v=0.12)
    >>> empty = no_source(model, xi, np.full(60, 200.0))
    >>> best = best_model(forward_selection(empty, new, 3), new)
    >>> best.theta[np.argsort(best.theta[:, 0])].round(0)
    array([[-40.,  10.],
           [ 30.,  50.]])
    """
    candidates = [start]
    while len(candidates[-1].u) < n:
        evidence = [candidate.log_evidence_of_set for candidate in candidates]
        if patience is not None and len(candidates) - 1 - int(np.argmax(evidence)) >= patience:
            break
        candidates.append(candidates[-1].enlarged(new))
    return candidates


def best_model(candidates: list[Candidate], new: NewSourcePrior) -> Candidate:
    """Return the candidate of the largest evidence after a local search over all changes."""
    best = max(candidates, key=lambda candidate: candidate.log_evidence_of_set)
    return local_search(best, new, same_number=False)


def local_search(candidate: Candidate, new: NewSourcePrior, same_number: bool) -> Candidate:
    """Change a candidate as long as that increases the evidence.

    Forward selection ends in local maxima where several sources share the place of one, or one
    stands for several. A change removes a source, replaces two near ones by one, or removes one
    and searches for it again.

    Parameters
    ----------
    candidate : Candidate
    new : NewSourcePrior
    same_number : bool
        Whether a source is added for each one removed.

    Returns
    -------
    Candidate
    """
    while True:
        threshold = candidate.log_evidence_of_set + MIN_GAIN
        changed = changes(candidate, new, same_number)
        better = next((other for other in changed if other.log_evidence_of_set > threshold), None)
        if better is None:
            return candidate
        candidate = better


def changes(candidate: Candidate, new: NewSourcePrior, same_number: bool) -> Iterator[Candidate]:
    """Yield candidates with one source removed, two merged, or one searched for again."""
    fewer = [candidate.without(j) for j in range(len(candidate.u))]
    if not same_number:
        yield from sorted(fewer, key=lambda other: -other.log_evidence_of_set)
    near, _ = nearest_sources(candidate.theta)
    for j, k in sorted({(min(j, k), max(j, k)) for j, k in enumerate(near.tolist())}):
        merged = fewer[k].without(j).enlarged(new)
        yield merged.enlarged(new) if same_number else merged
    yield from (other.enlarged(new) for other in fewer)


def nearest_sources(theta: Float) -> tuple[Int, Float]:
    """Return index and distance of the nearest other source, for positions (n, 2).

    Examples
    --------
    >>> nearest_sources(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]]))
    (array([1, 2, 1]), array([5., 1., 1.]))
    """
    if len(theta) < 2:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    distance = np.linalg.norm(theta[:, None] - theta, axis=-1)
    np.fill_diagonal(distance, np.inf)
    return distance.argmin(axis=1), np.asarray(distance.min(axis=1))
