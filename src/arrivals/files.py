"""Files of a user: outputs that appear only when complete, inputs that are regular files."""

import contextlib
import errno
import hashlib
import io
import os
import re
import shutil
import socket
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any, BinaryIO

from arrivals.messages import in_line

WAIT_FOR_READER = 5.0  # s, of a named pipe
MAX_NAME_LENGTH = 200  # bytes of a name to which a prefix and a suffix can be added


@contextmanager
def atomic_write(path: str | os.PathLike[str], *, binary: bool = False) -> Iterator[IO[Any]]:
    """Open a text or binary file whose contents reach `path` only if all goes well.

    A regular file is replaced and keeps its mode; links are followed. A device, a pipe or a socket
    is never replaced: it receives the contents. What writers that were killed have left beside the
    file is removed.

    Parameters
    ----------
    path : str or path
        Name of the output.
    binary : bool
        True for a binary file; False for text in UTF-8.

    Yields
    ------
    file
        A file that can be written and positioned.

    Raises
    ------
    OSError
        If the output cannot be written; the error has its name.

    Examples
    --------
    >>> with atomic_write("/nowhere/tracks.csv"):
    ...     pass
    Traceback (most recent call last):
    FileNotFoundError: [Errno 2] the folder does not exist: '/nowhere'
    """
    with _errors_of(path, (None,)):
        check_output(path)
        target = _without_links(path)
        replaced = target is not None and not _is_special(target)
    opened = _beside(target, path) if target is not None and replaced else _through(path)
    with opened as file:
        if binary:
            yield file
        else:
            text = io.TextIOWrapper(file, encoding="utf-8", newline="")
            yield text
            text.detach()


def check_output(path: str | os.PathLike[str]) -> None:
    """Raise an OSError for an output that cannot be written.

    Parameters
    ----------
    path : str or path
        Name of the output.

    Examples
    --------
    >>> check_output("/nowhere/tracks.csv")
    Traceback (most recent call last):
    FileNotFoundError: [Errno 2] the folder does not exist: '/nowhere'
    """
    target = _without_links(path)
    if target is None or _is_special(target):
        return
    folder = os.path.dirname(target) or os.curdir
    if not os.path.isdir(folder):
        raise FileNotFoundError(errno.ENOENT, "the folder does not exist", folder)
    if os.path.isdir(target):
        raise IsADirectoryError(errno.EISDIR, "this is a folder", os.fspath(path))
    if not os.access(folder, os.W_OK):
        raise PermissionError(errno.EACCES, "the folder may not be written to", folder)
    with contextlib.suppress(FileNotFoundError), _errors_of(path, (target,)):
        os.lstat(target)  # its name may be too long
        if not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, "the file may not be written to", target)


def file_error(path: str | os.PathLike[str], error: Exception) -> ValueError:
    """Return an error about a file: one line of limited length that begins with its name.

    Examples
    --------
    >>> file_error("a.csv", ValueError("line 2" + "9" * 1000)).args[0][-8:]
    '99999...'
    """
    return ValueError(f"{os.fspath(path)}: {in_line(error)}")


def open_input(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a regular file for reading; a folder, device, pipe or socket is an error.

    Parameters
    ----------
    path : str or path
        Name of the file.

    Returns
    -------
    file
        Binary file.

    Raises
    ------
    OSError
        If the file does not exist, is not a regular file, or cannot be read.

    Examples
    --------
    >>> open_input(os.curdir)
    Traceback (most recent call last):
    IsADirectoryError: [Errno 21] not a regular file: '.'
    """
    name = os.fspath(path)
    mode = os.stat(name).st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "not a regular file", name)
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "not a regular file", name)
    return open(name, "rb")


@contextmanager
def open_live(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open an output that grows while it is read, such as the table of a stream.

    Parameters
    ----------
    path : str or path
        Name of the output; a regular file is emptied.

    Yields
    ------
    file
        Binary file; `flush` after each complete part.
    """
    with _errors_of(path, (None,)):
        check_output(path)
        target = _without_links(path)
        special = target is None or _is_special(target)
        with _open_special(os.fspath(path)) if special else open(path, "wb") as file:
            yield file


@contextmanager
def _beside(target: str, path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file beside a target that takes its name at the end."""
    folder, name = os.path.split(target)
    encoded = os.fsencode(name)
    if len(encoded) > MAX_NAME_LENGTH:  # a part must have another name of the same target
        name = hashlib.sha256(encoded).hexdigest()
    _remove_abandoned(folder or os.curdir, name)
    part = None
    try:
        with _errors_of(path, (None,)):
            file, part = _new_part(os.path.join(folder, f".{name}.{os.getpid()}"))
        with _errors_of(path, (None, part)):
            with file:
                _copy_mode(target, part)
                yield file
            os.replace(part, target)
    except BaseException:
        if part is not None:
            with contextlib.suppress(OSError):
                os.unlink(part)
        raise


def _new_part(stem: str) -> tuple[BinaryIO, str]:
    """Open a new file; another thread may be writing to the same target."""
    for n in range(1000):
        part = f"{stem}-{n}.part" if n else f"{stem}.part"
        with contextlib.suppress(FileExistsError):
            return open(part, "xb"), part
    raise FileExistsError(errno.EEXIST, "too many unfinished parts beside the file", stem)


def _copy_mode(target: str, part: str) -> None:
    """Give a new file the owner and the mode of the one that it replaces."""
    try:
        old, new = os.stat(target), os.stat(part)
    except OSError:
        return
    if (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
        with contextlib.suppress(OSError):
            os.chown(part, old.st_uid, old.st_gid)
    if old.st_mode != new.st_mode:
        os.chmod(part, stat.S_IMODE(old.st_mode))


def _remove_abandoned(folder: str, name: str) -> None:
    """Remove the parts of a target whose processes have ended."""
    if sys.platform == "win32":  # no signal 0 there
        return
    part = re.compile(re.escape(f".{name}.") + r"(\d{1,9})(-\d+)?\.part")
    with contextlib.suppress(OSError):
        for entry in os.listdir(folder):
            found = part.fullmatch(entry)
            if found and not _is_alive(int(found[1])):
                os.unlink(os.path.join(folder, entry))


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        pass
    return True


@contextmanager
def _through(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Collect the contents, then write them to a device, pipe or socket."""
    with _errors_of(path, (None,)), tempfile.TemporaryFile() as contents:
        yield contents
        contents.seek(0)
        with _open_special(os.fspath(path)) as file:
            shutil.copyfileobj(contents, file)


def _open_special(path: str) -> BinaryIO:
    """Open a device, a pipe once it has a reader, or a socket, for writing."""
    mode = os.stat(path).st_mode
    if stat.S_ISSOCK(mode) and hasattr(socket, "AF_UNIX"):
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(path)
            return client.makefile("wb")
    if not stat.S_ISFIFO(mode):
        return open(path, "ab")  # not emptied if it is an open file: `>> file`
    last = time.monotonic() + WAIT_FOR_READER
    while True:
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        except OSError as error:
            if error.errno != errno.ENXIO:
                raise
            if time.monotonic() > last:
                raise OSError(errno.ENXIO, "no process reads this pipe", path) from None
            time.sleep(0.02)
        else:
            os.set_blocking(descriptor, True)
            return open(descriptor, "wb")


def _without_links(path: str | os.PathLike[str]) -> str | None:
    """Return the name to which links lead; None if it is that of an open file of a process."""
    name = os.fspath(path)
    for _ in range(40):
        folder = os.path.realpath(os.path.dirname(name))
        if folder.startswith("/proc/"):
            return None
        if not os.path.islink(name):
            return name
        name = os.path.join(os.path.dirname(name), os.readlink(name))
    raise OSError(errno.ELOOP, "too many levels of symbolic links", os.fspath(path))


def _is_special(name: str) -> bool:
    """Return True if a name is that of something other than a regular file or a folder."""
    try:
        mode = os.stat(name).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


@contextmanager
def _errors_of(path: str | os.PathLike[str], names: tuple[str | None, ...]) -> Iterator[None]:
    """Put the user's name of a file into errors without one, or with one of these names."""
    try:
        yield
    except OSError as error:
        if error.filename in names:
            error.filename, error.filename2 = os.fspath(path), None
        raise
