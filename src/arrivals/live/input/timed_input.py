"""Binary input that a thread reads ahead, with the time at which its bytes were received."""

from __future__ import annotations

import io
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

BLOCK = 2**16  # bytes of a read at most
MAX_BYTES = 2**25  # that are kept until they are asked for
POLL = 0.2  # s: waiting is interrupted so often, for Ctrl-C on all systems


class TimedInput:
    """Source of bytes, read by a thread as soon as they are there.

    Parameters
    ----------
    source : binary file
        With `read1`, or the descriptor of an open file by `fileno`, which is then read past any
        buffer.
    max_bytes : int
        Bytes that are kept; the source waits when there are more.

    Attributes
    ----------
    received : float
        Monotonic time at which the last byte that `read` has returned was received, s; NaN before.

    Examples
    --------
    >>> source = TimedInput(io.BytesIO(b"abcdef"))
    >>> source.read(4), source.read(4), source.received > 0
    (b'abcd', b'ef', True)
    """

    def __init__(self, source: Any, max_bytes: int = MAX_BYTES) -> None:
        self.received = np.nan
        self._take = _reader(source)
        self._max_bytes = max_bytes
        self._blocks: deque[tuple[bytes, float]] = deque()
        self._n_bytes, self._ended, self._closed = 0, False, False
        self._error: Exception | None = None
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._receive, name="input", daemon=True)
        self._thread.start()

    def read(self, size: int) -> bytes:
        """Return the next bytes, fewer at the end only.

        Parameters
        ----------
        size : int
            Number of bytes.

        Raises
        ------
        Exception
            That of the source, after the bytes before it.
        """
        parts, missing = [], size
        while missing > 0:
            block = self._next(missing)
            if not block:
                break
            parts.append(block)
            missing -= len(block)
        return b"".join(parts)

    def close(self) -> None:
        """End the thread after its present read."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def join(self, timeout: float) -> None:
        """Wait for the end of the thread.

        Parameters
        ----------
        timeout : float
            Longest time, s.
        """
        self._thread.join(timeout)

    def _next(self, size: int) -> bytes:
        """Return some bytes, at most `size`; none at the end."""
        with self._changed:
            while not self._blocks and not self._ended:
                self._changed.wait(POLL)
            if not self._blocks:
                if self._error is not None:
                    raise self._error
                return b""
            block, self.received = self._blocks.popleft()
            if len(block) > size:
                self._blocks.appendleft((block[size:], self.received))
                block = block[:size]
            self._n_bytes -= len(block)
            self._changed.notify_all()
            return block

    def _receive(self) -> None:
        try:
            while not self._closed:
                block = self._take(BLOCK)
                now = time.monotonic()
                if not block:
                    break
                with self._changed:
                    self._blocks.append((block, now))
                    self._n_bytes += len(block)
                    self._changed.notify_all()
                    while self._n_bytes > self._max_bytes and not self._closed:
                        self._changed.wait(POLL)
        except Exception as error:
            self._error = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()


def _reader(source: Any) -> Callable[[int], bytes]:
    """Return a function that waits for some bytes of a source.

    A descriptor is read by itself: a thread that waits in a buffered file would hold its lock at
    the end of the program.
    """
    try:
        descriptor = source.fileno()
    except (AttributeError, OSError, io.UnsupportedOperation):
        take: Callable[[int], bytes] = source.read1
        return take
    return lambda size: os.read(descriptor, size)
