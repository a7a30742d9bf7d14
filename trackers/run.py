"""Estimates over time: rectangular arrays that know how to write themselves."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.files import atomic_write
from arrivals.trackers.estimates import Estimate
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class Run:
    """What a tracker found over time.

    The fields of its estimates are attributes, arrays over time: `run.doa` (n_steps, n_slots) is
    padded with NaN where less was found, `run.label` with -1; `run.converged` (n_steps,).

    Parameters
    ----------
    kind : type of Estimate
    fields : mapping of str to ndarray
        The estimates' fields, first axis time.
    x : ndarray, shape (n_steps, dim_x)
        The tracker's `x` after each step.
    n_found : ndarray of int, shape (n_steps,)
    time : ndarray, shape (n_steps,)
        Seconds, or the unit of the `dt` that the tracker was run with.
    elapsed : float
        Wall-clock time that the run took, s.
    extras : mapping of str to ndarray
        What else a tracker keeps of every step, first axis time, and no estimate holds; they are
        attributes too, such as `run.signals` (n_steps, n_sources).
    """

    kind: type[Estimate]
    fields: Mapping[str, NDArray[Any]] = field(repr=False)
    x: Float = field(repr=False)
    n_found: NDArray[np.int64] = field(repr=False)
    time: Float = field(repr=False)
    elapsed: float
    extras: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False)

    def __getattr__(self, name: str) -> NDArray[Any]:
        for home in ("fields", "extras"):
            try:
                arrays: Mapping[str, NDArray[Any]] = object.__getattribute__(self, home)
                return arrays[name]
            except (AttributeError, KeyError):
                pass
        raise AttributeError(f"this run has no {name!r}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.fields, *self.extras]

    def __len__(self) -> int:
        return len(self.time)

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.time)

    def estimate(self, step: int) -> Estimate:
        """Return the estimate of one step."""
        n = int(self.n_found[step])
        return self.kind(
            **{
                name: values[step, :n] if name in self.kind.per_source else values[step].item()
                for name, values in self.fields.items()
            }
        )

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Give the rows of the tracks file: step (from 0), time, then the estimate's columns."""
        for step, time in enumerate(self.time.tolist()):
            for row in self.estimate(step).rows():
                yield (step, time, *row)

    def to_csv(self, path: str | os.PathLike[str], *, time: ArrayLike | None = None) -> None:
        """Write the tracks file; it appears under its name only when it is complete.

        Parameters
        ----------
        path : path
        time : array_like, shape (n_steps,), optional
            Times to write in place of the run's own, s.
        """
        run = self if time is None else self.at(time)
        with atomic_write(path) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header(self.kind))
            writer.writerows(map(text, run.rows()))

    def at(self, time: ArrayLike) -> Run:
        """Return the same run with other times, (n_steps,)."""
        time = np.asarray(time, dtype=np.float64)
        if time.shape != self.time.shape:
            raise ValueError(f"time must have shape {self.time.shape}; got {time.shape}")
        return replace(self, time=time)


def header(kind: type[Estimate]) -> tuple[str, ...]:
    """Return the column names of a tracks file of such estimates."""
    return ("step", "time_s", *kind.columns)


def text(row: tuple[Any, ...]) -> list[str]:
    """Return the cells of a row of a tracks file: numbers to 9 digits, nothing for NaN.

    Examples
    --------
    >>> text((3, 0.1, np.int64(7), 1 / 3, np.nan))
    ['3', '0.1', '7', '0.333333333', '']
    """
    return ["" if value != value else f"{value:.9g}" if isinstance(value, float) else str(value)
            for value in row]  # fmt: skip


class RunRecorder:
    """Arrays over time that grow with the estimates added, and hold little beyond them."""

    def __init__(self, kind: type[Estimate]) -> None:
        self._kind = kind
        self._columns: dict[str, NDArray[Any]] = {}
        self._n = 0

    def add(self, estimate: Estimate, x: Float) -> None:
        """Add one step."""
        values = {"n_found": estimate.n_found, "x": x}
        values |= {name: getattr(estimate, name) for name in vars(estimate)}
        for name, value in values.items():
            array = np.asarray(value)
            column = self._room(name, array)
            if name in self._kind.per_source:
                column[self._n, : len(array)] = array
            else:
                column[self._n] = array
        self._n += 1

    def _room(self, name: str, value: NDArray[Any]) -> NDArray[Any]:
        """Return the column, enlarged if it is too short in time or too narrow in slots."""
        column = self._columns.get(name)
        if column is not None and self._n < len(column) and column.shape[1:] == value.shape:
            return column  # the usual case
        wanted = (self._n + 1, *value.shape)
        if column is None:
            column = self._columns[name] = self._fresh(name, (16, *value.shape), value.dtype)
        if any(have < want for have, want in zip(column.shape, wanted, strict=True)):
            steps = column.shape[0] if column.shape[0] > self._n else 2 * column.shape[0]
            shape = (steps, *np.maximum(column.shape[1:], value.shape).tolist())
            larger = self._fresh(name, shape, column.dtype)
            larger[tuple(slice(n) for n in column.shape)] = column
            column = self._columns[name] = larger
        return column

    def _fresh(self, name: str, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        filler = self._kind.per_source.get(name, 0)
        return np.full(shape, filler, dtype=dtype)

    def run(self, dt: float, elapsed: float) -> Run:
        """Return what was recorded."""
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
