"""Cells of text tables, with the separators and the encodings that spreadsheets write."""

import codecs
import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

COMMENTS = ("#", "%")
ERRORS = ("#n/a", "#num!", "#div/0!", "#value!", "#ref!", "#name?", "#null!")  # of spreadsheets
MISSING = ("", "nan", "na", "n/a", "none", "null", "nil", "<na>", *ERRORS)  # in lower case


class TableLine(NamedTuple):
    """Cells of one line, its number in the file, and what separates its cells: None for spaces."""

    number: int
    cells: list[str]
    separator: str | None

    def real(self, column: int) -> float:
        """Return the number in a column, NaN if it is missing.

        Raises
        ------
        ValueError
            If the cell is not a number.
        """
        cell = plain(self.cells[column], self.separator)
        if cell.lower() in MISSING:
            return float("nan")
        try:
            return float("" if "_" in cell else cell)
        except ValueError:
            raise ValueError(
                f"line {self.number}: {self.cells[column]!r} is not a number"
            ) from None


@dataclass(frozen=True)
class TableRow:
    """Row of a table whose columns have names."""

    line: TableLine
    columns: dict[str, int]

    @property
    def number(self) -> int:
        """Number of the line in the file."""
        return self.line.number

    def __getitem__(self, column: str) -> str:
        return self.line.cells[self.columns[column]]

    def real(self, column: str) -> float:
        """Return the number in a column, NaN if it is missing."""
        return self.line.real(self.columns[column])


def named_rows(data: bytes) -> list[TableRow]:
    r"""Return the rows below the header of a table; cells at the end of a row may be missing.

    Parameters
    ----------
    data : bytes
        Contents of the file.

    Returns
    -------
    list of TableRow
        At least one row.

    Raises
    ------
    ValueError
        If the table has no rows, a row is too long, or two columns have one name.

    Examples
    --------
    >>> [row.real("x_m") for row in named_rows(b"name;x_m\na;2,5\nb;")]
    [2.5, nan]
    """
    lines = list(table_lines(data, comments=()))
    header = _without_empty([name.strip() for name in lines[0].cells]) if lines else []
    repeated = sorted({name for name in header if header.count(name) > 1})
    if repeated:
        raise ValueError(f"the column {repeated[0]!r} is listed twice")
    if len(lines) < 2:
        raise ValueError("there is no row below the header")
    columns = {name: k for k, name in enumerate(header)}
    for line in lines:
        if len(_without_empty(line.cells)) > len(header):
            raise ValueError(f"line {line.number} has more cells than the header")
        line.cells.extend([""] * (len(header) - len(line.cells)))
    return [TableRow(line, columns) for line in lines[1:]]


def _without_empty(cells: list[str]) -> list[str]:
    """Return cells without empty ones at the end, as spreadsheets write for empty columns."""
    n = len(cells)
    while n and not cells[n - 1].strip():
        n -= 1
    return cells[:n]


def plain(cell: str, separator: str | None) -> str:
    """Return a cell without spaces around it, with a decimal point for a comma.

    Examples
    --------
    >>> plain(" 2,5", ";"), plain("2,5", ",")
    ('2.5', '2,5')
    """
    cell = cell.strip()
    return cell.replace(",", ".") if separator != "," and cell.count(",") == 1 else cell


def table_lines(data: bytes, comments: tuple[str, ...] = COMMENTS) -> Iterator[TableLine]:
    r"""Yield the lines of a table that are neither blank nor comments.

    The first of them shows what separates cells: semicolons, tabs, commas or spaces. Cells may be
    in double quotes.

    Parameters
    ----------
    data : bytes
        Contents of the file: UTF-8 or, with a byte-order mark, UTF-16.
    comments : tuple of str
        First characters of lines that are comments.

    Yields
    ------
    TableLine
        Cells as they are in the file.

    Raises
    ------
    ValueError
        If the text is of another encoding, or a quotation mark has no partner.

    Examples
    --------
    >>> [line.cells for line in table_lines(b'a;"b;c"\r\n1,5;\r\n')]
    [['a', 'b;c'], ['1,5', '']]
    >>> list(table_lines("f\xfcr".encode("latin-1")))
    Traceback (most recent call last):
    ValueError: line 1 must be UTF-8 text; got the byte 0xfc: save the file as UTF-8
    """
    lines = list(io.StringIO(_decoded(data), newline=None))
    is_data = partial(_is_data, comments=comments)
    first = next(filter(is_data, lines), "")
    separator = next((each for each in ";\t," if each in first), None)
    if separator == "\t" and ",\t" in first:  # commas, and tabs for the eye
        separator = ","
    if separator is None:
        for number, line in enumerate(lines, start=1):
            if is_data(line):
                yield TableLine(number, line.split(), None)
        return
    reader = csv.reader(
        (line if is_data(line) else "\n" for line in lines),
        delimiter=separator, skipinitialspace=True, strict=True,
    )  # fmt: skip
    try:
        for cells in reader:
            if cells:
                yield TableLine(reader.line_num, cells, separator)
    except csv.Error as error:
        raise ValueError(f"line {reader.line_num}: {error}") from None


def _is_data(line: str, comments: tuple[str, ...]) -> bool:
    line = line.strip(" \r\n")
    return bool(line) and (not line.startswith(comments) or line.lower().startswith(ERRORS))


def _decoded(data: bytes) -> str:
    try:
        if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return data.decode("utf-16")
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, byte = data.count(b"\n", 0, error.start) + 1, data[error.start]
        raise ValueError(
            f"line {line} must be UTF-8 text; got the byte 0x{byte:02x}: save the file as UTF-8"
        ) from None
