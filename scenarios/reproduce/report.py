"""Report of a study: table, figures, remarks, and the results that its claims are decided by."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from arrivals.files import atomic_write
from arrivals.scenarios.reproduce.claims import Verdict, sections
from arrivals.trackers.run import text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_COLUMNS = 8  # of a table on the page; all columns are in the CSV file


@dataclass(frozen=True, eq=False)
class Report:
    """Results of a study.

    Parameters
    ----------
    title : str
        Heading of the page.
    columns : sequence of str
        Names of the table's columns.
    rows : sequence of tuple
        Rows of the table: text and numbers, NaN for missing ones.
    remarks : sequence of str
        Paragraphs below the table: its columns, and what the paper leaves open.
    figures : mapping of str to Figure
        Figures by name.
    shown : sequence of str
        Columns of the page's table, at most `MAX_COLUMNS`; the first ones if empty.
    results : object
        What the study's claims are decided by.
    captions : mapping of str to str
        What a figure shows, by its name, where that is not all runs of the study: "run 0", a
        sketch, fewer runs.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[tuple[Any, ...]]
    remarks: Sequence[str] = ()
    figures: Mapping[str, Figure] = field(default_factory=dict)
    shown: Sequence[str] = ()
    results: Any = None
    captions: Mapping[str, str] = field(default_factory=dict)

    def to_csv(self, path: Path) -> None:
        """Write the table as CSV, with all columns."""
        with atomic_write(path) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.columns)
            writer.writerows(text(row) for row in self.rows)

    def markdown(self, pictures: Sequence[str] = (), verdicts: Sequence[Verdict] = ()) -> str:
        """Return the page: title, figures, table, claims with their verdicts, and remarks.

        Examples
        --------
        >>> print(Report("Two", ["name", "RMSE"], [("B", 0.65), ("C", float("nan"))]).markdown())
        # Two
        <BLANKLINE>
        | name | RMSE |
        | --- | --- |
        | B | 0.65 |
        | C | - |
        <BLANKLINE>
        """
        columns = list(self.shown or self.columns[:MAX_COLUMNS])
        index = [self.columns.index(name) for name in columns]
        figures = [part for name in pictures for part in ("", f"![{name}]({name})")]
        heading = [f"# {self.title}", *figures, "", _line(columns), _line(["---"] * len(columns))]
        table = [_line([_cell(row[n]) for n in index]) for row in self.rows]
        remarks = [part for remark in self.remarks for part in ("", remark)]
        return "\n".join([*heading, *table, *sections(verdicts), *remarks, ""])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "-" if value != value else f"{value:.4g}"
    return str(value)
