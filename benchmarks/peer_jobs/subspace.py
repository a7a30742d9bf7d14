"""Root-MUSIC, ESPRIT and PAST on blocks of 50 snapshots, beside doa-py."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from arrivals.trackers import ESPRIT, PAST, DirectionTracker, RootMUSIC
from arrivals.typing import Complex
from peer_jobs import Job
from peer_jobs.blocks import N_SENSORS, block_model, step, two_sources

LIGHT = 3e8  # m/s: the waves of doa-py
PEER_FREQUENCY = 1e9  # Hz


def jobs() -> list[Job]:
    """Return the jobs, none if doa-py is not installed."""
    if not find_spec("doa_py"):
        return []
    model, block = block_model(), two_sources()
    trackers: list[tuple[str, DirectionTracker, str]] = [
        ("root_music", RootMUSIC(model, n_sources=2, forgetting=0.0), "root_music"),
        ("esprit", ESPRIT(model, n_sources=2, forgetting=0.0), "esprit"),
        ("past", PAST(model, n_sources=2), "esprit"),
    ]
    return [
        Job(
            f"{name}, 15 sensors, block of 50 snapshots",
            lambda tracker=tracker: step(tracker, block),  # type: ignore[misc]
            _peer(method, block),
            "doa-py" if name == method else f"doa-py, {method}",
            1.0,
        )
        for name, tracker, method in trackers
    ]


def _peer(method: str, block: Complex) -> Callable[[], object]:
    from doa_py import algorithm
    from doa_py.arrays import UniformLinearArray

    array = UniformLinearArray(m=N_SENSORS, dd=LIGHT / PEER_FREQUENCY / 2)
    received = block.conj().T  # its phases fall along the line
    find = getattr(algorithm, method)

    def directions() -> object:
        return np.deg2rad(find(received, 2, array, PEER_FREQUENCY))

    return directions
