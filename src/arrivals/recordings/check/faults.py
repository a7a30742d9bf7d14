"""Faults of levels, wiring and spacing, in words with their cures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from arrivals.recordings.check.levels import ChannelLevels
from arrivals.recordings.check.report import Fault
from arrivals.recordings.check.wiring import INVERTED, LATE, SWAPPED, Correction
from arrivals.recordings.check.wiring_result import WiringResult
from arrivals.typing import Bool, Float

SILENT_DB = 35.0  # below the median of the channels; sensors of one kind differ by 6 dB or so
WEAK_DB = 12.0  # below the median: noted
MAX_CLIPPED = 1e-3  # share of samples in flat tops; less does no harm to directions
NOTED_CLIPPED = 1e-4
MAX_HUM, HUM_ABOVE_DB = 0.5, 10.0  # share of hum in a channel, and its power above the median
LARGER, NOTED, SMALLER = 1.5, 0.6, 0.2  # of the scale: 0.2 is 78 degrees over the plane
MIN_LOW = 0.3  # of the range of a small scale: no delays at all are waves from straight above
MOST_BROKEN = 3  # part of the channels: if more than a third disagree, the array does not fit
LENGTH_UNITS = {  # by the factor between them
    1000.0: "millimetres for metres",
    100.0: "centimetres for metres",
    39.37: "inches for metres",
    10.0: "millimetres for centimetres",
    3.28: "feet for metres",
    2.54: "inches for centimetres",
    2.0: "a diameter for a radius",
}


def is_silent(levels: ChannelLevels) -> Bool:
    """Return True for channels that are constant, missing, or 35 dB below the median.

    Examples
    --------
    >>> blocks = np.random.default_rng(0).standard_normal((1, 1000, 3)) * [1.0, 0.0, 1.0]
    >>> is_silent(ChannelLevels.of(blocks))
    array([False,  True, False])
    """
    active = levels.rms[levels.rms > 0]
    least = float(np.median(active)) * 10 ** (-SILENT_DB / 20) if len(active) else 0.0
    return np.asarray((levels.rms <= least) | (levels.rms == 0) | (levels.missing == 1))


def level_faults(
    levels: ChannelLevels, hum: tuple[Float, Float], labels: Sequence[int]
) -> list[Fault]:
    """Return faults of the levels.

    Parameters
    ----------
    levels : ChannelLevels
        Of the channels.
    hum : (ndarray, ndarray)
        Power and share of mains hum.
    labels : sequence of int
        Numbers of the channels.

    Returns
    -------
    list of Fault

    Examples
    --------
    >>> blocks = np.random.default_rng(0).standard_normal((1, 1000, 3)) * [1.0, 0.0, 1.0]
    >>> levels = ChannelLevels.of(blocks)
    >>> print(*level_faults(levels, (np.zeros(3), np.zeros(3)), [1, 2, 3]))
    channel 2 is silent: connect its sensor, or add missing = [2] to the array file
    """
    faults, silent = [], is_silent(levels)
    for m in np.flatnonzero(silent).tolist():
        n = labels[m]
        cure = f"connect its sensor, or add missing = [{m + 1}] to the array file"
        faults.append(Fault("silent", (n,), f"channel {n} is silent: {cure}"))
    for m in np.flatnonzero(levels.twin != np.arange(len(levels.twin))).tolist():
        pair = labels[int(levels.twin[m])], labels[m]
        text = f"channels {pair[0]} and {pair[1]} are identical: one signal was recorded twice"
        faults.append(Fault("identical", pair, text))
    clipped = np.flatnonzero((levels.clipped > MAX_CLIPPED) & ~silent).tolist()
    if clipped:
        numbers = tuple(labels[m] for m in clipped)
        share, level = 100 * levels.clipped[clipped].max(), levels.peak[clipped].max()
        extent = f"clipped at {level:.3g} in up to {share:.2g} % of the samples"
        text = f"{_listed(numbers, len(labels))} {extent}: lower the gain of the recording"
        faults.append(Fault("clipped", numbers, text))
    above = hum[0] > 10 ** (HUM_ABOVE_DB / 10) * np.median(hum[0])
    for m in np.flatnonzero((hum[1] > MAX_HUM) & above & ~silent).tolist():
        n, cure = labels[m], "check its cable, shield and ground"
        text = f"channel {n} has {100 * hum[1][m]:.0f} % mains hum: {cure}"
        faults.append(Fault("hum", (n,), text))
    return faults


def level_notes(
    levels: ChannelLevels, hum: tuple[Float, Float], labels: Sequence[int]
) -> list[str]:
    """Return notes on channels that are weak, missing in part, or have hum as the others have.

    Parameters
    ----------
    levels, hum, labels
        As in `level_faults`.

    Returns
    -------
    list of str

    Examples
    --------
    >>> blocks = np.random.default_rng(0).standard_normal((1, 1000, 3)) * [1.0, 0.1, 1.0]
    >>> levels = ChannelLevels.of(blocks)
    >>> level_notes(levels, (np.zeros(3), np.zeros(3)), [1, 2, 3])
    ['channel 2 is 20 dB weaker than the median of the channels']
    """
    silent = is_silent(levels)
    reference = float(np.median(levels.rms[~silent])) if not silent.all() else np.nan
    notes = []
    for m in np.flatnonzero(~silent).tolist():
        weaker = 20 * np.log10(reference / levels.rms[m])
        if weaker > WEAK_DB:
            text = f"is {weaker:.0f} dB weaker than the median of the channels"
            notes.append(f"channel {labels[m]} {text}")
        if NOTED_CLIPPED < levels.clipped[m] <= MAX_CLIPPED:
            notes.append(f"channel {labels[m]} is clipped in few samples")
        if levels.missing[m] > 0.01:
            notes.append(f"{100 * levels.missing[m]:.0f} % of channel {labels[m]} are missing")
    if np.median(hum[1]) > MAX_HUM:
        notes.append(f"mains hum has {100 * np.median(hum[1]):.0f} % of the power of the channels")
    return notes


def wiring_faults(result: WiringResult, labels: Sequence[int]) -> list[Fault]:
    """Return faults of the wiring.

    Parameters
    ----------
    result : WiringResult
        Of the channels.
    labels : sequence of int
        Their numbers.

    Returns
    -------
    list of Fault

    Examples
    --------
    >>> result = WiringResult(np.full(4, 0.8), [Correction("late", (2,), 5)])
    >>> print(*wiring_faults(result, [1, 2, 3, 4]))
    channel 3 is 5 samples late: delay the others by 5 samples
    """
    changes = [each for each in result.corrections if each.kind != SWAPPED]
    faults = [*_order_faults(result, labels), *(_of_correction(each, labels) for each in changes)]
    corrected = {m for each in result.corrections for m in each.channels}
    broken = [m for m in result.broken if m not in corrected]
    if len(broken) > len(labels) // MOST_BROKEN:
        return faults
    for m in broken:
        n, value = labels[m], result.agreement[m]
        values = f"{value:.2f}; they have {result.usual:.2f}"
        text = f"channel {n} does not agree with the others ({values})"
        cure = "replace its sensor or cable, or correct channels = [...] of the array file"
        faults.append(Fault("no agreement", (n,), f"{text}: {cure}"))
    return faults


def wiring_notes(result: WiringResult, labels: Sequence[int]) -> list[str]:
    """Return notes on what was not tested, and on an array that does not fit as a whole.

    Parameters
    ----------
    result, labels
        As in `wiring_faults`.

    Returns
    -------
    list of str

    Examples
    --------
    >>> wiring_notes(WiringResult(np.array([0.8, 0.9, 0.9, 0.1, 0.1])), [1, 2, 3, 4, 5])
    ['2 of 5 channels do not agree with the others: positions or wave speed may be wrong']
    """
    corrected = {m for each in result.corrections for m in each.channels}
    n_broken = len(set(result.broken) - corrected)
    notes = [f"the wiring was not tested: {result.not_tested}"] if result.not_tested else []
    notes += [result.remark] if result.remark else []
    if n_broken > len(labels) // MOST_BROKEN:
        notes.append(
            f"{n_broken} of {len(labels)} channels do not agree with the others: positions or wave "
            "speed may be wrong"
        )
    return notes


def _order_faults(result: WiringResult, labels: Sequence[int]) -> list[Fault]:
    """Return a fault for each cycle of channels that are exchanged."""
    swaps = [each for each in result.corrections if each.kind == SWAPPED]
    order = np.arange(len(labels))  # channel of each sensor
    for each in swaps:
        one, other = each.channels
        order[[one, other]] = order[[other, one]]
    faults, seen = [], set[int]()
    for start in np.flatnonzero(order != np.arange(len(order))).tolist():
        cycle = []
        while start not in seen:
            seen.add(start)
            cycle.append(start)
            start = int(order[start])
        same = [each for each in swaps if sorted(each.channels) == sorted(cycle)]
        if same:
            faults.append(_of_correction(same[0], labels))
        elif cycle:
            sensors = sorted(cycle)
            channels = tuple(labels[int(order[m])] for m in sensors)
            text = (f"channels {', '.join(str(labels[m]) for m in sensors)} are in another order: "
                    f"correct channels = [...] of the array file to {', '.join(map(str, channels))}"
                    " at these places")  # fmt: skip
            faults.append(Fault(SWAPPED, tuple(labels[m] for m in sensors), text))
    return faults


def _of_correction(each: Correction, labels: Sequence[int]) -> Fault:
    others = "".join(f", or {_change(other, labels)}" for other in each.alternatives)
    samples = _samples(each.delay)
    cure = {
        SWAPPED: "swap their plugs, or their numbers in channels = [...] of the array file",
        INVERTED: "swap its two wires, or multiply its samples by -1",
        LATE: f"delay it by {samples}" if each.delay < 0 else f"delay the others by {samples}",
    }[each.kind]
    numbers = tuple(labels[m] for m in each.channels)
    return Fault(each.kind, numbers, f"{_change(each, labels)}{others}: {cure}")


def _change(each: Correction, labels: Sequence[int]) -> str:
    numbers = [labels[m] for m in each.channels]
    if each.kind == SWAPPED:
        return f"channels {numbers[0]} and {numbers[1]} are swapped"
    if each.kind == INVERTED:
        return f"{_listed(numbers, 0)} inverted"
    return f"channel {numbers[0]} is {_samples(each.delay)} {'late' if each.delay > 0 else 'early'}"


def _samples(delay: int) -> str:
    return "1 sample" if abs(delay) == 1 else f"{abs(delay)} samples"


def scale_fault(scale: Float, dim: int, is_confirmed: bool = True) -> Fault | str | None:
    """Return the fault, or a note, on a range of the size of an array relative to its file.

    Parameters
    ----------
    scale : ndarray, shape (2,)
        As of `spacing_scale`.
    dim : int
        Dimension of the positions: from the side of a line all delays are small.
    is_confirmed : bool
        True if the channels agree better on an array of this size; else there is only a note.

    Returns
    -------
    Fault, str or None

    Examples
    --------
    >>> print(scale_fault(np.array([0.0099, 0.0104]), 2))  # doctest: +ELLIPSIS
    the array is 0.0099 to 0.01 times the size in its file (centimetres for metres?): correct ...
    """
    low, high = scale
    is_small, is_large = high < (NOTED if dim > 1 else SMALLER), (low + high) / 2 > LARGER
    if not is_small and not is_large:
        return None
    least, most = (1 / high, 1 / max(low, 1e-9)) if is_small else (low, high)
    units = [unit for factor, unit in LENGTH_UNITS.items() if least / 1.1 < factor < most * 1.1]
    hint = f" ({', or '.join(units)}?)" if units else ""
    size = f"{low:.2g} to {high:.2g} times the size in its file"
    is_sure = not is_small or (dim > 1 and high < SMALLER and low > MIN_LOW * high)
    if not is_confirmed or not is_sure:
        aside = "waves from far outside of its plane" if dim > 1 else "waves from its side"
        cause = f"{aside}, echoes" if is_small else "echoes"
        return f"delays fit an array {size}: {cause}, another wave speed, or wrong lengths"
    text = f"the array is {size}{hint}: correct its lengths, or the wave speed, in the array file"
    return Fault("scale", (), text)


def _listed(numbers: Sequence[int], n_channels: int) -> str:
    if len(numbers) == n_channels:
        return "all channels are"
    if len(numbers) == 1:
        return f"channel {numbers[0]} is"
    return f"channels {', '.join(map(str, numbers[:-1]))} and {numbers[-1]} are"
