"""Short studies that several test modules share, and their reference numbers."""

from functools import cache
from typing import Any

from arrivals.scenarios import Method, Study, create
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.simulations import PairsInTurn

SHORT = {"fig6": PairsInTurn(n_steps=3), "scenario1": create("svalse_scenario1", n_steps=2)}
TRACKERS: list[str | Method] = [
    "cbf",
    Method("ssbl", {"n_directions": 91}, "ssbl"),
    "peaks_gnn",
    Method("svalse", {"solver__tolerance": 0.01}, "svalse"),
]
METRICS = ("gospa", "rmse", "nees")


def numbers(study: Study) -> list[tuple[Any, ...]]:
    """Return all rows but the times, values as text, since NaN differs from itself."""
    rows = [row for row in study.rows() if row.metric != "cpu_ms"]
    return [(*row[:4], repr(row.value), row.note) for row in rows]


def small(runs: int = 5, **options: Any) -> Study:
    """Run the short study."""
    return compute_study(SHORT, TRACKERS, runs, 3, StudySettings(METRICS, batch=2, **options))


@cache
def reference() -> list[tuple[Any, ...]]:
    """Return the numbers of the short study, computed in this process."""
    return numbers(small())
