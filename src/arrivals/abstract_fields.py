"""Abstract properties that dataclasses may declare as fields."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    property_or_field = property
else:

    class property_or_field:  # noqa: N801  (a decorator)
        """A property that a class derived from it may declare as a field of a dataclass.

        A dataclass takes an inherited class attribute for the default of a field. This one hides
        from classes that annotate its name. All others must define it if it is abstract.
        """

        def __init__(self, function):
            self.function, self.__name__, self.__doc__ = (
                function,
                function.__name__,
                function.__doc__,
            )
            self.__isabstractmethod__ = getattr(function, "__isabstractmethod__", False)

        def __get__(self, instance, owner):
            if instance is None:
                if any(self.__name__ in inspect.get_annotations(base) for base in owner.__mro__):
                    raise AttributeError(f"{self.__name__} is a field of {owner.__name__}")
                return self
            if self.__isabstractmethod__:
                raise AttributeError(f"{owner.__name__} declares {self.__name__} without a value")
            return self.function(instance)
