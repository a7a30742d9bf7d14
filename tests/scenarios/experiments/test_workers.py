"""Killed worker processes: one line of error, finished runs kept."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arrivals.__main__ import main
from arrivals.scenarios import Study, monte_carlo
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.reproduce import studies as reproduce
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.simulations import PairsInTurn
from arrivals.trackers import CBF, Run, register

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="kills as POSIX does")
RUNS = 6


@register("is_killed")
class IsKilled(CBF):
    """Kills its process after the first kept run, if ARRIVALS_TEST_KILLED names the folder."""

    calls = 0

    def run(self, measurements: Any, dt: float = 1.0) -> Run:
        IsKilled.calls += 1
        folder = os.environ.get("ARRIVALS_TEST_KILLED")
        while folder and IsKilled.calls > 1:
            if list(Path(folder).glob("study-*.csv")):
                os.kill(os.getpid(), signal.SIGKILL)
            time.sleep(0.02)
        return super().run(measurements, dt)


def study(runs: int, seed: int, out: Path | None = None) -> Report:
    settings = StudySettings(["gospa"], out, batch=1)
    scenario = {"fig6": PairsInTurn(n_steps=3)}
    made = compute_study(scenario, ["is_killed", "cbf"], runs, seed, settings)
    values = [(method, float(v)) for method in made.methods for v in made.array("gospa", method)]
    return Report("Killed", ["method", "GOSPA"], values)


def run_script(
    script: str, killed: Path | None, *arguments: str
) -> subprocess.CompletedProcess[str]:
    """Run a script that may import this module, in a new process."""
    paths = [str(Path(__file__).parent), *sys.path]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    if killed is not None:
        environment["ARRIVALS_TEST_KILLED"] = str(killed)
    return subprocess.run(
        [sys.executable, "-c", script, *arguments], env=environment, capture_output=True,
        text=True, check=False,
    )  # fmt: skip


COMMAND = (
    "import sys; from arrivals.__main__ import main\n"
    "from arrivals.scenarios.reproduce import studies as reproduce\n"
    "reproduce.STUDIES['killed'] = 'test_workers:study'; sys.exit(main(sys.argv[1:]))"
)


def test_killed_worker_is_reported_in_one_line_and_study_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = ["reproduce", "killed", "--runs", str(RUNS), "--out", str(tmp_path)]
    done = run_script(COMMAND, tmp_path / "runs", *out, "--jobs", "2")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    (path,) = (tmp_path / "runs").glob("study-*.csv")
    assert line.startswith("arrivals: a worker process died (SIGKILL(-9)); finished runs are kept")
    assert f"in {path}: call again to resume" in line
    assert not (tmp_path / "killed.csv").exists()
    kept = {row for row in Study.read(path).rows() if row.metric == "cpu_ms"}
    assert 0 < len(kept) < 2 * RUNS

    monkeypatch.setitem(reproduce.STUDIES, "killed", f"{__name__}:study")
    assert main(out) == 0
    again = Study.read(path).rows()
    assert kept <= set(again)  # not computed again: their times are the old ones
    whole = monte_carlo({"fig6": PairsInTurn(n_steps=3)}, ["is_killed", "cbf"], RUNS,
                        metrics=["gospa"])  # fmt: skip
    assert [row for row in again if row.metric == "gospa"] == [
        row for row in whole.rows() if row.metric == "gospa"
    ]
    assert (tmp_path / "killed.csv").read_text().count("\n") == 1 + 2 * RUNS


def kill_at_three(n: int) -> int:
    if n == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return n


def test_killed_worker_of_a_study_without_file_is_reported() -> None:
    from joblib import parallel_config

    with (
        parallel_config(n_jobs=2),
        pytest.raises(ChildProcessError, match=r"died \(SIGKILL.*keeps no runs") as failure,
    ):
        parallel_map(kill_at_three, [(n,) for n in range(8)])
    assert "\n" not in str(failure.value)
    assert parallel_map(kill_at_three, [(1,), (2,)]) == [1, 2]


def long_table(runs: int, seed: int) -> Report:
    return Report("Written", ["x"], [(float(x),) for x in np.arange(1000.0)], ["Holds: x (1)."])


def test_full_disk_and_unwritable_folder_are_reported_in_one_line(tmp_path: Path) -> None:
    script = (
        "import atexit, resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "before = resource.getrlimit(resource.RLIMIT_FSIZE)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))\n"
        "atexit.register(resource.setrlimit, resource.RLIMIT_FSIZE, before)  # for coverage\n"
        f"{COMMAND.replace(':study', ':long_table')}"
    )
    done = run_script(script, None, "reproduce", "killed", "--out", str(tmp_path))
    assert done.returncode == 2
    assert done.stderr.splitlines() == [f"arrivals: {tmp_path / 'killed.csv'}: File too large"]
    assert list(tmp_path.iterdir()) == []  # no partial file
    page = tmp_path / "nowhere" / "page.md"
    done = run_script(
        COMMAND, None, "reproduce", "killed", "--out", str(tmp_path), "--page", str(page)
    )
    assert done.stderr.splitlines() == [f"arrivals: {page.parent}: the folder does not exist"]
    assert list(tmp_path.iterdir()) == []  # checked before the study
    (tmp_path / "file").write_text("")
    done = run_script(COMMAND, None, "reproduce", "killed", "--out", str(tmp_path / "file"))
    assert done.returncode == 2
    assert done.stderr.splitlines() == [f"arrivals: {tmp_path / 'file'}: File exists"]
