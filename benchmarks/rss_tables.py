"""Rows of the tables of the signal-strength benchmarks, and their verdicts."""

from __future__ import annotations

WITHIN: list[bool] = []  # of the rows with a limit


def line(what: str, ours: str, wanted: str, passed: bool | None = None) -> None:
    """Print a row; what has a limit counts as passed or not."""
    verdict = "" if passed is None else "yes" if passed else "**no**"
    if passed is not None:
        WITHIN.append(passed)
    print(f"| {what} | {ours} | {wanted} | {verdict} |", flush=True)


def heading(title: str) -> None:
    print(f"\n{title}\n\n| | ours | specification | within |\n|---|---|---|---|")


def between(value: float, low: float, high: float) -> bool:
    return bool(low <= value <= high)
