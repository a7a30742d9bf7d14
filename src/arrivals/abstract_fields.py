"""Abstract properties that dataclasses may declare as fields."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    property_or_field = property
else:

    class property_or_field:  # noqa: N801  (a decorator)
        """An abstract property that a dataclass derived from it may declare as a field.

        A dataclass takes an inherited class attribute for the default of a field. This one hides
        from classes that annotate its name, so that their field has no default; every other
        subclass must define the property.
        """

        __isabstractmethod__ = True

        def __init__(self, function):
            self.__name__, self.__doc__ = function.__name__, function.__doc__

        def __get__(self, instance, owner):
            name, cls = self.__name__, owner.__name__
            if instance is not None:
                raise AttributeError(f"{cls} declares {name}, but has no value of it")
            if any(name in inspect.get_annotations(base) for base in owner.__mro__):
                raise AttributeError(f"{name} is a field of {cls}")
            return self
