"""Tables of numbers in text files."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from arrivals.files import open_input
from arrivals.recordings.formats.file_contents import FileContents, ReadingOptions, check_size
from arrivals.tables import MISSING, TableLine, plain, table_lines

TIME_HEADINGS = ("time", "time_s", "t")  # of a first column with times


def read_text(path: Path, options: ReadingOptions) -> FileContents:
    """Return the table of a text file, and the times of a first column with that heading."""
    check_size(path.stat().st_size, options.max_bytes)
    with open_input(path) as file:
        return _table(file)


def _table(file: BinaryIO) -> FileContents:
    rows: list[NDArray[Any]] = []
    heading: list[str] | None = None
    for line in table_lines(file.read()):
        if not rows and heading is None and _is_heading(line):
            heading = line.cells
            continue
        n = len(line.cells)
        if rows and n != len(rows[0]):
            raise ValueError(f"line {line.number} must have {len(rows[0])} values; got {n}")
        rows.append(np.array(_numbers(line)))
    if not rows:
        raise ValueError("the file contains no numbers")
    table = np.array(rows)
    if heading and heading[0].strip().lower() in TIME_HEADINGS and table.shape[1] > 1:
        return FileContents(table[:, 1:], time=table[:, 0].real)
    return FileContents(table)


def _numbers(line: TableLine) -> list[float] | list[float | complex]:
    try:
        if "_" not in "".join(line.cells):
            return list(map(float, line.cells))  # the usual case
    except ValueError:
        pass
    return [_number(line, column) for column in range(len(line.cells))]


def _is_heading(line: TableLine) -> bool:
    """Return True if no cell is a number and a cell is something else than missing."""
    return not any(_is_number(line, column) for column in range(len(line.cells))) and any(
        cell.strip().lower() not in MISSING for cell in line.cells
    )


def _is_number(line: TableLine, column: int) -> bool:
    try:
        is_nan = line.cells[column].strip().lower() == "nan"
        return is_nan or not math.isnan(abs(_number(line, column)))
    except ValueError:
        return False


def _number(line: TableLine, column: int) -> float | complex:
    """Return the real or complex number in a cell, NaN if it is missing."""
    try:
        return line.real(column)
    except ValueError:
        text = plain(line.cells[column], line.separator)
    try:
        text = re.sub(r"\s*([+-])\s*", r"\1", re.sub(r"i(?=\)?$)", "j", text)).replace("+-", "-")
        return complex("" if "_" in text else text)
    except ValueError:
        got = line.cells[column].strip()
        raise ValueError(f"line {line.number} must contain numbers; got {got!r}") from None
