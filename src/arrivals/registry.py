"""Classes by name, those of other packages through entry points included."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

Base = TypeVar("Base")
Kind = TypeVar("Kind", bound=type)


class Registry(Generic[Base]):
    """Classes by name, only ever added to.

    Parameters
    ----------
    base : type
        What every entry derives from.
    group : str
        Group of entry points through which other packages add theirs; they are imported when
        they are asked for.
    noun : str
        What an entry is called in messages.
    """

    def __init__(self, base: type[Base], group: str, noun: str) -> None:
        self.base, self.group, self.noun = base, group, noun
        self._classes: dict[str, type[Base]] = {}

    def register(self, name: str) -> Callable[[Kind], Kind]:
        """Return a class decorator that enters the class under a name.

        Raises
        ------
        ValueError
            If the name is taken.
        TypeError
            If the class does not derive from the base.
        """

        def enter(kind: Kind) -> Kind:
            fits = isinstance(kind, type) and issubclass(kind, self.base)
            if not fits:
                raise TypeError(f"{kind!r} is no {self.noun}: derive it from {self.base.__name__}")
            known = self._classes.get(name)
            if known not in (None, kind):
                raise ValueError(
                    f"the {self.noun} name {name!r} is taken by "
                    f"{known.__module__}.{known.__qualname__}"
                )
            self._classes[name] = kind
            return kind

        return enter

    def _entry_points(self) -> dict[str, list[EntryPoint]]:
        found: dict[str, list[EntryPoint]] = {}
        for point in entry_points(group=self.group):
            same = found.setdefault(point.name, [])
            if point.value not in [other.value for other in same]:
                same.append(point)
        return found

    def available(self) -> list[str]:
        """Return the names of all, installed entry points included, in alphabetical order."""
        return sorted({*self._classes, *self._entry_points()})

    def find(self, name: str) -> type[Base]:
        """Return the class of that name, imported now if another package brings it.

        Raises
        ------
        ValueError
            If there is none, with the names that come near; or if two packages claim the name.
        """
        if not isinstance(name, str):
            raise TypeError(f"a {self.noun} is named by a string; got {name!r}")
        points = self._entry_points().get(name, [])
        ours = self._classes.get(name)
        if ours is not None:  # a package may name its class by another path than the class does
            points = [point for point in points if self._load(point) is not ours]
        claims = [point.value for point in points]
        if ours is not None:
            claims.append(f"{ours.__module__}:{ours.__qualname__}")
        if len(claims) > 1:
            raise ValueError(f"the {self.noun} name {name!r} is taken twice: {', '.join(claims)}")
        if ours is not None:
            return ours
        if points:
            return self.register(name)(self._load(points[0]))
        near = difflib.get_close_matches(name, self.available(), n=3, cutoff=0.5)
        hint = (
            f"did you mean {' or '.join(near)}?"
            if near
            else f"known: {', '.join(self.available())}"
        )
        raise ValueError(f"there is no {self.noun} {name!r}; {hint}")

    def _load(self, point: EntryPoint) -> type[Base]:
        """Import what an entry point names; whatever goes wrong in it is somebody else's."""
        try:
            loaded: type[Base] = point.load()
        except Exception as error:
            raise ValueError(
                f"the {self.noun} {point.name!r}, {point.value}, cannot be loaded: {error}"
            ) from error
        return loaded

    def create(self, name: str, **params: Any) -> Base:
        """Make the one of that name from its constructor's arguments."""
        return self.find(name)(**params)

    def name_of(self, kind: type) -> str | None:
        """Return the name that a class is entered under, or None."""
        return next((name for name, known in self._classes.items() if known is kind), None)
