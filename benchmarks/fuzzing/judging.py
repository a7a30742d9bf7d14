"""What counts as a fault, and how faults are counted.

An error of a user has to be a ValueError or TypeError that the package raises on purpose, in one
line, and leaves everything as it was. Anything else is a fault: another exception, an error of
numpy or Python that comes through, a warning of numpy, a changed state or argument, a number that
is silently not finite, a hang, a crash.
"""

from __future__ import annotations

import copy
import linecache
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import arrivals
from arrivals.trackers.conformance import difference

LONGEST_MESSAGE = 600
HOMES = (str(Path(arrivals.__file__).parent), *(
    str((Path(arrivals.__file__).parent / name).resolve())
    for name in ("trackers", "motion_models", "measurement_models", "scenarios")
))  # fmt: skip


@dataclass
class Call:
    """One call to try.

    Attributes
    ----------
    text : str
        The call, as a report prints it.
    run : callable
        Makes the call.
    subject : object or None
        Object that an error must leave as it was.
    arguments : tuple
        What the call must not modify.
    check : callable or None
        Return what is wrong after a call without an error, or None.
    allowed : tuple of type
        Exceptions that are right.
    deliberate : bool
        Whether an exception has to be raised by the package itself.
    extreme : bool
        Whether its numbers are so large or so small that warnings of numpy are no fault.
    counts : bool
        Whether it is one of the inputs tried, rather than a usual step between them.
    """

    text: str
    run: Callable[[], Any]
    subject: Any = None
    arguments: tuple[Any, ...] = ()
    check: Callable[[Any], str | None] | None = None
    allowed: tuple[type[Exception], ...] = (ValueError, TypeError)
    deliberate: bool = True
    extreme: bool = False
    counts: bool = True
    failed: bool = field(default=False, init=False)


@dataclass(frozen=True)
class Fault:
    """A fault: what happened where, and the input that shows it."""

    what: str
    place: str
    call: str
    seed: int
    number: int

    @property
    def key(self) -> tuple[str, str]:
        """What happened, without details, and the place."""
        return self.what.partition(":")[0], self.place


def judge(call: Call) -> tuple[str, str] | None:
    """Make a call; return what is wrong and the place, or None."""
    before = _state(call.subject)
    kept = _contents(call.arguments)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result = call.run()
        except Exception as error:
            call.failed = True
            fault = _of_error(error, call)
        else:
            fault = _after(call, result)
    if fault is None and call.failed and call.subject is not None:
        changed = difference(before, _state(call.subject), "state")
        fault = (f"state changed by an error: {_short(changed)}", changed[:60]) if changed else None
    if fault is None and kept != _contents(call.arguments):
        fault = "argument modified", "in the call"
    return fault or (None if call.extreme else _of_warnings(caught))


def _contents(arguments: tuple[Any, ...]) -> list[bytes]:
    return [a.tobytes() for a in arguments if type(a) is np.ndarray]


def _after(call: Call, result: Any) -> tuple[str, str] | None:
    """Return what is wrong after a call without an error."""
    try:
        wrong = call.check(result) if call.check else None
    except Exception as error:
        fault = _of_error(error, call)
        return (f"after the call: {fault[0]}", fault[1]) if fault else None
    return (wrong, "after the call") if wrong else None


def _state(subject: Any) -> Any:
    return None if subject is None else copy.deepcopy(vars(subject))


def _of_error(error: Exception, call: Call) -> tuple[str, str] | None:
    place, line = _place(error)
    kind, message = type(error), str(error)
    if kind not in call.allowed and Exception not in call.allowed:
        return f"{kind.__name__}: {_short(message)}", place
    if "\n" in message:
        return f"multi-line {kind.__name__}: {_short(message)}", place
    if len(message) > LONGEST_MESSAGE:
        return f"long {kind.__name__}: {len(message)} characters, {_short(message)}", place
    of_signature = "() missing" in message or "() got" in message  # names the arguments
    if call.deliberate and not of_signature and not line.startswith("raise"):
        return f"foreign {kind.__name__}: {_short(message)}", place
    return None


def _place(error: Exception) -> tuple[str, str]:
    """Return file and line of the package's innermost frame, and the last line of all."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename.startswith(HOMES)]
    last, home = frames[-1], (own or frames)[-1]
    is_own = last.filename.startswith(HOMES)
    line = linecache.getline(last.filename, last.lineno or 0).strip() if is_own else ""
    return f"{'/'.join(Path(home.filename).parts[-2:])}:{home.lineno}", line


def _of_warnings(caught: list[warnings.WarningMessage]) -> tuple[str, str] | None:
    for warning in caught:
        name, text = warning.category.__name__, str(warning.message)
        if warning.category is not UserWarning:
            place = "/".join(Path(warning.filename).parts[-2:])
            return f"{name}: {_short(text)}", f"{place}:{warning.lineno}"
        if "\n" in text:
            return f"multi-line {name}: {_short(text)}", "warning"
    return None


def _short(text: str | None) -> str:
    line = " ".join((text or "").split())
    return line if len(line) < 160 else line[:157] + "..."


@dataclass
class Report:
    """Inputs tried and faults found, by kind."""

    tried: dict[str, int] = field(default_factory=dict)
    faulty: dict[str, int] = field(default_factory=dict)
    distinct: dict[tuple[str, tuple[str, str]], Fault] = field(default_factory=dict)

    def add(self, kind: str, tried: int, faults: list[Fault]) -> None:
        """Count inputs and faults of one kind; the shortest call of equal faults is kept."""
        self.tried[kind] = self.tried.get(kind, 0) + tried
        self.faulty[kind] = self.faulty.get(kind, 0) + len(faults)
        for fault in faults:
            known = self.distinct.get((kind, fault.key))
            if known is None or len(fault.call) < len(known.call):
                self.distinct[kind, fault.key] = fault

    @property
    def n_tried(self) -> int:
        """Number of inputs."""
        return sum(self.tried.values())

    @property
    def n_faults(self) -> int:
        """Number of inputs at fault."""
        return sum(self.faulty.values())

    def lines(self) -> Iterator[str]:
        """Iterate over the lines of the table, then the distinct faults."""
        yield "| kind | tried | faults | distinct |"
        yield "|---|---|---|---|"
        kinds = [kind for kind, _ in self.distinct]
        for kind in sorted(self.tried):
            yield f"| {kind} | {self.tried[kind]} | {self.faulty[kind]} | {kinds.count(kind)} |"
        yield f"| all | {self.n_tried} | {self.n_faults} | {len(kinds)} |"
        for (kind, _), fault in sorted(self.distinct.items(), key=lambda item: item[0]):
            where = f"--seed {fault.seed} --input {fault.number}"
            yield f"{kind}: {fault.what} [{fault.place}] {fault.call} ({where})"


def try_input(
    calls: Callable[[str, np.random.Generator], Iterator[Call]], kind: str, seed: int, number: int
) -> tuple[int, list[Fault]]:
    """Try the calls of one input until one is at fault; return their number and the faults."""
    tried, history = 0, []
    for call in calls(kind, np.random.default_rng([seed, number])):
        tried += call.counts
        history.append(call.text)
        if fault := judge(call):
            return tried, [Fault(*fault, "; ".join(history[-3:]), seed, number)]
    return tried, []
