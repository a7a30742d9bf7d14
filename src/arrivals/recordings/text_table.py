"""Tables of numbers in text files."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.file_contents import FileContents

TIME_HEADINGS = ("time", "time_s", "t")  # of a first column with times


def read_text(file: BinaryIO) -> FileContents:
    """Return the table of a text file, and the times of a first column with that heading."""
    rows: list[NDArray[Any]] = []
    heading: list[str] | None = None
    for line, cells in _lines(io.TextIOWrapper(file, encoding="utf-8-sig")):
        if not rows and heading is None and not any(map(_is_number, cells)):
            heading = cells
            continue
        if rows and len(cells) != len(rows[0]):
            raise ValueError(f"line {line} must have {len(rows[0])} values; got {len(cells)}")
        rows.append(np.array([_cell(cell, line) for cell in cells]))
    if not rows:
        raise ValueError("the file contains no numbers")
    table = np.array(rows)
    if heading and heading[0].strip().lower() in TIME_HEADINGS and table.shape[1] > 1:
        return FileContents(table[:, 1:], time=table[:, 0].real)
    return FileContents(table)


def _lines(file: io.TextIOWrapper) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each line that is not blank or a comment."""
    separator: str | None = ""
    for number, line in enumerate(file, 1):
        line = line.strip(" \r\n")
        if not line or line[0] in "#%":
            continue
        if separator == "":
            separator = next((s for s in ";,\t" if s in line), None)
        line = line.replace(",", ".") if separator == ";" else line  # a decimal comma
        yield number, line.split(separator)


def _is_number(cell: str) -> bool:
    try:
        return bool(cell.strip()) and _cell(cell, 1) is not None
    except ValueError:
        return False


def _cell(cell: str, line: int) -> float | complex:
    """Return the number in a cell, NaN if it is empty."""
    text = cell.strip()
    try:
        return float(text or "nan")
    except ValueError:
        pass
    try:
        return complex(re.sub(r"i(?=\)?$)", "j", text.replace(" ", "")).replace("+-", "-"))
    except ValueError:
        raise ValueError(f"line {line} must contain numbers; got {text!r}") from None
