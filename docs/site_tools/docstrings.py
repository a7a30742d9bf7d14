"""Docstrings as the reference shows them: literal bars and stars, and names in backticks."""

import inspect
import re
from collections.abc import Callable
from typing import Any

from docutils import nodes
from sphinx.domains.python import PyXRefRole

STAR = re.compile(r"(?<![*\\])\*(?![*\s])")  # neither bold type nor a bullet
ATTRIBUTE = re.compile(r":obj:`(\w+) <\.\w+>`")  # numpydoc's link to an attribute of any class
PARTS = re.compile(r"(``.*?``|`[^`]*`)")


def signature(
    app: object, what: str, name: str, thing: Any, options: object, text: str | None, result: object
) -> tuple[str, str] | None:
    """Return the parameters of a class or a function, with models as defaults in short.

    It answers Sphinx's event `autodoc-process-signature`. A metaclass hides those of trackers.
    """
    if what not in ("class", "function") or not text:
        return None
    parameters = [
        one.replace(annotation=one.empty, default=short(one.default))
        for one in inspect.signature(thing).parameters.values()
    ]
    return str(inspect.Signature(parameters)), ""


class Short:
    """A default value that is shown as the call of its class, without arguments."""

    def __init__(self, value: object) -> None:
        self.name = type(value).__name__

    def __repr__(self) -> str:
        return "..." if self.name.startswith("_") else f"{self.name}(...)"


def short(value: Any) -> Any:
    """Return a default value, or in its place one that is shown in short."""
    plain = value is None or value is inspect.Parameter.empty
    return value if plain or isinstance(value, bool | int | float | str | tuple) else Short(value)


def escape(
    app: object, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Escape what docstrings mean literally and reStructuredText does not.

    It answers Sphinx's event `autodoc-process-docstring`, after numpydoc. Examples are left alone.
    """
    example = False
    for i, line in enumerate(lines):
        example = line.lstrip().startswith(">>>") or (example and bool(line.strip()))
        if not example:
            lines[i] = escaped(line)


def escaped(line: str) -> str:
    """Return a line with bars of |x| and stars of (*x, y) escaped, and `x`² separated."""
    parts = PARTS.split(ATTRIBUTE.sub(r"**\1**", line))
    parts[::2] = [STAR.sub(r"\*", part.replace("|", r"\|")) for part in parts[::2]]
    for i in range(2, len(parts), 2):
        if parts[i][:1].isalnum():
            parts[i] = rf"\ {parts[i]}"
    return "".join(parts)


def name_role(pages: dict[str, str]) -> Callable[..., Any]:
    """Return the role of text in backticks: a link for a public name, and code for all else.

    Parameters
    ----------
    pages : dict of str
        Full name under which a public name is documented, by full name.
    """
    short: dict[str, set[str]] = {}
    for full, page in pages.items():
        short.setdefault(full.rsplit(".", 1)[1], set()).add(page)
    target = {name: one for name, (one, *more) in short.items() if not more} | pages
    # a word that is a name and a noun, such as `grid`, is mostly the parameter
    linked = {name: to for name, to in target.items() if "." in name or name[0].isupper()}
    reference = PyXRefRole()

    def role(
        kind: str, raw: str, text: str, line: int, inliner: Any, *more: Any
    ) -> tuple[list[nodes.Node], list[Any]]:
        if text in linked:
            words = f"{text} <{linked[text]}>"
            return reference("py:obj", f"`{words}`", words, line, inliner, *more)
        return [nodes.literal(raw, text)], []

    return role
