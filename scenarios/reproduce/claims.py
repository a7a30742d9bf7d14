"""Verdicts on the claims of a paper: one line each."""

from __future__ import annotations


def verdict(claim: str, fact: bool | None, numbers: str) -> str:
    """Return the line of a claim: it holds, does not hold, or is not decided (None).

    Examples
    --------
    >>> verdict("one below two", 1 < 2, "1 and 2")
    'Holds: one below two (1 and 2).'
    """
    word = "Not decided" if fact is None else "Holds" if fact else "Does not hold"
    return f"{word}: {claim} ({numbers})."


def negative(mean: float, error: float) -> bool | None:
    """Return True if a mean is below zero, None if it is within two standard errors of zero.

    Examples
    --------
    >>> negative(-1.0, 0.1), negative(-0.1, 0.1), negative(-1.0, float("nan"))
    (True, None, None)
    """
    return mean < 0 if abs(mean) > 2 * error else None
