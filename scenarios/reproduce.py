"""The papers' tables and figures again: our numbers beside theirs, as CSV, pictures and a page."""

from __future__ import annotations

import argparse
import csv
import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from arrivals.checks import count, one_of
from arrivals.trackers.recorder import replacing, text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

T = TypeVar("T")
QUICK = 10  # runs of a study that is only looked at

# Where each study lives: a function of the number of runs and the seed. A new one gets its line.
STUDIES: dict[str, str] = {
    "interpolation-table1": "arrivals.scenarios.reproduce_interpolation:table1",
    "interpolation-convergence": "arrivals.scenarios.reproduce_interpolation:convergence",
    "interpolation-rmse": "arrivals.scenarios.reproduce_interpolation:rmse_study",
    "interpolation-moving": "arrivals.scenarios.reproduce_interpolation:moving",
    "any-array": "arrivals.scenarios.reproduce_any_array:any_array",
}


@dataclass(frozen=True, eq=False)
class Report:
    """What a study found.

    Parameters
    ----------
    title : str
    columns : sequence of str
        Names of the table's columns.
    rows : sequence of tuple
        Its rows: text and numbers, NaN where there is none.
    remarks : sequence of str
        What could not be reproduced, and why; how to read the table.
    figures : mapping of str to Figure
        Pictures by name.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[tuple[Any, ...]]
    remarks: Sequence[str] = ()
    figures: Mapping[str, Figure] = field(default_factory=dict)

    def to_csv(self, path: Path) -> None:
        """Write the table as CSV."""
        with replacing(path) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.columns)
            writer.writerows(text(row) for row in self.rows)

    def markdown(self, pictures: Sequence[str] = ()) -> str:
        """Return the page: title, table, remarks and pictures.

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
        heading = [f"# {self.title}", "", _line(self.columns), _line(["---"] * len(self.columns))]
        table = [_line([_cell(value) for value in row]) for row in self.rows]
        remarks = [part for remark in self.remarks for part in ("", remark)]
        shown = [part for name in pictures for part in ("", f"![{name}]({name})")]
        return "\n".join([*heading, *table, *remarks, *shown, ""])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "-" if value != value else f"{value:.4g}"
    return str(value)


def spread(function: Callable[..., T], cases: Iterable[Sequence[Any]]) -> list[T]:
    """Call a function with the arguments of every case, on as many processes as joblib is told.

    Inside `joblib.parallel_config(n_jobs=...)` that many, else in this one; the results are those
    of a loop, in its order.

    Examples
    --------
    >>> spread(pow, [(2, 3), (3, 2)])
    [8, 9]
    """
    from joblib import Parallel, delayed

    return list(Parallel()(delayed(function)(*case) for case in cases))


def reproduce(
    name: str,
    out: str | Path,
    runs: int | None = None,
    seed: int = 0,
    quick: bool = False,
    jobs: int = 1,
) -> list[Path]:
    """Run a study, and write NAME.csv, its pictures as NAME-*.png, and NAME.md.

    Parameters
    ----------
    name : str
        One of `STUDIES`.
    out : path
        Folder; it is made if it is not there.
    runs : int, optional
        Trials of each case; 100, or 10 if `quick`.
    seed : int
    quick : bool
    jobs : int
        Processes to use, -1 for one a core; the numbers are the same with any.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    ValueError
        If there is no such study.

    Examples
    --------
    >>> reproduce("interpolation-table9", "out")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: name must be one of 'interpolation-table1', ...; got 'interpolation-table9'
    """
    from joblib import parallel_config

    if jobs != -1:
        count("jobs", jobs)
    module, _, function = STUDIES[one_of("name", name, tuple(STUDIES))].partition(":")
    n_runs = (QUICK if quick else 100) if runs is None else count("runs", runs, least=2)
    study: Callable[[int, int], Report] = getattr(importlib.import_module(module), function)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    with parallel_config(n_jobs=jobs):
        report = study(n_runs, seed)
    report.to_csv(folder / f"{name}.csv")
    pictures = [f"{name}-{key}.png" for key in report.figures]
    for picture, figure in zip(pictures, report.figures.values(), strict=True):
        figure.savefig(folder / picture, dpi=130)
    with replacing(folder / f"{name}.md") as file:
        file.write(report.markdown(pictures))
    return [folder / part for part in (f"{name}.csv", f"{name}.md", *pictures)]


def add_reproduce(commands: Any) -> None:
    """Add `arrivals reproduce` to the subparsers of the command line."""
    add = commands.add_parser(
        "reproduce",
        help="run a paper's experiment again: table, pictures, our numbers beside the paper's",
        description="Run a paper's experiment again. Writes NAME.csv, NAME.md and pictures.",
        allow_abbrev=False,
    )
    add.add_argument("name", metavar="NAME", help=", ".join(STUDIES))
    add.add_argument("--out", default="arrivals-reproduced", metavar="DIR",
                     help="(arrivals-reproduced)")  # fmt: skip
    add.add_argument("--runs", type=int, metavar="N", help="trials of each case (100)")
    add.add_argument("--seed", type=int, default=0, metavar="N", help="(0)")
    add.add_argument("--quick", action="store_true", help=f"{QUICK} trials of each case")
    add.add_argument("--jobs", type=int, default=1, metavar="N",
                     help="processes, -1 for one a core (1)")  # fmt: skip
    add.set_defaults(command=_reproduce)


def _reproduce(arguments: argparse.Namespace) -> None:
    written = reproduce(
        arguments.name, arguments.out, arguments.runs, arguments.seed, arguments.quick,
        arguments.jobs,
    )  # fmt: skip
    for path in written:
        print(path)
