"""The table of claims, and the page of results that shows each of them once."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from arrivals.scenarios.reproduce.claims import Claim, counts
from arrivals.scenarios.reproduce.decisions import Decision
from arrivals.scenarios.reproduce.paper_claims import CLAIMS, OWN, PAPERS
from arrivals.scenarios.reproduce.results_page import add_stamp, write_page
from arrivals.scenarios.reproduce.studies import STUDIES

PAGE = Path(__file__).parents[3] / "docs" / "results.md"


def items(page: str) -> list[tuple[str, str]]:
    """Return the items of all lists of verdicts: study, and claim without its verdicts."""
    study, found = "", []
    for line in page.splitlines():
        if match := re.match(r'<a id="(.*)"></a>', line):
            study = match[1]
        elif match := re.match(r"\* (.*?) \*\*(Holds|Does not hold|Not decided)\*\*", line):
            found.append((study, match[1]))
    return found


def item(claim: Claim) -> tuple[str, str]:
    place = f"{claim.place}: " if claim.place else ""
    return claim.study, f"{place}{claim.text}."


def test_page_of_results_shows_each_claim_once() -> None:
    assert Counter(items(PAGE.read_text(encoding="utf-8"))) == Counter(map(item, CLAIMS))


def test_claims_belong_to_studies_and_differ() -> None:
    assert {claim.study for claim in CLAIMS} <= set(STUDIES)
    assert max(Counter(map(item, CLAIMS)).values()) == 1
    assert all(claim.by_paper or claim.by_ours for claim in CLAIMS)


def test_claims_of_papers_name_a_place_and_stand_apart_from_ours() -> None:
    assert all(claim.source == "paper" and claim.place for claim in PAPERS)
    assert len(PAPERS) + len(OWN) == len(CLAIMS)


@pytest.mark.parametrize("name", sorted({claim.study for claim in CLAIMS}))
def test_pictures_and_tables_of_the_page_exist(name: str) -> None:
    page = PAGE.read_text(encoding="utf-8")
    links = re.findall(rf"\((results/{name}[-.][^)]*)\)", page)
    assert f"results/{name}.csv" in links
    for link in links:
        path = PAGE.parent / link
        assert path.stat().st_size <= 150_000 or path.suffix == ".csv", link


def test_ours_does_not_decide_where_the_papers_form_is_left_out() -> None:
    ours = Decision(False, "1")
    both = Claim("rss", "Sec. 1", "one", lambda _: None, lambda _: ours)
    alone = Claim("rss", "Sec. 1", "two", None, lambda _: ours)
    verdicts = [both.decide(None), alone.decide(None)]
    assert counts(verdicts) == {"paper": [0, 1, 1]}
    assert "**Does not hold** by ours" in verdicts[0].line()


def test_page_copies_what_it_shows_of_each_study_once(tmp_path: Path) -> None:
    folder, names = tmp_path / "runs", ("rss", "rss-doppler")
    folder.mkdir()
    stamp = {"runs": 2, "seed": 0, "version": "0.1.0", "verdicts": {"check": [1, 2, 3]}}
    for name in names:
        for path in (f"{name}.csv", f"{name}-lead.png", f"{name}-stale.png"):
            (folder / path).write_bytes(b"")
        text = add_stamp(f"# {name}\n\n![{name}-lead.png]({name}-lead.png)\n", stamp)
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    written = write_page(tmp_path / "page.md", names, folder, "arrivals")
    assert sorted(path.name for path in written) == sorted(
        ["page.md", *(f"{name}{end}" for name in names for end in (".csv", "-lead.png"))]
    )
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert page.count("![") == page.count("](page/rss-lead.png)") + page.count("doppler-lead.png)")
    assert "| - | - | - | - | - | 2 / 4 / 6 |" in page  # claims of both studies together
