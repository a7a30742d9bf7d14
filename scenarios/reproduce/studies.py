"""The papers' tables and figures again: our numbers beside theirs, as CSV, pictures and a page."""

from __future__ import annotations

import argparse
import csv
import importlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import arrivals
from arrivals.files import atomic_write
from arrivals.scenarios.experiments.results_file import code_mark
from arrivals.scenarios.reproduce.results_page import add_stamp, read_stamp, write_page
from arrivals.trackers.run import text
from arrivals.validation import count, one_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUICK = 10  # runs of a study that is only looked at

# Where each study lives: a function of the number of runs and the seed, and if it likes of `out`, a
# folder for its runs, and of `quick`. A new one gets its line.
STUDIES: dict[str, str] = {
    "any-array": "arrivals.scenarios.reproduce.svalse.any_array:any_array",
    "ar-kf": "arrivals.scenarios.reproduce.ar_kalman:ar_kf",
    "interpolation-table1": "arrivals.scenarios.reproduce.interpolation.figures:table1",
    "interpolation-convergence": "arrivals.scenarios.reproduce.interpolation.figures:convergence",
    "interpolation-rmse": "arrivals.scenarios.reproduce.interpolation.figures:rmse_study",
    "interpolation-moving": "arrivals.scenarios.reproduce.interpolation.figures:moving",
    "rss": "arrivals.scenarios.reproduce.rss.table_1:table1",
    "svalse-fig4": "arrivals.scenarios.reproduce.svalse.figures_4_to_7:fig4",
    "svalse-fig5": "arrivals.scenarios.reproduce.svalse.figures_4_to_7:fig5",
    "svalse-fig6": "arrivals.scenarios.reproduce.svalse.figures_4_to_7:fig6",
    "svalse-fig7": "arrivals.scenarios.reproduce.svalse.figures_4_to_7:fig7",
    "svalse-fig8": "arrivals.scenarios.reproduce.svalse.figures_8_to_10:fig8",
    "svalse-fig9": "arrivals.scenarios.reproduce.svalse.figures_8_to_10:fig9",
    "svalse-fig10": "arrivals.scenarios.reproduce.svalse.figures_8_to_10:fig10",
    "swellex96": "arrivals.scenarios.reproduce.swellex96.figures_11_12:swellex96",
}
# Runs of a study that wants others than 100, and QUICK if it is only looked at.
RUNS: dict[str, tuple[int, int]] = {
    "any-array": (20, 3),
    "ar-kf": (100, 4),
    "svalse-fig4": (20, 4),
    "svalse-fig5": (20, 4),
    "svalse-fig6": (20, 4),
    "svalse-fig7": (6, 2),
    "svalse-fig8": (5, 2),
    "svalse-fig9": (5, 2),
    "svalse-fig10": (5, 2),
    "swellex96": (4, 1),
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
        with atomic_write(path) as file:
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


def reproduce(
    name: str,
    out: str | Path,
    runs: int | None = None,
    seed: int = 0,
    quick: bool = False,
    jobs: int = 1,
    page: str | Path | None = None,
) -> list[Path]:
    """Run a study, and write NAME.csv, its pictures as NAME-*.png, and NAME.md.

    Parameters
    ----------
    name : str
        One of `STUDIES`, or "all".
    out : path
        Folder; it is made if it is not there. Studies of many runs keep theirs in its folder
        "runs", and go on from there if they were stopped; "all" runs no study again whose page is
        there, of the same runs, seed and code.
    runs : int, optional
        Trials of each case; if None what `RUNS` says, else 100, or 10 if `quick`.
    seed : int
    quick : bool
    jobs : int
        Processes to use, -1 for one a core; the numbers are the same with any.
    page : path, optional
        Where to write the tables of all studies on one page; OUT/results.md for "all" if None.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    ValueError
        If there is no such study.
    OSError
        If something cannot be written, or a process died; what was finished stays.

    Examples
    --------
    >>> reproduce("interpolation-table9", "out")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: name must be one of 'all', 'any-array', ...; got 'interpolation-table9'
    """
    one_of("name", name, ("all", *STUDIES))
    if jobs != -1:
        count("jobs", jobs)
    if runs is not None:
        count("runs", runs, least=min(2, _runs(name, quick=True)))
    count("seed", seed, least=0)
    if page is not None:  # known before hours of work
        if not Path(page).parent.is_dir():
            raise FileNotFoundError(2, "the folder does not exist", str(Path(page).parent))
        if Path(page).is_dir():
            raise IsADirectoryError(21, "page must be a file; this is a folder", str(page))
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    names, written = tuple(STUDIES) if name == "all" else (name,), []
    for one in names:
        n_runs = _runs(one, quick) if runs is None else runs
        stamp = {"runs": n_runs, "seed": seed, "quick": quick, "version": arrivals.__version__,
                 "code": code_mark()}  # fmt: skip
        if name != "all" or not _is_done(one, folder, stamp):
            _write(one, _report(one, folder, n_runs, seed, jobs, quick), folder, stamp)
        written += _files(one, folder)
    if name == "all" or page is not None:
        target = folder / "results.md" if page is None else Path(page)
        options = " --quick" if quick else f" --runs {runs}" if runs is not None else ""
        to = "" if page is None else f" --page {_shown(target)}"
        command = f"arrivals reproduce {name}{options} --seed {seed} --out {_shown(folder)}{to}"
        write_page(target, names, folder, command)
        written.append(target)
    return written


def _shown(path: Path) -> str:
    """Return a path as a page may show it: of one that only this machine has, the name."""
    return path.name if path.is_absolute() else path.as_posix()


def _is_done(name: str, folder: Path, stamp: Mapping[str, Any]) -> bool:
    """Tell whether the study's page is there, of the same runs and code, and what it shows."""
    page = folder / f"{name}.md"
    return read_stamp(page) == stamp and all(path.exists() for path in _files(name, folder))


def _files(name: str, folder: Path) -> list[Path]:
    """Return what a study has written: table, page, and the pictures that the page shows."""
    lines = (folder / f"{name}.md").read_text(encoding="utf-8").splitlines()
    pictures = [line[2:].partition("]")[0] for line in lines if line.startswith("![")]
    return [folder / part for part in (f"{name}.csv", f"{name}.md", *pictures)]


def _runs(name: str, quick: bool) -> int:
    return RUNS.get(name, (100, QUICK))[quick]


def _report(name: str, folder: Path, runs: int, seed: int, jobs: int, quick: bool) -> Report:
    from joblib import parallel_config

    module, _, function = STUDIES[name].partition(":")
    study: Callable[..., Report] = getattr(importlib.import_module(module), function)
    offered = {"out": folder / "runs", "quick": quick}
    asked = inspect.signature(study).parameters
    with parallel_config(n_jobs=jobs):
        return study(runs, seed, **{name: offered[name] for name in offered if name in asked})


def _write(name: str, report: Report, folder: Path, stamp: Mapping[str, Any]) -> None:
    """Write a report's table, pictures and page; each picture says where it comes from."""
    report.to_csv(folder / f"{name}.csv")
    pictures = [f"{name}-{key}.png" for key in report.figures]
    runs = f"{stamp['runs']} run{'s' * (stamp['runs'] != 1)}"
    origin = f"{name}, seed {stamp['seed']}, {runs} · arrivals {stamp['version']}"
    for picture, figure in zip(pictures, report.figures.values(), strict=True):
        told = f"{report.title} · {origin}"
        figure.supxlabel(told, x=0.995, ha="right", fontsize=6, color="0.4")
        with atomic_write(folder / picture, binary=True) as file:
            figure.savefig(file, format="png", dpi=130)
    with atomic_write(folder / f"{name}.md") as file:
        file.write(add_stamp(report.markdown(pictures), stamp))


def add_reproduce(commands: Any) -> None:
    """Add `arrivals reproduce` to the subparsers of the command line."""
    add = commands.add_parser(
        "reproduce",
        help="run a paper's experiment again: table, pictures, our numbers beside the paper's",
        description="Run a paper's experiment again. Writes NAME.csv, NAME.md and pictures.",
        allow_abbrev=False,
    )
    add.add_argument("name", metavar="NAME", help=f"all, {', '.join(STUDIES)}")
    add.add_argument("--out", default="arrivals-reproduced", metavar="DIR",
                     help="(arrivals-reproduced)")  # fmt: skip
    add.add_argument("--page", metavar="FILE", help="tables of all on one page (DIR/results.md)")
    add.add_argument("--runs", type=int, metavar="N",
                     help="trials of each case (100; fewer where a trial is long)")  # fmt: skip
    add.add_argument("--seed", type=int, default=0, metavar="N", help="(0)")
    add.add_argument("--quick", action="store_true", help=f"at most {QUICK} trials of each case")
    add.add_argument("--jobs", type=int, default=1, metavar="N",
                     help="processes, -1 for one a core (1)")  # fmt: skip
    add.set_defaults(command=_reproduce)


def _reproduce(arguments: argparse.Namespace) -> None:
    written = reproduce(
        arguments.name, arguments.out, arguments.runs, arguments.seed, arguments.quick,
        arguments.jobs, arguments.page,
    )  # fmt: skip
    for path in written:
        print(path)
