"""Claims of our own on positions from signal strength."""

from __future__ import annotations

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.rss.convergence_decisions import jumps_mostly
from arrivals.scenarios.reproduce.rss.decisions import LITERAL, OURS, between_cases
from arrivals.scenarios.reproduce.rss.published_values import SEVEN, THREE

# fmt: off
CLAIMS: tuple[Claim, ...] = (
    *(Claim("rss", "", f"{case}: with the prior kept fixed VB has a smaller location error than "
            "Algorithm 1", None, between_cases("location_rms", (case, OURS), (case, LITERAL)),
            "ours") for case in (THREE, SEVEN)),
    *(Claim("rss", "", f"{case}: undamped and parallel with a fixed prior, a cycle of VB moves a "
            "source by more than 100 m in most trials", None, jumps_mostly(case, "vb_undamped"),
            "ours")
      for case in (THREE, SEVEN)),
)
# fmt: on
