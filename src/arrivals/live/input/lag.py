"""Lag of a run behind a live source, its message, and steps that are left out."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from arrivals.live.input.timed_input import TimedInput
from arrivals.typing import Complex
from arrivals.validation import one_of

LIMIT = 0.5  # s behind the source at which there is a message
WINDOW = 2.0  # s of the source, in which a live one takes that time
BURST = 0.5  # s by which it may be faster: it delivers blocks
AHEAD = 10.0  # s by which it may be ahead of time: what had waited for the program to start
START = 10.0  # s of the source in which a run catches up, without a message
LATE = ("wait", "drop")


class LagMeter:
    """Lag of the steps of a run behind its source, if that one is live.

    A source is live if its latest two seconds were received in about that time: a file that is
    piped is received faster, and samples that have waited for the program to start are, too.

    Parameters
    ----------
    source : TimedInput
        Input of the run.
    late : {"wait", "drop"}
        Whether all steps are tracked, or those that are late count as missing.
    report : callable, optional
        Receives a message; it is printed on standard error if None.
    clock : callable
        Returns the monotonic time, s.
    start : float
        Time of the source before which lag has no consequence, s.

    Attributes
    ----------
    n_left_out : int
        Number of steps left out.

    Examples
    --------
    >>> import io
    >>> meter = LagMeter(TimedInput(io.BytesIO(b"")))
    >>> meter.lag
    nan
    """

    def __init__(
        self,
        source: TimedInput,
        late: str = "wait",
        report: Callable[[str], object] | None = None,
        clock: Callable[[], float] = time.monotonic,
        start: float = START,
    ) -> None:
        self.late = one_of("late", late, LATE)
        self.n_left_out = 0
        self._source, self._clock, self._start = source, clock, start
        self._report = report or (lambda text: print(f"arrivals: {text}", file=sys.stderr))
        self._reported = self._live = False
        self._window: deque[tuple[float, float]] = deque()
        self._first: tuple[float, float] | None = None

    @property
    def lag(self) -> float:
        """Time since the last sample of the present step was received, s; NaN if not live."""
        return self._clock() - self._source.received if self._live else np.nan

    def steps(self, steps: Iterable[tuple[float, Complex]]) -> Iterator[tuple[float, Complex]]:
        """Yield steps; late ones without data if they are to be left out.

        Parameters
        ----------
        steps : iterable of (float, ndarray)
            Times, s, and snapshots.

        Yields
        ------
        (float, ndarray)
        """
        for at, z in steps:
            self._live = self._is_live(at)
            lag = self.lag
            if at >= self._start and lag > LIMIT:
                self._say(at, lag)
                if self.late == "drop":
                    self.n_left_out += 1
                    z = np.full_like(z, np.nan)
            yield at, z

    def _is_live(self, at: float) -> bool:
        """Return True if the source took its time for the window that ends at a time, s."""
        window, received = self._window, self._source.received
        window.append((at, received))
        while len(window) > 2 and at - window[1][0] >= WINDOW:
            window.popleft()
        self._first = self._first or window[0]
        passed, taken = np.subtract((at, received), window[0])
        ahead = at - self._first[0] - (received - self._first[1])
        return bool(passed >= WINDOW and taken > passed - BURST and ahead < AHEAD)

    def close(self) -> None:
        """Say how many steps were left out."""
        if self.n_left_out:
            self._report(f"{self.n_left_out} late steps were left out")

    def _say(self, at: float, lag: float) -> None:
        if self._reported:
            return
        self._reported = True
        cure = "are left out" if self.late == "drop" else "are tracked: --late drop leaves them out"
        self._report(f"{lag:.1f} s behind the source at {at:.1f} s: late steps {cure}")
