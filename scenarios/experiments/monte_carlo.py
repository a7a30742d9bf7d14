"""Monte Carlo comparison of trackers on one or several scenarios, in parallel by joblib."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import arrivals
from arrivals.messages import shown
from arrivals.parameters import to_plain
from arrivals.scenarios.base import Scenario
from arrivals.scenarios.experiments.batch import ERROR, Row, RunBatch
from arrivals.scenarios.experiments.methods import Method, methods
from arrivals.scenarios.experiments.results_file import Results, code_mark
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.experiments.workers import report_worker_failure
from arrivals.scenarios.metrics.registry import CPU, METRICS, RANGE_METRICS, Metric
from arrivals.scenarios.registry import create
from arrivals.validation import count, items, one_of

Metrics = Sequence[str] | Mapping[str, Metric]
Scenarios = str | Scenario | Sequence[str | Scenario] | Mapping[str, str | Scenario]


@dataclass(frozen=True)
class StudySettings:
    """Settings of the computation and storage of a study; see `monte_carlo`.

    `batch` is the number of runs in one task of a process, and in one call of a method with its
    own `run_batch`.
    """

    metrics: Metrics | None = None
    out: str | os.PathLike[str] | None = None
    batch: int = 4
    n_jobs: int | None = None
    progress: bool = False


def monte_carlo(
    scenario: Scenarios,
    trackers: Sequence[str | Method],
    runs: int = 100,
    seed: int = 0,
    *,
    metrics: Metrics | None = None,
    out: str | os.PathLike[str] | None = None,
    n_jobs: int | None = None,
    progress: bool = False,
) -> Study:
    """Compare trackers on the same draws of one or several scenarios.

    Run r of every scenario and every method is seeded by `SeedSequence(seed, spawn_key=(r,))`:
    serial, threads, processes and a cluster give the same numbers.

    Parameters
    ----------
    scenario : str, Scenario, sequence of them, or mapping of str to them
        Registered name or scenario; several, whose cases are named by class and by the parameters
        that differ; or scenarios by the names of their cases.
    trackers : sequence of str or Method
        Registered names, and trackers with settings; see `grid` for grids of settings.
    runs : int
        Number of runs.
    seed : int
        Seed of all runs.
    metrics : sequence of str, or mapping of str to callable, optional
        Names in `METRICS` or `RANGE_METRICS` of `arrivals.scenarios.metrics`, or functions of
        (trial, run); all of `METRICS` if None. Degrees where the truth is directions, metres where
        it is positions.
    out : path, optional
        A CSV file to which results are appended, or a folder in which each configuration has its
        own file. Finished runs in it are not computed again; new runs are added.
    n_jobs : int, optional
        Number of processes; -1 for all cores. If None, that of `joblib.parallel_config`, whose
        other backends work too, and 1 without it.
    progress : bool
        Show a progress bar on standard error.

    Returns
    -------
    Study
        Results of runs 0 to `runs` - 1.

    Raises
    ------
    ValueError
        If a scenario, tracker or metric is unknown, or `out` is the file of another study.
    OSError
        If the file cannot be written, or another process writes to it.
    ChildProcessError
        If a worker process was killed; an OSError too. Rows in the file are kept in each case.

    Notes
    -----
    A configuration is scenarios, trackers, metrics, seed, and the code of all of them. A run that
    fails is a row with its error and its seed, and the study continues. Only the rows of
    "cpu_ms", processor time of a step, differ from call to call.

    Examples
    --------
    >>> scenario = create("svalse_fig6", n_steps=5)
    >>> study = monte_carlo(scenario, ["cbf", "sbl"], runs=3, metrics=["gospa", "rmse"])
    >>> study.cases, study.methods, study.runs
    (['PairsInTurn'], ['cbf', 'sbl'], [0, 1, 2])
    >>> study.mean("gospa", "sbl") < study.mean("gospa", "cbf")
    True
    >>> monte_carlo([scenario, scenario.replace(snr_db=5.0)], ["cbf"], runs=1).cases
    ['PairsInTurn(snr_db=20.0)', 'PairsInTurn(snr_db=5.0)']
    """
    settings = StudySettings(metrics, out, n_jobs=n_jobs, progress=progress)
    return compute_study(scenario, trackers, runs, seed, settings)


def compute_study(
    scenario: Scenarios,
    trackers: Sequence[str | Method],
    runs: int,
    seed: int,
    settings: StudySettings,
) -> Study:
    """Return the study of `monte_carlo`, with settings of its computation."""
    cases, compared, measures = _cases(scenario), methods(trackers), _metrics(settings.metrics)
    count("runs", runs)
    config = {
        "version": arrivals.__version__,
        "code": code_mark({one.__module__ for one in [*cases.values(), *measures.values()]}),
        "seed": count("seed", seed, minimum=0, maximum=2**128),
        "scenarios": {name: to_plain(one) for name, one in cases.items()},
        "methods": [method.to_dict() for method in compared],
        "metrics": {name: f"{f.__module__}.{f.__qualname__}" for name, f in measures.items()},
    }
    results = Results(config, settings.out)
    with results.writing():
        finished = _finished(results, len(compared))
        results.keep(lambda row: (row.case, row.run) in finished)
        pending = list(_pending(cases, runs, count("batch", settings.batch), finished))
        batches = (RunBatch(name, cases[name], compared, measures, seed, numbers)
                   for name, numbers in pending)  # fmt: skip
        total = runs * len(cases)
        with _bar(
            settings.progress, total, total - sum(len(numbers) for _, numbers in pending)
        ) as bar:
            for rows in _computed(batches, results, settings.n_jobs):
                results.add(rows)
                bar.update(len({row.run for row in rows}))
    return Study(results, range(runs))


def _pending(
    cases: Iterable[str], runs: int, batch: int, finished: set[tuple[str, int]]
) -> Iterator[tuple[str, list[int]]]:
    """Yield cases and numbers of unfinished runs, in batches with fixed first runs."""
    for first in range(0, runs, batch):
        for name in cases:
            numbers = range(first, min(first + batch, runs))
            unfinished = [run for run in numbers if (name, run) not in finished]
            if unfinished:
                yield name, unfinished


def _cases(scenario: Scenarios) -> dict[str, Scenario]:
    if isinstance(scenario, str):
        return {scenario: create(scenario)}
    if isinstance(scenario, Scenario):
        return {type(scenario).__name__: scenario}
    several = scenario.values() if isinstance(scenario, Mapping) else items("scenario", scenario)
    made = [create(one) if isinstance(one, str) else one for one in several]
    if not made:
        raise ValueError("scenario must have at least one case; got none")
    for one in made:
        if not isinstance(one, Scenario):
            raise TypeError(f"scenario must be a Scenario or a registered name; got {shown(one)}")
    return dict(zip(scenario, made, strict=True)) if isinstance(scenario, Mapping) else _named(made)


def _named(scenarios: Sequence[Scenario]) -> dict[str, Scenario]:
    """Return scenarios by class, with the parameters in which those of a class differ."""
    cases: dict[str, Scenario] = {}
    for one in scenarios:
        params = [other.get_params(deep=False) for other in scenarios if type(other) is type(one)]
        own = one.get_params(deep=False)
        differ = [name for name in own if len({str(to_plain(each[name])) for each in params}) > 1]
        settings = ", ".join(f"{name}={shown(own[name])}" for name in differ)
        label = type(one).__name__ + (f"({settings})" if settings else "")
        if label in cases:
            raise ValueError(f"scenario must have different cases; got {label} twice")
        cases[label] = one
    return cases


def _metrics(metrics: Metrics | None) -> dict[str, Metric]:
    if metrics is None:
        return METRICS
    if isinstance(metrics, Mapping):
        return dict(metrics)
    known = METRICS | RANGE_METRICS
    return {one_of("metrics", name, tuple(known)): known[name] for name in metrics}


def _finished(results: Results, n_methods: int) -> set[tuple[str, int]]:
    """Return the (case, run) for which the last row of every method exists."""
    last = Counter((row.case, row.run) for row in results.rows() if row.metric in (ERROR, CPU))
    return {key for key, n in last.items() if n == n_methods}


def _computed(
    batches: Iterable[RunBatch], results: Results, n_jobs: int | None
) -> Iterator[list[Row]]:
    """Yield the rows of the batches in order of completion."""
    from joblib import Parallel, delayed

    parallel = Parallel(
        n_jobs, return_as="generator_unordered", pre_dispatch="2*n_jobs", batch_size=1
    )
    kept = "no run is kept: out is None"
    if results.path is not None:
        kept = f"finished runs are kept in {results.path}: call again to resume"
    with report_worker_failure(kept):
        yield from parallel(delayed(RunBatch.rows)(batch) for batch in batches)


def _bar(progress: bool, total: int, done: int) -> Any:
    from tqdm import tqdm

    return tqdm(total=total, initial=done, unit="run", disable=not progress)
