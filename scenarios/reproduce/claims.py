"""Claims, functions that decide them, and verdicts: one line each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

Source = Literal["paper", "ours", "check"]
HEADINGS: dict[Source, str] = {
    "paper": "Claims of the paper",
    "ours": "What this library adds",
    "check": "Checks of these programs",
}
FORMS = ("by the paper's form", "by ours")
WORDS = {True: "holds", False: "does not hold", None: "not decided"}


class Decision(NamedTuple):
    """Whether a claim holds, and the numbers that decide it.

    Parameters
    ----------
    holds : bool or None
        None where the runs do not decide it.
    numbers : str
        The numbers, with their units.
    """

    holds: bool | None
    numbers: str


Decide: TypeAlias = Callable[[Any], Decision | None]


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


def negative(mean: float, error: float) -> bool | None:
    """Return True if a mean is below zero, None if it is within two standard errors of zero.

    Examples
    --------
    >>> negative(-1.0, 0.1), negative(-0.1, 0.1), negative(-1.0, float("nan"))
    (True, None, None)
    """
    return mean < 0 if abs(mean) > 2 * error else None


def all_of(decisions: Iterable[bool | None]) -> bool | None:
    """Return True if all hold, False if one does not, else None.

    Examples
    --------
    >>> all_of([True, None]), all_of([None, False])
    (None, False)
    """
    found = set(decisions)
    return False if False in found else None if None in found else True


def below(lower: ArrayLike, higher: ArrayLike, unit: str = "") -> Decision:
    """Decide by paired runs that one figure is below another.

    Parameters
    ----------
    lower, higher : array_like, shape (n_runs,)
    unit : str
        Unit of the figures.

    Examples
    --------
    >>> below([1.0, 1.2, 1.1], [2.0, 2.1, 2.3])
    Decision(holds=True, numbers='1.1 and 2.13, paired difference -1.03 ± 0.09')
    """
    first, second = np.asarray(lower, dtype=float), np.asarray(higher, dtype=float)
    d = first - second
    error = float(d.std(ddof=1) / np.sqrt(len(d))) if len(d) > 1 else np.nan
    of = f" {unit}" if unit else ""
    means = f"{first.mean():.3g} and {second.mean():.3g}{of}"
    spread = f"paired difference {d.mean():.2f} ± {error:.2f}" if len(d) > 1 else "one run"
    return Decision(negative(float(d.mean()), error), f"{means}, {spread}")
