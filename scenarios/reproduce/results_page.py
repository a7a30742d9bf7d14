"""One page of all that studies found, from the pages that they have written."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import arrivals
from arrivals.files import atomic_write

MARK = "<!-- arrivals "
HOLD, FAIL = ("Holds", "Reproduced"), ("Does not hold", "Not reproduced", "Not confirmed")
VERDICTS = (*HOLD, *FAIL, "Not decided")
# What a study's name begins with, and whose claims it holds.
PAPERS = {
    "svalse": "Park, Meyer and Gerstoft, 2023: SVALSE",
    "swellex96": "Park, Meyer and Gerstoft, 2023: SVALSE at sea",
    "ar": "Gu, Chan, Zhu and Swamy, 2013, and Magakian's report, 2024: autoregressive sources",
    "interpolation": "The interpolation-delay filter",
    "rss": "Cevher, Sankaranarayanan and Chellappa, 2008: positions from signal strength",
    "any": "Any array: nothing of it is published",
}


def add_stamp(text: str, stamp: Mapping[str, Any]) -> str:
    r"""Return a study's page with what it was made of at its end, where no reader sees it.

    Examples
    --------
    >>> print(add_stamp("# Two\n", {"runs": 2}))
    # Two
    <BLANKLINE>
    <!-- arrivals {"runs": 2} -->
    <BLANKLINE>
    """
    return f"{text}\n{MARK}{json.dumps(dict(stamp), sort_keys=True)} -->\n"


def read_stamp(page: Path) -> dict[str, Any] | None:
    """Return what a study's page was made of; None if there is no such page, or no stamp."""
    try:
        last = page.read_text(encoding="utf-8").splitlines()[-1]
        found: dict[str, Any] = json.loads(last.removeprefix(MARK).removesuffix(" -->"))
    except (OSError, ValueError, IndexError):
        return None
    return found if last.startswith(MARK) and isinstance(found, dict) else None


def write_page(path: Path, names: Sequence[str], folder: Path, command: str) -> None:
    """Write the pages of some studies as one: contents, then a section for each.

    Parameters
    ----------
    path : Path
    names : sequence of str
        Studies that have written NAME.md.
    folder : Path
        Where.
    command : str
        What writes this page.
    """
    pages = {name: (folder / f"{name}.md").read_text(encoding="utf-8") for name in _ordered(names)}
    contents, sections, paper = [], [], ""
    for name, text in pages.items():
        if paper != _paper(name):
            paper = _paper(name)
            contents += ["", f"**{paper}**", ""]
            sections += [f"## {paper}", ""]
        contents.append(f"* [{_title(text)}](#{name}){_verdicts(text)}")
        sections.append(_section(name, text, read_stamp(folder / f"{name}.md")))
    head = (
        "# Results\n\nOur numbers beside the papers', and a line on each claim that has one. "
        f"Written by\n\n    {command}\n\nwith arrivals {arrivals.__version__}; each study's "
        "pictures and CSV lie beside its own page."
        f"{' What is finished is not run again.' if len(names) > 1 else ''}\n"
    )
    with atomic_write(path) as file:
        file.write("\n".join([head.rstrip(), *contents, "", *sections]).rstrip() + "\n")


def _ordered(names: Sequence[str]) -> list[str]:
    """Return the names paper by paper."""
    papers = list(PAPERS.values())
    place = {name: papers.index(_paper(name)) if _paper(name) in papers else 99 for name in names}
    return sorted(names, key=place.__getitem__)


def _paper(name: str) -> str:
    return PAPERS.get(name.partition("-")[0], "Others")


def _title(text: str) -> str:
    return text.partition("\n")[0].removeprefix("# ")


def _verdicts(text: str) -> str:
    r"""Return how many claims hold, if the study says so line by line.

    Examples
    --------
    >>> _verdicts("Holds: a (1).\n\nHolds: b (2).\n\nDoes not hold: c (3).\n")
    ': 2 claims hold, 1 does not'
    """
    said = [line.partition(": ")[0] for line in text.splitlines()]
    hold, fail, open_ = (sum(map(said.count, kind)) for kind in (HOLD, FAIL, ("Not decided",)))
    if hold + fail + open_ == 0:
        return ""
    told = f": {hold} claim{'s' * (hold != 1)} hold{'s' * (hold == 1)}, "
    told += f"{fail} do{'es' * (fail == 1)} not"
    return told + (f", {open_} not decided" if open_ else "")


def _section(name: str, text: str, stamp: Mapping[str, Any] | None) -> str:
    """Return a study's page a level deeper, without pictures and stamp; claims as a list."""
    title, *lines = text.splitlines()
    kept = [line for line in lines if not line.startswith(("![", MARK))]
    told = ""
    if stamp is not None:
        runs = stamp["runs"]
        told = f", seed {stamp['seed']}, {runs} run{'s' * (runs != 1)}, arrivals {stamp['version']}"
    body = "\n".join(kept).strip()
    while "\n\n\n" in body:
        body = body.replace("\n\n\n", "\n\n")
    for said in VERDICTS:
        body = body.replace(f"\n{said}: ", f"\n* **{said}**: ")
    body = re.sub(r"(\n\* \*\*.*)\n(?=\n\* \*\*)", r"\1", body)  # one list
    return f'<a id="{name}"></a>\n\n##{title}\n\n`arrivals reproduce {name}`{told}.\n\n{body}\n'
