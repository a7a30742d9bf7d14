"""Claims of our own on the report's scenes, and checks of these programs against the limits."""

from __future__ import annotations

from functools import partial

import numpy as np

from arrivals.scenarios.reproduce.ar_kalman.decisions import (
    literal_fails,
    values,
)
from arrivals.scenarios.reproduce.ar_kalman.experiments import OURS, REPORT
from arrivals.scenarios.reproduce.ar_kalman.scores import Results
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decision, all_of, below, negative, share

STUDY = "ar-kf"
# Largest medians of the RMSE that are accepted, degrees
ACCEPTED = {"30 dB": 0.12, "N = 3, d = .5, 1": 0.85, "N = 30, d = .5, 1": 0.2, "10 dB": 0.7,
            "5 dB": 1.2, "1 dB": 2.0, "M = 2": 0.45, "M = 3": 0.28, "M = 4": 0.2,
            "order 3": 0.12, "3 sources, 3 sensors": 0.4}  # fmt: skip


def improved(name: str, results: Results) -> Decision | None:
    """Decide that our form has less error than the report's."""
    ours, report = (values(results, "rmse", form, name) for form in (OURS, REPORT))
    if not ours or not report:
        return None
    return below(ours[0], report[0], "degrees", ("ours", "report's form"))


def within_limits(results: Results) -> Decision | None:
    """Decide that the median of every part is within its limit: most runs are."""
    found = {name: values(results, "rmse", OURS, name) for name in ACCEPTED}
    runs = {name: one[0] / ACCEPTED[name] for name, one in found.items() if one}
    if len(runs) < len(ACCEPTED):
        return None
    medians = {name: float(np.median(one)) for name, one in runs.items()}
    worst = max(medians, key=lambda name: medians[name])
    shares = [share(one > 1.0) for one in runs.values()]
    holds = all_of(negative(share - 0.5, error) for share, error in shares)
    return Decision(holds, f"at most {medians[worst]:.0%} of the limit, at {worst}")


CLAIMS = (
    *(
        Claim(
            STUDY, "", f"with the covariance of the estimated samples (ours) the error is smaller, "
            f"{name}",
            by_ours=partial(improved, name), source="ours",
        )
        for name in ("10 dB", "5 dB", "1 dB", "speech, 10 dB", "speech, 5 dB",
                     "3 sources, 3 sensors", "2 sources, 2 sensors")
    ),
    Claim(
        STUDY, "", "word for word (quotient of rows, estimated rows put back) the directions stay "
        "more than 5 degrees wrong: 30 dB, N = 3, M = 2",
        by_ours=literal_fails(5.0, "30 dB", "N = 3, d = .5, .5", "M = 2"), source="ours",
    ),
    Claim(
        STUDY, "", "word for word it fails on speech with order 1 as with order 2, 30 dB",
        by_ours=literal_fails(2.5, "speech, 30 dB", "speech, order 2, 30 dB"), source="ours",
    ),
    Claim(
        STUDY, "", f"the medians of the RMSE of {len(ACCEPTED)} parts are below the largest "
        "accepted ones",
        by_ours=within_limits, source="check",
    ),
)  # fmt: skip
