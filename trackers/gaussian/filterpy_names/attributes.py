"""Attributes that exist: assigning or reading any other raises with a suggestion."""

from __future__ import annotations

import inspect
from typing import Any

from arrivals.messages import similar

UNDECLARED = object()


class DeclaredAttributes:
    """Base of trackers that refuse attributes they do not have.

    A name can be assigned if the class or a base defines or annotates it, if it was assigned
    before, while the object is constructed, and in methods of the object: subclasses declare
    attributes as usual.

    Examples
    --------
    >>> class Cup(DeclaredAttributes):
    ...     def __init__(self):
    ...         self.fill = 0.0
    >>> cup = Cup()
    >>> cup.fill = 0.5
    >>> cup.fil = 1.0
    Traceback (most recent call last):
    AttributeError: Cup has no attribute 'fil': did you mean fill?
    """

    def __setattr__(self, name: str, value: Any) -> None:
        declared = getattr(type(self), name, UNDECLARED)
        if isinstance(declared, property) and declared.fset is None:
            kind = type(self).__name__
            raise AttributeError(f"{name} of {kind} cannot be assigned: {_cure(name)}")
        if not (name in vars(self) or declared is not UNDECLARED or annotated(type(self), name)):
            caller = inspect.currentframe().f_back  # type: ignore[union-attr]  # CPython has frames
            if not _assigned_by_own_method(self, caller):
                raise AttributeError(unknown_attribute(self, name))
        super().__setattr__(name, value)


class Elsewhere:
    """A name of filterpy that a tracker does not have: reading or assigning it says what to use.

    Parameters
    ----------
    cure : str
        What to use instead.

    Examples
    --------
    >>> class Cup:
    ...     mug = Elsewhere("use fill")
    >>> Cup().mug
    Traceback (most recent call last):
    AttributeError: Cup does not have mug of filterpy: use fill
    """

    def __init__(self, cure: str) -> None:
        self.cure = cure

        self.names: list[str] = []

    def __set_name__(self, owner: type, name: str) -> None:
        self.names.append(name)

    def __get__(self, owner: object, kind: type) -> Any:
        if owner is None:
            return self
        raise AttributeError(self.message(kind))

    def __set__(self, owner: object, value: Any) -> None:
        raise AttributeError(self.message(type(owner)))

    def message(self, kind: type) -> str:
        """Return the sentence for a class of trackers."""
        names = ", ".join(self.names)
        return f"{kind.__name__} does not have {names} of filterpy: {self.cure}"


def annotated(kind: type, name: str) -> bool:
    """Return True if a class or one of its bases annotates a name.

    Examples
    --------
    >>> class Cup:
    ...     fill: float
    >>> annotated(Cup, "fill"), annotated(Cup, "fil")
    (True, False)
    """
    return any(name in inspect.get_annotations(each) for each in kind.__mro__)


def unknown_attribute(owner: DeclaredAttributes, name: str) -> str:
    """Return the message about an attribute that does not exist."""
    kind = type(owner)
    message = f"{kind.__name__} has no attribute {name!r}"
    public = [each for each in {*dir(kind), *vars(owner)} if not each.startswith("_")]
    return f"{message}{similar(name, public)}"


def _cure(name: str) -> str:
    of_models = name in ("F", "Q", "B", "H", "R") or name.startswith("dim_")
    return "assign motion or measurement" if of_models else "it follows from other attributes"


def _assigned_by_own_method(owner: DeclaredAttributes, frame: Any) -> bool:
    """Return True if the object is being constructed, or the frame is that of its method."""
    while frame.f_code.co_name == "__setattr__":
        frame = frame.f_back
    if hasattr(type(owner), frame.f_code.co_name) and _is_method(frame, owner):
        return True
    while frame is not None:
        if frame.f_code.co_name == "__init__" and _is_method(frame, owner):
            return True
        frame = frame.f_back
    return False


def _is_method(frame: Any, owner: DeclaredAttributes) -> bool:
    code = frame.f_code
    first = code.co_varnames[0] if code.co_argcount else None
    return first is not None and frame.f_locals.get(first) is owner
