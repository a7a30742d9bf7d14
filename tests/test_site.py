"""Parts of the build of the documentation site that need no Sphinx, and its command."""

import importlib
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("measurement_models", "motion_models", "plots", "recordings", "scenarios", "trackers")


@pytest.fixture
def markdown(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("site_tools.markdown")


@pytest.fixture
def check_site(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("site_tools.check_site")


@pytest.mark.parametrize(
    ("link", "expected"),
    [
        ("[r](results.md#svalse-fig4)", "[r](#svalse-fig4)"),  # an anchor in raw HTML
        ("[r](svalse.md#any-array)", "[r](svalse.md#any-array)"),  # a heading
        ("[c](../CONTRIBUTING.md#commits)", "[c](contributing.md#commits)"),
        ("[g](gallery/plot_tow.py)", "[g](auto_gallery/plot_tow.rst)"),
        ("[g](gallery)", "[g](auto_gallery/index.rst)"),
        ("![p](choose.png)", "![p](choose.png)"),
        ("[w](https://example.org/a)", "[w](https://example.org/a)"),
    ],
)
def test_links_lead_to_pages_of_the_site(markdown: ModuleType, link: str, expected: str) -> None:
    assert markdown.rewritten(link, Path("docs/page.md")) == expected


def test_links_of_a_page_in_a_folder_go_up(markdown: ModuleType) -> None:
    text = markdown.rewritten("[c](../../CONTRIBUTING.md#commits)", Path("docs/start/page.md"))
    assert text == "[c](../contributing.md#commits)"


def test_source_file_is_a_link_to_the_repository_or_its_path(markdown: ModuleType) -> None:
    text = markdown.rewritten("[l](../LICENSE)", Path("docs/page.md"))
    assert text == "l (`LICENSE`)" or re.fullmatch(r"\[l\]\(https://.*/LICENSE\)", text)


def test_raw_anchor_becomes_a_target(markdown: ModuleType) -> None:
    assert markdown.rewritten('<a id="rss"></a>', Path("docs/page.md")) == "(rss)="


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        ('<a href="other.html#here">x</a>', None),
        ('<a href="https://example.org">x</a>', None),
        ('<a href="absent.html">x</a>', "absent.html does not exist"),
        ('<a href="other.html#there">x</a>', "other.html#there has no such anchor"),
        ('<img src="https://example.org/x.png">', "is loaded from elsewhere"),
    ],
)
def test_check_of_links_finds_faults(
    check_site: ModuleType, tmp_path: Path, body: str, fault: str | None
) -> None:
    (tmp_path / "index.html").write_text(f"<html><body>{body}</body></html>")
    (tmp_path / "other.html").write_text('<h1 id="here">x</h1>')
    faults = check_site.link_faults(tmp_path)
    assert len(faults) == (fault is not None)
    assert fault is None or fault in faults[0]


def test_check_of_names_finds_a_missing_page(check_site: ModuleType, tmp_path: Path) -> None:
    names = set(check_site.reference.documented().values())
    assert len(check_site.name_faults(tmp_path)) == len(names)
    assert {"arrivals.track", "arrivals.trackers.SVALSE", "arrivals.plots.plot_map"} <= names


def test_reference_has_every_package_with_public_names(check_site: ModuleType) -> None:
    homes = {top: Path(importlib.import_module(f"arrivals.{top}").__path__[0]) for top in PACKAGES}
    inside = ("arrivals.trackers.svalse.", "arrivals.scenarios.simulations.")  # parts of a package
    names = {"arrivals"} | {
        ".".join(("arrivals", top, *file.parent.relative_to(home).parts))
        for top, home in homes.items()
        for file in home.rglob("__init__.py")
    }
    public = {name for name in names if getattr(importlib.import_module(name), "__all__", [])}
    public -= {name for name in public if name.startswith(inside)}
    assert public == set(check_site.reference.PACKAGES)


def test_every_page_is_in_the_navigation() -> None:
    docs = ROOT / "docs"
    tree = re.compile(r"```\{toctree\}\n(.*?)```", re.DOTALL)
    listed = {
        (file.parent / entry).relative_to(docs).as_posix()
        for file in docs.rglob("*.md")
        for block in tree.findall(file.read_text(encoding="utf-8"))
        for entry in block.split()
    }
    pages = [*docs.glob("*.md"), *docs.glob("start/*.md"), *docs.glob("notebooks/*.ipynb")]
    names = {page.relative_to(docs).with_suffix("").as_posix() for page in pages}
    assert names - listed == {"index"}  # Sphinx warns of others, and a warning is an error


def test_ci_builds_the_site_by_the_command_of_contributing() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    commands = re.findall(r"^ {4}(python3 -m venv .venv &&.*)$", text, re.MULTILINE)
    assert sum("-m sphinx -W docs site" in command for command in commands) == 1
    assert "CONTRIBUTING.md" in (ROOT / ".ci" / "docs").read_text(encoding="utf-8")
