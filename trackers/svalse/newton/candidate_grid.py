"""Grids of candidates: where components may be added, and which of them count as one."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from arrivals.symmetric import clamped_inverse, log_det
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.charts.angle_chart import LOG_2PI, AngleChart
from arrivals.trackers.svalse.newton.charts.point_chart import PointChart
from arrivals.trackers.svalse.newton.elbo import Evaluation
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.typing import Bool, Complex, Float, Int

GRID_POINTS_PER_SENSOR = 4  # angles at which components may be added
MAX_PEAK_CORRELATION = 0.4  # of the responses of candidates that are added together


class CandidateGrid(ABC):
    """Points at which components may be added, and the response there.

    Parameters
    ----------
    response : ExpectedResponse
    points : ndarray, shape (point_size, G)
        Points.
    merge : float
        Smallest distance of two components, rad of direction; 0 for any.
    merge_correlation : float, optional
        In place of a distance: smallest correlation, in all bins, of the responses of two
        components that count as one.
    """

    log_range: float  # constant of the KL divergence of a new component
    birth_mean: Float | None = None
    birth_precision: Float
    birth_quadratic: Float | float = 0.0

    def __init__(
        self,
        response: ExpectedResponse,
        points: Float,
        merge: float,
        merge_correlation: float | None = None,
    ) -> None:
        self.response, self.points = response, points
        self.merge, self.merge_correlation = merge, merge_correlation
        self.A, self.gram, self.norm2 = response.chart.at(points)
        self.birth_precision = np.zeros(self.gram.shape[1])

    @property
    def n_points(self) -> int:
        """Number of points."""
        return int(self.points.shape[1])

    def first_duplicate(self, evaluation: Evaluation) -> Int:
        """Return the first component too near to an earlier one, (B,), or -1."""
        B, L = evaluation.used.shape
        if L < 2 or (self.merge == 0 and self.merge_correlation is None):
            return np.full(B, -1)
        if self.merge_correlation:
            near = self.correlated(evaluation)
        elif self.all_apart(evaluation):
            return np.full(B, -1)
        else:
            near = self.close(evaluation)
        later = np.asarray(np.tril(near, -1).any(axis=2))
        return np.where(later.any(axis=1), later.argmax(axis=1), -1)

    def correlated(self, evaluation: Evaluation) -> Bool:
        """Return which components have responses that count as one, (B, L, L)."""
        assert self.merge_correlation is not None
        J, used = np.abs(evaluation.X[:, :, 0]), evaluation.used
        size = np.sqrt(J.diagonal(axis1=2, axis2=3))
        limit = self.merge_correlation * size[..., None] * size[:, :, None]
        return np.asarray((limit < J).all(axis=1) & used[:, :, None] & used[:, None])

    def near(self, evaluation: Evaluation, P: Complex) -> Bool:
        """Return which points are too near to a component, (B, G); P is âᴴa, (B, F, L, G)."""
        used = evaluation.used[:, :, None]
        if self.merge_correlation:
            return np.asarray((self.alike(evaluation, P) & used).any(axis=1))
        return np.asarray((self.beside(evaluation.components.point) & used).any(axis=1))

    def exclusion(self, evaluation: Evaluation, rows: Bool, k: Int) -> Bool:
        """Return which points are too near to the k-th component of some rows, (n, G)."""
        index = np.flatnonzero(rows)
        if self.merge_correlation:
            a = evaluation.A[index, :, k[rows]]
            P = a.conj()[:, :, None] @ self.A.swapaxes(1, 2)
            size = evaluation.X[:, :, 0].diagonal(axis1=2, axis2=3).real[index, :, k[rows]]
            limit = self.merge_correlation * np.sqrt(size[..., None] * self.norm2)
            return np.asarray((np.abs(P[:, :, 0]) > limit).all(axis=1))
        return self.beside(evaluation.components.point[index, :, k[rows]][..., None])[:, 0]

    def alike(self, evaluation: Evaluation, P: Complex) -> Bool:
        """Return which points and components have responses that count as one, (B, L, G)."""
        assert self.merge_correlation is not None
        size = evaluation.X[:, :, 0].diagonal(axis1=2, axis2=3).real
        limit = self.merge_correlation * np.sqrt(size[..., None] * self.norm2[:, None])
        return np.asarray((np.abs(P) > limit).all(axis=1))

    def all_apart(self, evaluation: Evaluation) -> bool:
        """Return True if a quick test shows that no two components are close."""
        return False

    @abstractmethod
    def close(self, evaluation: Evaluation) -> Bool:
        """Return which components are nearer than `merge`, (B, L, L); each to itself, or none."""

    @abstractmethod
    def beside(self, x: Float) -> Bool:
        """Return which points are nearer than `merge` to others, (B, p, L): (B, L, G)."""

    @abstractmethod
    def local_maxima(self, gain: Float) -> Bool:
        """Return the mask (B, G) of points that may be added along with the best."""

    @abstractmethod
    def near_peak(self, last: Int) -> Bool:
        """Return which points are within a beam's width of a point of each row, (B, G)."""

    @abstractmethod
    def return_costs(
        self, memory: Components, curvature: Float, covariance: Float
    ) -> tuple[Float, Float]:
        """Return KL costs, (B, n, G), and precisions (B, q, n, G) of components that return."""


class AngleCandidates(CandidateGrid):
    """Equally spaced angles.

    Parameters
    ----------
    response : ExpectedResponse
    points_per_sensor : int
        Angles for each sensor of a filled line of the same extent.
    merge, merge_correlation
        As in `CandidateGrid`.
    """

    def __init__(
        self,
        response: ExpectedResponse,
        points_per_sensor: int = GRID_POINTS_PER_SENSOR,
        merge: float = 0.0,
        merge_correlation: float | None = None,
    ) -> None:
        assert isinstance(response.chart, AngleChart)
        self.manifold = response.chart.manifold
        n = int(np.ceil(points_per_sensor * max(response.extent, 4)))
        self.theta = -np.pi + 2 * np.pi * np.arange(n) / n
        # uniform over all angles that differ
        self.log_range = LOG_2PI
        if self.manifold.front_back_ambiguous:  # the front half is enough
            self.theta = (self.theta + np.pi / n) / 2
            self.log_range = LOG_2PI - np.log(2)
        super().__init__(response, self.theta[None], merge, merge_correlation)
        self.doa = self.manifold.to_doa(self.theta)
        self.phasors = np.exp(1j * self.theta)
        two_beams = 4 * np.pi / response.extent
        self.cos_apart = np.cos(two_beams) + 1e-9 if two_beams < np.pi + 1e-9 else -2.0
        self.cos_merge = np.cos(min(merge, np.pi))
        # of angles whose directions may be near: any where front and back are ambiguous
        largest = 1.01 * merge * float(self.manifold.slope(self.theta).max())
        self.cos_near = (
            -2.0 if self.manifold.front_back_ambiguous else np.cos(min(largest, np.pi)) - 1e-12
        )

    def all_apart(self, evaluation: Evaluation) -> bool:
        """Return True if the angles alone show that no two components are close."""
        theta = np.where(evaluation.used, evaluation.components.mu, np.nan)
        near = np.cos(theta[:, :, None] - theta[:, None, :]) > self.cos_near
        return bool(np.count_nonzero(near) == evaluation.K.sum())  # each near to itself only

    def close(self, evaluation: Evaluation) -> Bool:
        """Return which components are nearer than `merge`, (B, L, L); each to itself, or none."""
        theta = np.where(evaluation.used, evaluation.components.mu, np.nan)
        doa = self.manifold.to_doa(theta)  # round the circle, too
        return np.asarray(np.cos(doa[:, :, None] - doa[:, None, :]) > self.cos_merge)

    def beside(self, x: Float) -> Bool:
        """Return which angles are nearer than `merge` to angles (B, 1, L): (B, L, G)."""
        doa = self.manifold.to_doa(x[:, 0])
        return np.asarray(np.cos(doa[..., None] - self.doa) > self.cos_merge)

    def local_maxima(self, gain: Float) -> Bool:
        """Return the mask of local maxima."""
        return np.asarray((gain >= np.roll(gain, 1, axis=1)) & (gain >= np.roll(gain, -1, axis=1)))

    def near_peak(self, last: Int) -> Bool:
        """Return which angles are less than two beams from an angle of each row, (B, G)."""
        return np.asarray(np.cos(self.theta - self.theta[last][:, None]) > self.cos_apart)

    def return_costs(
        self, memory: Components, curvature: Float, covariance: Float
    ) -> tuple[Float, Float]:
        """Return KL costs of normal densities from von Mises priors, and precisions."""
        kappa, variance = memory.prior_kappa, covariance[:, 0]
        phasors = (kappa * np.exp(-1j * memory.prior_mu))[:, :, None] * self.phasors
        entropy = 0.5 * (LOG_2PI + 1 + np.log(variance))
        kl = memory.kl_constant[:, :, None] - phasors.real - entropy[:, None]
        return kl, (1 / variance[:, None] + kappa[:, :, None])[:, None]


class PointCandidates(CandidateGrid):
    """The candidates of a manifold of points.

    Parameters
    ----------
    response : ExpectedResponse
    merge, merge_correlation
        As in `CandidateGrid`.
    """

    def __init__(
        self, response: ExpectedResponse, merge: float, merge_correlation: float | None = None
    ) -> None:
        assert isinstance(response.chart, PointChart)
        self.chart, self.manifold = response.chart, response.chart.manifold
        candidates = self.manifold.candidates()
        super().__init__(response, candidates.points, merge, merge_correlation)
        self.log_range = candidates.log_measure
        self.birth_precision, self.birth_mean = candidates.precision, candidates.mean
        if self.birth_mean is not None:
            mean = self.birth_mean[:, None] + np.zeros_like(self.points)
            self.birth_quadratic = self.chart.quadratic(
                self.points, mean, self.birth_precision[:, None]
            )

    def close(self, evaluation: Evaluation) -> Bool:
        """Return which components are nearer than `merge`, (B, L, L)."""
        x, used = evaluation.components.point, evaluation.used
        near = self.manifold.distance(x, x) < self.merge
        return np.asarray(near & used[:, :, None] & used[:, None])

    def beside(self, x: Float) -> Bool:
        """Return which points are nearer than `merge` to points (B, p, L): (B, L, G)."""
        return np.asarray(self.manifold.distance(x, self.points) < self.merge)

    def local_maxima(self, gain: Float) -> Bool:
        """Return True for all points: those near to a peak are left out by their responses."""
        return np.ones_like(gain, dtype=np.bool_)

    def near_peak(self, last: Int) -> Bool:
        """Return which points have responses correlated with that of one of each row, (B, G)."""
        correlation = np.abs(self.A.conj() @ self.A[:, last].swapaxes(1, 2)).max(axis=0)
        return np.asarray(MAX_PEAK_CORRELATION * self.response.n_sensors < correlation.T)

    def return_costs(
        self, memory: Components, curvature: Float, covariance: Float
    ) -> tuple[Float, Float]:
        """Return KL costs of normal densities from the prior's, and precisions."""
        d, G = self.response.n_unknowns, self.n_points
        B, _, n = memory.prior_precision.shape
        # every point for every component: the last axis is (n, G)
        precision = np.repeat(memory.prior_precision, G, axis=2)
        total = np.tile(curvature, n) + precision
        S = clamped_inverse(total, 1 / self.chart.max_variance)
        mean = np.repeat(memory.prior_mean, G, axis=2)
        quadratic = self.chart.quadratic(np.tile(self.points, n), mean, precision, S)
        kl = quadratic - 0.5 * (d * LOG_2PI + d + log_det(S))
        cost = memory.kl_constant[:, :, None] + kl.reshape(B, n, G)
        return cost, total.reshape(B, -1, n, G)


def candidate_grid(
    response: ExpectedResponse, merge: float, merge_correlation: float | None
) -> CandidateGrid:
    """Return the grid of a manifold."""
    if isinstance(response.chart, PointChart):
        return PointCandidates(response, merge, merge_correlation)
    return AngleCandidates(response, GRID_POINTS_PER_SENSOR, merge, merge_correlation)
