"""GOSPA beside the lines of numpy and scipy that compute it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linear_sum_assignment

from arrivals.scenarios import gospa
from arrivals.typing import Float
from peer_jobs import Job

CUT_OFF = 10.0


def plain_gospa(truth: Float, estimate: Float, c: float) -> tuple[float, float, float, float]:
    """Return GOSPA of p = 1 and α = 2 and its parts, without any check of the arguments."""
    d = np.sqrt(((truth[:, None] - estimate) ** 2).sum(axis=-1))
    rows, columns = linear_sum_assignment(np.minimum(d, c))
    pairs = d[rows, columns]
    detected = pairs[pairs < c]
    missed, false = len(truth) - len(detected), len(estimate) - len(detected)
    distance = detected.sum()
    return distance + c / 2 * (missed + false), distance, c / 2 * missed, c / 2 * false


def jobs() -> list[Job]:
    """Return GOSPA of 6 and of 50 points in the plane."""
    return [_job(n, limit) for n, limit in ((6, 2.0), (50, 1.3))]


def _job(n: int, limit: float) -> Job:
    rng = np.random.default_rng(n)
    truth = rng.uniform(0, 100, (n, 2))
    estimate = truth + 3 * rng.standard_normal((n, 2))
    ours: Callable[[], object] = lambda: gospa(truth, estimate, CUT_OFF)  # noqa: E731
    return Job(
        f"gospa {n} x {n}",
        ours,
        lambda: plain_gospa(truth, estimate, CUT_OFF),
        "numpy + scipy, a few lines",
        limit,
    )
