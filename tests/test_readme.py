"""Python and commands of the README: they run as printed, and CI finds them."""

import doctest
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"


def test_readme_examples_run() -> None:
    result = doctest.testfile(str(README), module_relative=False)
    assert result.attempted > 10
    assert result.failed == 0


def test_readme_has_its_two_commands_once() -> None:
    lines = [line.strip() for line in README.read_text().splitlines()]
    assert len([line for line in lines if line.startswith("python3 -m venv .venv &&")]) == 2
