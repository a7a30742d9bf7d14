"""Many runs of scenarios by several trackers, on as many processes or machines as joblib has."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import arrivals
from arrivals.parameters import to_plain
from arrivals.scenarios.base import Scenario, create
from arrivals.scenarios.experiments.batch import ERROR, Row, RunBatch
from arrivals.scenarios.experiments.methods import Method, methods
from arrivals.scenarios.experiments.results_file import Results, code_mark
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.experiments.workers import report_worker_failure
from arrivals.scenarios.metrics.registry import CPU, METRICS, Metric
from arrivals.validation import count

Metrics = Sequence[str] | Mapping[str, Metric]


def monte_carlo(
    scenario: str | Scenario | Mapping[str, Scenario],
    trackers: Sequence[str | Method],
    runs: int = 100,
    seed: int = 0,
    *,
    metrics: Metrics | None = None,
    out: str | os.PathLike[str] | None = None,
    n_jobs: int | None = None,
    batch: int = 4,
    progress: bool = False,
) -> Study:
    """Compare trackers on the same draws of a scenario, or of several.

    Run r of every scenario and every method descends from `SeedSequence(seed, spawn_key=(r,))`,
    so that serial, threads, processes and a cluster give the same numbers.

    Parameters
    ----------
    scenario : str, Scenario, or mapping of str to Scenario
        A mapping names its cases.
    trackers : sequence of str or Method
        Registered names, and trackers with settings; see `methods.grid` for grids.
    runs : int
    seed : int
    metrics : sequence of str, or mapping of str to callable, optional
        Names out of `scores.METRICS`, or functions of (trial, run); all of `METRICS` if
        None, degrees where the truth is directions, metres where it is positions.
    out : path, optional
        A CSV file that results stream into, or a folder in which each configuration finds its
        own. What is in it already is not computed again; more runs are added to it.
    n_jobs : int, optional
        Processes; what `joblib.parallel_config` says if None, and 1 without it.
    batch : int
        Runs that a process is given at a time, and a method with its own `run_batch` at once.
    progress : bool
        Show a bar on standard error.

    Returns
    -------
    Study

    Raises
    ------
    ValueError
        If there is no such scenario, tracker or metric, or `out` is the file of another study.
    OSError
        If the file cannot be written, or another process writes to it.
    ChildProcessError
        If a worker process died, an OSError too. What was in the file before any of these is kept.

    Notes
    -----
    A configuration is scenarios, trackers, metrics, seed, and the code of all of them. A run that
    fails is a row with its error and its seed, and the study goes on. The rows of
    "cpu_ms", processor time of a step, are the only ones that differ from call to call.

    Examples
    --------
    >>> scenario = create("svalse_fig6", n_steps=5)
    >>> study = monte_carlo(scenario, ["cbf", "sbl"], runs=3, metrics=["gospa", "rmse"])
    >>> study.cases, study.methods, study.runs
    (['PairsInTurn'], ['cbf', 'sbl'], [0, 1, 2])
    >>> study.mean("gospa", "sbl") < study.mean("gospa", "cbf")
    True
    """
    cases, compared, scored = _cases(scenario), methods(trackers), _metrics(metrics)
    count("runs", runs)
    config = {
        "version": arrivals.__version__,
        "code": code_mark({one.__module__ for one in [*cases.values(), *scored.values()]}),
        "seed": count("seed", seed, least=0),
        "scenarios": {name: to_plain(one) for name, one in cases.items()},
        "methods": [method.to_dict() for method in compared],
        "metrics": {name: f"{f.__module__}.{f.__qualname__}" for name, f in scored.items()},
    }
    results = Results(config, out)
    with results.writing():
        finished = _finished(results, len(compared))
        results.keep(lambda row: (row.case, row.run) in finished)
        todo = list(_todo(cases, runs, count("batch", batch), finished))
        blocks = (RunBatch(name, cases[name], compared, scored, seed, left) for name, left in todo)
        total = runs * len(cases)
        with _bar(progress, total, total - sum(len(left) for _, left in todo)) as bar:
            for rows in _computed(blocks, n_jobs, results):
                results.add(rows)
                bar.update(len({row.run for row in rows}))
    return Study(results, range(runs))


def _todo(
    cases: Iterable[str], runs: int, batch: int, finished: set[tuple[str, int]]
) -> Iterator[tuple[str, list[int]]]:
    """Give the runs that are to be done, in batches that do not depend on what was finished."""
    for first in range(0, runs, batch):
        for name in cases:
            numbers = range(first, min(first + batch, runs))
            left = [run for run in numbers if (name, run) not in finished]
            if left:
                yield name, left


def _cases(scenario: str | Scenario | Mapping[str, Scenario]) -> dict[str, Scenario]:
    if isinstance(scenario, Mapping):
        if not scenario:
            raise ValueError("a study needs at least one scenario")
        return dict(scenario)
    if isinstance(scenario, str):
        return {scenario: create(scenario)}
    return {type(scenario).__name__: scenario}


def _metrics(wanted: Metrics | None) -> dict[str, Metric]:
    if wanted is None:
        return METRICS
    if isinstance(wanted, Mapping):
        return dict(wanted)
    unknown = [name for name in wanted if name not in METRICS]
    if unknown:
        raise ValueError(f"there is no metric {unknown[0]!r}; known: {', '.join(METRICS)}")
    return {name: METRICS[name] for name in wanted}


def _finished(results: Results, n_methods: int) -> set[tuple[str, int]]:
    """Return the (case, run) of which every method's last row is there."""
    last = Counter((row.case, row.run) for row in results.rows() if row.metric in (ERROR, CPU))
    return {key for key, n in last.items() if n == n_methods}


def _computed(
    blocks: Iterable[RunBatch], n_jobs: int | None, results: Results
) -> Iterator[list[Row]]:
    """Give the rows of the blocks as they come, whoever computes them."""
    from joblib import Parallel, delayed

    parallel = Parallel(n_jobs=n_jobs, return_as="generator_unordered", pre_dispatch="2*n_jobs",
                        batch_size=1)  # fmt: skip
    kept = "nothing is kept: no file was named"
    if results.path is not None:
        kept = f"finished runs are kept in {results.path}: call again to go on"
    with report_worker_failure(kept):
        yield from parallel(delayed(RunBatch.rows)(block) for block in blocks)


def _bar(progress: bool, total: int, done: int) -> Any:
    from tqdm import tqdm

    return tqdm(total=total, initial=done, unit="run", disable=not progress)
