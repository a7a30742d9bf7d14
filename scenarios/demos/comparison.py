"""Comparison of several methods on one recording: tracks as CSV files and one figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from arrivals.measurement_models import ArraySnapshot
from arrivals.trackers import Run, Tracker
from arrivals.typing import Complex, Float

Bar: TypeAlias = Callable[..., Any]


def silent(steps: Complex, **_: Any) -> Complex:
    """Return the steps, without a progress bar."""
    return steps


@dataclass(frozen=True, eq=False)
class MethodComparison:
    """A recording and the settings of its figure.

    Parameters
    ----------
    name : str
        File name of the figure, without suffix.
    measurement : ArraySnapshot
        Array and wavelengths.
    steps : ndarray, shape (n_steps, ...)
        Snapshots of each step.
    time : ndarray, shape (n_steps,)
        Centre of each step, s.
    axes : mapping
        Properties of the panels, such as `ylabel`.
    prefix : str
        Prefix of the names of tracks files.
    """

    name: str
    measurement: ArraySnapshot
    steps: Complex
    time: Float
    axes: Mapping[str, Any]
    prefix: str = ""

    def run(
        self,
        out: str | PathLike[str],
        methods: Mapping[str, tuple[str, Tracker]],
        bar: Bar = silent,
        n_steps: int | None = None,
    ) -> None:
        """Run each method and write PREFIXmethod.csv and NAME.png.

        Parameters
        ----------
        out : path
            Folder; created if missing.
        methods : mapping of str to (str, Tracker)
            Titles of the panels, and the trackers, by name.
        bar : callable
            Progress bar: takes the steps and `desc`, returns the steps, as tqdm does.
        n_steps : int, optional
            Maximum number of steps.
        """
        runs = {
            title: self.track(out, name, tracker, bar, n_steps)
            for name, (title, tracker) in methods.items()
        }
        figure = Path(out) / f"{self.name}.png"
        self._draw(figure, runs, self.steps[:n_steps])
        print(figure)

    def track(
        self,
        out: str | PathLike[str],
        name: str,
        tracker: Tracker,
        bar: Bar = silent,
        n_steps: int | None = None,
    ) -> Run:
        """Run one method and write PREFIXname.csv.

        Parameters
        ----------
        out : path
            Folder; created if missing.
        name : str
            Name of the method.
        tracker : Tracker
        bar : callable
            As in `run`.
        n_steps : int, optional
            Maximum number of steps.

        Returns
        -------
        Run
        """
        from threadpoolctl import threadpool_limits

        folder = Path(out)
        folder.mkdir(parents=True, exist_ok=True)
        with threadpool_limits(1, "blas"):
            run = tracker.run(bar(self.steps[:n_steps], desc=f"{name:<6}"))
        run = run.at(self.time[:n_steps])
        path = folder / f"{self.prefix}{name}.csv"
        run.to_csv(path)
        print(f"{path}: {_summary(run)}", flush=True)
        return run

    def _draw(self, path: Path, runs: Mapping[str, Run], steps: Complex) -> None:
        """Draw the tracks of each method over the beam power, one panel a method."""
        from matplotlib.figure import Figure

        from arrivals.plots.bearing_time import plot_bearing_time, save

        figure = Figure(figsize=(9.0, 10.5), layout="constrained")
        panels = figure.subplots(len(runs), sharex=True)
        for ax, (title, run) in zip(panels, runs.items(), strict=True):
            plot_bearing_time(
                run, snapshots=steps, measurement=self.measurement, time=run.time, ax=ax
            )
            ax.set_title(title, fontsize=11)
            ax.set(**self.axes)
            ax.label_outer()
        save(panels[0], path)


def _summary(run: Run) -> str:
    """Return the numbers of directions, labels and steps, and the elapsed time, as text."""
    n_labels = len(np.unique(run.label[run.label >= 0]))
    labels = f" under {n_labels} labels" if n_labels else ""
    return f"{run.n_found.sum()} directions{labels} in {len(run)} steps, {run.elapsed:.1f} s"
