"""Wiring faults: search for the changes of channels that make beams stronger."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from arrivals.recordings.check.beam_agreement import agreement, beam_power, bin_power
from arrivals.recordings.check.segments import PhaseSegments
from arrivals.typing import Complex, Float, Int

INVERTED, SWAPPED, LATE = "inverted", "swapped", "late"
# Least gain of beam power, in units of what one more channel in phase adds. Set above the gains
# in simulated rooms without a fault, with the most room for inversions, the least for swaps.
MIN_GAIN = {INVERTED: 0.4, SWAPPED: 0.06, LATE: 0.15}
MIN_NARROWBAND_GAIN = 0.3  # with one frequency: other directions make up for small changes
# Share of the best gain that is enough, as delays fit anything. Set between the shares of an
# inversion in simulated rooms with an inverted channel, and in those with a late one.
SIMPLER = {INVERTED: 0.93, SWAPPED: 0.95, LATE: 1.0}
SIMILAR = {INVERTED: 0.9, SWAPPED: 0.9, LATE: 0.85}  # share of the gain that is worth a mention
PAIR_RATIO = 1.3  # of beam power after two inversions to that after one change
MAX_ALTERNATIVES = 3
REFINED = 2  # samples about the peak of the agreement
MIN_SIGNIFICANCE = 2.5  # standard errors of the gain, over segments
MIN_LINE_SIGNIFICANCE = 2.2  # over lines of the spectrum, above tones over several paths
MIN_PEAK = 0.4  # of a delayed channel's agreement, relative to the others
SAME_DIRECTION = 0.8  # coherence of responses
MAX_DELAY = 64  # samples
MAX_SUSPECTS = 8  # channels of a large array whose changes are tried: those that agree least


@dataclass(frozen=True)
class Correction:
    """Change of one channel, or of two, that makes the beams stronger.

    Parameters
    ----------
    kind : str
        `inverted`, `swapped` or `late`.
    channels : tuple of int
        One, or two that are swapped or both inverted; counted from 0.
    delay : int
        Samples; negative if the channel is early.
    gain : float
        Gain of beam power; that of a channel that comes into phase is about 1.
    alternatives : tuple of Correction
        Others that fit nearly as well, such as a swap in the mirror image of the array.

    Examples
    --------
    >>> Correction("swapped", (1, 2)).apply(np.arange(4.0), np.ones(1))
    array([0., 2., 1., 3.])
    """

    kind: str
    channels: tuple[int, ...]
    delay: int = 0
    gain: float = 0.0
    alternatives: tuple[Correction, ...] = ()

    @property
    def parts(self) -> list[tuple[int, ...]]:
        """Channels of the correction, each one that is inverted by itself."""
        return [(m,) for m in self.channels] if self.kind == INVERTED else [self.channels]

    def apply(self, phasors: Complex, turn: Complex) -> Complex:
        """Return phase factors (..., n_channels) with the change undone.

        `turn` has the phase factors (n_bins, 1) of an advance by one sample.
        """
        changed, one = phasors.copy(), self.channels[0]
        if self.kind == SWAPPED:
            other = self.channels[1]
            changed[..., [one, other]] = phasors[..., [other, one]]
            return changed
        if self.kind == INVERTED:
            changed[..., list(self.channels)] *= -1
        else:
            changed[..., one] *= turn**self.delay
        return changed


@dataclass(frozen=True, eq=False)
class WiringSearch:
    """Greedy search for corrections of the channels.

    Parameters
    ----------
    segments : PhaseSegments
        As recorded.
    responses : ndarray, shape (n_bins, n_sensors, n_directions)
        As of `scan_responses`.
    rate : float
        Samples per second, Hz; 1 for complex snapshots.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> u = np.exp(2j * np.pi * rng.random((8, 24, 4, 1))) * np.array([1, 1, -1, 1, 1])
    >>> f = np.arange(3, 27) * 1000 / 64
    >>> segments = PhaseSegments(u, np.ones((8, 24)), f, 64)
    >>> search = WiringSearch(segments, np.ones((24, 5, 1), complex), rate=1000.0)
    >>> [(each.kind, each.channels) for each in search.corrections()]
    [('inverted', (2,))]
    """

    segments: PhaseSegments
    responses: Complex
    rate: float

    def corrections(self) -> list[Correction]:
        """Return corrections of at most half of the channels, the largest gain first."""
        made: list[Correction] = []
        for _ in range(self.segments.n_channels // 2):
            best = self._best(self.corrected(made))
            if best is None:
                break
            made += [replace(best, channels=each) for each in best.parts]
        for each in made[:-1]:  # a first change that a later one made superfluous
            others = [other for other in made if other is not each]
            with_it, without = (self._power(self.corrected(some)) for some in (made, others))
            if not self._gain(each.kind, without, with_it):
                made = others
        return made

    def corrected(self, corrections: Sequence[Correction]) -> PhaseSegments:
        """Return the segments with corrections applied."""
        phasors = self.segments.phasors
        for each in corrections:
            phasors = each.apply(phasors, self._turn)
        return self.segments.with_phasors(phasors)

    def agreement(self, corrections: Sequence[Correction] = ()) -> Complex:
        """Return the agreement of each channel, as recorded, with the corrected others."""
        segments = self.corrected(corrections)
        direction = beam_power(segments, self.responses).argmax(axis=1)
        recorded = self.segments.phasors
        result = agreement(segments, self.responses, direction, np.zeros(1), recorded)
        return np.asarray(result[0])

    def n_directions(self) -> int:
        """Return the number of directions of segments whose responses differ."""
        direction = np.unique(beam_power(self.segments, self.responses).argmax(axis=1))
        a = self.responses[:, :, direction].reshape(-1, len(direction))
        similar = np.abs(a.conj().T @ a) / len(a) > SAME_DIRECTION
        n, left = 0, np.ones(len(direction), bool)
        while left.any():
            left &= ~similar[np.flatnonzero(left)[0]]
            n += 1
        return n

    @property
    def _turn(self) -> Complex:
        angle = 2 * np.pi * self.segments.frequency / self.rate
        return np.asarray(np.exp(1j * angle).astype(np.complex64)[:, None])

    def _power(self, segments: PhaseSegments, direction: Int | None = None) -> Float:
        """Return the power of the strongest beams, (n_segments, n_bins)."""
        if direction is None:
            direction = beam_power(segments, self.responses).argmax(axis=1)
        return bin_power(segments, self.responses, direction)

    def _gain(self, kind: str, before: Float, after: Float) -> float:
        """Return the gain, in channels; 0 if it is small, or that of few segments or tones."""
        steps = after - before
        gain = float(steps.sum() / max(after.sum(), 1e-12) * self.segments.n_channels / 2)
        least = MIN_GAIN[kind]
        if self.segments.is_narrowband:
            least = max(least, MIN_NARROWBAND_GAIN)
        errors = [MIN_SIGNIFICANCE * np.linalg.norm(steps.sum(axis=1))]
        if self.segments.window > 1:
            by_line = np.bincount(self.segments.lines(self.rate), steps.sum(axis=0))
            errors.append(MIN_LINE_SIGNIFICANCE * np.linalg.norm(by_line))
        return gain if gain >= least and steps.sum() >= max(errors) else 0.0

    def _best(self, segments: PhaseSegments) -> Correction | None:
        direction = beam_power(segments, self.responses).argmax(axis=1)
        before = self._power(segments, direction)

        def measured(each: Correction) -> Correction:
            changed = segments.with_phasors(each.apply(segments.phasors, self._turn))
            return replace(each, gain=self._gain(each.kind, before, self._power(changed)))

        found = [measured(each) for each in self._candidates(segments, direction)]
        latest = max((each for each in found if each.kind == LATE), key=_gain_of, default=None)
        if latest is not None and latest.gain:
            shifts = (k for k in range(-REFINED, REFINED + 1) if k and latest.delay + k)
            found += [measured(replace(latest, delay=latest.delay + k)) for k in shifts]
        found += self._both_inverted(found, measured)
        found = sorted((each for each in found if each.gain), key=_gain_of, reverse=True)
        if not found:
            return None
        simple = [each for each in found if each.gain >= SIMPLER[each.kind] * found[0].gain]
        chosen = min(simple, key=lambda each: (each.kind == LATE, -each.gain))
        return replace(chosen, alternatives=_alternatives(chosen, found))

    def _both_inverted(
        self, found: list[Correction], measured: Callable[[Correction], Correction]
    ) -> list[Correction]:
        """Return pairs of inversions, one of which alone may gain little, if they gain much."""
        best = max(each.gain for each in found)
        suspects = [each.channels[0] for each in found if each.kind == INVERTED]
        both = (Correction(INVERTED, pair) for pair in combinations(suspects, 2) if best)

        def power(gain: float) -> float:  # after the change, relative to that before
            return 1 / max(1e-9, 1 - 2 * gain / self.segments.n_channels)

        return [each for each in map(measured, both) if power(each.gain) > PAIR_RATIO * power(best)]

    def _candidates(self, segments: PhaseSegments, direction: Int) -> Iterator[Correction]:
        """Yield inversions, delays at peaks of the agreement, and swaps."""
        limit = 0 if segments.is_narrowband else min(MAX_DELAY, segments.window // 4)
        delays = np.arange(-limit, limit + 1)
        profile = agreement(segments, self.responses, direction, delays / self.rate).real
        suspects = np.sort(np.argsort(profile[limit], kind="stable")[:MAX_SUSPECTS]).tolist()
        least = MIN_PEAK * float(np.median(np.abs(profile).max(axis=0)))
        for m in suspects:
            yield Correction(INVERTED, (m,))
            peak = int(profile[:, m].argmax())
            if delays[peak] and profile[peak, m] >= least:
                yield Correction(LATE, (m,), int(delays[peak]))
        for pair in combinations(suspects, 2):
            yield Correction(SWAPPED, pair)


def _alternatives(chosen: Correction, found: list[Correction]) -> tuple[Correction, ...]:
    """Return other corrections, the best first, of nearly the same gain: one for each channel."""
    others: dict[tuple[str, tuple[int, ...]], Correction] = {}
    for each in found:
        is_delay_of_inversion = each.kind == LATE and chosen.kind == INVERTED
        if each.gain >= SIMILAR[each.kind] * chosen.gain and not is_delay_of_inversion:
            others.setdefault((each.kind, each.channels), each)
    others.pop((chosen.kind, chosen.channels), None)
    return tuple(others.values())[:MAX_ALTERNATIVES]


def _gain_of(correction: Correction) -> float:
    return correction.gain
