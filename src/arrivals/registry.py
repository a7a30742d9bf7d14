"""Registry of named classes, including those of other packages through entry points."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from arrivals.messages import nearest, shown, with_article

Base = TypeVar("Base")
Kind = TypeVar("Kind", bound=type)


class Registry(Generic[Base]):
    """Named classes; entries are added, never removed or replaced.

    Parameters
    ----------
    base : type
        Base class of all entries.
    group : str
        Group of entry points of other packages; they are imported on demand.
    noun : str
        Noun for an entry in messages.

    Examples
    --------
    >>> registry = Registry(dict, "example.group", "mapping")
    >>> @registry.register("plain")
    ... class Plain(dict):
    ...     pass
    >>> registry.available(), registry.create("plain", a=1)
    (['plain'], {'a': 1})
    """

    def __init__(self, base: type[Base], group: str, noun: str) -> None:
        self.base, self.group, self.noun = base, group, noun
        self._classes: dict[str, type[Base]] = {}
        self._installed: dict[str, list[EntryPoint]] = {}
        self._read_for: object = None  # state in which the installed ones were read

    def register(self, name: str) -> Callable[[Kind], Kind]:
        """Return a class decorator that registers the class under a name.

        Parameters
        ----------
        name : str
            Name of the class.

        Returns
        -------
        callable
            Returns the class unchanged.

        Raises
        ------
        ValueError
            If the name is registered for another class.
        TypeError
            If the class does not derive from the base.

        Examples
        --------
        >>> registry = Registry(dict, "example.group", "mapping")
        >>> registry.register("plain")(dict)
        <class 'dict'>
        """

        def enter(kind: Kind) -> Kind:
            is_subclass = isinstance(kind, type) and issubclass(kind, self.base)
            if not is_subclass:
                noun, base = with_article(self.noun), self.base.__name__
                raise TypeError(f"{kind!r} is not {noun}: derive it from {base}")
            existing = self._classes.get(name)
            if existing not in (None, kind):
                raise ValueError(
                    f"the {self.noun} name {name!r} is taken by "
                    f"{existing.__module__}.{existing.__qualname__}"
                )
            self._classes[name] = kind
            return kind

        return enter

    def available(self) -> list[str]:
        """Return the names of all classes, including installed entry points, in alphabetical order.

        Returns
        -------
        list of str
            Names.

        Examples
        --------
        >>> Registry(dict, "example.group", "mapping").available()
        []
        """
        return sorted({*self._classes, *installed(self.group)})

    def find(self, name: str) -> type[Base]:
        """Return the class of a name; import it if it belongs to another package.

        Parameters
        ----------
        name : str
            Name of the class.

        Returns
        -------
        type
            The class.

        Raises
        ------
        ValueError
            If the name is unknown, with similar names; or if two packages claim it.

        Examples
        --------
        >>> registry = Registry(dict, "example.group", "mapping")
        >>> _ = registry.register("tidy")(dict)
        >>> registry.find("plain")
        Traceback (most recent call last):
        ValueError: there is no mapping 'plain': known: tidy
        """
        if not isinstance(name, str):
            raise TypeError(
                f"name of {with_article(self.noun)} must be a string; got {shown(name)}"
            )
        points = self._points(name)
        ours = self._classes.get(name)
        if ours is not None:  # an entry point may name the same class by another path
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
        raise ValueError(f"there is no {self.noun} {name!r}: {nearest(name, self.available())}")

    def _points(self, name: str) -> list[EntryPoint]:
        """Return the entry points of a name; all are read again if it is new, or the path is."""
        state = entry_points, tuple(sys.path)
        is_new = name not in self._classes and name not in self._installed
        if is_new or self._read_for != state:
            self._installed, self._read_for = installed(self.group), state
        return self._installed.get(name, [])

    def _load(self, point: EntryPoint) -> type[Base]:
        kind: type[Base] = loaded(point, self.noun)
        return kind

    def create(self, name: str, **params: Any) -> Base:
        """Make an object of the named class.

        Parameters
        ----------
        name : str
            Name of the class.
        **params : object
            Arguments of its constructor.

        Returns
        -------
        object
            The new object.

        Examples
        --------
        >>> registry = Registry(dict, "example.group", "mapping")
        >>> _ = registry.register("plain")(dict)
        >>> registry.create("plain", a=1)
        {'a': 1}
        """
        return self.find(name)(**params)

    def name_of(self, kind: type) -> str | None:
        """Return the registered name of a class, or None."""
        return next((name for name, existing in self._classes.items() if existing is kind), None)


def installed(group: str) -> dict[str, list[EntryPoint]]:
    """Return the entry points of a group by name, each only once.

    Parameters
    ----------
    group : str
        Group of entry points.

    Returns
    -------
    dict of str to list of EntryPoint
        Several of one name if several packages claim it.

    Examples
    --------
    >>> installed("example.group")
    {}
    """
    by_name: dict[str, list[EntryPoint]] = {}
    for point in entry_points(group=group):
        points = by_name.setdefault(point.name, [])
        if point.value not in [other.value for other in points]:
            points.append(point)
    return by_name


def loaded(point: EntryPoint, noun: str) -> Any:
    """Import the object of an entry point; any error becomes a ValueError with its name.

    Parameters
    ----------
    point : EntryPoint
        The entry point.
    noun : str
        Noun for an entry in messages.

    Returns
    -------
    object
        What the entry point names.

    Raises
    ------
    ValueError
        If it cannot be imported.
    """
    try:
        return point.load()
    except (Exception, SystemExit) as error:
        raise ValueError(
            f"the {noun} {point.name!r}, {point.value}, cannot be loaded: {error}"
        ) from error
