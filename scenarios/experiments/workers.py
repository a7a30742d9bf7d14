"""Parallel calls by joblib, and the report of a killed worker process."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

T = TypeVar("T")
NOT_KEPT = "this study keeps no runs and starts again from the first; finished studies are kept"


@contextmanager
def report_worker_failure(kept: str) -> Iterator[None]:
    """Report a killed worker process in one line.

    Parameters
    ----------
    kept : str
        Place of the finished runs, and how to resume.

    Raises
    ------
    ChildProcessError
        In place of joblib's error.
    """
    from joblib.externals.loky.process_executor import BrokenProcessPool

    try:
        yield
    except BrokenProcessPool as error:
        raise ChildProcessError(
            f"a worker process died ({_cause(str(error))}); {kept}; use fewer processes if memory "
            "ran out"
        ) from None


def _cause(message: str) -> str:
    """Return the exit codes in a message of joblib, or a guess if it has none.

    Examples
    --------
    >>> _cause("A worker process ... The exit codes of the workers are {SIGKILL(-9), EXIT(0)}")
    'SIGKILL(-9)'
    """
    codes = re.findall(r"\w+\(-?\d+\)", message)
    bad = dict.fromkeys(code for code in codes if code != "EXIT(0)")
    return ", ".join(bad) or "killed, or out of memory"


def parallel_map(function: Callable[..., T], cases: Iterable[Sequence[Any]]) -> list[T]:
    """Call a function with the arguments of every case, in the processes that joblib is set to.

    `joblib.parallel_config(n_jobs=...)` sets their number; without it all run in this process.

    Parameters
    ----------
    function : callable
        Called once a case.
    cases : iterable of sequence
        Positional arguments of each call.

    Returns
    -------
    list
        Results in the order of the cases.

    Raises
    ------
    ChildProcessError
        If a process was killed.

    Examples
    --------
    >>> parallel_map(pow, [(2, 3), (3, 2)])
    [8, 9]
    """
    from joblib import Parallel, delayed

    with report_worker_failure(NOT_KEPT):
        return list(Parallel()(delayed(function)(*case) for case in cases))
