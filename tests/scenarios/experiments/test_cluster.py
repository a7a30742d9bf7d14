"""A study on a dask cluster of two worker processes, one of which is killed during the study."""

import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from arrivals.scenarios import Study, monte_carlo
from arrivals.scenarios.simulations import PairsInTurn

pytest.importorskip("distributed")
DASK = Path(sysconfig.get_path("scripts")) / ("dask.exe" if sys.platform == "win32" else "dask")


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[Path, list[subprocess.Popen[bytes]]]]:
    """Start a scheduler and two workers; yield the scheduler file and the workers."""
    where = tmp_path / "scheduler.json"
    common = ["--scheduler-file", str(where), "--no-dashboard"]
    one_thread = ["--nthreads", "1", "--no-nanny"]
    commands = [["scheduler", "--port", "0"], ["worker", *one_thread], ["worker", *one_thread]]
    started = [
        subprocess.Popen(
            [DASK, command[0], *common, *command[1:]], cwd=tmp_path, stderr=subprocess.DEVNULL
        )
        for command in commands
    ]
    yield where, started[1:]
    for process in started:
        process.terminate()
        process.wait()


def numbers(study: Study) -> list[tuple[Any, ...]]:
    return [row[:5] for row in study.rows() if row.metric != "cpu_ms"]


def test_study_with_a_killed_worker_has_equal_numbers(
    cluster: tuple[Path, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    from distributed import Client
    from joblib import parallel_config

    where, workers = cluster
    options: dict[str, Any] = {"runs": 12, "seed": 1, "metrics": ["gospa"], "batch": 1}
    scenario, trackers = PairsInTurn(n_steps=4), ["cbf", "ssbl", "svalse"]
    with Client(scheduler_file=str(where)) as client:
        client.wait_for_workers(2, timeout=60)

        def kill() -> None:
            path = tmp_path / "study.csv"
            while not path.exists():
                time.sleep(0.05)
            workers[0].kill()

        killer = Thread(target=kill)
        killer.start()
        with parallel_config(backend="dask"):
            study = monte_carlo(scenario, trackers, out=tmp_path / "study.csv", **options)
        killer.join()
        assert workers[0].wait() != 0
    assert numbers(study) == numbers(monte_carlo(scenario, trackers, **options))
