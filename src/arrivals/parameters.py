"""Parameters by name, by scikit-learn's rules, and configurations as plain dictionaries."""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from arrivals.messages import nearest, shown

FINDERS: list[Callable[[str], type]] = []  # functions from registered names to classes
NAMERS: list[Callable[[type], str | None]] = []  # functions from classes to registered names
MAX_DEPTH = 32  # of parts and lists in a configuration, one in the other


class Configurable:
    """Base of classes whose constructor arguments are attributes of the same names.

    Notes
    -----
    The rules are scikit-learn's: `sklearn.base.clone`, `ParameterGrid` and nested search work.
    A nested name joins the names of part and parameter by two underscores: `motion__kappa`.

    A parameter that was renamed is listed in `renamed`, {"old": "new"}, and a class that was
    renamed has its old names in `former_names`: constructors, `set_params` and `from_dict` refuse
    an old name with the new one in the message. Subclasses inherit `renamed`.

    Examples
    --------
    >>> class Walk(FrozenModel):
    ...     renamed = {"speed": "q"}
    ...     def __init__(self, q=1.0):
    ...         self.q = q
    >>> Walk(speed=2.0)
    Traceback (most recent call last):
    TypeError: Walk has no parameter 'speed': it is now called 'q'
    """

    renamed: ClassVar[dict[str, str]] = {}
    former_names: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        inherited = [vars(kind).get("renamed", {}) for kind in reversed(cls.__mro__)]
        cls.renamed = {old: new for names in inherited for old, new in names.items()}

    if not TYPE_CHECKING:  # type checkers read the signature of __init__

        def __new__(cls, *args, **params):
            """Refuse parameters that were renamed."""
            if cls.renamed and not cls.renamed.keys().isdisjoint(params):
                raise TypeError(next(filter(None, map(cls.renaming, params))))
            return super().__new__(cls)

    @classmethod
    def renaming(cls, name: str) -> str | None:
        """Return the message about a parameter that was renamed, or None for other names."""
        if name not in cls.renamed:
            return None
        part, nested, new = cls.renamed[name].rpartition("__")
        place = f"it is now {new!r} of {part!r}" if nested else f"it is now called {new!r}"
        return f"{cls.__name__} has no parameter {name!r}: {place}"

    @classmethod
    def param_names(cls) -> list[str]:
        """Return the names of the constructor's arguments.

        Raises
        ------
        TypeError
            If the constructor takes arguments without a name.
        """
        parameters = list(inspect.signature(cls).parameters.values())
        for p in parameters:
            if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD):
                stars = "*" if p.kind is p.VAR_POSITIONAL else "**"
                raise TypeError(f"{cls.__name__} must name its parameters; got {stars}{p.name}")
        return [p.name for p in parameters]

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the constructor's arguments by name.

        Parameters
        ----------
        deep : bool
            Include the parameters of parts under nested names.

        Returns
        -------
        dict of str to object
            Values by name.
        """
        params = {name: getattr(self, name) for name in self.param_names()}
        if deep:
            for name, part in list(params.items()):
                if isinstance(part, Configurable):
                    params |= {f"{name}__{key}": each for key, each in part.get_params().items()}
        return params

    def changed_params(self, changes: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
        """Return the constructor's arguments after changes by (nested) names.

        Parameters
        ----------
        changes : mapping of str to object
            New values by name.
        prefix : str
            Start of the names of a part in messages.

        Returns
        -------
        dict of str to object
            All arguments by name; parts with changed parameters are new objects.

        Raises
        ------
        ValueError
            If there is no such parameter.
        """
        params = self.get_params(deep=False)
        nested: dict[str, dict[str, Any]] = {}
        for key, value in changes.items():
            name, deeper, rest = key.partition("__")
            if name not in params:
                hint = nearest(prefix + key, (prefix + each for each in self.get_params()))
                message = f"{type(self).__name__} has no parameter {name!r}: {hint}"
                raise ValueError(self.renaming(name) or message)
            if deeper:
                nested.setdefault(name, {})[rest] = value
            else:
                params[name] = value
        for name, inner in nested.items():
            part = params[name]
            if not isinstance(part, Configurable):
                raise ValueError(f"{name} of {type(self).__name__} has no parameters of its own")
            params[name] = type(part)(**part.changed_params(inner, f"{prefix}{name}__"))
        return params

    @classmethod
    def type_name(cls) -> str:
        """Return the name of the class in configurations.

        Returns
        -------
        str
            The registered name, if any; else "package:Class" if the package, the first two parts
            of the module's name, exports the class; else "module:Class".
        """
        for name_of in NAMERS:
            if name := name_of(cls):
                return name
        package = ".".join(cls.__module__.split(".")[:2])
        is_public = getattr(sys.modules.get(package), cls.__qualname__, None) is cls
        return f"{package if is_public else cls.__module__}:{cls.__qualname__}"

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as plain numbers, strings, lists and dictionaries."""
        params = self.get_params(deep=False)
        return {"type": self.type_name()} | {key: to_plain(value) for key, value in params.items()}

    @classmethod
    def from_dict(cls, config: Mapping[str, Any]) -> Self:
        """Make the object that `to_dict` described.

        Nothing is imported but modules of `arrivals` and registered entry points; other modules
        must have been imported before.

        Parameters
        ----------
        config : mapping of str to object
            "type" and the constructor's arguments.

        Returns
        -------
        Configurable
            An object of the class that "type" names.

        Raises
        ------
        ValueError, TypeError
            If "type" is not the name of such a class, or the class refuses a parameter.
        """
        _check_depth(config)
        if not isinstance(config, Mapping) or "type" not in config:
            raise ValueError(
                f"config must be a dictionary with the key 'type'; got {shown(config)}"
            )
        name = config["type"] if isinstance(config["type"], str) else shown(config["type"])
        kind = _find_type(name[:500])
        if not (inspect.isclass(kind) and issubclass(kind, cls)):
            raise TypeError(f"{name} is not a {cls.__name__}")
        for key in sorted(set(config) - {"type", *kind.param_names()}, key=str):
            unknown = f"{name} has no parameter {key!r}: {nearest(key, kind.param_names())}"
            raise ValueError(kind.renaming(key) or unknown)
        params = {key: _built(value) for key, value in config.items() if key != "type"}
        try:
            return kind(**params)
        except (AttributeError, LookupError, ArithmeticError, RuntimeError, MemoryError) as error:
            raise ValueError(f"{name} must have valid parameters; got {error}") from error


class FrozenModel(Configurable):
    """Base of immutable parts: two with equal parameters are interchangeable."""

    def replace(self, **changes: Any) -> Self:
        """Return the same model with other values for some of its parameters.

        Parameters
        ----------
        **changes : object
            New values by (nested) name.

        Returns
        -------
        FrozenModel
            A new model of the same class.
        """
        return type(self)(**self.changed_params(changes))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self

    def __copy__(self) -> Self:
        return self

    def __sklearn_clone__(self) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        # by the constructor, which makes arrays read-only
        return partial(type(self), **self.get_params(deep=False)), ()


def _find_type(name: str) -> Any:
    """Return the class of a registered name, or of "module:Class"."""
    module, colon, qualname = name.partition(":")
    if not colon:
        return _registered(name)
    try:
        if module.partition(".")[0] != "arrivals" and module not in sys.modules:
            raise ImportError
        value: Any = importlib.import_module(module)
        for part in qualname.split("."):
            value = vars(value)[part]  # not getattr, which may import and call
    except (ImportError, KeyError, TypeError, ValueError):
        public = _public_name(module, qualname)
        hint = f"it is now called {public!r}" if public else "install and import its package"
        raise ValueError(f"there is no class {name!r}: {hint}") from None
    return value


def _public_name(module: str, qualname: str) -> str | None:
    """Return the public name of a class of ours that had another name or module, or None."""
    package = ".".join(module.split(".")[:2])
    try:
        exported = importlib.import_module(package) if package.startswith("arrivals.") else None
    except ImportError:
        return None
    for name in getattr(exported, "__all__", ()):
        own = getattr(getattr(exported, name), "__dict__", {})  # former names are not inherited
        if qualname in (name, *own.get("former_names", ())):
            return f"{package}:{name}"
    return None


def _registered(name: str) -> type:
    for find in FINDERS:
        try:
            return find(name)
        except ValueError as error:
            unknown = error
    raise unknown if FINDERS else ValueError(f"there is no registered class {name!r}")


def to_plain(value: Any) -> Any:
    """Return a value as JSON has it: parts as dictionaries, arrays and tuples as lists."""
    if isinstance(value, Configurable):
        return value.to_dict()
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [to_plain(item) for item in value] if isinstance(value, tuple | list) else value


def _check_depth(value: Any, depth: int = 0) -> None:
    if depth > MAX_DEPTH:
        raise ValueError(f"config must be nested at most {MAX_DEPTH} deep; got more")
    if isinstance(value, Mapping | list | tuple):
        for item in value.values() if isinstance(value, Mapping) else value:
            _check_depth(item, depth + 1)


def _built(value: Any) -> Any:
    if isinstance(value, Mapping) and "type" in value:
        return Configurable.from_dict(value)
    return [_built(item) for item in value] if isinstance(value, list) else value
