"""Jobs that this library and a peer both do, timed by `benchmarks/peers.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Job:
    """One job, done by this library and by a peer on the same data.

    Parameters
    ----------
    name : str
        What is computed, with its sizes.
    ours, peer : callable
        Do the job once. They return comparable results, or None.
    peer_name : str
        Distribution of the peer, as `importlib.metadata.version` knows it, or distributions
        joined by " + "; words that follow a comma are printed only.
    limit : float
        Largest ratio of CPU times wanted, ours over the peer's.
    """

    name: str
    ours: Callable[[], object]
    peer: Callable[[], object]
    peer_name: str
    limit: float
