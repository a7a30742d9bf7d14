"""Compare the verdicts of two results pages: python benchmarks/verdict_changes.py FULL QUICK.

Prints the claims that hold on one page and do not on the other, and counts those decided on one
page only.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from pathlib import Path

VERDICT = re.compile(r"\*\*(Holds|Does not hold|Not decided)\*\*( by the paper's form| by ours|)")
DECIDED = ("Holds", "Does not hold")


def verdicts(page: Path) -> dict[tuple[str, str, str], str]:
    """Return the verdicts of a page by study, claim and form."""
    found: dict[tuple[str, str, str], str] = {}
    study = ""
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith('<a id="'):
            study = line.split('"')[1]
        elif line.startswith("* ") and (marks := VERDICT.findall(line)):
            claim = line[2 : line.index("**")].strip()
            for verdict, form in marks:
                found[study, claim, form] = verdict
    return found


def main() -> None:
    """Print what changed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("full", type=Path)
    parser.add_argument("quick", type=Path)
    pages = parser.parse_args()
    full, quick = verdicts(pages.full), verdicts(pages.quick)
    pairs = Counter((full[key], quick[key]) for key in full if key in quick)
    for (first, second), count in sorted(pairs.items()):
        print(f"{count:4d}  {first} -> {second}")
    flips = [k for k in full if k in quick and {full[k], quick[k]} == set(DECIDED)]
    print(f"{len(flips)} of {sum(pairs.values())} verdicts flip")
    for key in flips:
        study, claim, form = key
        print(f"  {study}: {claim}{form}: {full[key]} -> {quick[key]}")


if __name__ == "__main__":
    main()
