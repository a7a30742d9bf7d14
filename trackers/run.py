"""Estimates over time as rectangular arrays, and the tracks file."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.files import atomic_write
from arrivals.measurements import real_numbers
from arrivals.trackers.estimates import Estimate
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class Run:
    """Estimates of a tracker over time.

    The fields of the estimates are attributes, arrays over time: `run.doa` (n_steps, n_slots) is
    padded with NaN, `run.label` with -1; `run.converged` is (n_steps,).

    Parameters
    ----------
    kind : type of Estimate
        Class of the estimates.
    fields : mapping of str to ndarray
        Fields of the estimates, first axis time.
    x : ndarray, shape (n_steps, dim_x)
        `x` of the tracker after each step.
    n_found : ndarray of int, shape (n_steps,)
        Number of sources of each estimate.
    time : ndarray, shape (n_steps,)
        Times, s, or in the unit of `dt`.
    elapsed : float
        Wall-clock time of the run, s.
    extras : mapping of str to ndarray
        Results per step that are not part of an estimate, first axis time; attributes too, such as
        `run.signals` (n_steps, n_sources).
    tracker : str
        Class of the tracker, for titles; empty if it is not known.
    measurement : MeasurementModel, optional
        Measurement model of the tracker.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers import CBF
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0)
    >>> run = CBF(model, max_sources=1).run([model.steering_vector(0.5), None])
    >>> run.doa.round(2).ravel(), run.n_found
    (array([0.5, nan]), array([1, 0]))
    """

    kind: type[Estimate]
    fields: Mapping[str, NDArray[Any]] = field(repr=False)
    x: Float = field(repr=False)
    n_found: NDArray[np.int64] = field(repr=False)
    time: Float = field(repr=False)
    elapsed: float
    extras: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False)
    tracker: str = field(default="", repr=False)
    measurement: Any = field(default=None, repr=False)

    def __getattr__(self, name: str) -> NDArray[Any]:
        for home in ("fields", "extras"):
            try:
                arrays: Mapping[str, NDArray[Any]] = object.__getattribute__(self, home)
                return arrays[name]
            except (AttributeError, KeyError):
                pass
        raise AttributeError(f"run has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.fields, *self.extras]

    def __len__(self) -> int:
        return len(self.time)

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.time)

    def estimate(self, step: int) -> Estimate:
        """Return the estimate of one step.

        Parameters
        ----------
        step : int
            Index of the step.

        Returns
        -------
        Estimate
            Estimate of class `kind`.
        """
        n = int(self.n_found[step])
        return self.kind(
            **{
                name: values[step, :n] if name in self.kind.per_source else values[step].item()
                for name, values in self.fields.items()
            }
        )

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns of `rows`."""
        return header(self.kind)

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Iterate over the rows of the tracks file.

        Yields
        ------
        tuple
            Step (from 0), time, then the columns of the estimate.
        """
        for step, time in enumerate(self.time.tolist()):
            for row in self.estimate(step).rows():
                yield (step, time, *row)

    def to_csv(self, path: str | os.PathLike[str], *, time: ArrayLike | None = None) -> None:
        """Write the tracks file; it has its final name only when it is complete.

        Parameters
        ----------
        path : str or path
            Name of the CSV file.
        time : array_like, shape (n_steps,), optional
            Times, s; those of the run if None.
        """
        run = self if time is None else self.at(time)
        with atomic_write(path) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.header)
            writer.writerows(map(text, run.rows()))

    def at(self, time: ArrayLike) -> Run:
        """Return the same run with other times.

        Parameters
        ----------
        time : array_like, shape (n_steps,)
            Times, s.

        Returns
        -------
        Run
            A copy with the times.
        """
        time = real_numbers("time", time)
        if time.shape != self.time.shape:
            raise ValueError(f"time must have shape {self.time.shape}; got {time.shape}")
        return replace(self, time=time)

    def made_by(self, tracker: Any) -> Run:
        """Return the same run with the class and the measurement model of its tracker.

        Parameters
        ----------
        tracker : Tracker
            Tracker that the estimates are from.

        Returns
        -------
        Run
            A copy with `tracker` and `measurement`.
        """
        measurement = getattr(tracker, "measurement", None)
        return replace(self, tracker=type(tracker).__name__, measurement=measurement)


def header(kind: type[Estimate]) -> tuple[str, ...]:
    """Return the column names of a tracks file of a class of estimates."""
    return ("step", "time_s", *kind.columns)


def text(row: tuple[Any, ...]) -> list[str]:
    """Return the cells of a row of a tracks file: numbers to 9 digits, empty if not finite.

    Examples
    --------
    >>> text((3, 0.1, np.int64(7), 1 / 3, np.inf))
    ['3', '0.1', '7', '0.333333333', '']
    """
    return [_cell(value) for value in row]


def _cell(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{value:.9g}" if math.isfinite(value) else ""


class RunRecorder:
    """Recorder of estimates in arrays that double in length when they are full."""

    def __init__(self, kind: type[Estimate]) -> None:
        self._kind = kind
        self._columns: dict[str, NDArray[Any]] = {}
        self._n = 0

    def add(self, estimate: Estimate, x: Float) -> None:
        """Append the estimate and the state of one step."""
        values: dict[str, Any] = {"n_found": estimate.n_found, "x": x}
        values |= {each.name: getattr(estimate, each.name) for each in fields(estimate)}
        for name, value in values.items():
            array = np.asarray(value)
            column = self._column_for(name, array)
            if name in self._kind.per_source:
                column[self._n, : len(array)] = array
            else:
                column[self._n] = array
        self._n += 1

    def _column_for(self, name: str, value: NDArray[Any]) -> NDArray[Any]:
        """Return a column, enlarged if it has too few steps or slots."""
        column = self._columns.get(name)
        if column is not None and self._n < len(column) and column.shape[1:] == value.shape:
            return column  # the usual case
        required = (self._n + 1, *value.shape)
        if column is None:
            column = self._columns[name] = self._padded(name, (16, *value.shape), value.dtype)
        if any(have < need for have, need in zip(column.shape, required, strict=True)):
            steps = column.shape[0] if column.shape[0] > self._n else 2 * column.shape[0]
            shape = (steps, *np.maximum(column.shape[1:], value.shape).tolist())
            larger = self._padded(name, shape, column.dtype)
            larger[tuple(slice(n) for n in column.shape)] = column
            column = self._columns[name] = larger
        return column

    def _padded(self, name: str, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        filler = self._kind.per_source.get(name, 0)
        return np.full(shape, filler, dtype=dtype)

    def run(self, dt: float, elapsed: float) -> Run:
        """Return the recorded steps as a run."""
        columns = {name: np.full((0, 0), filler) for name, filler in self._kind.per_source.items()}
        columns |= {
            field.name: np.array([field.default])[:0]
            for field in fields(self._kind)
            if field.name not in self._kind.per_source
        }
        columns |= {name: column[: self._n].copy() for name, column in self._columns.items()}
        keep_x = "x" in self._kind.per_source
        x = columns["x"] if keep_x else columns.pop("x", np.zeros((0, 0)))
        n_found = columns.pop("n_found", np.zeros(0, dtype=np.int64))
        time: Float = dt * np.arange(self._n, dtype=np.float64)
        return Run(self._kind, columns, x, n_found, time, elapsed)
