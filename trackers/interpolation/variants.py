"""Variants of the interpolation-delay filter, assembled from their models."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
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
from arrivals.measurement_models.delays.source_correlation import FlatBand, SourceCorrelation, Tones
from arrivals.messages import shown
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.combined import CombinedMotion
from arrivals.motion_models.linear import LinearMotion
from arrivals.parameters import FrozenModel
from arrivals.trackers.interpolation.assembly import MAX_INITIAL_STD, FilterAssembly
from arrivals.trackers.interpolation.channel_filters import settling_steps
from arrivals.trackers.interpolation.updates import JointUpdate, Order, PairwiseUpdate
from arrivals.validation import count, items, not_negative, one_of, positive

VariantName: TypeAlias = Literal["literal", "B", "Bw", "C", "D", "E", "E2", "phasor"]


RENAMED = {  # former parameters of InterpolationEKF
    **{f: f"variant__{f}" for f in ("offsets", "loading", "baselines", "aligned", "extrapolate")},
    "both_ways": "variant__bidirectional",
    "each_sensor": "variant__sequential_update",
    "drive": "variant__process_noise",
}


@dataclass(frozen=True)
class Variant(FrozenModel):
    """Settings that define a variant of `InterpolationEKF`.

    Parameters
    ----------
    offsets : sequence of int, optional
        Taps of baseline 1, samples; a window that covers ±κ if None.
    loading : float, optional
        ε_c, noise over source power in the taps; the true ratio if None.
    baselines : sequence of int
        Distances, in sensors, between which samples are interpolated.
    bidirectional : bool
        Interpolate backwards along the array too.
    sequential_update : bool, "frozen" or "literal"
        Update sensor by sensor, with new coefficients at each one, as in the specification; else
        by all sensors of a baseline at once. "frozen": sensor by sensor, with the coefficients of
        the start of the snapshot, the loop of the paper's section 2.4. "literal": that loop with
        the index of (3) and (11), which stands one above that of (4): sin β is 1/κ too small.
        Sensor by sensor makes four times the array calls and acquires the
        source from larger initial errors: of 400 trials of a tone at 60° and 5 dB that start at 0°,
        65 % end within 3° with it and 8 % without for "B", 88 and 64 % for "D", 88 and 93 % for
        "C".
    aligned : bool
        All baselines use the same snapshot, that of the longest latency.
    extrapolate : bool
        Allow taps that do not reach the largest delay: the paper's form where it is biased.
    joint : str, optional
        Update by all sensors at once, with the source waveform in the state: "delay_line", or
        "phasor" in closed form for one tone.
    acquire : bool
        Acquire the source by the pairwise update before a joint one.
    process_noise : float, optional
        q_s of `DelayLine` or `Phasor`; their own if None.

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> VARIANTS["D"].baselines, VARIANTS["C"].replace(bidirectional=False).bidirectional
    ((1, 2, 4, 7), False)
    """

    offsets: Sequence[int] | None = None
    loading: float | None = None
    baselines: Sequence[int] = (1,)
    bidirectional: bool = False
    sequential_update: Order = False
    aligned: bool = False
    extrapolate: bool = False
    joint: str | None = None
    acquire: bool = False
    process_noise: float | None = None

    def __post_init__(self) -> None:
        if self.offsets is not None:
            offsets = (count("offsets", o, -10_000) for o in items("offsets", self.offsets))
            object.__setattr__(self, "offsets", tuple(offsets))
        baselines = tuple(count("baselines", m) for m in items("baselines", self.baselines))
        object.__setattr__(self, "baselines", baselines)
        if self.loading is not None:
            not_negative("loading", self.loading)
        one_of("sequential_update", self.sequential_update, (False, True, "frozen", "literal"))
        for name in ("bidirectional", "aligned", "extrapolate", "acquire"):
            one_of(name, getattr(self, name), (False, True))
        if self.joint is not None:
            one_of("joint", self.joint, ("delay_line", "phasor"))
        if self.process_noise is not None:
            positive("process_noise", self.process_noise)


VARIANTS: dict[str, Variant] = {
    "literal": Variant(offsets=(0, 1), loading=0.0, sequential_update="literal"),
    "B": Variant(offsets=(0, 1), loading=0.0, sequential_update=True),
    "Bw": Variant(offsets=(0, 1), sequential_update=True),
    "C": Variant(bidirectional=True),
    "D": Variant(baselines=(1, 2, 4, 7), sequential_update=True),
    "E": Variant(joint="delay_line"),
    "E2": Variant(bidirectional=True, joint="delay_line", acquire=True),
    "phasor": Variant(joint="phasor"),
}


def to_variant(variant: VariantName | Variant) -> Variant:
    """Return the variant of a name, or the variant itself.

    Examples
    --------
    >>> to_variant("C") == to_variant(Variant(bidirectional=True))
    True
    """
    if isinstance(variant, Variant):
        return variant
    return VARIANTS[one_of("variant", variant, tuple(VARIANTS))]


@lru_cache(maxsize=128)
def assemble_filter(
    measurement: ArraySamples,
    motion: MotionModel,
    variant: Variant,
    acquisition: int,
    gate: float | None,
) -> FilterAssembly:
    """Return the filter of a variant for an array, a source and a motion of the delay."""
    if variant.sequential_update == "literal":
        _check_literal(measurement, motion, variant)
    kappa = measurement.kappa
    acquisition += settling_steps(measurement.band_filter, measurement.noise_ratio)
    pairwise = PairwiseUpdate(
        _baseline_models(measurement, variant), kappa, measurement.correlation.highest,
        variant.sequential_update, variant.aligned,
    )  # fmt: skip
    source = _source_model(measurement, variant)
    if source is None:
        return FilterAssembly(
            motion, None, pairwise, kappa, measurement.n_grid_points, acquisition, gate
        )
    motion = CombinedMotion(motion, LinearMotion(source.transition, source.innovation))
    return FilterAssembly(
        motion, pairwise if variant.acquire else None,
        JointUpdate(source, kappa, pairwise.max_frequency), kappa, measurement.n_grid_points,
        acquisition, gate,
    )  # fmt: skip


def initial_std(assembly: FilterAssembly, doa: float, std: float | None) -> float:
    """Return the initial standard deviation of the delay, samples; warn if it is too wide.

    Parameters
    ----------
    assembly : FilterAssembly
    doa, std : float
        Initial direction and its standard deviation, rad.
    """
    kappa = assembly.kappa
    slope = kappa * max(float(np.cos(doa)), 0.05)
    delay_std = slope * (np.deg2rad(15.0) if std is None else std)
    if assembly.source is None or assembly.acquire is not None:
        return delay_std
    lobe = 2 / assembly.n_grid_points
    if std is not None and delay_std > lobe * kappa:
        warnings.warn(
            "a joint filter converges only from inside the main lobe, |sin doa - sin truth| < "
            f"{lobe:.3g}; std reaches {delay_std / kappa:.3g}. Start nearer, or use variant 'E2'",
            stacklevel=4,
        )
    return min(MAX_INITIAL_STD * kappa, delay_std)


def _source_model(measurement: ArraySamples, variant: Variant) -> SourceAtCentre | None:
    """Return the model of all sensors, None for a pairwise variant."""
    n, ratio, source = measurement.n_grid_points, measurement.noise_ratio, measurement.correlation
    q = variant.process_noise
    if variant.joint is None:
        return None
    if variant.joint == "delay_line":
        return DelayLine(n, ratio, source, measurement.kappa, q)
    if not isinstance(source, Tones) or source.order != 2:
        raise ValueError(f"variant 'phasor' requires a source of one tone; got {shown(source)}")
    return Phasor(n, ratio, source.highest, 1e-2 if q is None else q)


def _baseline_models(measurement: ArraySamples, variant: Variant) -> tuple[InterpolationDelay, ...]:
    """Return the models of all baselines, forwards and, if bidirectional, backwards."""
    source, kappa, ratio = measurement.correlation, measurement.kappa, measurement.noise_ratio
    loading = ratio if variant.loading is None else variant.loading
    inflation = 3.0 if len(variant.baselines) > 1 else 1.0  # residuals share samples
    models = []
    for m in variant.baselines:
        if m >= measurement.n_grid_points:
            continue
        offsets = variant.offsets if m == 1 else None
        offsets = window(m * kappa) if offsets is None else tuple(offsets)
        if not (variant.extrapolate or variant.sequential_update == "literal"):
            _check_reach(source, offsets, m * kappa)
        taps = DelayInterpolator(source, offsets, loading, measurement.band_filter)
        models += [
            InterpolationDelay(taps, measurement.n_grid_points, ratio, direction * m, inflation)
            for direction in ((1, -1) if variant.bidirectional else (1,))
        ]
    if not models:
        wanted = f"below the number of grid points, {measurement.n_grid_points}"
        raise ValueError(f"baselines must be {wanted}; got {variant.baselines}")
    return tuple(models)


def _check_literal(measurement: ArraySamples, motion: MotionModel, variant: Variant) -> None:
    """Raise a ValueError for a part that the paper's loop, section 2.4, does not have."""
    source, n = measurement.correlation, measurement.n_grid_points
    parts: tuple[tuple[bool, str, object], ...] = (
        (variant.offsets == (0, 1) and variant.loading == 0, "the taps (0, 1) and loading 0",
         f"offsets {variant.offsets} and loading {variant.loading}"),
        (variant.baselines == (1,) and not variant.bidirectional, "baseline 1, forwards",
         f"baselines {variant.baselines}"),
        (variant.joint is None, "the delay alone in the state", f"joint={variant.joint!r}"),
        (motion.dim_x == 1, "the delay alone in the state", shown(motion)),
        (len(measurement.grid_index) == n, "a uniform line without gaps",
         f"{len(measurement.grid_index)} sensors at {n} places"),
        (isinstance(source, FlatBand) or source.order == 2, "a flat band or one tone, as in (4)",
         shown(source)),
        (measurement.band_filter is None, "samples as they are", f"band={measurement.band}"),
    )  # fmt: skip
    for known, wanted, got in parts:
        if not known:
            raise ValueError(f"variant 'literal' requires {wanted}; got {got}: use variant 'B'")


def _check_reach(source: SourceCorrelation, offsets: tuple[int, ...], reach: float) -> None:
    """Raise a ValueError for taps that would extrapolate, unless that is exact (tones)."""
    exact = source.order is not None and len(offsets) >= source.order
    if not exact and not min(offsets) - 1 <= -reach + 1e-9 <= reach - 1e-9 <= max(offsets):
        raise ValueError(
            f"offsets must cover delays of ±{reach:.4g} samples for this source; got {offsets}: "
            f"use offsets={window(reach)}"
        )
