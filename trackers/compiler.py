"""Compile functions by numba if it is installed; else leave them as they are."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])
MIN_NUMBA = (0, 61)  # the first for numpy 2.1 and later


def compiled(function: Function, sources: Path | None = None) -> Function:
    """Return a function that is compiled at its first call, and kept on disk; or as it is.

    numba compiles anew if the function's own module has changed. If it uses others of the folder
    `sources`, the name of its file has a digest of them all.
    """
    if compiler_error() is None and sources is not None:
        function.__qualname__ += f"_{digest(sources)}"
    return _with_options(function, cache=True)


def compiled_part(function: Function) -> Function:
    """Return the same for a function that only compiled functions call, and that they include.

    It has no file, and no form that Python could call: it compiles faster.
    """
    return _with_options(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def _with_options(function: Function, **options: bool) -> Function:
    if compiler_error() is not None:
        return function
    import numba

    jit: Any = numba.njit
    # no fast math: sums reordered by what is inlined differ between compiled and loaded functions
    result: Function = jit(function, error_model="numpy", **options)
    return result


def digest(folder: Path) -> str:
    """Return a digest of the Python files of a folder and those below, and of this one."""
    sources = [Path(__file__), *sorted(folder.rglob("*.py"))]
    return sha256(b"".join(each.read_bytes() for each in sources)).hexdigest()[:16]


@cache
def compiler_error() -> str | None:
    """Return why numba cannot be used: "" if it is not installed, None if it can."""
    try:
        import numba
    except ModuleNotFoundError as error:
        return "" if error.name == "numba" else str(error)
    except Exception as error:  # a broken installation raises any of them
        return str(error)
    version = tuple(int(part) for part in numba.__version__.split(".")[:2])
    if version < MIN_NUMBA:
        oldest = ".".join(map(str, MIN_NUMBA))
        return f"numba must be at least {oldest}; got {numba.__version__}"
    return None
