"""What the variants of the interpolation-delay filter are made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.measurement_models.delays.delay_line import DelayLine, Phasor, SourceAtCentre
from arrivals.measurement_models.delays.interpolation import (
    DelayInterpolator,
    InterpolationDelay,
    window,
)
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation, Tones
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.combined import CombinedMotion
from arrivals.motion_models.linear import LinearMotion
from arrivals.trackers.interpolation.updates import JointUpdate, PairwiseUpdate, move
from arrivals.typing import Float
from arrivals.validation import not_negative

VariantName: TypeAlias = Literal["B", "Bw", "C", "D", "E", "E2", "phasor"]
LOBE = 0.12  # of κ: the largest standard deviation of a delay that the joint filters start from


@dataclass(frozen=True)
class Variant:
    """What a variant is made of; None leaves the choice to the source and the array."""

    offsets: tuple[int, ...] | None = None
    loading: float | None = None
    baselines: tuple[int, ...] = (1,)
    both_ways: bool = False
    joint: Literal["delay_line", "phasor"] | None = None
    acquire: bool = False
    each_sensor: bool = False


VARIANTS: dict[str, Variant] = {
    "B": Variant(offsets=(0, 1), loading=0.0, each_sensor=True),
    "Bw": Variant(offsets=(0, 1), each_sensor=True),
    "C": Variant(both_ways=True),
    "D": Variant(baselines=(1, 2, 4, 7), each_sensor=True),
    "E": Variant(joint="delay_line"),
    "E2": Variant(both_ways=True, joint="delay_line", acquire=True),
    "phasor": Variant(joint="phasor"),
}


@dataclass(frozen=True)
class FilterAssembly:
    """The models that a recipe makes of a source, an array and a motion, and what they do."""

    motion: MotionModel
    acquire: PairwiseUpdate | None
    last: PairwiseUpdate | JointUpdate
    kappa: float
    n_places: int
    acquisition: int

    @property
    def joint(self) -> SourceAtCentre | None:
        """The model of all sensors, None for variants that go from neighbour to neighbour."""
        return self.last.line if isinstance(self.last, JointUpdate) else None

    @property
    def n_delay(self) -> int:
        """Elements of the state that come before the source's."""
        return self.motion.dim_x - (0 if self.joint is None else self.joint.dim_source)

    @property
    def span(self) -> int:
        """Snapshots that must be kept."""
        return self.last.span if self.acquire is None else max(self.acquire.span, self.acquisition)

    def stage(self, n: int) -> PairwiseUpdate | JointUpdate:
        """Return what treats the n-th snapshot."""
        return self.acquire if self.acquire is not None and n <= self.acquisition else self.last

    def start(self, delay: float, variance: float, rate_std: float) -> tuple[Float, Float]:
        """Return the belief before anything is heard."""
        x, P = np.zeros(self.motion.dim_x), np.zeros((self.motion.dim_x, self.motion.dim_x))
        P[np.diag_indices(self.n_delay)] = (self.kappa * rate_std) ** 2
        x[0], P[0, 0] = delay, variance
        if self.joint is not None:
            P[self.n_delay :, self.n_delay :] = self.joint.covariance
        return x, P

    def update(self, x: Float, P: Float, frames: Float, n: int) -> tuple[Float, Float]:
        """Correct beliefs by the n-th snapshot, the newest of `frames`, (..., span, n_places)."""
        x, P = self.stage(n).update(x, P, frames)
        if self.acquire is not None and n == self.acquisition:
            return self._replayed(x, P, frames[..., -n:, :])
        return x, P

    def _replayed(self, x: Float, P: Float, frames: Float) -> tuple[Float, Float]:
        """Start the joint filter where acquisition ended, and let it hear `frames` again."""
        n = self.n_delay
        fresh, prior = self.start(0.0, 0.0, 0.0)
        fresh, prior = np.zeros_like(x) + fresh, np.zeros_like(P) + prior
        fresh[..., :n], prior[..., :n, :n] = x[..., :n], P[..., :n, :n]
        prior[..., 0, 0] = np.minimum(2 * P[..., 0, 0], (LOBE * self.kappa) ** 2)
        x, P = fresh, prior
        F, Q = self.motion.F(np.zeros(self.motion.dim_x)), self.motion.Q()
        for k in range(frames.shape[-2]):
            x, P = self.last.update(*move(x, P, F, Q), frames[..., k : k + 1, :])
        return x, P


@lru_cache(maxsize=128)
def assembled(
    measurement: ArraySamples,
    motion: MotionModel,
    recipe: Variant,
    aligned: bool,
    drive: float | None,
    acquisition: int,
    gate: float | None,
    extrapolate: bool,
) -> FilterAssembly:
    """Build the parts of a recipe; the same ones as long as nothing in it changes."""
    kappa, n_places = measurement.kappa, measurement.n_places
    line = _line(measurement, recipe, drive)
    looks, highest = _looks(measurement, recipe, extrapolate), measurement.correlation.highest
    neighbours = PairwiseUpdate(looks, kappa, highest, recipe.each_sensor, aligned, gate)
    if line is None:
        return FilterAssembly(motion, None, neighbours, kappa, n_places, acquisition)
    both = CombinedMotion(motion, LinearMotion(line.transition, line.innovation))
    first = neighbours if recipe.acquire else None
    return FilterAssembly(both, first, JointUpdate(line, kappa, gate), kappa, n_places, acquisition)


def _line(measurement: ArraySamples, recipe: Variant, drive: float | None) -> SourceAtCentre | None:
    n, ratio, source = measurement.n_places, measurement.noise_ratio, measurement.correlation
    if recipe.joint is None:
        return None
    if recipe.joint == "delay_line":
        return DelayLine(n, ratio, source, measurement.kappa, drive)
    if not isinstance(source, Tones) or source.order != 2:
        raise ValueError(f"variant 'phasor' is for one tone; the source is {source!r}")
    return Phasor(n, ratio, source.highest, 1e-2 if drive is None else drive)


def _looks(
    measurement: ArraySamples, recipe: Variant, extrapolate: bool
) -> tuple[InterpolationDelay, ...]:
    """Return the models of all baselines, forwards and, if wanted, backwards."""
    source, kappa, ratio = measurement.correlation, measurement.kappa, measurement.noise_ratio
    loading = ratio if recipe.loading is None else not_negative("loading", recipe.loading)
    looks = []
    for m in recipe.baselines:
        if m >= measurement.n_places:
            continue
        own = recipe.offsets if m == 1 else None
        offsets = window(m * kappa) if own is None else own
        if not extrapolate:
            _check_reach(source, offsets, m * kappa)
        taps = DelayInterpolator(source, offsets, loading)
        inflation = 3.0 if len(recipe.baselines) > 1 else 1.0
        looks += [
            InterpolationDelay(taps, measurement.n_places, ratio, way * m, inflation)
            for way in ((1, -1) if recipe.both_ways else (1,))
        ]
    return tuple(looks)


def _check_reach(source: SourceCorrelation, offsets: tuple[int, ...], reach: float) -> None:
    """Refuse taps that would have to extrapolate; tones may, it is exact for them."""
    exact = source.order is not None and len(offsets) >= source.order
    if not exact and not min(offsets) - 1 <= -reach + 1e-9 <= reach - 1e-9 <= max(offsets):
        raise ValueError(
            f"delays reach ±{reach:.4g} samples, which taps {offsets} cannot serve on this "
            f"source: use offsets={window(reach)}"
        )
