"""Malformed inputs, kills and interrupts: what is tried, what fails."""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import os
import resource
import sys
import tempfile
import time
from multiprocessing.connection import Connection
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from fuzzing.judging import Fault, Report, try_input

PARTS = ("trackers", "models", "files", "cli", "signals")
LIMIT_S, MEMORY = 30.0, 4 << 30  # of one input, and of the process that tries it


def part(name: str) -> Any:
    """Return the module of a part: `kinds()` and `calls(kind, rng)`."""
    return importlib.import_module(f"fuzzing.{'command_line' if name == 'cli' else name}")


def try_inputs(name: str, seed: int, numbers: range, only: str | None = None) -> Report:
    """Try inputs in this process, for tests; a hang or a crash is not survived."""
    module, report = part(name), Report()
    kinds = module.kinds()
    for number in numbers:
        kind = kinds[number % len(kinds)]
        if only in (None, kind):
            report.add(kind, *try_input(module.calls, kind, seed, number))
    return report


def _work(
    name: str, seed: int, numbers: range, only: str | None, folder: str, results: Connection
) -> None:
    """Try inputs, and send the result of each."""
    tempfile.tempdir = folder
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)
    module = part(name)
    kinds = module.kinds()
    for number in numbers:
        kind = kinds[number % len(kinds)]
        if only in (None, kind):
            try:
                results.send((number, kind, *try_input(module.calls, kind, seed, number)))
            except Exception as error:
                own = f"{type(error).__name__} of the harness: {error}"
                results.send((number, kind, 1, [Fault(own, "harness", "", seed, number)]))
    results.send(None)


def supervise(name: str, seed: int, n_inputs: int, seconds: float, only: str | None) -> Report:
    """Try inputs in a child process that is replaced when it dies or hangs."""
    with tempfile.TemporaryDirectory(prefix="arrivals-fuzz-") as folder:
        return _supervise(name, seed, n_inputs, seconds, only, folder)


def _supervise(
    name: str, seed: int, n_inputs: int, seconds: float, only: str | None, folder: str
) -> Report:
    report, started, first = Report(), time.monotonic(), 0
    kinds = part(name).kinds()
    step = 1 if only is None else len(kinds)
    first = 0 if only is None else kinds.index(only)
    fork = multiprocessing.get_context("fork")
    while first < n_inputs and time.monotonic() - started < seconds:
        results, end = fork.Pipe(duplex=False)
        arguments = (name, seed, range(first, n_inputs, step), only, folder, end)
        child = fork.Process(target=_work, args=arguments, daemon=True)
        child.start()
        end.close()
        died = ""
        while not died and time.monotonic() - started < seconds:
            message: Any = "hang"
            try:
                if results.poll(LIMIT_S):
                    message = results.recv()
            except EOFError:
                child.join()
                died = f"crash: the process died with status {child.exitcode}"
                break
            if message is None:
                first = n_inputs
                break
            if message == "hang":
                died = f"hang: longer than {LIMIT_S:.0f} s"
                break
            number, kind, tried, faults = message
            report.add(kind, tried, faults)
            first = number + step
        child.kill()
        child.join()
        if died:
            kind = kinds[first % len(kinds)]
            report.add(kind, 1, [Fault(died, "process", "see the input", seed, first)])
            first += step
    return report


def show(name: str, seed: int, number: int) -> None:
    """Try one input here, and print its calls as they are made."""
    import numpy as np
    from fuzzing.judging import judge

    module = part(name)
    kinds = module.kinds()
    kind = kinds[number % len(kinds)]
    for call in module.calls(kind, np.random.default_rng([seed, number])):
        print(f"{kind}: {call.text}", flush=True)
        if fault := judge(call):
            print("    ", *fault, flush=True)
            return


def main() -> int:
    """Print the table of a part; the status is 1 if there is a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--inputs", type=int, default=10_000_000)
    parser.add_argument("--only", help="one kind, such as kalman")
    parser.add_argument("--input", type=int, help="show the calls of one input")
    options = parser.parse_args()
    if options.input is not None:
        show(options.part, options.seed, options.input)
        return 0
    if options.inputs == 10_000_000 and options.seconds == float("inf"):
        options.seconds = 60.0
    report = supervise(options.part, options.seed, options.inputs, options.seconds, options.only)
    print("\n".join(report.lines()))
    return int(report.n_faults > 0)


if __name__ == "__main__":
    sys.exit(main())
