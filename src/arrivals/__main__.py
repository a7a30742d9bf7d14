"""Run the command line: python -m arrivals."""

import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, TextIO

MAX_MESSAGE_LENGTH = 1000  # characters: an error may quote a whole file


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process if None.

    Returns
    -------
    int
        0; 1 if `arrivals check` finds a fault; 2 for invalid input, with one line on standard
        error; 130 after an interrupt. If the reader of standard output closes it, the program ends
        with status 0. With ARRIVALS_DEBUG=1 in the environment, an error prints its traceback too.

    Examples
    --------
    >>> main(["list"])  # doctest: +ELLIPSIS
    trackers
      ar_kalman_qrd_rls ...
    0
    """
    try:
        _prepare_streams()
        status = _run(argv)
        sys.stdout.flush()
        return status
    except BaseException as error:
        _flush(sys.stdout)
        if isinstance(error, BrokenPipeError) and error.filename is None:
            return 0
        if isinstance(error, KeyboardInterrupt):
            return 130
        if not isinstance(error, Exception):
            raise
        _report(error)
        return 2


def _run(argv: Sequence[str] | None) -> int:
    from arrivals.cli.main import run

    with warnings.catch_warnings():
        if not sys.warnoptions:
            warnings.simplefilter("default", UserWarning)
        warnings.showwarning = _print_warning  # type: ignore[assignment]  # its first argument
        try:
            return run(argv)
        except SystemExit as end:  # of -h and --version
            return end.code if isinstance(end.code, int) else 2 if end.code else 0


def _print_warning(text: Warning | str, *_: Any, **__: Any) -> None:
    with suppress(OSError):
        print(f"arrivals: warning: {' '.join(str(text).split())}", file=sys.stderr)


def message(error: Exception) -> str:
    """Return the message of an error in one line.

    Examples
    --------
    >>> message(FileNotFoundError(2, "No such file or directory", "a.wav"))
    'a.wav: No such file or directory'
    >>> message(KeyError("x"))
    "internal error: KeyError: 'x'; set ARRIVALS_DEBUG=1 for the traceback"
    >>> message(ImportError("reading a .flac file requires soundfile"))
    'reading a .flac file requires soundfile'
    """
    text = " ".join(str(error).split()) or "not enough memory"
    if isinstance(error, OSError) and (error.filename or error.strerror):
        name = error.filename or "standard input or output"  # all other files have names
        text = " ".join(f"{name}: {error.strerror or text}{_similar_file(error)}".split())
    if len(text) > MAX_MESSAGE_LENGTH:
        text = f"{text[:MAX_MESSAGE_LENGTH]} ..."
    if isinstance(error, ValueError | TypeError | OSError | MemoryError | Warning):
        return text
    if isinstance(error, ImportError) and error.name is None:  # ours: Python's own has a name
        return text
    name = type(error).__name__
    return f"internal error: {name}: {text}; set ARRIVALS_DEBUG=1 for the traceback"


def _similar_file(error: OSError) -> str:
    """Return a hint about a file that does not exist, empty if its folder has none like it."""
    if not isinstance(error, FileNotFoundError) or not isinstance(error.filename, str):
        return ""
    from arrivals.messages import similar

    folder, name = os.path.split(error.filename)
    try:
        hint = similar(name, os.listdir(folder or os.curdir))
    except OSError:
        return ""
    return hint


def _report(error: Exception) -> None:
    """Print the message of an error, if standard error can be written to."""
    with suppress(OSError):
        if os.environ.get("ARRIVALS_DEBUG") == "1":
            import traceback

            traceback.print_exception(error)
        print(f"arrivals: {message(error)}", file=sys.stderr)
    _flush(sys.stderr)


def _prepare_streams() -> None:
    """Replace standard streams that are closed, and characters that an output cannot show."""
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115  (for the whole program)
    if sys.stdout is None:  # writing to it is an error, as elsewhere
        sys.stdout = open(os.open(os.devnull, os.O_RDONLY), "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    raises = getattr(sys.stdout, "errors", None) in ("strict", "surrogateescape")
    if raises and hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")


def _flush(stream: TextIO) -> None:
    """Flush a stream; if it is broken, redirect it so that the last flush raises no error."""
    try:
        stream.flush()
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)


if __name__ == "__main__":
    sys.exit(main())
