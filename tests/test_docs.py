"""The Python of every page of docs runs as printed."""

import doctest
from pathlib import Path

import pytest

PAGES = sorted((Path(__file__).parents[1] / "docs").glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_examples_run(page: Path) -> None:
    assert doctest.testfile(str(page), module_relative=False).failed == 0


def test_page_for_users_of_filterpy_has_examples() -> None:
    page = next(page for page in PAGES if page.stem == "from_filterpy")
    assert page.read_text(encoding="utf-8").count(">>>") > 40
