"""The claims of the paper on SVALSE at sea."""

from __future__ import annotations

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.swellex96 import decisions as sea

# fmt: off
CLAIMS: tuple[Claim, ...] = (
    *(Claim("swellex96", "Sec. VIII, Fig. 12", f"{text}, steps 1 to 100", *sea.lower(*decide))
      for text, decide in (
        ("VALSE has a better resolution than CBF: less missed", ("missed", "valse", "cbf")),
        ("SVALSE has a better resolution than CBF: less missed", ("missed", "svalse", "cbf")),
        ("SVALSE is more accurate than VALSE: GOSPA", ("gospa", "svalse", "valse")),
        ("SVALSE distinguishes more of the paths than VALSE: less missed",
         ("missed", "svalse", "valse")))),
    *(Claim("swellex96", "Sec. VIII", text, decide) for text, decide in sea.FIELD),
)
# fmt: on
