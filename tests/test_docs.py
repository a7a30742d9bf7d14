"""The Python of every page of docs runs as printed."""

import doctest
import re
import tomllib
from pathlib import Path

import pytest

from arrivals.measurement_models.arrays import from_description
from arrivals.measurement_models.arrays.description import COMMON, KEYS
from arrivals.measurement_models.arrays.presets import preset_names

PAGES = sorted((Path(__file__).parents[1] / "docs").glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_examples_run(page: Path) -> None:
    assert doctest.testfile(str(page), module_relative=False).failed == 0


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
