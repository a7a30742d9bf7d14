"""Sizes and boundaries of modules."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("trackers", "motion_models", "measurement_models", "scenarios", "src/arrivals")
MODULES = sorted({file.resolve() for top in FOLDERS for file in (ROOT / top).rglob("*.py")})
TREES = {file: ast.parse(file.read_text(encoding="utf-8")) for file in MODULES}
OTHERS = sorted(file for top in ("tests", "benchmarks") for file in (ROOT / top).rglob("*.py"))


def name(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


def n_lines(file: Path) -> int:
    return len(file.read_text(encoding="utf-8").splitlines())


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    a = function.args
    return len([x for x in a.posonlyargs + a.args + a.kwonlyargs if x.arg not in ("self", "cls")])


def test_folders_have_at_most_14_modules() -> None:
    n_modules = Counter(name(file.parent) for file in MODULES)
    assert {folder: n for folder, n in n_modules.items() if n > 14} == {}


def test_packages_have_at_least_3_modules() -> None:
    n_modules = Counter(file.parent for file in MODULES)
    packages = {file.parent for file in MODULES if file.name == "__init__.py"}
    assert [name(folder) for folder in packages if n_modules[folder] < 3] == []


def test_modules_have_at_most_300_lines() -> None:
    assert {name(file): n_lines(file) for file in MODULES if n_lines(file) > 300} == {}


def test_tests_and_benchmarks_have_at_most_350_lines() -> None:
    assert {name(file): n_lines(file) for file in OTHERS if n_lines(file) > 350} == {}


def test_functions_have_at_most_8_parameters_and_constructors_10() -> None:
    many = {}
    for file, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                limit = 10 if node.name == "__init__" else 8
                if parameters(node) > limit:
                    many[f"{name(file)}:{node.name}"] = parameters(node)
    assert many == {}


def test_public_class_names_are_unique() -> None:
    classes = Counter(
        node.name
        for tree in TREES.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [each for each, n in classes.items() if n > 1] == []


@pytest.mark.parametrize("file", MODULES, ids=name)
def test_private_names_stay_in_their_module(file: Path) -> None:
    """`_x` is used on `self` or `cls`, or is defined in the module that uses it."""
    tree = TREES[file]
    defined = {
        node.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
    } | {
        node.attr if isinstance(node, ast.Attribute) else node.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute | ast.Name) and isinstance(node.ctx, ast.Store)
    }
    defined |= set(re.findall(r'__setattr__\(self, "(_\w+)"', file.read_text(encoding="utf-8")))
    foreign = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("arrivals"):
            foreign += [alias.name for alias in node.names if is_private(alias.name)]
        if isinstance(node, ast.Attribute) and is_private(node.attr):
            foreign += [node.attr] if node.attr not in defined else []
    assert foreign == []


def is_private(identifier: str) -> bool:
    namedtuple = identifier in ("_asdict", "_fields", "_replace")
    return identifier.startswith("_") and not identifier.startswith("__") and not namedtuple
