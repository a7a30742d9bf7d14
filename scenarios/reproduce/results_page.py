"""Results page: the pages of all studies joined, with contents and verdicts."""

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
# Prefix of a study's name: paper, heading of its section
PAPERS = {
    "svalse": "Park, Meyer and Gerstoft, 2023: SVALSE",
    "swellex96": "Park, Meyer and Gerstoft, 2023: SVALSE at sea",
    "ar": "Gu, Chan, Zhu and Swamy, 2013, and Magakian's report, 2024: autoregressive sources",
    "interpolation": "The interpolation-delay filter",
    "rss": "Cevher, Sankaranarayanan and Chellappa, 2008: positions from signal strength",
    "any": "Any array: no published results",
    "calibration": "Stated deviations and existence: no published results",
}


def add_stamp(text: str, stamp: Mapping[str, Any]) -> str:
    r"""Return a study's page with its configuration as a comment in the last line.

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
    """Return the configuration in the last line of a page; None if it is missing."""
    try:
        last = page.read_text(encoding="utf-8").splitlines()[-1]
        stamp: dict[str, Any] = json.loads(last.removeprefix(MARK).removesuffix(" -->"))
    except (OSError, ValueError, IndexError):
        return None
    return stamp if last.startswith(MARK) and isinstance(stamp, dict) else None


def write_page(path: Path, names: Sequence[str], folder: Path, command: str) -> None:
    """Write the pages of several studies as one: contents, then one section a study.

    Parameters
    ----------
    path : Path
        The page.
    names : sequence of str
        Names of the studies.
    folder : Path
        Folder of their pages NAME.md.
    command : str
        Command line that writes this page.
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
        "# Results\n\nOur results beside those of the papers, with one line on each claim. "
        f"Written by\n\n    {command}\n\nwith arrivals {arrivals.__version__}; figures and CSV "
        "files are next to each study's own page."
        f"{' Finished studies are not run again.' if len(names) > 1 else ''}\n"
    )
    with atomic_write(path) as file:
        file.write("\n".join([head.rstrip(), *contents, "", *sections]).rstrip() + "\n")


def _ordered(names: Sequence[str]) -> list[str]:
    """Return the names sorted by paper."""
    papers = list(PAPERS.values())
    order = {name: papers.index(_paper(name)) if _paper(name) in papers else 99 for name in names}
    return sorted(names, key=order.__getitem__)


def _paper(name: str) -> str:
    return PAPERS.get(name.partition("-")[0], "Others")


def _title(text: str) -> str:
    return text.partition("\n")[0].removeprefix("# ")


def _verdicts(text: str) -> str:
    r"""Return the numbers of claims that hold and do not, if a page has verdicts.

    Examples
    --------
    >>> _verdicts("Holds: a (1).\n\nHolds: b (2).\n\nDoes not hold: c (3).\n")
    ': 2 claims hold, 1 does not'
    """
    words = [line.partition(": ")[0] for line in text.splitlines()]
    hold, fail, open_ = (sum(map(words.count, kind)) for kind in (HOLD, FAIL, ("Not decided",)))
    if hold + fail + open_ == 0:
        return ""
    summary = f": {hold} claim{'s' * (hold != 1)} hold{'s' * (hold == 1)}, "
    summary += f"{fail} do{'es' * (fail == 1)} not"
    return summary + (f", {open_} not decided" if open_ else "")


def _section(name: str, text: str, stamp: Mapping[str, Any] | None) -> str:
    """Return a study's page one level deeper, without figures and stamp; claims as a list."""
    title, *lines = text.splitlines()
    kept = [line for line in lines if not line.startswith(("![", MARK))]
    origin = ""
    if stamp is not None:
        runs = f"{stamp['runs']} run{'s' * (stamp['runs'] != 1)}"
        origin = f", seed {stamp['seed']}, {runs}, arrivals {stamp['version']}"
    body = "\n".join(kept).strip()
    while "\n\n\n" in body:
        body = body.replace("\n\n\n", "\n\n")
    for word in VERDICTS:
        body = body.replace(f"\n{word}: ", f"\n* **{word}**: ")
    body = re.sub(r"(\n\* \*\*.*)\n(?=\n\* \*\*)", r"\1", body)  # one list
    return f'<a id="{name}"></a>\n\n##{title}\n\n`arrivals reproduce {name}`{origin}.\n\n{body}\n'
