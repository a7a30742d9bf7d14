"""Write files that appear under their name only when complete."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any


@contextmanager
def atomic_write(path: str | os.PathLike[str], *, binary: bool = False) -> Iterator[IO[Any]]:
    """Open a text or binary file beside `path` that takes its name only if all goes well.

    Examples
    --------
    >>> with atomic_write("/nowhere/tracks.csv"):
    ...     pass
    Traceback (most recent call last):
    FileNotFoundError: [Errno 2] the folder /nowhere does not exist
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(2, f"the folder {target.parent} does not exist")
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        text_mode: dict[str, Any] = {} if binary else {"newline": "", "encoding": "utf-8"}
        with open(part, "wb" if binary else "w", **text_mode) as file:
            yield file
        os.replace(part, target)
    except BaseException as error:
        part.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename in (None, str(part)):
            error.filename = str(target)
        raise
