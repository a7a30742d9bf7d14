"""Results page: a paragraph on each paper, then the figure, table and claims of every study."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import arrivals
from arrivals.files import atomic_write

MARK = "<!-- arrivals "
SOURCES = ("paper", "ours", "check")
PICTURE = re.compile(r"!\[(.*?)\]\((.*?)\)")


class Paper(NamedTuple):
    """A paper: prefix of its studies' names, heading, citation, and what it proposes."""

    prefix: str
    heading: str
    citation: str
    paragraph: str


PAPERS = (
    Paper(
        "svalse",
        "Sequential direction finding: SVALSE",
        "Y. Park, F. Meyer and P. Gerstoft, *Graph-based sequential beamforming*, JASA 153(1), "
        "2023",
        "Directions of an unknown number of sources by variational Bayes, from step to step with a "
        "Bernoulli-von Mises motion model. The paper has single runs of three scenes, and sweeps "
        "of the SNR; here each scene has many runs, beside the conventional beamformer (`cbf`), "
        "its peaks tracked by Kalman filters (`peaks_gnn`), sparse Bayesian learning (`sbl`, and "
        "`ssbl` with memory) and the method without memory (`valse`).",
    ),
    Paper(
        "swellex96",
        "SVALSE at sea",
        "the same paper, Sec. VIII",
        "A tow past a vertical line of hydrophones; the field is simulated, as the recordings are "
        "too large to ship.",
    ),
    Paper(
        "ar",
        "Directions and signals of autoregressive sources",
        "J.-F. Gu, S. C. Chan, W.-P. Zhu and M. N. S. Swamy, *Joint DOA estimation and source "
        "signal tracking with Kalman filtering and regularized QRD RLS algorithm*, IEEE Trans. "
        'Circuits and Systems II 60(1), 2013; H. Magakian, *Paper analysis*, 2024 ("the report")',
        "A Kalman filter estimates the source signals, regressions estimate directions and "
        "coefficients from them.",
    ),
    Paper(
        "interpolation",
        "The interpolation-delay filter",
        "K. Radhakrishnan, A. Unnikrishnan and K. G. Balakrishnan, *Performance evaluation of an "
        "algorithm for estimation of DOA using model estimation technique*",
        "An extended Kalman filter of the delay between sensors, which interpolates between "
        "samples. literal is the paper's loop as printed; frozen is that loop with the index of "
        "(4), and is judged as the paper's form. B renews the coefficients at each sensor, C, the "
        "default, has eight taps and both directions along the array, D more baselines, E a phasor "
        "on all sensors, and E2 is E on the record twice.",
    ),
    Paper(
        "rss",
        "Positions from signal strength",
        "V. Cevher, A. C. Sankaranarayanan and R. Chellappa, *Factorized variational "
        "approximations for acoustic multi source localization*, ICASSP 2008",
        "A log-normal model of the envelope at each sensor, and a factorised variational posterior "
        "(VB) of the positions and powers of several sources, against maximum likelihood (ML).",
    ),
    Paper("any", "Any array", "no published results", "SVALSE on circles and sparse lines."),
    Paper(
        "sphere",
        "Azimuth and elevation",
        "no published results",
        "SVALSE with two unknowns a source, on arrays in a plane and in space: two sources that "
        "cross in azimuth, one over the zenith, and one at the horizon.",
    ),
    Paper(
        "rooms",
        "Talkers in rooms",
        "no published results",
        "Speech with pauses and reflections, received by small arrays: the mixture over bins "
        "(`wideband_mixture`), SVALSE with white and with diffuse noise, and the beamformer "
        "(`cbf`).",
    ),
    Paper(
        "calibration",
        "Uncertainties",
        "no published results",
        "Whether the stated deviations and probabilities of existence of SVALSE are true.",
    ),
)
OTHERS = Paper("", "Others", "", "")
ABBREVIATIONS = (
    "GOSPA is the mean over the steps of the sum of the distances of estimates to sources and half "
    "the cut-off (10 degrees) for each missed source and each false estimate; RMSE ignores false "
    "estimates, and counts the cut-off for missed sources. ± is a standard error.\n\n"
    "Each claim of a paper is decided by the form that it prints and, where they differ, by ours; "
    "differences within two standard errors are not decided. The counts of a paper's claims are by "
    "its own form where there is one. What this library adds, and checks of these programs against "
    "limits that we set, are counted apart."
)


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


def write_page(path: Path, names: Sequence[str], folder: Path, command: str) -> list[Path]:
    """Write the pages of several studies as one, and its tables and pictures beside it.

    They lie in a folder of the page's name without its suffix, unless that is `folder`.

    Parameters
    ----------
    path : Path
        The page.
    names : sequence of str
        Names of the studies.
    folder : Path
        Folder of their pages NAME.md, tables and pictures.
    command : str
        Command line that writes this page.

    Returns
    -------
    list of Path
        Files written.
    """
    if path.parent.resolve() == folder.resolve():
        beside, written = "", []
    else:
        beside, written = f"{path.stem}/", _copy(names, folder, path.with_suffix(""))
    stamps = {name: read_stamp(folder / f"{name}.md") or {} for name in names}
    lines: list[str] = []
    for paper in (*PAPERS, OTHERS):
        mine = [name for name in names if _paper(name) == paper]
        if mine:
            texts = [(folder / f"{name}.md").read_text(encoding="utf-8") for name in mine]
            lines += [f"## {paper.heading}", "", f"{paper.citation}.", "", paper.paragraph, ""]
            lines += [f"* [{text.splitlines()[0].lstrip('# ')}](#{name})"
                      for name, text in zip(mine, texts, strict=True)]  # fmt: skip
            lines += ["", *(_section(name, text, stamps[name], beside)
                            for name, text in zip(mine, texts, strict=True))]  # fmt: skip
    head = (
        "# Results\n\nOur results beside those of the papers, with a verdict on each claim. "
        f"Written by\n\n    {command}\n\nwith arrivals {arrivals.__version__}; finished studies "
        f"are not run again.\n\n{_summary(stamps)}\n{ABBREVIATIONS}\n"
    )
    with atomic_write(path) as file:
        file.write("\n".join([head, *lines]).rstrip() + "\n")
    return [*written, path]


def _copy(names: Sequence[str], folder: Path, target: Path) -> list[Path]:
    target.mkdir(exist_ok=True)
    copies = []
    for name in names:
        page = (folder / f"{name}.md").read_text(encoding="utf-8")
        pictures = [picture for _, picture in PICTURE.findall(page)]
        for source in (folder / one for one in (f"{name}.csv", *pictures)):
            with atomic_write(target / source.name, binary=True) as file:
                file.write(source.read_bytes())
            copies.append(target / source.name)
    return copies


def _summary(stamps: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the table of claims: how many of each paper hold, do not, and are not decided."""
    lines = ["| | claims of the paper | hold | do not | not decided | ours: hold / do not / not "
             "decided | checks: pass / fail / not decided |",
             "| --- | --- | --- | --- | --- | --- | --- |"]  # fmt: skip
    for paper in (*PAPERS, OTHERS):
        mine = [s.get("verdicts", {}) for name, s in stamps.items() if _paper(name) == paper]
        if mine:
            paper_s, *own = (
                np.sum([verdicts.get(source, (0, 0, 0)) for verdicts in mine], axis=0)
                for source in SOURCES
            )
            cells = [paper_s.sum(), *paper_s] if paper_s.any() else ["-"] * 4
            others = [" / ".join(map(str, counted)) if counted.any() else "-" for counted in own]
            heading = f"[{paper.heading}](#{_anchor(paper.heading)})"
            lines.append(f"| {' | '.join(map(str, [heading, *cells, *others]))} |")
    return "\n".join(lines) + "\n"


def _anchor(heading: str) -> str:
    """Return the anchor of a heading.

    Examples
    --------
    >>> _anchor("Sequential direction finding: SVALSE")
    'sequential-direction-finding-svalse'
    """
    return re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-")


def _paper(name: str) -> Paper:
    prefix = name.partition("-")[0]
    return next((paper for paper in PAPERS if paper.prefix == prefix), OTHERS)


def _section(name: str, text: str, stamp: Mapping[str, Any], beside: str) -> str:
    """Return a study's page one level deeper, with links to its table and pictures."""
    title, *lines = text.splitlines()
    body = "\n".join(line for line in lines if not line.startswith(MARK)).strip()
    body = re.sub(r"\n{3,}", "\n\n", PICTURE.sub(rf"![\1]({beside}\2)", body))
    origin = ""
    if stamp:
        runs = f"{stamp['runs']} run{'s' * (stamp['runs'] != 1)}"
        origin = f", seed {stamp['seed']}, {runs}, arrivals {stamp['version']}"
    table = f"[all columns]({beside}{name}.csv)"
    return (f'<a id="{name}"></a>\n\n##{title}\n\n`arrivals reproduce {name}`{origin}; {table}.'
            f"\n\n{body}\n")  # fmt: skip
