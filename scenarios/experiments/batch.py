"""A few runs of one scenario by several methods: what one process is given at a time."""

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

ERROR = "error"  # the metric of a run that failed; its note tells why
LONGEST = 300  # letters of a note: an error may quote a whole array


class Row(NamedTuple):
    """One number of a study; `note` says why it is missing."""

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
        What the scenario is called in the study.
    scenario : Scenario
    methods : sequence of Method
    metrics : mapping of str to callable
    seed : int
        Of the study.
    runs : sequence of int
        Their numbers.
    """

    case: str
    scenario: Scenario
    methods: Sequence[Method]
    metrics: Mapping[str, Metric]
    seed: int
    runs: Sequence[int]

    def rows(self) -> list[Row]:
        """Draw the trials, let every method work on them, and score what it found."""
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, "blas"):  # the matrices are small: more threads only wait
            trials = {run: self._draw(run) for run in self.runs}
            return [row for method in self.methods for row in self._scored(method, trials)]

    def seed_sequence(self, run: int) -> np.random.SeedSequence:
        """Return what the run draws from: the same, whichever process and whatever company."""
        return np.random.SeedSequence(self.seed, spawn_key=(run,))

    def _draw(self, run: int) -> Trial | Exception:
        try:
            return self.scenario.sample(np.random.default_rng(self.seed_sequence(run)))
        except Exception as error:
            return error

    def _scored(self, method: Method, trials: Mapping[int, Trial | Exception]) -> Iterator[Row]:
        drawn = {run: trial for run, trial in trials.items() if isinstance(trial, Trial)}
        done = self._together(method, drawn) or {
            run: self._alone(method, run, trial) for run, trial in drawn.items()
        }
        for run, trial in trials.items():
            outcome = done[run] if isinstance(trial, Trial) else trial
            if isinstance(outcome, Exception):
                yield self._failed(method, run, outcome)
            else:
                yield from self._scores(method, run, drawn[run], *outcome)

    def _together(
        self, method: Method, trials: Mapping[int, Trial]
    ) -> dict[int, tuple[Run, float] | Exception] | None:
        """Run a batch, if the tracker has a way of its own and the trials differ in data alone."""
        try:
            made = [method.make(trial, self.seed_sequence(run)) for run, trial in trials.items()]
            own = made and type(made[0]).run_batch is not Tracker.run_batch
            if not own or any(one.to_dict() != made[0].to_dict() for one in made):
                return None
            started = time.thread_time()
            found = made[0].run_batch([trial.measurements for trial in trials.values()])
            cpu = (time.thread_time() - started) / len(made)
        except Exception:
            return None  # one by one, to see which of them it is
        return {run: (one, cpu) for run, one in zip(trials, found, strict=True)}

    def _alone(self, method: Method, run: int, trial: Trial) -> tuple[Run, float] | Exception:
        try:
            tracker = method.make(trial, self.seed_sequence(run))
            started = time.thread_time()
            found = tracker.run(trial.measurements)
            return found, time.thread_time() - started
        except Exception as error:
            return error

    def _scores(
        self, method: Method, run: int, trial: Trial, found: Run, cpu: float
    ) -> Iterator[Row]:
        for name, metric in self.metrics.items():
            try:
                yield Row(self.case, run, method.label, name, float(metric(trial, found)))
            except Exception as error:
                note = brief(f"{method.label}: {error}")
                yield Row(self.case, run, method.label, name, np.nan, note)
        yield Row(self.case, run, method.label, CPU, 1e3 * cpu / max(1, len(found)))

    def _failed(self, method: Method, run: int, error: Exception) -> Row:
        what = brief(f"{type(error).__name__}: {error}")
        note = f"{what} (SeedSequence({self.seed}, spawn_key=({run},)))"
        return Row(self.case, run, method.label, ERROR, np.nan, note)


def brief(text: str) -> str:
    r"""Return one line; of a long one, its beginning and its end.

    Examples
    --------
    >>> brief("a\nb"), len(brief(1000 * "a"))
    ('a b', 300)
    """
    line = " ".join(text.split())
    end = LONGEST // 4
    return line if len(line) <= LONGEST else f"{line[: LONGEST - end - 5]} ... {line[-end:]}"
