"""The Python of every page of docs runs as printed."""

import doctest
import re
import shlex
import tomllib
from pathlib import Path

import pytest

from arrivals.__main__ import main
from arrivals.cli.main import _parser
from arrivals.measurement_models.arrays import from_description
from arrivals.measurement_models.arrays.description import COMMON, KEYS
from arrivals.measurement_models.arrays.presets import preset_names
from arrivals.trackers import available
from arrivals.trackers.registry import TRACKERS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.glob("*.md"), *DOCS.glob("start/*.md")])
COMMAND = re.compile(r"^ {4}arrivals (.*)$", re.MULTILINE)
SHOWN_ELSEWHERE = ("demo", "reproduce")  # longer runs, which tests of their own have


@pytest.fixture(autouse=True)
def trackers_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out trackers that other tests of this process have registered."""
    own = {
        n: kind for n, kind in TRACKERS._classes.items() if kind.__module__.startswith("arrivals.")
    }
    monkeypatch.setattr(TRACKERS, "_classes", own)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_examples_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the Python of a page and then, of a start page, its commands on the files it wrote."""
    monkeypatch.chdir(tmp_path)
    assert doctest.testfile(str(page), module_relative=False).failed == 0
    if page.parent.name != "start":
        return
    for command in COMMAND.findall(page.read_text(encoding="utf-8")):
        if not command.startswith(SHOWN_ELSEWHERE):
            assert main(shlex.split(command)) == 0, command


def test_start_pages_are_seven_and_have_examples() -> None:
    pages = [page for page in PAGES if page.parent.name == "start" and page.stem != "index"]
    assert len(pages) == 7
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert ">>>" in text
        assert "## Next" in text


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.stem)
def test_page_commands_are_those_of_the_parser(page: Path) -> None:
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    for command in re.findall(r"^ {4}(?:.*\| )?arrivals (.*)$", text, re.MULTILINE):
        _parser().parse_args(shlex.split(command, comments=True))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_toml_and_plain_python_parse(page: Path) -> None:
    blocks = re.findall(r"^```(toml|python)\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)
    for kind, text in blocks:
        if kind == "toml":
            tomllib.loads(text)
        elif ">>>" not in text:
            compile(text, str(page), "exec")


def test_page_of_the_choice_has_every_tracker() -> None:
    text = (DOCS / "choose.md").read_text(encoding="utf-8")
    table = "".join(line for line in text.splitlines() if line.startswith("|"))
    assert [name for name in available() if f"`{name}`" not in table] == []


def test_page_for_users_of_filterpy_has_examples() -> None:
    page = next(page for page in PAGES if page.stem == "from_filterpy")
    assert page.read_text(encoding="utf-8").count(">>>") > 40


def test_page_of_array_files_has_every_kind_key_and_preset() -> None:
    page = next(page for page in PAGES if page.stem == "array_files")
    text = page.read_text(encoding="utf-8")
    examples = [tomllib.loads(each) for each in re.findall(r"```toml\n(.*?)```", text, re.DOTALL)]
    assert all(from_description(each).n_sensors > 1 for each in examples)
    assert set(KEYS) <= {each["kind"] for each in examples}
    for name in (*COMMON, *preset_names(), "latitude", "height"):
        assert f"`{name}" in text or f"\n{name} = " in text, name
    pictures = [page.parent / each for each in re.findall(r"\((\S+\.png)\)", text)]
    assert len(pictures) == len({each["kind"] for each in examples}) + 1
    assert all(0 < picture.stat().st_size < 30_000 for picture in pictures)
