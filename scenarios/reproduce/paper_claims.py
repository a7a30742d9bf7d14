"""The table of claims: those of the four papers, ours, and checks of these programs.

Each claim has its study, section, our words, and the functions that decide it: by the form that the
paper prints, by the defaults of this library, or by both where they differ.
"""

from __future__ import annotations

from typing import Any

from arrivals.scenarios.reproduce import rooms, sphere
from arrivals.scenarios.reproduce.ar_kalman import own_claims as own_ar
from arrivals.scenarios.reproduce.ar_kalman import paper_claims as autoregressive
from arrivals.scenarios.reproduce.claims import Claim, Verdict
from arrivals.scenarios.reproduce.interpolation import own_claims as own_interpolation
from arrivals.scenarios.reproduce.interpolation import paper_claims as interpolation
from arrivals.scenarios.reproduce.rss import own_claims as own_rss
from arrivals.scenarios.reproduce.signal_strength import doppler, envelope_decisions, network
from arrivals.scenarios.reproduce.signal_strength import paper_claims as signal_strength
from arrivals.scenarios.reproduce.svalse import any_array, calibration
from arrivals.scenarios.reproduce.svalse import own_claims as own_svalse
from arrivals.scenarios.reproduce.svalse import paper_claims as svalse
from arrivals.scenarios.reproduce.swellex96 import decisions as own_sea
from arrivals.scenarios.reproduce.swellex96 import paper_claims as sea
from arrivals.scenarios.reproduce.swellex96 import ranges as sea_ranges

PAPERS: tuple[Claim, ...] = (
    *svalse.CLAIMS,
    *sea.CLAIMS,
    *autoregressive.CLAIMS,
    *interpolation.CLAIMS,
    *signal_strength.CLAIMS,
)
OWN: tuple[Claim, ...] = (
    *own_svalse.CLAIMS,
    *own_sea.CLAIMS,
    *sea_ranges.CLAIMS,
    *own_ar.CLAIMS,
    *own_interpolation.CLAIMS,
    *own_rss.CLAIMS,
    *any_array.CLAIMS,
    *rooms.CLAIMS,
    *sphere.CLAIMS,
    *calibration.CLAIMS,
    *envelope_decisions.CLAIMS,
    *doppler.CLAIMS,
    *network.CLAIMS,
)
CLAIMS = (*PAPERS, *OWN)


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
