"""Variable numbers of sources in arrays of one size."""

from __future__ import annotations

import copy
import time
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.run import Recorder, Run
from arrivals.typing import Bool, Float, Int
from arrivals.validation import positive

OVER: Any = object()  # in place of a measurement, where one sequence has ended and others go on


def padded(values: Float | Int | Bool, n: int, filler: float) -> Float:
    """Return the first n values, as floats, followed by fillers up to length n.

    Examples
    --------
    >>> padded(np.array([1.0, 2.0]), 4, np.nan)
    array([ 1.,  2., nan, nan])
    """
    full = np.full(n, filler)
    full[: len(values[:n])] = values[:n]
    return full


class DirectionTracker(Tracker):
    """A tracker that reports as many directions as there are.

    Attributes
    ----------
    x, P : ndarray, shapes (n_slots,), (n_slots, n_slots)
        The directions reported, rad, NaN in unused places, and their variances on a diagonal, 0
        where they are not known.
    estimate : DirectionEstimate
        Read-only, as is
    noise : float
        Variance of the noise of one sensor as estimated last; NaN where it is not.
    """

    @property
    @abstractmethod
    def n_slots(self) -> int:
        """Number of directions that may be reported at once."""

    @property
    def estimate(self) -> DirectionEstimate:
        """The directions reported last."""
        return self._estimate

    @property
    def noise(self) -> float:
        """Variance of the noise of one sensor as estimated last; NaN where it is not."""
        return self._estimate.noise

    def _show(self, estimate: DirectionEstimate) -> None:
        """Report directions."""
        self._estimate = estimate
        self.x = padded(estimate.doa, self.n_slots, np.nan)
        variance = padded(estimate.std**2, self.n_slots, 0.0)
        self.P = np.diag(np.nan_to_num(variance, posinf=np.inf))


class SideBySide(DirectionTracker):
    """A direction tracker that solves a step of several sequences as one array program."""

    @abstractmethod
    def _together(self, trackers: Sequence[Self], step: Sequence[Any], dt: float) -> None:
        """Predict and update copies of this tracker, each with its measurement."""

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences, the leading axis, each from the present state.

        All are solved together, step by step, as one array program; the numbers are those of
        single runs, up to rounding. The tracker itself stays as it is.
        """
        positive("dt", dt)
        sequences = [list(sequence) for sequence in measurements]
        trackers = [copy.deepcopy(self) for _ in sequences]
        recorders = [Recorder(type(self.estimate)) for _ in sequences]
        started = time.perf_counter()
        for step in zip_longest(*sequences, fillvalue=OVER):
            on = [n for n, z in enumerate(step) if z is not OVER]
            self._together([trackers[n] for n in on], [step[n] for n in on], dt)
            for n in on:
                recorders[n].add(trackers[n].estimate, trackers[n].x)
        elapsed = (time.perf_counter() - started) / max(len(sequences), 1)
        return [recorder.run(dt=dt, elapsed=elapsed) for recorder in recorders]
