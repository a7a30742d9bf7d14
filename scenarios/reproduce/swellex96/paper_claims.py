"""The claims of the paper on SVALSE at sea."""

from __future__ import annotations

from functools import partial

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.swellex96 import decisions as sea

# fmt: off
CLAIMS: tuple[Claim, ...] = (
    *(Claim("swellex96", "Sec. VIII, Fig. 12", f"{text}, steps 1 to 100", *sea.lower(*decide))
      for text, decide in (
        ("VALSE has a better resolution than CBF: a smaller missed part of GOSPA",
         ("missed", "valse", "cbf")),
        ("SVALSE has a better resolution than CBF: a smaller missed part of GOSPA",
         ("missed", "svalse", "cbf")),
        ("SVALSE is more accurate than VALSE: a lower GOSPA", ("gospa", "svalse", "valse")),
        ("SVALSE distinguishes more of the paths than VALSE: a smaller missed part of GOSPA",
         ("missed", "svalse", "valse")))),
    *(Claim("swellex96", "Sec. VIII", text, by_ours=partial(sea.of_field, decide))
      for text, decide in sea.FIELD),
)
# fmt: on
