"""Resumable results file of a study: one row a number, below a line with the configuration.

A row ends with a checksum of itself and of that line; rows of older files have none.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import io
import json
import os
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import arrivals
from arrivals import measurement_models, motion_models, trackers
from arrivals.files import atomic_write, open_input
from arrivals.scenarios.experiments.batch import Row

MARK = "# arrivals study "
COLUMNS = (*Row._fields, "check")
NO_ROW = "is not a row of a study: remove it to resume"
CHANGED = "does not agree with its checksum, it or line 1 was changed: remove it to resume"
MAX_CONFIG = 2**24  # characters of the first line


def fingerprint(config: Mapping[str, Any]) -> str:
    """Return a hash of a configuration without the version, ten hexadecimal digits.

    Examples
    --------
    >>> fingerprint({"seed": 0}) == fingerprint({"seed": 1})
    False
    """
    identity = {key: value for key, value in config.items() if key != "version"}
    return hashlib.sha256(_text(identity).encode()).hexdigest()[:10]


def code_mark(modules: Iterable[str] | None = None) -> str:
    """Return a hash of the code of trackers, models and the named modules, ten digits.

    It has the modules that all share, too, and all scenarios if no modules are given. The version
    is not part of it: a release with the same code continues a study.

    Examples
    --------
    >>> code_mark([]) == code_mark(["arrivals.scenarios.simulations.line_arrays"])
    False
    """
    packages = (measurement_models, motion_models, trackers)
    files = {path for package in packages for path in Path(package.__path__[0]).rglob("*.py")}
    shared = Path(arrivals.__file__).parent.glob("*.py")
    files |= {path for path in shared if path.name != "__init__.py"}  # which has the version
    if modules is None:
        files |= set(Path(__file__).parents[1].rglob("*.py"))
    named = (getattr(sys.modules.get(name), "__file__", None) for name in modules or ())
    files |= {Path(file) for file in named if file}
    contents = hashlib.sha256()
    for path in sorted(files):
        contents.update(path.read_bytes())
    return contents.hexdigest()[:10]


def _text(config: Mapping[str, Any]) -> str:
    return json.dumps(config, sort_keys=True, ensure_ascii=True)


class Results:
    """Rows in a file, which other processes may read at any time, or in memory.

    Parameters
    ----------
    config : mapping
        Configuration of the study, as JSON has it.
    path : path, optional
        A CSV file, or a folder in which each configuration has its own file. In memory if None.

    Raises
    ------
    ValueError
        If the file is not a study file, or has another configuration.
    OSError
        If it cannot be read or written.
    """

    def __init__(self, config: Mapping[str, Any], path: str | os.PathLike[str] | None) -> None:
        self.config = dict(config)
        self.path = None if path is None else _place(Path(path), config)
        self._rows: list[Row] = []
        if self.path is not None and self.path.exists():
            stored = read_config(self.path)
            self._check(stored)
            if "version" in stored:  # in which the study began
                self.config["version"] = stored["version"]

    def _check(self, other: Mapping[str, Any]) -> None:
        """Reject a file of another study, or with rows of cases that its first line lacks."""
        keys = {*self.config, *other} - ({"version"} & other.keys())
        differ = sorted(k for k in keys if self.config.get(k) != other.get(k))
        if differ:
            raise ValueError(
                f"{self.path} must be the file of this study; got another {', '.join(differ)}: "
                "name another file, or a folder, in which each study has its own file"
            )
        scenarios = other.get("scenarios", {})
        strange = next((row.case for row in self.rows() if row.case not in scenarios), None)
        if strange is not None:
            raise ValueError(
                f"cases of {self.path} must be those of its first line; got {strange!r}"
            )

    def rows(self) -> Iterator[Row]:
        """Iterate over the rows, in order of completion."""
        return iter(self._rows) if self.path is None else read_rows(self.path)

    def keep(self, condition: Callable[[Row], bool]) -> None:
        """Keep the rows that satisfy a condition; remove the others and an incomplete last line."""
        if self.path is None or not self.path.exists():
            return
        if _is_complete(self.path) and all(condition(row) for row in self.rows()):
            return
        with atomic_write(self.path) as file:
            file.write(self._head())
            self._write(file, (row for row in self.rows() if condition(row)))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Lock the file against other writers; the lock ends with the process.

        Raises
        ------
        BlockingIOError
            If another process has the lock.
        """
        if self.path is None or sys.platform == "win32":
            yield
            return
        import fcntl

        lock = self.path.with_name(f".{self.path.name}.lock")
        with open(lock, "w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise BlockingIOError(f"another process is writing to {self.path}") from None
            try:
                yield
            finally:
                lock.unlink(missing_ok=True)

    def add(self, rows: Iterable[Row]) -> None:
        """Append rows and write them to the file.

        Raises
        ------
        OSError
            If the disk is full; earlier rows are kept.
        """
        if self.path is None:
            self._rows.extend(rows)
            return
        new = not self.path.exists()  # removed again if its first rows cannot be written
        lines = io.StringIO()
        self._write(lines, rows)
        size = 0 if new else self.path.stat().st_size
        try:
            with open(self.path, "ab") as file:
                file.write(((self._head() if new else "") + lines.getvalue()).encode())
        except OSError as error:
            with contextlib.suppress(OSError):
                self.path.unlink() if new else os.truncate(self.path, size)
            raise OSError(
                error.errno,
                f"{error.strerror}: finished runs are kept; call again to resume",
                str(self.path),
            ) from None

    def _write(self, file: IO[str], rows: Iterable[Row]) -> None:
        first = self._head().partition("\n")[0]
        cells = ([str(value) for value in row] for row in rows)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([*row, _checksum(first, row)] for row in cells)

    def _head(self) -> str:
        return f"{MARK}{_text(self.config)}\n{','.join(COLUMNS)}\n"


def _checksum(first: str, cells: Iterable[str]) -> str:
    """Return the checksum of a row below a first line, eight hexadecimal digits."""
    return f"{zlib.crc32(chr(0).join([first, *cells]).encode()):08x}"


def _place(path: Path, config: Mapping[str, Any]) -> Path:
    if path.suffix == ".csv" and not path.is_dir():
        if not path.parent.is_dir():
            raise FileNotFoundError(2, "the folder does not exist", str(path.parent))
        return path
    path.mkdir(parents=True, exist_ok=True)
    return path / f"study-{fingerprint(config)}.csv"


def _is_complete(path: Path) -> bool:
    """Return True if the last line of a file is complete, and its rows have checksums."""
    with open_input(path) as file:
        file.readline(MAX_CONFIG)
        heading = file.readline(MAX_CONFIG).decode(errors="replace")
        file.seek(-1, os.SEEK_END)
        return file.read() == b"\n" and heading == ",".join(COLUMNS) + "\n"


def _opened(path: Path) -> IO[str]:
    return io.TextIOWrapper(open_input(path), encoding="utf-8", errors="replace", newline="")


def read_config(path: Path) -> dict[str, Any]:
    """Return the configuration in the first line of a study file.

    Raises
    ------
    ValueError
        If the file is not a study file.
    """
    with _opened(path) as file:
        first = file.readline(MAX_CONFIG)
    try:
        config: Any = json.loads(first.removeprefix(MARK)) if first.startswith(MARK) else None
    except (ValueError, RecursionError):
        config = None
    if not isinstance(config, dict) or not {"scenarios", "methods"} <= config.keys():
        raise ValueError(f"{path} is not a study file")
    return config


def read_rows(path: Path) -> Iterator[Row]:
    """Iterate over the rows of a study file, without an incomplete last line.

    Raises
    ------
    ValueError
        If another line is not a row, or does not agree with its checksum.
    """
    if not path.exists():
        return
    with _opened(path) as file:
        first = file.readline(MAX_CONFIG).removesuffix("\n")
        has_checksums = file.readline(MAX_CONFIG) == ",".join(COLUMNS) + "\n"
        lines = csv.reader(line for line in file if line.endswith("\n"))
        try:
            for cells in lines:
                yield _row(cells, first, has_checksums)
        except (ValueError, csv.Error) as error:
            fault = CHANGED if str(error) == CHANGED else NO_ROW
            raise ValueError(f"line {lines.line_num + 2} of {path} {fault}") from None


def _row(cells: list[str], first: str, has_checksum: bool) -> Row:
    case, run, method, metric, value, note, *check = cells
    row = Row(case, int(run), method, metric, float(value), note)
    if (check or has_checksum) and check != [_checksum(first, cells[: len(row)])]:
        raise ValueError(CHANGED)
    return row
