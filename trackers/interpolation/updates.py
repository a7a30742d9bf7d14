"""Updates of a delay by one snapshot: pairwise along the array, or by all sensors at once.

Beliefs x (..., dim_x), P (..., dim_x, dim_x) have the delay Δ as element 0 and any leading axes:
many independent filters are one array program. Missing samples are NaN.

References
----------
Radhakrishnan, Unnikrishnan and Balakrishnan, (11) and (18)-(23).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np

from arrivals.measurement_models.delays.delay_line import SourceAtCentre
from arrivals.measurement_models.delays.interpolation import InterpolationDelay
from arrivals.motion_models.base import MotionModel
from arrivals.parameters import FrozenModel
from arrivals.trackers.gaussian.equations import predict_gaussian, update_scalar
from arrivals.trackers.gaussian.gains import joseph
from arrivals.trackers.gaussian.linalg import apply, multiplication, symmetric, transposed
from arrivals.trackers.interpolation.error_covariance import ScoreTable
from arrivals.trackers.interpolation.gating import is_used
from arrivals.typing import Bool, Float

Order: TypeAlias = bool | Literal["frozen", "literal"]  # `sequential_update` of `Variant`
NO_RESIDUAL, ALL_USED = np.empty(0), np.empty(0, dtype=np.bool_)  # nothing is judged by them
MAX_PHASE_STD = 0.35  # rad: of the phase of a baseline longer than 1, so that no cycle is lost


class DelayObservation(NamedTuple):
    """Residuals of a snapshot, linearized: y = H d + v, one for each sensor."""

    y: Float  # (..., n_sensors), 0 for a sensor without a residual
    H: Float  # (..., n_sensors, dim_x), 0 there too
    R: Float  # variances of v, (..., n_sensors)


class DelayUpdate(NamedTuple):
    """Beliefs after a snapshot, and which of its residuals were used."""

    x: Float
    P: Float
    e: Float  # of the first baseline, (..., n); NaN where there is none
    used: Bool  # both empty where there is no limit


@lru_cache(maxsize=128)
def transition(motion: MotionModel, dt: float) -> tuple[Float, Float]:
    """Return F and Q of a linear motion."""
    return motion.F(np.zeros(motion.dim_x), dt), motion.Q(dt)


def predict(x: Float, P: Float, F: Float, Q: Float) -> tuple[Float, Float]:
    """Predict beliefs; the covariance is symmetric to the last bit.

    Examples
    --------
    >>> predict(np.ones(1), np.eye(1), np.full((1, 1), 2.0), np.eye(1))
    (array([2.]), array([[5.]]))
    """
    # x = F x   (18),   P = F P F' + Q   (19)
    return apply(F, x), symmetric(predict_gaussian(P, F, Q))


@dataclass(frozen=True, eq=False)
class PairwiseUpdate(FrozenModel):
    """Updates along the array: each sensor is interpolated from one `baseline` away.

    Parameters
    ----------
    baseline_models : sequence of InterpolationDelay
        Used one after the other, each at the newest snapshot for which it has all taps.
    kappa : float
        The delay is clipped to ±κ.
    max_frequency : float
        Highest frequency of the source, cycles per sample.
    sequential : bool, "frozen" or "literal"
        `sequential_update` of `Variant`. A vector update is linear in the delay: e - H (Δ - Δ₀);
        "frozen" and "literal" use e at each sensor.
    aligned : bool
        `aligned` of `Variant`.
    """

    baseline_models: tuple[InterpolationDelay, ...]
    kappa: float
    max_frequency: float
    sequential: Order = False
    aligned: bool = False

    source: ClassVar[None] = None  # the source is not in the state

    @property
    def gated_variance(self) -> float:
        """Variance of the delay below which residuals are gated."""
        return (MAX_PHASE_STD / (2 * np.pi * self.max_frequency)) ** 2

    @property
    def latency(self) -> int:
        """Snapshots by which the estimate may lag."""
        return max(model.latency for model in self.baseline_models)

    @property
    def span(self) -> int:
        """Number of snapshots to buffer."""
        memory = max(model.memory for model in self.baseline_models)
        return self.latency + 1 + memory + (self.sequential == "literal")

    @property
    def frozen(self) -> bool:
        """True if the coefficients stay the same within a snapshot."""
        return self.sequential in ("frozen", "literal")

    @cached_property
    def scores(self) -> ScoreTable:
        """Moments of the scores of all residuals."""
        return ScoreTable.of(self.baseline_models, self.kappa, bool(self.sequential))

    def updated_error(self, M: Float, prior: Float, x: Float, P: Float) -> Float:
        """Return the covariance of the error after a snapshot, as `ScoreTable.updated`."""
        if len(self.scores.noise) == 1:
            return self.scores.updated(M, prior, x, P, 0)
        lengths = {abs(model.baseline) for model in self.baseline_models}
        n = sum(np.asarray(m == 1 or self._is_unambiguous(m, P), np.int64) for m in lengths)
        return self.scores.updated(M, prior, x, P, np.maximum(n, 1) - 1)

    def update(self, x: Float, P: Float, frames: Float, limit: Float | None) -> DelayUpdate:
        """Update beliefs by the newest of `frames`, (..., span or more, n_sensors).

        Residuals whose squares are beyond `limit` times their variance are left out.
        """
        if self.frozen:
            return self._update_frozen(x, P, frames, limit)
        first_baseline = []
        for model in self.baseline_models:
            z, X = self._split(model, frames)
            n = 1 if self.sequential else model.dim_z
            for first in range(0, model.dim_z, n):
                sensors = slice(first, first + n)
                # e = y_j - c'X, H = m c''X, R   (11)
                e, H, R, used = self._residuals(
                    x, P, model, z[..., sensors], X[..., sensors, :], limit
                )
                if limit is not None and model is self.baseline_models[0]:
                    first_baseline.append((e, used))
                if not used.all():
                    e, H = np.where(used, e, 0.0), np.where(used, H, 0.0)
                # K = P H' (H P H' + R)^-1, x = x + K e, P = P - K H P   (20)-(23)
                x, P = update_scalar(x, P, e, H, R)
                x[..., 0] = self._clipped(x[..., 0])
        if limit is None:
            return DelayUpdate(x, P, NO_RESIDUAL, ALL_USED)
        e, used = (np.concatenate(each, axis=-1) for each in zip(*first_baseline, strict=True))
        return DelayUpdate(x, P, e, used)

    def _update_frozen(self, x: Float, P: Float, frames: Float, limit: Float | None) -> DelayUpdate:
        """Update beliefs sensor by sensor, with the coefficients of the start of the snapshot.

        Section 2.4: every sensor corrects the same residual again, as a, b and a', b' are those of
        the last snapshot while Δ is updated.
        """
        first_baseline = None
        for model in self.baseline_models:
            e, H, R, used = self._residuals(x, P, model, *self._split(model, frames), limit)
            first_baseline = (e, used) if first_baseline is None else first_baseline
            e, H = np.where(used, e, 0.0), np.where(used, H, 0.0)
            for j in range(model.dim_z):
                # K = P H / (H P H + R), Δ = Δ + K e, P = P - K H P   (20)-(23)
                x, P = update_scalar(x, P, e[..., j : j + 1], H[..., j : j + 1], R)
                x[..., 0] = self._clipped(x[..., 0])
        assert first_baseline is not None
        return DelayUpdate(x, P, *first_baseline)

    def linearize(self, x: Float, P: Float, frames: Float, limit: Float | None) -> DelayObservation:
        """Return the residuals of the newest of `frames`, all baselines of a sensor combined.

        Baselines l of a sensor have residuals e, slopes h and variances r. They are equivalent to
        one residual y with the slope H and the variance R of the first baseline, where
        H² / R = Σ h² / r and H y / R = Σ h e / r.
        """
        information, gradient, sign = np.zeros((3, *frames.shape[:-2], frames.shape[-1]))
        R = self.baseline_models[0].linearise(x[..., 0])[1][..., None]
        for model in self.baseline_models:
            e, h, r, used = self._residuals(x, P, model, *self._split(model, frames), limit)
            if not used.all():
                e, h = np.where(used, e, 0.0), np.where(used, h, 0.0)
            first = max(model.baseline, 0)
            sensors = slice(first, first + model.dim_z)
            information[..., sensors] += h * h / r[..., None]
            gradient[..., sensors] += h * e / r[..., None]
            sign[..., sensors] += (sign[..., sensors] == 0) * np.sign(h)
        slope = sign * np.sqrt(information * R)
        observed = slope != 0
        y = np.where(observed, gradient * R / np.where(observed, slope, 1.0), 0.0)
        H = np.zeros((*slope.shape, x.shape[-1]))
        H[..., 0] = slope
        return DelayObservation(y, H, R + np.zeros_like(y))

    def _split(self, model: InterpolationDelay, frames: Float) -> tuple[Float, Float]:
        """Return the samples and taps of the snapshot that a baseline uses."""
        latency = self.latency if self.aligned else model.latency
        k = frames.shape[-2] - 1 - latency
        if self.sequential == "literal":
            # y_j(k) from y_{j-1}(k-1) and y_{j-1}(k-2), with the a and b of (4)   (3), (11)
            return model.split(frames, k)[0], model.split(frames, k - 1)[1]
        return model.split(frames, k)

    def _residuals(
        self, x: Float, P: Float, model: InterpolationDelay, z: Float, X: Float, limit: Float | None
    ) -> tuple[Float, Float, Float, Bool]:
        """Return residuals, slopes and variance of a baseline, and which are used."""
        # c(mΔ), c'(mΔ) (4), R(mΔ)
        taps, R = model.linearise(x[..., 0])
        predicted = multiplication(taps)(taps, transposed(X))  # c'X and c''X, (..., 2, n)
        e, H = z - predicted[..., 0, :], model.baseline * predicted[..., 1, :]
        if limit is None:
            used = np.isfinite(e)
        else:
            used = is_used(e, H * H * P[..., :1, 0] + R[..., None], limit)
        if abs(model.baseline) > 1:
            used &= self._is_unambiguous(model.baseline, P)[..., None]
        return e, H, R, used

    def _clipped(self, delay: Float) -> Float:
        """Return delays within ±κ."""
        return np.maximum(np.minimum(delay, self.kappa), -self.kappa)  # a third of np.clip's time

    def _is_unambiguous(self, baseline: int, P: Float) -> Bool:
        """Return True where the phase of a baseline is known to a fraction of a cycle."""
        phase_std = 2 * np.pi * self.max_frequency * abs(baseline) * np.sqrt(P[..., 0, 0])
        return np.asarray(phase_std < MAX_PHASE_STD)


@dataclass(frozen=True, eq=False)
class JointUpdate(FrozenModel):
    """One vector update by all sensors, with the waveform of the source in the state.

    Parameters
    ----------
    source : SourceAtCentre
        Model of all sensors.
    kappa, max_frequency : float
        As in `PairwiseUpdate`.
    """

    source: SourceAtCentre
    kappa: float
    max_frequency: float

    latency: ClassVar[int] = 0  # snapshots by which the estimate may lag
    span: ClassVar[int] = 1  # number of snapshots to buffer

    @property
    def gated_variance(self) -> float:
        """Variance of the delay below which residuals are gated: of the outermost sensors."""
        reach = np.pi * self.max_frequency * (self.source.n_sensors - 1)
        return (MAX_PHASE_STD / reach) ** 2

    def update(self, x: Float, P: Float, frames: Float, limit: Float | None) -> DelayUpdate:
        """Update beliefs by the newest of `frames`, (..., span or more, n_sensors)."""
        (e, H, R), residuals, used = self._residuals(x, P, frames, limit)
        R = R[..., None] * np.eye(R.shape[-1])
        # K = P H' (H P H' + R)^-1, x = x + K e   (20)-(22)
        HP = H @ P
        K = np.swapaxes(np.linalg.solve(HP @ np.swapaxes(H, -1, -2) + R, HP), -1, -2)
        x = x + apply(K, e)
        x[..., 0] = np.clip(x[..., 0], -self.kappa, self.kappa)
        # P = (I - K H) P (I - K H)' + K R K'   (23), in Joseph's form
        return DelayUpdate(x, joseph(P, K, H, R), residuals, used)

    def linearize(self, x: Float, P: Float, frames: Float, limit: Float | None) -> DelayObservation:
        """Return the residuals of the newest of `frames`."""
        return self._residuals(x, P, frames, limit)[0]

    def _residuals(
        self, x: Float, P: Float, frames: Float, limit: Float | None
    ) -> tuple[DelayObservation, Float, Bool]:
        h, H, R = self.source.linearise(x)
        e = frames[..., -1, :] - h
        used = is_used(e, ((H @ P) * H).sum(axis=-1) + R, limit)
        if used.all():
            return DelayObservation(e, H, R), e, used
        y, H = np.where(used, e, 0.0), np.where(used[..., None], H, 0.0)
        return DelayObservation(y, H, R), e, used
