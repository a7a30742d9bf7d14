"""Batch of runs of one scenario by several methods: the task of one process."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.experiments.methods import Method
from arrivals.scenarios.metrics.registry import CPU, Metric
from arrivals.trackers import Run, Tracker

ERROR = "error"  # metric of a failed run; its note has the cause
MAX_NOTE_LENGTH = 300  # characters: an error may quote a whole array


class Row(NamedTuple):
    """One number of a study; `note` has the reason for a missing one."""

    case: str
    run: int
    method: str
    metric: str
    value: float
    note: str = ""


@dataclass(frozen=True, eq=False)
class RunBatch:
    """Runs of one scenario.

    Parameters
    ----------
    case : str
        Name of the scenario in the study.
    scenario : Scenario
        Draws the trials.
    methods : sequence of Method
        Trackers with settings.
    metrics : mapping of str to callable
        Functions of (trial, run).
    seed : int
        Seed of the study.
    runs : sequence of int
        Numbers of the runs.
    """

    case: str
    scenario: Scenario
    methods: Sequence[Method]
    metrics: Mapping[str, Metric]
    seed: int
    runs: Sequence[int]

    def rows(self) -> list[Row]:
        """Draw the trials, run every method on them, and evaluate the metrics."""
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, "blas"):  # small matrices: more threads only wait
            trials = {run: self._draw(run) for run in self.runs}
            return [row for method in self.methods for row in self._scored(method, trials)]

    def seed_sequence(self, run: int) -> np.random.SeedSequence:
        """Return the seed sequence of a run, the same in every process and batch."""
        return np.random.SeedSequence(self.seed, spawn_key=(run,))

    def _draw(self, run: int) -> Trial | Exception:
        try:
            return self.scenario.sample(np.random.default_rng(self.seed_sequence(run)))
        except Exception as error:
            return error

    def _scored(self, method: Method, trials: Mapping[int, Trial | Exception]) -> Iterator[Row]:
        drawn = {run: trial for run, trial in trials.items() if isinstance(trial, Trial)}
        outcomes = self._run_batch(method, drawn) or {
            run: self._run_single(method, run, trial) for run, trial in drawn.items()
        }
        for run, trial in trials.items():
            outcome = outcomes[run] if isinstance(trial, Trial) else trial
            if isinstance(outcome, Exception):
                yield self._failed(method, run, outcome)
            else:
                yield from self._scores(method, run, drawn[run], *outcome)

    def _run_batch(
        self, method: Method, trials: Mapping[int, Trial]
    ) -> dict[int, tuple[Run, float] | Exception] | None:
        """Run a batch if the tracker has its own `run_batch` and the trials share their models."""
        try:
            made = [method.make(trial, self.seed_sequence(run)) for run, trial in trials.items()]
            own = made and type(made[0]).run_batch is not Tracker.run_batch
            if not own or any(one.to_dict() != made[0].to_dict() for one in made):
                return None
            started = time.thread_time()
            results = made[0].run_batch([trial.measurements for trial in trials.values()])
            cpu = (time.thread_time() - started) / len(made)
        except Exception:
            return None  # then single runs: only the faulty ones fail
        return {run: (result, cpu) for run, result in zip(trials, results, strict=True)}

    def _run_single(self, method: Method, run: int, trial: Trial) -> tuple[Run, float] | Exception:
        try:
            tracker = method.make(trial, self.seed_sequence(run))
            started = time.thread_time()
            result = tracker.run(trial.measurements)
            return result, time.thread_time() - started
        except Exception as error:
            return error

    def _scores(
        self, method: Method, run: int, trial: Trial, result: Run, cpu: float
    ) -> Iterator[Row]:
        for name, metric in self.metrics.items():
            try:
                yield Row(self.case, run, method.label, name, float(metric(trial, result)))
            except Exception as error:
                note = brief(f"{method.label}: {error}")
                yield Row(self.case, run, method.label, name, np.nan, note)
        yield Row(self.case, run, method.label, CPU, 1e3 * cpu / max(1, len(result)))

    def _failed(self, method: Method, run: int, error: Exception) -> Row:
        cause = brief(f"{type(error).__name__}: {error}")
        note = f"{cause} (SeedSequence({self.seed}, spawn_key=({run},)))"
        return Row(self.case, run, method.label, ERROR, np.nan, note)


def brief(text: str) -> str:
    r"""Return text as one line, shortened in the middle if it is long.

    Examples
    --------
    >>> brief("a\nb"), len(brief(1000 * "a"))
    ('a b', 300)
    """
    line = " ".join(text.split())
    if len(line) <= MAX_NOTE_LENGTH:
        return line
    end = MAX_NOTE_LENGTH // 4
    return f"{line[: MAX_NOTE_LENGTH - end - 5]} ... {line[-end:]}"
