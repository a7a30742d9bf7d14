"""Version, citation, licences, scripts and workflows agree with each other and with the folders."""

import os
import re
import sys
import tomllib
from fnmatch import fnmatch
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
import yaml

import arrivals
from arrivals.scenarios.reproduce.results_page import PAPERS
from arrivals.trackers import available

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("[!c]*.yml"))
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def commands(workflow: Path) -> list[str]:
    jobs = yaml.safe_load(workflow.read_text(encoding="utf-8"))["jobs"].values()
    steps: list[dict[str, Any]] = list(chain.from_iterable(job.get("steps", []) for job in jobs))
    return [step["run"] for step in steps if "run" in step]


# one version


def test_version_is_that_of_the_package_everywhere() -> None:
    citation = yaml.safe_load(text("CITATION.cff"))
    release, date = re.findall(r"^## (\S+) - (\S+)$", text("CHANGELOG.md"), re.MULTILINE)[0]
    assert PROJECT["dynamic"] == ["version"]
    assert re.fullmatch(r"\d+\.\d+\.\d+", arrivals.__version__)
    assert citation["version"] == release == arrivals.__version__
    assert citation["date-released"].isoformat() == date


# citation


def test_citation_has_what_its_format_requires() -> None:
    citation = yaml.safe_load(text("CITATION.cff"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert citation["cff-version"] == "1.2.0"
    assert citation["authors"] == PROJECT["authors"]
    assert citation["license"] == PROJECT["license"]
    kinds = {reference["type"] for reference in citation["references"]}
    assert kinds <= {"article", "conference-paper"}


def test_citation_lists_the_papers_of_the_results() -> None:
    references = yaml.safe_load(text("CITATION.cff"))["references"]
    citations = [paper.citation for paper in PAPERS if "*" in paper.citation]
    assert len(references) == len(citations) == 4
    for reference, citation in zip(references, citations, strict=True):
        assert f"*{reference['title']}*" in citation
        names = [f"{who['given-names']} {who['family-names']}" for who in reference["authors"]]
        assert all(name in citation for name in names)
        assert str(reference.get("year", "")) in citation
        assert set(reference["notes"].split(", ")) <= set(available())


# what is packed


def test_every_licence_of_data_is_a_licence_file() -> None:
    present = {path.relative_to(ROOT).as_posix() for path in ROOT.glob("scenarios/**/*LICEN[CS]E*")}
    patterns = PROJECT["license-files"]
    assert len(present) == 2
    assert {name for name in present if not any(fnmatch(name, each) for each in patterns)} == set()


def test_classifiers_name_the_versions_of_python_that_are_tested() -> None:
    prefix = "Programming Language :: Python :: 3."
    classified = [each.rpartition(" ")[2] for each in PROJECT["classifiers"] if prefix in each]
    assert classified[0] == PROJECT["requires-python"].removeprefix(">=")
    assert f"{sys.version_info.major}.{sys.version_info.minor}" in classified
    jobs = yaml.safe_load(text(".github/workflows/tests.yml"))["jobs"]
    assert jobs["tests"]["strategy"]["matrix"]["python"] == classified


# scripts and workflows


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_workflow_calls_scripts_that_exist_and_can_be_run(workflow: Path) -> None:
    scripts = [name for command in commands(workflow) for name in re.findall(r"\.ci/\w+", command)]
    assert scripts or workflow.stem == "publish"  # which calls the other workflows
    for name in scripts:
        assert os.access(ROOT / name, os.X_OK), name


def test_every_script_of_the_checks_is_called_by_a_workflow() -> None:
    called = set(re.findall(r"^(\.ci/\w+)", text(".ci/run"), re.MULTILINE))
    assert {".ci/tests", ".ci/checks", ".ci/package"} <= called
    assert called <= set(re.findall(r"\.ci/\w+", "\n".join(chain(*map(commands, WORKFLOWS)))))


def test_called_workflows_take_calls() -> None:
    publish = yaml.safe_load(text(".github/workflows/publish.yml"))["jobs"]
    called = [Path(job["uses"]) for job in publish.values() if "uses" in job]
    assert {path.stem for path in called} == {"tests", "package"}
    for path in called:  # `on` is read as a true value
        assert "workflow_call" in yaml.safe_load(text(path.as_posix()))[True]
    assert set(publish["publish"]["needs"]) == {"tests", "package"}
    assert publish["publish"]["permissions"] == {"id-token": "write"}


@pytest.mark.parametrize("form", FORMS, ids=lambda path: path.stem)
def test_issue_form_has_what_its_format_requires(form: Path) -> None:
    fields = yaml.safe_load(form.read_text(encoding="utf-8"))
    assert {"name", "description", "body"} <= fields.keys()
    inputs = [each for each in fields["body"] if each["type"] != "markdown"]
    assert all(each["attributes"]["label"] for each in inputs)
    assert len({each["id"] for each in inputs}) == len(inputs)
    assert any(each.get("validations", {}).get("required") for each in inputs)
