"""Models and updates of a variant, put together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.delays.delay_line import SourceAtCentre
from arrivals.motion_models.base import MotionModel
from arrivals.parameters import FrozenModel
from arrivals.trackers.gaussian.equations import predict_gaussian
from arrivals.trackers.interpolation.gating import gate_limit, updated_misfit, widened
from arrivals.trackers.interpolation.updates import (
    DelayObservation,
    JointUpdate,
    PairwiseUpdate,
    predict,
    transition,
)
from arrivals.typing import Bool, Float

MAX_INITIAL_STD = 0.12  # over κ: standard deviation of the delay at the start of a joint filter


@dataclass(frozen=True, eq=False)
class ErrorCovariance:
    """Covariance of the error of the delay and its rate, beside the filter's own.

    Attributes
    ----------
    P : ndarray, shape (..., dim_x, dim_x)
        The filter's own, to which M belongs.
    M : ndarray, shape (..., n, n), or None
        None where it is that of P.
    """

    P: Float
    M: Float | None = None

    @property
    def variance(self) -> Float:
        """Variance of the error of the delay."""
        return np.asarray((self.P if self.M is None else self.M)[..., 0, 0])

    def of(self, P: Float) -> ErrorCovariance:
        """Return the same if it belongs to P; else P is the only one that is known."""
        known = P is self.P or np.array_equal(P, self.P)
        return self if known else ErrorCovariance(P)


@dataclass(frozen=True, eq=False)
class FilterAssembly(FrozenModel):
    """Models and updates of a variant for one array, source and motion.

    Parameters
    ----------
    motion : MotionModel
        Motion of the whole state.
    acquire : PairwiseUpdate or None
        Update of the first `acquisition` snapshots, if it differs from `final`.
    final : PairwiseUpdate or JointUpdate
        Update of the other snapshots.
    kappa : float
    n_grid_points : int
        Grid points of the line.
    acquisition : int
    gate : float or None
        Standard deviations beyond which a residual is left out.
    """

    motion: MotionModel
    acquire: PairwiseUpdate | None
    final: PairwiseUpdate | JointUpdate
    kappa: float
    n_grid_points: int
    acquisition: int
    gate: float | None

    @property
    def source(self) -> SourceAtCentre | None:
        """Model of all sensors, None for pairwise variants."""
        return self.final.source

    @property
    def largest_variance(self) -> float:
        """Variance of a delay of which nothing is known: uniform within ±κ."""
        return self.kappa**2 / 3

    @property
    def n_delay(self) -> int:
        """Number of elements of the state before those of the source."""
        return self.motion.dim_x - (0 if self.source is None else self.source.dim_source)

    @property
    def span(self) -> int:
        """Number of snapshots to buffer."""
        return self.final.span if self.acquire is None else max(self.acquire.span, self.acquisition)

    def stage(self, n: int) -> PairwiseUpdate | JointUpdate:
        """Return the update of the n-th snapshot."""
        return self.acquire if self.acquire is not None and n <= self.acquisition else self.final

    def initial_belief(self, delay: float, variance: float, rate_std: float) -> tuple[Float, Float]:
        """Return the belief before the first snapshot."""
        x, P = np.zeros(self.motion.dim_x), np.zeros((self.motion.dim_x, self.motion.dim_x))
        P[np.diag_indices(self.n_delay)] = (self.kappa * rate_std) ** 2
        x[0], P[0, 0] = delay, variance
        if self.source is not None:
            P[self.n_delay :, self.n_delay :] = self.source.covariance
        return x, P

    def initial_error(self, P: Float) -> ErrorCovariance:
        """Return the covariance of the error before the first snapshot."""
        stage, n = self.stage(1), self.n_delay
        separate = isinstance(stage, PairwiseUpdate) and not stage.frozen
        return ErrorCovariance(P, P[:n, :n].copy() if separate else None)

    def linearize(
        self, x: Float, P: Float, frames: Float, n: int, misfit: Float
    ) -> DelayObservation:
        """Return the residuals of snapshot n, the newest of `frames`."""
        return self.stage(n).linearize(x, P, frames, self.limit(P, n, misfit))

    def update(
        self, x: Float, P: Float, frames: Float, n: int, misfit: Float
    ) -> tuple[Float, Float, Float]:
        """Update beliefs and misfits by snapshot n, newest of `frames` (..., span, n_grid_points).

        Misfits are those of `updated_misfit`.
        """
        limit = self.limit(P, n, misfit)
        x, P, e, used = self.stage(n).update(x, P, frames, limit)
        if self.acquire is not None and n == self.acquisition:
            x, P = self._replay(x, P, frames[..., -n:, :])
        return x, P, misfit if limit is None else updated_misfit(misfit, e, used)

    def predicted_error(
        self, error: ErrorCovariance, P: Float, F: Float, Q: Float, missing: Bool
    ) -> ErrorCovariance:
        """Return the covariance of the error after a motion to the predicted covariance P."""
        if error.M is None:
            return ErrorCovariance(P)
        n = error.M.shape[-1]
        M = predict_gaussian(error.M, F[:n, :n], Q[:n, :n])
        return ErrorCovariance(P, widened(M, missing, self.largest_variance))

    def updated_error(
        self, error: ErrorCovariance, prior: Float, x: Float, P: Float, n: int
    ) -> ErrorCovariance:
        """Return the covariance of the error after snapshot n, by the update of P from `prior`."""
        if error.M is None:
            return ErrorCovariance(P)
        stage = self.stage(n)
        if isinstance(stage, JointUpdate) or self.stage(n + 1) is not stage:
            return ErrorCovariance(P)
        k = error.M.shape[-1]
        own = prior[..., :k, :k], x[..., :k], P[..., :k, :k]
        return ErrorCovariance(P, stage.updated_error(error.M, *own))

    def limit(self, P: Float, n: int, misfit: Float) -> Float | None:
        """Return the limit of the residuals of snapshot n."""
        if self.gate is None:
            return None
        return gate_limit(self.gate, misfit, P[..., 0, 0], self.stage(n).gated_variance)

    def _replay(self, x: Float, P: Float, frames: Float) -> tuple[Float, Float]:
        """Start the joint filter at the acquired delay, and process `frames` again."""
        n = self.n_delay
        x0, P0 = self.initial_belief(0.0, 0.0, 0.0)
        x0, P0 = np.zeros_like(x) + x0, np.zeros_like(P) + P0
        x0[..., :n], P0[..., :n, :n] = x[..., :n], P[..., :n, :n]
        P0[..., 0, 0] = np.minimum(2 * P[..., 0, 0], (MAX_INITIAL_STD * self.kappa) ** 2)
        x, P = x0, P0
        F, Q = transition(self.motion, 1.0)
        for k in range(frames.shape[-2]):
            x, P = self.final.update(*predict(x, P, F, Q), frames[..., k : k + 1, :], None)[:2]
        return x, P
