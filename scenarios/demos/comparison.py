"""Several methods on one recording: their tracks as CSV files, and one picture of all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySnapshot
from arrivals.trackers import Run, Tracker
from arrivals.typing import Complex, Float


@dataclass(frozen=True, eq=False)
class MethodComparison:
    """A recording, and what is to be drawn of it.

    Parameters
    ----------
    name : str
        The picture's file name, without its ending.
    measurement : ArraySnapshot
    steps : ndarray, shape (n_steps, ...)
    time : ndarray, shape (n_steps,)
        Middle of each step, s.
    axes : mapping
        Properties of the picture's panels, such as `ylabel`.
    prefix : str
        What the names of tracks files begin with.
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
        bar: Callable[..., Any] = lambda steps, **_: steps,
        n_steps: int | None = None,
    ) -> None:
        """Run each method, and write PREFIXmethod.csv and NAME.png.

        Parameters
        ----------
        out : path
            Folder; made if it is not there.
        methods : mapping of str to (str, Tracker)
            Titles of the panels, and the trackers, by name.
        bar : callable
            Takes the steps and `desc`, gives the steps back, such as tqdm.
        n_steps : int, optional
            Stop after so many steps.
        """
        from threadpoolctl import threadpool_limits

        folder = Path(out)
        folder.mkdir(parents=True, exist_ok=True)
        steps, time = self.steps[:n_steps], self.time[:n_steps]
        runs = {}
        for name, (title, tracker) in methods.items():
            with threadpool_limits(1, "blas"):
                run = tracker.run(bar(steps, desc=f"{name:<6}")).at(time)
            path = folder / f"{self.prefix}{name}.csv"
            run.to_csv(path)
            print(f"{path}: {_told(run)}", flush=True)
            runs[title] = run
        picture = folder / f"{self.name}.png"
        self._draw(picture, runs, steps)
        print(picture)

    def _draw(self, path: Path, runs: Mapping[str, Run], steps: Complex) -> None:
        """Draw the tracks of each method over the beam power, one below the other."""
        from matplotlib.figure import Figure

        from arrivals.plots.bearing_time import plot_bearing_time, save

        figure = Figure(figsize=(9.0, 10.5), layout="constrained")
        panels = figure.subplots(len(runs), sharex=True)
        for ax, (title, run) in zip(panels, runs.items(), strict=True):
            plot_bearing_time(
                run, snapshots=steps, measurement=self.measurement, time=run.time, ax=ax
            )
            ax.set_title(title, loc="left", fontsize=11)
            ax.set(**self.axes)
            ax.label_outer()
        save(panels[0], path)


def _told(run: Run) -> str:
    """Return in words how much was found."""
    n_labels = len(np.unique(run.label[run.label >= 0]))
    labels = f" under {n_labels} labels" if n_labels else ""
    return f"{run.n_found.sum()} directions{labels} in {len(run)} steps, {run.elapsed:.1f} s"
