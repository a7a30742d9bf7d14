"""Run the command line: python -m arrivals."""

import os
import sys
from collections.abc import Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process if None.

    Returns
    -------
    int
        0; 2 for invalid input, with one line on standard error; 130 after an interrupt. If the
        reader of standard output closes it, the program ends with status 0.

    Examples
    --------
    >>> main(["list"])  # doctest: +ELLIPSIS
    trackers
      ar_kalman_qrd_rls ...
    0
    """
    try:
        from arrivals.cli.main import run

        run(argv)
        sys.stdout.flush()
    except BrokenPipeError:
        _drop_output()
    except KeyboardInterrupt:
        _flush_output()
        return 130
    except (ValueError, TypeError, OSError, MemoryError) as error:
        _flush_output()
        print(f"arrivals: {message(error)}", file=sys.stderr)
        return 2
    return 0


def message(error: Exception) -> str:
    """Return the message of an error in one line.

    Examples
    --------
    >>> message(FileNotFoundError(2, "No such file or directory", "a.wav"))
    'a.wav: No such file or directory'
    """
    text = str(error)
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(text.split()) or type(error).__name__


def _flush_output() -> None:
    try:
        sys.stdout.flush()
    except OSError:
        _drop_output()


def _drop_output() -> None:
    """Redirect standard output to the null device, so that the last flush raises no error."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


if __name__ == "__main__":
    sys.exit(main())
