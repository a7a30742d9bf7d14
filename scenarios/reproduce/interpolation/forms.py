"""Forms of the interpolation-delay filter by which a claim is decided.

The paper's form is the loop of its section 2.4 with the index of (4), "frozen", beside which the
numbers of the loop as printed, "literal", are given; ours is the default of the library, "C".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from arrivals.scenarios.reproduce.decisions import WORDS, Both, Decide, Decision
from arrivals.scenarios.reproduce.interpolation.decisions import Results

PAPER, PRINTED, OURS = "frozen", "literal", "C"
SOURCE_NAMES = {"tone": "a tone", "band": "a band", "qpc": "coupled tones"}


def by_both(
    decide: Callable[..., Decision | None], also: str = "", beside: str = "", **options: Any
) -> Both:
    """Return a function that decides by the paper's form, and one by the default of the library.

    Parameters
    ----------
    decide : callable
        `decide(method, results, **options)`.
    also : str
        Another form of ours, with its numbers and decision behind those that decide.
    beside : str
        Another source, with the numbers of the paper's form.
    **options
        Of `decide`.
    """
    return (
        partial(_by_paper, decide, beside, options),
        partial(_by_ours, decide, also, options),
    )


def _by_paper(
    decide: Callable[..., Decision | None],
    beside: str,
    options: Mapping[str, Any],
    results: Results,
) -> Decision | None:
    decision = decide(PAPER, results, **options)
    if decision is None:
        return None
    others = [("as printed", decide(PRINTED, results, **options))]
    if beside:
        elsewhere = decide(PAPER, results, **{**options, "source": beside})
        others.append((f"on {SOURCE_NAMES[beside]}", elsewhere))
    found = [f"; {name} {one.numbers}" for name, one in others if one is not None]
    return Decision(decision.holds, decision.numbers + "".join(found))


def _by_ours(
    decide: Callable[..., Decision | None], also: str, options: Mapping[str, Any], results: Results
) -> Decision | None:
    decision = decide(OURS, results, **options)
    other = decide(also, results, **options) if also else None
    if decision is None or other is None:
        return decision
    return Decision(decision.holds, f"{decision.numbers}; {other.numbers}: {WORDS[other.holds]}")


def by_scan(
    decide: Callable[..., Decision | None], method: str, beside: str, **options: Any
) -> tuple[Decide]:
    """Return a function that decides by a scan, which is the same for all forms of the filter."""
    return (partial(_by_scan, decide, method, beside, options),)


def _by_scan(
    decide: Callable[..., Decision | None],
    method: str,
    beside: str,
    options: Mapping[str, Any],
    results: Results,
) -> Decision | None:
    decision = decide(method, results, **options)
    other = decide(method, results, **{**options, "source": beside})
    if decision is None or other is None:
        return decision
    return Decision(
        decision.holds, f"{decision.numbers}; on {SOURCE_NAMES[beside]} {other.numbers}"
    )
