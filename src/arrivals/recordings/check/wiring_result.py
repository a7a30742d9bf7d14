"""Test of the wiring: corrections, agreement and size of the array."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.check.beam_agreement import scan_responses
from arrivals.recordings.check.segments import PhaseSegments, Rows, window_length
from arrivals.recordings.check.spacing_scale import spacing_scale
from arrivals.recordings.check.wiring import Correction, WiringSearch
from arrivals.recordings.choice.limits import LOWEST_HZ, alias_frequency, power_of_two
from arrivals.typing import Float

LOWEST, HIGHEST = 0.12, 1.5  # of the alias limit: below, phases hardly differ between sensors
LOWEST_OF_RATE = 0.05  # where that is lower: of an array of almost no size
MIN_SCALE = 1e-3  # of waves from straight above: no delays at all
MIN_AGREEMENT = 0.5  # median of the channels; set below that of right arrays in simulated rooms
MIN_WEIGHT = 20.0  # cells of coherent channels; white noise has less than 5
MIN_SNAPSHOT_WEIGHT = 5.0  # segments of complex snapshots
USUAL_SCALE = (0.8, 1.25)  # beyond: elevated sources, another wave speed, or wrong lengths
BETTER_AT_SCALE = 0.05  # of agreement, by which wrong lengths are confirmed
MIN_USUAL = 0.65  # median agreement, below which a channel of no agreement may be far away
EVEN = 0.8  # least of a channel's agreement, of the median, where nothing is searched for
BROKEN = 0.35  # of a channel's agreement, relative to the median
CORRECTION_COST = 0.03  # of agreement, that one more correction must gain
MIN_CHANNELS, MIN_DIRECTIONS = 3, 3
MIN_WINDOWS = 16  # of a recording, if that leaves windows of 64 ms
MIN_LINES = 5  # below, tones that interfere over several paths resemble faults


FEW_DIRECTIONS = (
    "waves of one frequency from less than 3 directions do not show inverted or swapped channels"
)


@dataclass(frozen=True)
class Effort:
    """Segments that are read, and segments and bins that are used.

    Parameters
    ----------
    examined, segments, bins : int
        Numbers at most.
    is_short : bool
        True to search for corrections only where a channel agrees less than the others, and to
        leave out the size of the array.

    Examples
    --------
    >>> Effort().segments, SHORT.segments
    (48, 16)
    """

    examined: int = 128
    segments: int = 48
    bins: int = 96
    is_short: bool = False


SHORT = Effort(32, 16, 48, is_short=True)


@dataclass(frozen=True, eq=False)
class WiringResult:
    """Corrections, agreement and scale; or the reason why they were not tested.

    Parameters
    ----------
    corrections : list of Correction
        Channels counted from 0.
    agreement : ndarray, shape (n_channels,)
        With the beam of the others; NaN if not tested.
    scale : ndarray, shape (2,) or None
        Range of the size of the array, relative to that of its file.
    not_tested : str
        Reason; empty if tested.
    has_other_size : bool
        True if the channels agree clearly better on an array of this scale.
    quality : float
        Mean agreement after the corrections, less a cost for each.
    remark : str
        What was tested in part.

    Examples
    --------
    >>> WiringResult(np.full(3, np.nan), not_tested="no coherent source").corrections
    []
    """

    agreement: Float
    corrections: list[Correction] = field(default_factory=list)
    scale: Float | None = None
    not_tested: str = ""
    has_other_size: bool = False
    quality: float = 0.0
    remark: str = ""

    @property
    def usual(self) -> float:
        """Median agreement of the channels; 0 if not tested."""
        tested = np.abs(self.agreement[np.isfinite(self.agreement)])
        return float(np.median(tested)) if len(tested) else 0.0

    @property
    def broken(self) -> list[int]:
        """Channels without agreement, where the others have much; corrected ones included."""
        if self.usual < MIN_USUAL:
            return []
        return np.flatnonzero(np.abs(self.agreement) < BROKEN * self.usual).tolist()


def wiring_of_samples(
    rows: Rows, n_rows: int, rate: float, array: SensorArray, effort: Effort | None = None
) -> WiringResult:
    """Test the wiring of real samples.

    Parameters
    ----------
    rows : callable
        Samples of the rows from the first to before the last, one column a sensor.
    n_rows : int
        Number of rows.
    rate : float
        Samples per second, Hz.
    array : SensorArray
        With a wave speed.
    effort : Effort, optional
        Amount of data that is used.

    Returns
    -------
    WiringResult

    Examples
    --------
    >>> array = SensorArray.uca(4, radius=0.05, speed=343.0)
    >>> noise = np.random.default_rng(0).standard_normal((8000, 4))
    >>> wiring_of_samples(lambda a, b: noise[a:b], 8000, 8000.0, array).not_tested
    'no source is coherent over the channels'
    """
    effort = effort or Effort()
    if array.n_sensors < MIN_CHANNELS:
        return _not_tested(array, f"less than {MIN_CHANNELS} channels with a signal")
    alias = alias_frequency(array)
    window = window_length(rate, max(0.04 * alias, min(LOWEST_HZ, alias / 4)))
    window = min(window, max(window_length(rate, np.inf), power_of_two(n_rows / MIN_WINDOWS)))
    if n_rows < 2 * window:
        return _not_tested(array, "the recording is too short")
    segments = PhaseSegments.of_samples(rows, n_rows, rate, window, effort.examined)
    result = _at_scale(segments, array, rate, 1.0, effort)
    if effort.is_short and not result.corrections and not result.broken:
        return result
    wide = segments.strongest(0.0, np.inf, effort.segments, len(segments.frequency))
    sizes = [_scale(wide, array, rate, each) for each in (result, WiringResult(result.agreement))]
    best = result
    for size in sizes[: 1 + bool(result.corrections)]:
        if size is not None and not USUAL_SCALE[0] <= size.mean() <= USUAL_SCALE[1]:
            middle = max(float(size.mean()), MIN_SCALE)
            scaled = _at_scale(segments, array, rate, middle, effort)
            least = result.quality + BETTER_AT_SCALE if not result.not_tested else 0.0
            if scaled.quality > max(least, best.quality):
                best = scaled
    scale = _scale(wide, array, rate, best)
    return replace(best, scale=scale, has_other_size=best is not result)


def _scale(
    segments: PhaseSegments, array: SensorArray, rate: float, result: WiringResult
) -> Float | None:
    """Return the scale from the channels that agree with each other, corrected."""
    wired = WiringSearch(segments, np.ones((len(segments.frequency), 1, 1), complex), rate)
    segments = wired.corrected(result.corrections)
    corrected = {m for each in result.corrections for m in each.channels}
    kept = [m for m in range(array.n_sensors) if m in corrected or m not in result.broken]
    part = SensorArray(array.positions[kept], array.speed)
    return spacing_scale(segments.only(np.array(kept)), part, rate)


def wiring_of_snapshots(
    rows: Rows, n_rows: int, frequency: float, array: SensorArray, effort: Effort | None = None
) -> WiringResult:
    """Test the wiring of complex snapshots of one frequency.

    Parameters
    ----------
    rows : callable
        As in `wiring_of_samples`.
    n_rows : int
        Number of rows.
    frequency : float
        Hz.
    array : SensorArray
        With a wave speed.
    effort : Effort, optional
        Amount of data that is used.

    Returns
    -------
    WiringResult

    Examples
    --------
    >>> array = SensorArray.uca(5, radius=0.35, speed=3e8)
    >>> z = array.steering_vector(np.linspace(0, 6, 400), wavelength=0.7)
    >>> z[:, 3] *= -1
    >>> wiring_of_snapshots(lambda a, b: z[a:b], 400, 3e8 / 0.7, array).corrections[0].channels
    (3,)
    """
    effort = effort or Effort()
    if array.n_sensors < MIN_CHANNELS:
        return _not_tested(array, f"less than {MIN_CHANNELS} channels with a signal")
    segments = PhaseSegments.of_snapshots(rows, n_rows, frequency, effort.examined)
    segments = segments.strongest(0.0, np.inf, effort.segments, 1)
    return _result(segments, array, 1.0, effort.is_short)


def _at_scale(
    segments: PhaseSegments, array: SensorArray, rate: float, scale: float, effort: Effort
) -> WiringResult:
    scaled = SensorArray(scale * array.positions, array.speed)
    alias = alias_frequency(scaled)
    low = min(LOWEST * alias, LOWEST_OF_RATE * rate)
    chosen = segments.strongest(low, HIGHEST * alias, effort.segments, effort.bins)
    return _result(chosen, scaled, rate, effort.is_short)


def _result(
    segments: PhaseSegments, array: SensorArray, rate: float, is_short: bool
) -> WiringResult:
    least = MIN_SNAPSHOT_WEIGHT if segments.window == 1 else MIN_WEIGHT
    if segments.weight.sum() < least:
        return _not_tested(array, "no source is coherent over the channels")
    search = WiringSearch(segments, scan_responses(array, segments.frequency), rate)
    if segments.is_narrowband and search.n_directions() < MIN_DIRECTIONS:
        values = np.abs(search.agreement())
        if np.median(values) < MIN_AGREEMENT:
            return _not_tested(array, "no plane wave fits the channels")
        return WiringResult(values, remark=FEW_DIRECTIONS)
    if segments.window > 1 and segments.n_lines(rate) < MIN_LINES and not segments.is_narrowband:
        return _not_tested(array, "there are too few tones")
    before = search.agreement().real
    if is_short and before.min() >= EVEN * np.median(before) >= EVEN * MIN_AGREEMENT:
        return WiringResult(before, quality=float(before.mean()))
    corrections = search.corrections()
    after = WiringSearch(search.corrected(corrections), search.responses, rate)
    corrected = after.agreement().real
    if np.median(corrected) < MIN_AGREEMENT:
        return _not_tested(array, "no plane wave fits the channels")
    quality = float(corrected.mean()) - CORRECTION_COST * len(corrections)
    return WiringResult(search.agreement(corrections).real, corrections, quality=quality)


def _not_tested(array: SensorArray, reason: str) -> WiringResult:
    return WiringResult(np.full(array.n_sensors, np.nan), not_tested=reason)
