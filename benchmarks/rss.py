"""Signal strength: our figures beside those of the specification, and times.

python benchmarks/rss.py                          # everything but measured data
python benchmarks/rss.py --only table --runs 50   # one part; runs are per seed, three seeds
python benchmarks/rss.py --only measured --data DIR
"""

from __future__ import annotations

import argparse
import copy
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rss_accuracy import covariances_and_flags, single_and_divergence, table
from rss_tables import WITHIN, between, heading, line
from rss_tracking import births, counting, crossing, measured

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.scenarios.reproduce.rss.trials import draws
from arrivals.scenarios.simulations.signal_strength import Table1K3, Table1K7, in_disc
from arrivals.trackers import MAPSolver, VariationalSolver
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.rss_vb import variational_posterior
from arrivals.trackers.rss.settings import Sweep


def iteration_ms(K: int, M: int, sweep: Sweep = "gauss-seidel") -> float:
    """Return the processor time of one iteration, ms, the minimum of three."""
    rng = np.random.default_rng(0)
    radius = 100.0 * np.sqrt(max(1.0, K / 5))
    model = LogNormalRSS(in_disc(rng, (M,), radius), log_noise=float(db_to_neper(40.0)))
    theta = in_disc(rng, (1, K), 0.8 * radius)
    u = db_to_neper(80 + 3 * rng.standard_normal((1, K)))
    start = theta + 5 * rng.standard_normal(theta.shape)
    prior = Prior(np.full((1, K), 9.21), np.full((1, K), 8.38), start,
                  np.tile(np.eye(2) / 100, (1, K, 1, 1)))  # fmt: skip
    problem = JointPosterior(
        model.propagation, model.draw(u, theta, rng), 1 / model.variance[None], prior
    )
    damping = 0.5 if sweep == "jacobi" else 1.0
    solver = VariationalSolver(sweep, damping, max_iterations=4, tol_u=0.0, tol_theta=1e-6)
    best_time = np.inf
    for _ in range(3):
        started = time.process_time()
        variational_posterior(problem, prior.mu, start, solver)
        best_time = min(best_time, (time.process_time() - started) / solver.max_iterations)
    return 1e3 * best_time


def speed(runs: int) -> None:
    """Print the scaling of times, the gain of a batch, and the times of LM."""
    heading("Time of an iteration, ms of one core: Gauss-Seidel / Jacobi")
    of_k = {
        K: (iteration_ms(K, 400), iteration_ms(K, 400, "jacobi")) for K in (1, 5, 10, 20, 30, 50)
    }
    for K, (ours, jacobi) in of_k.items():
        line(f"K={K}, M=400", f"{ours:.1f} / {jacobi:.1f}", "")
    slope = of_k[50][0] / of_k[5][0] / 10
    line("K 5 to 50, over linear", f"{slope:.2f}", "0.5..2", between(slope, 0.5, 2))
    of_m = {
        M: (iteration_ms(3, M), iteration_ms(3, M, "jacobi")) for M in (100, 1000, 10_000, 100_000)
    }
    for M, (ours, jacobi) in of_m.items():
        line(f"K=3, M={M}", f"{ours:.1f} / {jacobi:.1f}", "")
    slope = of_m[100_000][0] / of_m[1000][0] / 100
    line("M 1e3 to 1e5, over linear", f"{slope:.2f}", "at most 2", slope <= 2)
    line("K=3, M=1e5: an iteration", f"{of_m[100_000][0] / 1e3:.2f} s", "at most 0.3 s",
         of_m[100_000][0] <= 300)  # fmt: skip
    memory = peak_mb()
    line("K=3, M=1e5: an update of rss_vb, whole process", f"{memory:.0f} MB", "at most 300 MB",
         memory <= 300)  # fmt: skip
    heading("A batch of trials against one after the other, wall ms a trial of 5 steps")
    for K, M in ((1, 100), (3, 100), (7, 100)):
        one, many = batch_ms(K, M)
        line(f"K={K}, M={M}", f"{one:.1f} / {many:.2f} = {one / many:.0f} times", "10 times",
             one / many >= 10)  # fmt: skip
    heading("To convergence, ms of one core, median error m: vb / lm, start and prior 10 m off")
    for K in (3, 7, 20, 50):
        line(f"K={K}, M={max(100, 24 * K)}", against_lm(K, max(4, runs // 10)), "whichever wins")


def peak_mb() -> float:
    """Return the peak memory of a fresh process that updates once with 1e5 sensors."""
    script = (
        "import numpy as np, resource\n"
        "from arrivals.scenarios.simulations.signal_strength import Table1K3\n"
        "trial = Table1K3(n_sensors=100000).sample(np.random.default_rng(0))\n"
        "trial.tracker('rss_vb').update(trial.measurements[0])\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def batch_ms(K: int, M: int, trials: int = 200, looped: int = 20) -> tuple[float, float]:
    """Return wall ms a trial: one after the other, and as a batch."""
    rng = np.random.default_rng(0)
    trial = Table1K3(n_sources=K, n_sensors=M).sample(rng)
    tracker = trial.tracker("rss_vb")
    where = np.broadcast_to(trial.truth[0], (trials, 5, K, 2))
    z = trial.measurement.draw(np.broadcast_to(trial.log_amplitude, where.shape[:-1]), where, rng)
    started = time.perf_counter()
    for sequence in z[:looped]:
        copy.deepcopy(tracker).run(sequence)
    one = (time.perf_counter() - started) / looped
    started = time.perf_counter()
    tracker.run_batch(z)
    return 1e3 * one, 1e3 * (time.perf_counter() - started) / trials


def against_lm(K: int, runs: int) -> str:
    """Return processor times and errors of both methods from the same start."""
    took = np.zeros(2)
    far: tuple[list[float], list[float]] = ([], [])
    for run in range(-1, runs):  # the first imports scipy and is not counted
        scenario = Table1K7(n_sources=K, n_sensors=max(100, 24 * K))
        trials = draws(scenario, 1, run + 1)
        problem, start = trials.problem, trials.problem.prior.theta
        started = time.process_time()
        vb = variational_posterior(
            problem, problem.prior.mu, start, VariationalSolver(max_iterations=60)
        )
        between_them = time.process_time()
        one = problem.select(0)
        lm = maximize(one, one.prior.mu, start[0], MAPSolver(tolerance=1e-4))
        if run < 0:
            continue
        took += between_them - started, time.process_time() - between_them
        for errors, theta in zip(far, (vb.theta[0], lm.theta), strict=True):
            errors += np.linalg.norm(theta - trials.theta[0], axis=-1).tolist()
    ms = 1e3 * took / runs
    return (f"{ms[0]:.0f} / {ms[1]:.0f} ms, {np.median(far[0]):.2f} / {np.median(far[1]):.2f} m, "
            f"{'vb' if ms[0] < ms[1] else 'lm'} wins")  # fmt: skip


PARTS: dict[str, Callable[[int], None]] = {
    "table": table,
    "single": single_and_divergence,
    "covariance": covariances_and_flags,
    "counting": lambda runs: counting(max(24, runs // 2)),
    "crossing": lambda runs: crossing(max(25, runs // 2)),
    "births": lambda runs: births(max(10, runs // 2)),
    "speed": speed,
}


def main() -> None:
    """Print the tables."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=form)
    parser.add_argument("--runs", type=int, default=50, help="of each case and seed (50)")
    parser.add_argument("--only", choices=(*PARTS, "measured"))
    parser.add_argument("--data", type=Path, help="folder of the measured data")
    options = parser.parse_args()
    data = options.data
    if data is None and "ARRIVALS_DATA" in os.environ:
        data = Path(os.environ["ARRIVALS_DATA"]) / "rss"
    for name, part in PARTS.items():
        if options.only in (None, name):
            part(options.runs)
    if data is not None and options.only in (None, "measured"):
        measured(data)
    print(f"\n{sum(WITHIN)} of {len(WITHIN)} rows with a limit are within it; "
          f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB.")  # fmt: skip


if __name__ == "__main__":
    main()
