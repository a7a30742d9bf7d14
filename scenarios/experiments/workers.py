"""Work in other processes, and what is said when one of them dies."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

T = TypeVar("T")
NOT_KEPT = "this study keeps no runs and starts anew when called again; finished ones stay"


@contextmanager
def report_worker_failure(kept: str) -> Iterator[None]:
    """Tell in one line that a process was killed, and what is kept.

    Parameters
    ----------
    kept : str
        Where what was finished is, and how to go on.

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
            f"a worker process died ({_cause(str(error))}); {kept}; if memory ran out, with fewer "
            "processes"
        ) from None


def _cause(message: str) -> str:
    """Return the exit codes that joblib tells, or that there are none.

    Examples
    --------
    >>> _cause("A worker process ... The exit codes of the workers are {SIGKILL(-9), EXIT(0)}")
    'SIGKILL(-9)'
    """
    codes = re.findall(r"\w+\(-?\d+\)", message)
    bad = dict.fromkeys(code for code in codes if code != "EXIT(0)")
    return ", ".join(bad) or "killed, or out of memory"


def parallel_map(function: Callable[..., T], cases: Iterable[Sequence[Any]]) -> list[T]:
    """Call a function with the arguments of every case, on as many processes as joblib is told.

    Inside `joblib.parallel_config(n_jobs=...)` that many, else in this one; the results are those
    of a loop, in its order.

    Raises
    ------
    ChildProcessError
        If a process died.

    Examples
    --------
    >>> parallel_map(pow, [(2, 3), (3, 2)])
    [8, 9]
    """
    from joblib import Parallel, delayed

    with report_worker_failure(NOT_KEPT):
        return list(Parallel()(delayed(function)(*case) for case in cases))
