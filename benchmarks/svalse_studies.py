"""The figures of SVALSE's paper by Monte Carlo, beside the specification's limits.

Section 12.1: means of 20 runs on Figs 4 to 6, held to the mean ± 2 standard deviations of runs of
the rebuilt methods, and the paired difference of SVALSE and SSBL, below zero. Section 12.2: GOSPA
against the SNR, in the same order, and within a fifth and 1 degree of the rebuilt means of 3 runs.
Section 12.3: activation probabilities, within twice the stated spread. Studies are kept in --out
and gone on with.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from joblib import parallel_config

from arrivals.scenarios import create
from arrivals.scenarios.experiments.methods import tracker_name
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.reproduce.svalse.figures_8_to_10 import SCENES, SNR_DB, sweep
from arrivals.scenarios.reproduce.svalse.forms import svalse_paper_form, table_methods
from arrivals.scenarios.reproduce.svalse.published_values import ACTIVATION, REBUILT, SWEEP, SWEPT


def verdict(passed: bool) -> str:
    """Return the last cell."""
    return "pass" if passed else "FAIL"


def scenes(runs: int, out: Path, quick: bool) -> None:
    """Print the table of section 12.1."""
    print("| scene | method | GOSPA ± std of runs | rebuilt | RMSE | rebuilt | within |")
    print("|---" * 7 + "|")
    for name, known in REBUILT.items():
        study = compute_study(
            {name: create(name)}, table_methods(quick), runs, 0, StudySettings(out=out, batch=2)
        )
        for method in study.methods:
            gospa, rmse = (study.mean(metric, method) for metric in ("gospa", "rmse"))
            mine = f"| {name} | {method} | {gospa:.2f} ± {study.spread('gospa', method):.2f} "
            if tracker_name(method) not in known:
                print(f"{mine}| | {rmse:.2f} | | |", flush=True)
                continue
            its = known[tracker_name(method)]
            off = abs(gospa - its.gospa) <= 2 * its.std
            print(f"{mine}| {its.gospa:.2f} ± {its.std:.2f} | {rmse:.2f} | {its.rmse:.2f} "
                  f"| {verdict(off)} |", flush=True)  # fmt: skip
        for method in [label for label in study.methods if tracker_name(label) == "svalse"]:
            d = study.paired("gospa", method, "ssbl")
            print(f"| {name} | {method} - ssbl, paired | {d.mean:.2f} ± {d.error:.2f}, below 0 in "
                  f"{d.n_below} of {d.n_runs} | below 0 | | | {verdict(d.mean < 0)} |")  # fmt: skip


def sweeps(runs: int, out: Path, quick: bool) -> None:
    """Print the table of section 12.2."""
    print("\n| scenario | SNR | method | GOSPA | rebuilt | RMSE | rebuilt | within |")
    print("|---" * 8 + "|")
    for name in SCENES:
        study = sweep(name, runs, 0, out, quick)
        for snr in SNR_DB:
            for method in study.methods:
                if tracker_name(method) not in SWEPT:
                    continue
                gospa, rmse = (study.mean(m, method, f"{snr:g}") for m in ("gospa", "rmse"))
                g, r = SWEEP[name][snr][SWEPT.index(tracker_name(method))]
                near = abs(gospa - g) <= max(0.2 * g, 1.0)
                print(f"| {name} | {snr:g} | {method} | {gospa:.2f} | {g} | {rmse:.2f} | {r} "
                      f"| {verdict(near)} |", flush=True)  # fmt: skip


def activations(runs: int, out: Path) -> None:
    """Print the table of section 12.3."""
    print("\n| p_d, p_a | GOSPA | rebuilt | missed | false | RMSE | rebuilt | within |")
    print("|---" * 8 + "|")
    settings = [
        svalse_paper_form(f"{off:g}, {on:g}", p_deactivate=off, p_activate=on)
        for off, on in ACTIVATION
    ]
    cases = {"svalse_fig6": create("svalse_fig6")}
    study = compute_study(cases, settings, runs, 0, StudySettings(out=out, batch=1))
    for method, known in zip(study.methods, ACTIVATION.values(), strict=True):
        gospa, missed, false, rmse = (
            study.mean(metric, method) for metric in ("gospa", "missed", "false", "rmse")
        )
        near = abs(gospa - known.gospa) <= 2 * known.std
        print(f"| {method} | {gospa:.2f} | {known.gospa:.2f} ± {known.std:.2f} | {missed:.2f} "
              f"| {false:.2f} | {rmse:.2f} | {known.rmse:.2f} | {verdict(near)} |",
              flush=True)  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--sweep-runs", type=int, default=3)
    parser.add_argument("--activation-runs", type=int, default=6)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="without the paper's slow form")
    parser.add_argument("--out", type=Path, default=Path("arrivals-studies"))
    options = parser.parse_args()
    with parallel_config(n_jobs=options.jobs):
        scenes(options.runs, options.out, options.quick)
        activations(options.activation_runs, options.out)
        sweeps(options.sweep_runs, options.out, options.quick)


if __name__ == "__main__":
    main()
