"""Claims and the verdicts on them: one line each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from arrivals.scenarios.reproduce.decisions import WORDS, Decide, Decision

Source = Literal["paper", "ours", "check"]
HEADINGS: dict[Source, str] = {
    "paper": "Claims of the paper",
    "ours": "What this library adds",
    "check": "Checks of these programs",
}
FORMS = ("by the paper's form", "by ours")


@dataclass(frozen=True, eq=False)
class Claim:
    """A claim, and the functions that decide it from the results of a study.

    A function returns None where a study has left out what it needs.

    Parameters
    ----------
    study : str
        Name of the study.
    place : str
        Section, figure or table of the paper; empty for claims of our own.
    text : str
        The claim in our words.
    by_paper, by_ours : callable, optional
        Decisions by the form that the paper prints, and by the defaults of this library.
    source : {"paper", "ours", "check"}
        A claim of the authors, one of this library, or a check of these programs.
    """

    study: str
    place: str
    text: str
    by_paper: Decide | None = None
    by_ours: Decide | None = None
    source: Source = "paper"

    def decide(self, results: Any) -> Verdict:
        """Return the verdict by the results of the study."""
        return Verdict(
            self,
            self.by_paper and self.by_paper(results),
            self.by_ours and self.by_ours(results),
        )


@dataclass(frozen=True, eq=False)
class Verdict:
    """A claim and its decisions, None where there is none by that form.

    Parameters
    ----------
    claim : Claim
    by_paper, by_ours : Decision or None
    """

    claim: Claim
    by_paper: Decision | None
    by_ours: Decision | None

    @property
    def holds(self) -> bool | None:
        """The decision by the paper's form, by ours for a claim without one; None if not decided.

        Where a run leaves out the paper's form, ours does not decide in its place.
        """
        decision = self.by_ours if self.claim.by_paper is None else self.by_paper
        return None if decision is None else decision.holds

    def line(self) -> str:
        """Return the claim and its decisions as an item of a list.

        Examples
        --------
        >>> claim = Claim("svalse-fig4", "Fig. 4", "one is below two", lambda r: Decision(True, r))
        >>> print(claim.decide("1 and 2").line())
        * Fig. 4: one is below two. **Holds** by the paper's form (1 and 2).
        """
        parts = [
            f"**{WORDS[decision.holds].capitalize()}** {form} ({decision.numbers})."
            for form, decision in zip(FORMS, (self.by_paper, self.by_ours), strict=True)
            if decision is not None
        ]
        if self.claim.source != "paper":
            parts = [part.replace(f" {FORMS[1]}", "") for part in parts]
        place = f"{self.claim.place}: " if self.claim.place else ""
        decisions = " ".join(parts) or "**Not decided**: left out of this run."
        return f"* {place}{self.claim.text}. {decisions}"


def sections(verdicts: Sequence[Verdict]) -> list[str]:
    """Return the verdicts as Markdown: one heading and list for each source."""
    lines: list[str] = []
    for source, heading in HEADINGS.items():
        items = [verdict.line() for verdict in verdicts if verdict.claim.source == source]
        if items:
            lines += ["", f"**{heading}**", "", *items]
    return lines


def counts(verdicts: Iterable[Verdict]) -> dict[str, list[int]]:
    """Return for each source how many claims hold, do not hold and are not decided.

    Examples
    --------
    >>> claim = Claim("svalse-fig4", "Fig. 4", "one is below two", lambda r: Decision(r, ""))
    >>> counts([claim.decide(True), claim.decide(None)])
    {'paper': [1, 0, 1]}
    """
    table: dict[str, list[int]] = {}
    for verdict in verdicts:
        row = table.setdefault(verdict.claim.source, [0, 0, 0])
        row[(True, False, None).index(verdict.holds)] += 1
    return table
