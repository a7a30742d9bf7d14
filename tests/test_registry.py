"""The registry of trackers, and entry points of other packages."""

import importlib.metadata
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import pytest
from recording_tracker import SNAPSHOTS

from arrivals.registry import Registry
from arrivals.trackers import (
    CBF,
    available,
    create,
    find,
)

# the registry


class Animal:
    pass


class Dog(Animal):
    pass


class Cat(Animal):
    pass


@pytest.fixture
def animals() -> Registry[Animal]:
    registry = Registry(Animal, "arrivals.test_animals", "animal")
    registry.register("dog")(Dog)
    return registry


def test_registered_class_is_found_created_and_unchanged(
    animals: Registry[Animal],
) -> None:
    assert animals.register("cat")(Cat) is Cat
    assert animals.available() == ["cat", "dog"]
    assert animals.find("cat") is Cat
    assert type(animals.create("cat")) is Cat
    assert (animals.name_of(Dog), animals.name_of(Animal)) == ("dog", None)


def test_taken_name_is_refused(animals: Registry[Animal]) -> None:
    with pytest.raises(
        ValueError, match=r"animal name 'dog' is taken by tests\.test_registry\.Dog"
    ):
        animals.register("dog")(Cat)
    assert animals.find("dog") is Dog
    assert animals.register("dog")(Dog) is Dog  # the same again is no conflict


@pytest.mark.parametrize("stranger", [int, Dog(), lambda: Dog()])
def test_class_without_the_base_is_refused(animals: Registry[Animal], stranger: Any) -> None:
    with pytest.raises(TypeError, match="is not an animal: derive it from Animal"):
        animals.register("stranger")(stranger)
    assert animals.available() == ["dog"]


def test_unknown_name_is_refused_with_similar_names() -> None:
    with pytest.raises(ValueError, match="there is no tracker 'svasle': did you mean svalse"):
        create("svasle")
    with pytest.raises(
        ValueError, match=r"no tracker 'xyz': known: ar_kalman_qrd_rls, .*cbf, .*svalse"
    ):
        find("xyz")


def test_built_in_trackers_are_created_by_name() -> None:
    assert {"cbf", "svalse", "valse"} <= set(available())
    tracker = create("cbf", measurement=SNAPSHOTS, max_sources=1)
    assert isinstance(tracker, CBF)
    assert tracker.max_sources == 1


# entry points of other packages


@pytest.fixture
def foreign(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[list[EntryPoint]]:
    """Simulate installed packages with animals; tests append to the list of entry points."""
    (tmp_path / "farm.py").write_text(
        "from test_registry import Animal\nclass Cow(Animal): pass\nclass Rock: pass\n"
    )
    (tmp_path / "farm_facade.py").write_text("from farm import Cow\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "test_registry", sys.modules[__name__])
    points: list[EntryPoint] = []

    def entry_points(*, group: str) -> EntryPoints:
        return EntryPoints(points).select(group=group)

    monkeypatch.setattr("arrivals.registry.entry_points", entry_points)
    yield points
    for module in ("farm", "farm_facade"):
        sys.modules.pop(module, None)


def point(name: str, value: str, group: str = "arrivals.test_animals") -> EntryPoint:
    return EntryPoint(name=name, value=value, group=group)


def test_foreign_class_is_listed_and_imported_on_demand(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign += [point("cow", "farm:Cow"), point("other", "farm:Cow", "another.group")]
    assert animals.available() == ["cow", "dog"]
    assert "farm" not in sys.modules
    cow = animals.find("cow")
    assert (cow.__module__, cow.__name__) == ("farm", "Cow")
    assert animals.find("cow") is cow
    assert type(animals.create("cow")) is cow
    assert animals.name_of(cow) == "cow"


def test_class_installed_after_another_was_found_is_found(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    animals.find("dog")
    foreign.append(point("cow", "farm:Cow"))
    assert animals.find("cow").__name__ == "Cow"


@pytest.mark.parametrize("code", ["raise SystemExit(3)", "1 / 0", "x = ", "\0"])
def test_package_that_fails_or_exits_is_an_error_with_its_name(
    code: str, animals: Registry[Animal], foreign: list[EntryPoint], tmp_path: Path
) -> None:
    (tmp_path / "rude_farm.py").write_text(code)
    foreign.append(point("cow", "rude_farm:Cow"))
    with pytest.raises(ValueError, match="'cow', rude_farm:Cow, cannot be loaded"):
        animals.find("cow")


def test_foreign_class_may_be_named_by_another_path(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign.append(point("cow", "farm_facade:Cow"))
    assert animals.find("cow") is animals.find("cow")


def test_repeated_entry_point_is_accepted(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign += [point("cow", "farm:Cow"), point("cow", "farm:Cow")]
    assert animals.find("cow").__name__ == "Cow"


def test_foreign_class_with_a_registered_name_is_refused(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign.append(point("dog", "farm:Cow"))
    with pytest.raises(
        ValueError, match=r"'dog' is taken twice: farm:Cow, tests.test_registry:Dog"
    ):
        animals.find("dog")
    assert animals.available() == ["dog"]


def test_two_foreign_classes_of_one_name_are_refused(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign += [point("cow", "farm:Cow"), point("cow", "byre:Cow")]
    with pytest.raises(ValueError, match="'cow' is taken twice: farm:Cow, byre:Cow"):
        animals.create("cow")


def test_foreign_class_without_the_base_is_refused(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign.append(point("rock", "farm:Rock"))
    with pytest.raises(TypeError, match=r"Rock.* is not an animal: derive it from Animal"):
        animals.find("rock")


def test_built_in_trackers_have_no_entry_points() -> None:
    ours = [p for p in importlib.metadata.entry_points(group="arrivals.trackers")
            if p.value.startswith("arrivals.")]  # fmt: skip
    assert ours == []


def test_tracker_that_cannot_be_imported_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    point = EntryPoint("broken", "no_such_package_here:Thing", "arrivals.trackers")
    monkeypatch.setattr("arrivals.registry.entry_points", lambda group: [point])
    with pytest.raises(ValueError, match="tracker 'broken', no_such_package_here:Thing, cannot"):
        find("broken")
    with pytest.raises(TypeError, match="name of a tracker must be a string; got 3"):
        find(3)  # type: ignore[arg-type]
