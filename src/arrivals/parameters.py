"""Parameters by name, as scikit-learn has them, and configurations that survive a round trip."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Self

import numpy as np

FINDERS: list[Callable[[str], type]] = []  # what turns registered names into classes


class Configurable:
    """Something made from its constructor's arguments, each kept under the argument's own name.

    Notes
    -----
    The rules are scikit-learn's: `sklearn.base.clone`, `ParameterGrid` and nested search work.
    A nested name joins the names of part and parameter by two underscores: `motion__kappa`.
    """

    @classmethod
    def _param_names(cls) -> list[str]:
        parameters = list(inspect.signature(cls).parameters.values())
        for p in parameters:
            if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD):
                stars = "*" if p.kind is p.VAR_POSITIONAL else "**"
                raise TypeError(
                    f"{cls.__name__} must name its parameters; it takes {stars}{p.name}"
                )
        return [p.name for p in parameters]

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the constructor's arguments by name, those of parts included if `deep`."""
        params = {name: getattr(self, name) for name in self._param_names()}
        if deep:
            for name, part in list(params.items()):
                if isinstance(part, Configurable):
                    nested = part.get_params(deep=True)
                    params.update({f"{name}__{key}": value for key, value in nested.items()})
        return params

    def _changed(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the constructor's arguments after changes by (nested) names."""
        params = self.get_params(deep=False)
        nested: dict[str, dict[str, Any]] = {}
        for key, value in changes.items():
            name, deeper, rest = key.partition("__")
            if name not in params:
                known = ", ".join(sorted(params)) or "none"
                raise ValueError(
                    f"{type(self).__name__} has no parameter {name!r}; it has: {known}"
                )
            if deeper:
                nested.setdefault(name, {})[rest] = value
            else:
                params[name] = value
        for name, inner in nested.items():
            part = params[name]
            if isinstance(part, FrozenModel):
                params[name] = part.replace(**inner)
            elif isinstance(part, Configurable):
                params[name] = type(part)(**part._changed(inner))
            else:
                raise ValueError(f"{name} of {type(self).__name__} has no parameters of its own")
        return params

    @classmethod
    def _type_name(cls) -> str:
        return f"{cls.__module__}:{cls.__qualname__}"

    @classmethod
    def _find_type(cls, name: str) -> Any:
        module, colon, qualname = name.partition(":")
        if not colon:
            return _registered(name)
        try:
            found: Any = importlib.import_module(module)
            for part in qualname.split("."):
                found = getattr(found, part)
        except (ImportError, AttributeError, ValueError):
            raise ValueError(f"no class {name!r} is installed here") from None
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as plain numbers, strings, lists and dictionaries."""
        params = self.get_params(deep=False)
        return {"type": self._type_name()} | {key: to_plain(value) for key, value in params.items()}

    @classmethod
    def from_dict(cls, config: Mapping[str, Any]) -> Self:
        """Make the object that `to_dict` described.

        Raises
        ------
        ValueError, TypeError
            If the description names no class of this kind, or parameters that it does not have.
        """
        if not isinstance(config, Mapping) or "type" not in config:
            raise ValueError(f"a configuration is a dictionary with the key 'type'; got {config!r}")
        kind = cls._find_type(str(config["type"]))
        if not (inspect.isclass(kind) and issubclass(kind, cls)):
            raise TypeError(f"{config['type']} is not a {cls.__name__}")
        params = {key: _built(value) for key, value in config.items() if key != "type"}
        unknown = sorted(set(params) - set(kind._param_names()))
        if unknown:
            raise ValueError(f"{config['type']} has no parameter {unknown[0]!r}")
        return kind(**params)


class FrozenModel(Configurable):
    """A part that never changes: two with the same numbers are interchangeable."""

    def replace(self, **changes: Any) -> Self:
        """Return the same model with other values for some of its parameters."""
        return type(self)(**self._changed(changes))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self

    def __copy__(self) -> Self:
        return self

    def __sklearn_clone__(self) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        # by the constructor, so that what it froze is frozen again
        return partial(type(self), **self.get_params(deep=False)), ()


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


def _registered(name: str) -> type:
    for find in FINDERS:
        try:
            return find(name)
        except ValueError as error:
            unknown = error
    raise unknown if FINDERS else ValueError(f"nothing is registered under {name!r}")


def to_plain(value: Any) -> Any:
    """Return a value as JSON has it: parts as dictionaries, arrays and tuples as lists."""
    if isinstance(value, Configurable):
        return value.to_dict()
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, tuple | list):
        return [to_plain(item) for item in value]
    return value


def _built(value: Any) -> Any:
    if isinstance(value, Mapping) and "type" in value:
        return Configurable.from_dict(value)
    if isinstance(value, list):
        return [_built(item) for item in value]
    return value
