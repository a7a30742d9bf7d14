"""Names of the entries of states."""

from collections.abc import Iterable

from arrivals.messages import shown
from arrivals.validation import items


def entry_names(name: str, value: Iterable[str], n: int) -> tuple[str, ...]:
    """Return the names of n entries, all different, or ().

    Examples
    --------
    >>> entry_names("names", ["x", "vx"], 3)
    Traceback (most recent call last):
    ValueError: names must be 3 different strings, one of each entry; got ['x', 'vx']
    """
    names = items(name, value)
    strings = all(isinstance(each, str) for each in names)
    if names and not (strings and len(set(names)) == len(names) == n):
        wanted = f"{n} different strings, one of each entry"
        raise ValueError(f"{name} must be {wanted}; got {shown(value)}")
    return names


def checked_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the entries of a state, all different, or ().

    Examples
    --------
    >>> checked_names(["x", "y"])
    ('x', 'y')
    """
    given = items("names", names)
    return entry_names("names", given, len(given))
