"""The claims of the papers: study, section, our words, and the functions that decide them.

A claim is decided by the form that the paper prints, by the defaults of this library, or by both
where they differ. Claims of our own and checks stand in the modules of their studies.
"""

from __future__ import annotations

from typing import Any

from arrivals.scenarios.reproduce.claims import Claim, Verdict
from arrivals.scenarios.reproduce.svalse import any_array, calibration

SVALSE: tuple[Claim, ...] = ()
AT_SEA: tuple[Claim, ...] = ()
AUTOREGRESSIVE: tuple[Claim, ...] = ()
INTERPOLATION: tuple[Claim, ...] = ()
SIGNAL_STRENGTH: tuple[Claim, ...] = ()

CLAIMS = (
    *SVALSE,
    *AT_SEA,
    *AUTOREGRESSIVE,
    *INTERPOLATION,
    *SIGNAL_STRENGTH,
    *any_array.CLAIMS,
    *calibration.CLAIMS,
)


def verdicts_of(study: str, results: Any) -> list[Verdict]:
    """Return the verdicts on all claims of a study.

    Parameters
    ----------
    study : str
        Name of the study.
    results : object
        `Report.results` of that study.

    Returns
    -------
    list of Verdict

    Examples
    --------
    >>> verdicts_of("interpolation-table9", None)
    []
    """
    return [claim.decide(results) for claim in CLAIMS if claim.study == study]
