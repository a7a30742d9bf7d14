"""Table of filterpy's names in docs/from_filterpy.md: `python filterpy_table.py` writes it."""

from pathlib import Path
from typing import Any

import numpy as np
from filterpy.kalman import (
    ExtendedKalmanFilter,
    IMMEstimator,
    KalmanFilter,
    MerweScaledSigmaPoints,
    UnscentedKalmanFilter,
)

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import RandomWalk
from arrivals.trackers import EKF, IMM, UKF, Kalman

PAGE = Path(__file__).parents[2] / "docs" / "from_filterpy.md"
START, END = "<!-- names: written by tests/helpers/filterpy_table.py -->", "<!-- end of names -->"

# names that exist in both, and differ
DIFFERENCES = {
    ("KalmanFilter", "predict"): "`B`, `F`, `Q` by name",
    ("KalmanFilter", "batch_filter"): "`saver` by name",
    ("KalmanFilter", "log_likelihood_of"): "0 of a missing measurement",
    ("KalmanFilter", "test_matrix_dimensions"): "raises ValueError, not AssertionError",
    ("KalmanFilter", "z"): "NaN where missing, not None",
    ("ExtendedKalmanFilter", "B"): "None, not 0, where there is no control input",
    ("ExtendedKalmanFilter", "update"): "also `update(z)`, by the measurement model",
    ("ExtendedKalmanFilter", "predict_update"): "`x_prior` is the predicted mean",
    ("UnscentedKalmanFilter", "predict"): "`predict(dt=...)`: the first argument is `u`",
    ("UnscentedKalmanFilter", "update"): "`R` by name; functions belong to the models",
    (
        "UnscentedKalmanFilter",
        "batch_filter",
    ): "arguments by name; four results",
    ("UnscentedKalmanFilter", "rts_smoother"): "arguments by name; uses `Qs`; four results",
    ("IMMEstimator", "predict"): "`x`, `P` mixed by predicted probabilities",
}


def pairs() -> list[tuple[Any, Any]]:
    """Return filters of filterpy, each with ours of the same kind."""
    models = RandomWalk(1.0), LinearMeasurement([[1.0, 0.0]], [[1.0]])

    def ours(kind: Any) -> Any:
        return kind(*models, np.zeros(2), np.eye(2))

    points = MerweScaledSigmaPoints(2, 0.5, 2.0, 0.0)
    chances = (np.array([0.5, 0.5]), np.eye(2))
    return [
        (KalmanFilter(2, 1), ours(Kalman)),
        (ExtendedKalmanFilter(2, 1), ours(EKF)),
        (UnscentedKalmanFilter(2, 1, 1.0, np.array, np.array, points), ours(UKF)),
        (
            IMMEstimator([KalmanFilter(2, 1), KalmanFilter(2, 1)], *chances),
            IMM([ours(Kalman), ours(Kalman)], *chances),
        ),
    ]


def public_names(theirs: Any) -> list[str]:
    return [name for name in dir(theirs) if not name.startswith("_")]


def table() -> str:
    """Return the table: what is the same, what differs, and what to use instead."""
    lines = ["| filterpy | Arrivals | the same |", "| --- | --- | --- |"]
    others = ["| name | in Arrivals |", "| --- | --- |"]
    for theirs, ours in pairs():
        kind, same = type(theirs).__name__, []
        sentences: dict[str, list[str]] = {}
        for name in public_names(theirs):
            if (kind, name) in DIFFERENCES:
                sentences.setdefault(DIFFERENCES[kind, name], []).append(name)
            elif hasattr(ours, name):
                same.append(f"`{name}`")
            else:
                sentences.setdefault("raises: " + vars(type(ours))[name].cure, []).append(name)
        lines.append(f"| `{kind}` | `{type(ours).__name__}` | {' '.join(same)} |")
        for sentence, names in sentences.items():
            others.append(f"| `{kind}` {' '.join(f'`{n}`' for n in names)} | {sentence} |")
    return "\n".join([START, "", *lines, "", *others, "", END])


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    before, after = page.split(START)[0], page.split(END)[1]
    PAGE.write_text(before + table() + after, encoding="utf-8")
