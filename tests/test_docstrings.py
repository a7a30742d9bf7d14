"""Docstrings of exported names are complete by numpydoc's rules."""

import importlib
import inspect
import warnings
from typing import Any

import pytest

PACKAGES = ("motion_models", "measurement_models", "trackers", "scenarios")
CODES = {"PR01", "PR02", "PR03", "PR04", "PR07", "RT01", "EX01"}


def exported() -> list[str]:
    """Return the full names of all exported classes and functions."""
    names = []
    for package in PACKAGES:
        module = importlib.import_module(f"arrivals.{package}")
        names += [f"arrivals.{package}.{name}" for name in module.__all__
                  if callable(getattr(module, name))]  # fmt: skip
    return names


def errors(name: str) -> list[str]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from numpydoc.validate import validate

        found: list[tuple[str, str]] = validate(name)["errors"]
    package, _, last = name.rpartition(".")
    kind = getattr(importlib.import_module(package), last)
    bare = inspect.isabstract(kind) or getattr(kind, "_is_protocol", False)  # not constructed
    return [f"{code} {text}" for code, text in found if code in CODES - {"PR01" if bare else ""}]


@pytest.mark.parametrize("name", exported())
def test_exported_name_has_a_complete_docstring(name: str) -> None:
    assert errors(name) == []


def methods() -> list[str]:
    """Return the public methods that exported classes define themselves."""
    names = []
    for full in exported():
        package, _, name = full.rpartition(".")
        kind: Any = getattr(importlib.import_module(package), name)
        if inspect.isclass(kind):
            names += [f"{full}.{key}" for key, value in vars(kind).items()
                      if not key.startswith("_") and inspect.isfunction(value)]  # fmt: skip
    return names


@pytest.mark.parametrize("name", methods())
def test_public_method_has_a_docstring(name: str) -> None:
    from numpydoc.validate import validate

    assert "GL08" not in [code for code, _ in validate(name)["errors"]]
