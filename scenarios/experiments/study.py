"""Results of a study: tidy rows, means with intervals, and paired differences."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.files import atomic_write
from arrivals.messages import nearest
from arrivals.scenarios.base import Scenario
from arrivals.scenarios.experiments.batch import ERROR, Row
from arrivals.scenarios.experiments.results_file import Results, read_config
from arrivals.scenarios.experiments.statistics import (
    Difference,
    bootstrap_interval,
    paired_difference,
)
from arrivals.typing import Float


class Study:
    """Results of a study, read from its file on demand.

    Parameters
    ----------
    results : Results
        Rows of the study.
    runs : sequence of int, optional
        Selected runs; all runs if None.

    Attributes
    ----------
    config : dict
        Scenarios, methods, metrics, seed and version.
    path : Path or None
        The study file.

    Examples
    --------
    >>> from arrivals.scenarios import create, monte_carlo
    >>> scenario = create("svalse_fig6", n_steps=5)
    >>> study = monte_carlo(scenario, ["cbf", "sbl"], runs=3, metrics=["gospa"])
    >>> study.paired("gospa", "sbl", "cbf").n_below
    3
    """

    def __init__(self, results: Results, runs: Sequence[int] | None = None) -> None:
        self._results = results
        self._runs = None if runs is None else set(runs)
        self.config: dict[str, Any] = results.config
        self.path = results.path

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Study:
        """Return the study of a file, finished or not.

        Parameters
        ----------
        path : path
            A study file.

        Returns
        -------
        Study
            All runs of the file.

        Raises
        ------
        ValueError
            If the file is not a study file.
        OSError
            If it cannot be read.
        """
        return cls(Results(read_config(Path(path)), Path(path)))

    @property
    def cases(self) -> list[str]:
        """Names of the scenarios."""
        return list(self.config["scenarios"])

    @property
    def methods(self) -> list[str]:
        """Labels of the methods."""
        return [method["label"] for method in self.config["methods"]]

    @property
    def runs(self) -> list[int]:
        """Numbers of the runs with results."""
        return sorted({row.run for row in self._rows()})

    @property
    def unit(self) -> str:
        """Unit of errors, "degrees" or "m"; empty if scenarios differ or are not installed."""
        try:
            cases = map(Scenario.from_dict, self.config["scenarios"].values())
            (unit,) = {one.truth_unit for one in cases}
            return unit
        except (ValueError, TypeError):
            return ""

    def _rows(self) -> Iterator[Row]:
        rows, runs = self._results.rows(), self._runs
        return (row for row in rows if runs is None or row.run in runs)

    def rows(self) -> list[Row]:
        """Return all rows, sorted by case, run and method.

        Returns
        -------
        list of Row
            Fields `case`, `run`, `method`, `metric`, `value` and `note`.
        """
        case, method = self.cases.index, self.methods.index
        return sorted(self._rows(), key=lambda row: (case(row.case), row.run, method(row.method)))

    def failures(self) -> list[Row]:
        """Return the rows of failed runs; their notes have error and seed.

        Returns
        -------
        list of Row
            One row a failed run.
        """
        return [row for row in self.rows() if row.metric == ERROR]

    def values(self, metric: str, method: str, case: str | None = None) -> dict[int, float]:
        """Return the values of a metric by run, without failed runs and NaN.

        Parameters
        ----------
        metric, method : str
            Name of the metric and label of the method.
        case : str, optional
            Name of the case; may be None if the study has one.

        Returns
        -------
        dict of int to float
            Values by run.

        Raises
        ------
        ValueError
            If the metric, method or case is unknown, or the metric does not apply to the method.
        """
        case = self._one("case", case, self.cases)
        self._one("method", method, self.methods)
        rows = [r for r in self._rows()
                if r.metric == metric and r.method == method and r.case == case]  # fmt: skip
        notes = [row.note for row in rows if row.note]
        if notes and len(notes) == len(rows):
            raise ValueError(f"{metric} is not defined: {notes[0]}")
        if not rows:
            failed = [r for r in self.failures() if r.method == method and r.case == case]
            if failed:
                raise ValueError(f"all runs of {method!r} failed; the first: {failed[0].note}")
            hint = nearest(metric, [*self.config["metrics"], "cpu_ms"])
            raise ValueError(f"no run of {method!r} has the metric {metric!r}: {hint}")
        return {row.run: row.value for row in sorted(rows) if row.value == row.value}

    def _one(self, noun: str, name: str | None, names: list[str]) -> str:
        if name is None and len(names) == 1:
            return names[0]
        if name not in names:
            raise ValueError(f"{noun} must be one of {', '.join(map(repr, names))}; got {name!r}")
        return name

    def array(self, metric: str, method: str, case: str | None = None) -> Float:
        """Return the values of a metric in order of runs.

        Parameters
        ----------
        metric, method, case : str
            As in `values`.

        Returns
        -------
        ndarray, shape (n,)
            Values.
        """
        return np.array(list(self.values(metric, method, case).values()), dtype=np.float64)

    def mean(self, metric: str, method: str, case: str | None = None) -> float:
        """Return the mean over the runs.

        Parameters
        ----------
        metric, method, case : str
            As in `values`.

        Returns
        -------
        float
            Mean; NaN without values.
        """
        values = self.array(metric, method, case)
        return float(values.mean()) if values.size else np.nan

    def spread(self, metric: str, method: str, case: str | None = None) -> float:
        """Return the standard deviation over the runs.

        Parameters
        ----------
        metric, method, case : str
            As in `values`.

        Returns
        -------
        float
            Standard deviation; NaN for fewer than two values.
        """
        values = self.array(metric, method, case)
        return float(values.std(ddof=1)) if values.size > 1 else np.nan

    def interval(
        self, metric: str, method: str, case: str | None = None, level: float = 0.95
    ) -> tuple[float, float]:
        """Return the bootstrap interval of the mean over the runs.

        Bias-corrected and accelerated, 2000 resamples with a fixed seed.

        Parameters
        ----------
        metric, method, case : str
            As in `values`.
        level : float
            Confidence level, in (0, 1).

        Returns
        -------
        low, high : float
            Ends of the interval; NaN for fewer than two values.

        References
        ----------
        Efron and Tibshirani, *An Introduction to the Bootstrap*, 1993, ch. 14.
        """
        return bootstrap_interval(self.array(metric, method, case), level)

    def paired(self, metric: str, first: str, second: str, case: str | None = None) -> Difference:
        """Return first minus second on the same draws, over the runs that both have.

        Parameters
        ----------
        metric, first, second : str
            Name of the metric and labels of two methods.
        case : str, optional
            As in `values`.

        Returns
        -------
        Difference
            Mean, standard error and numbers of runs.
        """
        return paired_difference(
            self.values(metric, first, case), self.values(metric, second, case)
        )

    def summary(self) -> list[dict[str, Any]]:
        """Return a row for each case, method and metric.

        Returns
        -------
        list of dict
            Keys `case`, `method`, `metric`, `mean`, `std`, `low`, `high`, `n_runs`.
        """
        table = []
        for case in self.cases:
            for method in self.methods:
                for metric in [*self.config["metrics"], "cpu_ms"]:
                    table.append(self._line(case, method, metric))
        return [line for line in table if line]

    def _line(self, case: str, method: str, metric: str) -> dict[str, Any]:
        try:
            n = self.array(metric, method, case).size
        except ValueError:
            return {}
        low, high = self.interval(metric, method, case)
        key = {"case": case, "method": method, "metric": metric}
        mean, std = self.mean(metric, method, case), self.spread(metric, method, case)
        return key | {"mean": mean, "std": std, "low": low, "high": high, "n_runs": n}

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the sorted rows as CSV, atomically.

        Parameters
        ----------
        path : path
            The file.
        """
        with atomic_write(path) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(Row._fields)
            writer.writerows(self.rows())
