"""Studies that reproduce the papers' tables and figures: CSV, figures and a page each."""

from __future__ import annotations

import argparse
import importlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import arrivals
from arrivals.files import atomic_write
from arrivals.scenarios.experiments.results_file import code_mark
from arrivals.scenarios.reproduce.claims import Verdict, counts
from arrivals.scenarios.reproduce.pictures import save_picture
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.results_page import add_stamp, read_stamp, write_page
from arrivals.validation import count, one_of

PACKAGE = "arrivals.scenarios.reproduce"
QUICK = 10  # runs of a quick study

# Function of each study: takes the number of runs and the seed, and optionally `out`, a folder for
# its runs, and `quick`.
STUDIES: dict[str, str] = {
    "any-array": f"{PACKAGE}.svalse.any_array:any_array",
    "ar-kf": f"{PACKAGE}.ar_kalman.figures_1_to_9:ar_kf",
    "calibration": f"{PACKAGE}.svalse.calibration:calibration",
    "interpolation-table1": f"{PACKAGE}.interpolation.table_1:table1",
    "interpolation-table2": f"{PACKAGE}.interpolation.table_2:table2",
    "interpolation-convergence": f"{PACKAGE}.interpolation.convergence:convergence",
    "interpolation-rmse": f"{PACKAGE}.interpolation.rmse:rmse_study",
    "interpolation-moving": f"{PACKAGE}.interpolation.moving_source:moving",
    "rooms": f"{PACKAGE}.rooms:rooms",
    "rss": f"{PACKAGE}.rss.table_1:table1",
    "rss-doppler": f"{PACKAGE}.signal_strength.doppler:doppler",
    "rss-envelope": f"{PACKAGE}.signal_strength.envelope:envelope_study",
    "rss-network": f"{PACKAGE}.signal_strength.network:network",
    "sphere": f"{PACKAGE}.sphere:sphere",
    "svalse-fig4": f"{PACKAGE}.svalse.figures_4_to_7:fig4",
    "svalse-fig5": f"{PACKAGE}.svalse.figures_4_to_7:fig5",
    "svalse-fig6": f"{PACKAGE}.svalse.figures_4_to_7:fig6",
    "svalse-fig7": f"{PACKAGE}.svalse.figures_4_to_7:fig7",
    "svalse-fig8": f"{PACKAGE}.svalse.figures_8_to_10:fig8",
    "svalse-fig9": f"{PACKAGE}.svalse.figures_8_to_10:fig9",
    "svalse-fig10": f"{PACKAGE}.svalse.figures_8_to_10:fig10",
    "swellex96": f"{PACKAGE}.swellex96.figures_11_12:swellex96",
    "swellex96-range": f"{PACKAGE}.swellex96.ranges:ranges",
}
# Runs of studies with numbers other than 100, and QUICK in a quick study
RUNS: dict[str, tuple[int, int]] = {
    "any-array": (20, 3),
    "calibration": (30, 2),
    "ar-kf": (100, 4),
    "interpolation-table2": (10, 4),
    "rooms": (10, 3),
    "rss": (1000, 100),
    "rss-doppler": (100, 12),
    "rss-envelope": (300, 40),
    "rss-network": (30, 4),
    "sphere": (4, 2),
    "svalse-fig4": (20, 4),
    "svalse-fig5": (20, 4),
    "svalse-fig6": (20, 4),
    "svalse-fig7": (6, 2),
    "svalse-fig8": (20, 2),
    "svalse-fig9": (20, 2),
    "svalse-fig10": (20, 2),
    "swellex96": (4, 1),
    "swellex96-range": (4, 1),
}


def reproduce(
    name: str,
    out: str | Path,
    runs: int | None = None,
    seed: int = 0,
    quick: bool = False,
    jobs: int = 1,
    page: str | Path | None = None,
) -> list[Path]:
    """Run a study, and write NAME.csv, its figures as NAME-*.png, and NAME.md.

    Parameters
    ----------
    name : str
        One of `STUDIES`, or "all".
    out : path
        Folder; created if missing. Monte Carlo studies keep their runs in its folder "runs" and
        resume from there; "all" skips studies with a page of the same runs, seed and code.
    runs : int, optional
        Trials of each case; `RUNS` or 100 if None, 10 if `quick`.
    seed : int
        Seed of all trials.
    quick : bool
        Few trials, without the slowest methods.
    jobs : int
        Number of processes, -1 for one a core; the results do not depend on it.
    page : path, optional
        Page with the tables of all studies; OUT/results.md for "all" if None.

    Returns
    -------
    list of Path
        Files written.

    Raises
    ------
    ValueError
        If the study is unknown.
    OSError
        If a file cannot be written, or a process was killed; finished runs are kept.

    Examples
    --------
    >>> reproduce("interpolation-table9", "out")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: name must be one of 'all', 'any-array', ...; got 'interpolation-table9': did you ...
    """
    one_of("name", name, ("all", *STUDIES))
    if jobs != -1:
        count("jobs", jobs)
    if runs is not None:
        count("runs", runs, minimum=min(2, _runs(name, quick=True)))
    count("seed", seed, minimum=0, maximum=2**128)
    if page is not None:  # checked before hours of computation
        if not Path(page).parent.is_dir():
            raise FileNotFoundError(2, "the folder does not exist", str(Path(page).parent))
        if Path(page).is_dir():
            raise IsADirectoryError(21, "page must be a file; got a folder", str(page))
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    from arrivals.scenarios.reproduce.paper_claims import verdicts_of  # imports all studies

    names, written = tuple(STUDIES) if name == "all" else (name,), []
    for one in names:
        n_runs = _runs(one, quick) if runs is None else runs
        stamp = {"runs": n_runs, "seed": seed, "quick": quick, "version": arrivals.__version__,
                 "code": code_mark()}  # fmt: skip
        if name != "all" or not _is_done(one, folder, stamp):
            report = _report(one, folder, n_runs, seed, jobs, quick)
            _write(one, report, verdicts_of(one, report.results), folder, stamp)
        written += _files(one, folder)
    if name == "all" or page is not None:
        target = folder / "results.md" if page is None else Path(page)
        options = " --quick" if quick else f" --runs {runs}" if runs is not None else ""
        to = "" if page is None else f" --page {_shown(target)}"
        command = f"arrivals reproduce {name}{options} --seed {seed} --out {_shown(folder)}{to}"
        written += write_page(target, names, folder, command)
    return written


def _shown(path: Path) -> str:
    """Return a path for a page: an absolute path is reduced to its name."""
    return path.name if path.is_absolute() else path.as_posix()


def _is_done(name: str, folder: Path, stamp: Mapping[str, Any]) -> bool:
    """Return True if the page of a study with this stamp exists, and all its files.

    It may be of another version of the same code.
    """
    found = read_stamp(folder / f"{name}.md") or {}
    keys = stamp.keys() - {"version"}  # the code counts
    same = all(key in found and found[key] == stamp[key] for key in keys)
    return same and all(path.exists() for path in _files(name, folder))


def _files(name: str, folder: Path) -> list[Path]:
    """Return the files of a study: table, page, and the figures of the page."""
    lines = (folder / f"{name}.md").read_text(encoding="utf-8").splitlines()
    figures = [line[2:].partition("]")[0] for line in lines if line.startswith("![")]
    return [folder / part for part in (f"{name}.csv", f"{name}.md", *figures)]


def _runs(name: str, quick: bool) -> int:
    return RUNS.get(name, (100, QUICK))[quick]


def _report(name: str, folder: Path, runs: int, seed: int, jobs: int, quick: bool) -> Report:
    from joblib import parallel_config

    module, _, function = STUDIES[name].partition(":")
    study: Callable[..., Report] = getattr(importlib.import_module(module), function)
    options = {"out": folder / "runs", "quick": quick}
    accepted = inspect.signature(study).parameters
    with parallel_config(n_jobs=jobs):
        return study(runs, seed, **{key: options[key] for key in options if key in accepted})


def _write(
    name: str, report: Report, verdicts: Sequence[Verdict], folder: Path, stamp: Mapping[str, Any]
) -> None:
    """Write a report's table, figures with their origin, and page."""
    report.to_csv(folder / f"{name}.csv")
    files = [f"{name}-{key}.png" for key in report.figures]
    for path, (key, figure) in zip(files, report.figures.items(), strict=True):
        shown = report.captions.get(key, report.title)
        origin = f"{name}, seed {stamp['seed']} · arrivals {stamp['version']}"
        save_picture(figure, folder / path, f"{shown} · {origin}")
    page = report.markdown(files, verdicts)
    with atomic_write(folder / f"{name}.md") as file:
        file.write(add_stamp(page, {**stamp, "verdicts": counts(verdicts)}))


def add_reproduce(commands: Any) -> None:
    """Add `arrivals reproduce` to the subparsers of the command line."""
    add = commands.add_parser(
        "reproduce",
        help="reproduce an experiment of a paper: table, figures, our numbers beside the paper's",
        description="Reproduce an experiment of a paper. Writes NAME.csv, NAME.md and figures.",
        allow_abbrev=False,
    )
    add.add_argument("name", metavar="NAME", help=f"all, {', '.join(STUDIES)}")
    add.add_argument("--out", default="arrivals-reproduced", metavar="DIR",
                     help="(arrivals-reproduced)")  # fmt: skip
    add.add_argument("--page", metavar="FILE", help="page with all tables (DIR/results.md)")
    add.add_argument("--runs", type=int, metavar="N",
                     help="trials of each case (100; fewer for slow trials)")  # fmt: skip
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
