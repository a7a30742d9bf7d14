"""Figs 4 to 7 of the paper on SVALSE: tracks of single runs, and tables over many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.base import Scenario
from arrivals.scenarios.bounds.snapshot import line_bound
from arrivals.scenarios.experiments.methods import Method, methods, tracker_name
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.claims import negative, verdict
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.calibration_scenes import CONSERVATIVE
from arrivals.scenarios.reproduce.svalse.plots import draw_parts, draw_runs
from arrivals.scenarios.reproduce.svalse.published_values import ACTIVATION, PAPER, REBUILT
from arrivals.trackers import CoordinateSolver

FAST = ("cbf", "peaks_gnn", "sbl", "ssbl", "valse", "svalse")


def as_printed(max_iterations: int) -> dict[str, Any]:
    """Return the parameters of the paper's form."""
    solver = CoordinateSolver(tolerance=1e-6, max_iterations=max_iterations)
    return {"solver": solver, "reference": "first"}


def svalse_as_printed(label: str, **probabilities: float) -> Method:
    """Return SVALSE as published, with its walk in the electrical angle.

    Examples
    --------
    >>> svalse_as_printed("no deaths", p_deactivate=0.0).params["motion"].walk.kappa
    148.0
    """
    motion = BernoulliVonMises(**probabilities)
    return Method("svalse", as_printed(1000) | {"motion": motion}, label)


PRINTED = (
    Method("valse", as_printed(2000), "valse as printed"),
    svalse_as_printed("svalse as printed"),
)
SHOWN = ("valse", "svalse", "sbl", "ssbl", "cbf", "peaks_gnn")
NAN = float("nan")
COLUMNS = ("method", "GOSPA", "std of runs", "from", "to", "distance", "missed", "false", "RMSE",
           "wrong number", "label switches", "track length", "NEES", "in 68 %", "in 95 %",
           "CPU ms a step", "paper's run", "rebuilt", "its std", "rebuilt RMSE")  # fmt: skip


def table_methods(quick: bool) -> list[Method]:
    """Return the methods of the tables; the published forms take ten times as long."""
    return methods(FAST if quick else (*FAST, *PRINTED))


def fig4(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """Six sources, of which two move and cross, 20 dB."""
    return scene("svalse_fig4", "Fig. 4: six sources, two of which cross", runs, seed, out, quick)


def fig5(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """Random pairs of the six sources inactive."""
    remark = "Our reading of Fig. 5: a pair redrawn at every step but the first is inactive."
    return scene("svalse_fig5", "Fig. 5: random pairs off", runs, seed, out, quick, remark)


def fig6(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """Neighbouring pairs of the six sources inactive in turn."""
    return scene("svalse_fig6", "Fig. 6: pairs off in turn", runs, seed, out, quick)


def scene(
    name: str, title: str, runs: int, seed: int, out: Path | None, quick: bool, *remarks: str
) -> Report:
    """Compare all methods on one scene; draw the first run, and the parts of GOSPA."""
    scenario = create(name)
    settings = StudySettings(out=out, batch=batch_of(runs))
    study = compute_study({name: scenario}, table_methods(quick), runs, seed, settings)
    rows = [_row(study, name, method) for method in study.methods]
    claims = [*_order(study), *_as_rebuilt(study, name), *_calibration(study)]
    lines = [*remarks, *SPREADS, *claims, _bound(scenario, runs, seed)]
    figures = {
        "tracks": draw_runs(
            scenario, seed, methods(SHOWN), [PAPER[name].get(method, NAN) for method in SHOWN]
        ),
        "gospa": draw_parts(study, name),
    }
    return Report(f"{title}, {runs} runs at 20 dB, degrees", COLUMNS, rows, lines, figures)


def batch_of(runs: int) -> int:
    """Return the number of runs in a batch: eight batches or more for a few processes.

    Examples
    --------
    >>> batch_of(2), batch_of(20), batch_of(1000)
    (1, 2, 16)
    """
    return min(max(1, runs // 8), 16)


SPREADS = (
    "From, to: 95 % bootstrap interval of the mean. Label switches: number in a run. Track length: "
    "number of steps in which a source is detected with one label, without a gap. NEES: squared "
    "error over stated variance, 1 if consistent; in 68 %, in 95 %: fraction of errors within the "
    "stated intervals. Deviations count as stated if these fractions are within "
    f"{CONSERVATIVE}: some sources stand still, and the motion models allow for more.",
    "Rebuilt: the published programs of SBL and SSBL; VALSE and SVALSE as the paper prints them "
    "(coordinate ascent, first sensor as phase reference, tolerance 1e-6, a walk in the electrical "
    "angle). Ours, unless called 'as printed', use joint Newton steps, a phase reference in the "
    "middle and a walk of 1.5 degrees in direction.",
)


def _row(study: Study, name: str, method: str) -> tuple[Any, ...]:
    def mean(metric: str) -> float:
        try:
            return study.mean(metric, method)
        except ValueError:  # methods without memory have no labels
            return NAN

    rebuilt = REBUILT[name].get(tracker_name(method))
    reference = (rebuilt.gospa, rebuilt.std, rebuilt.rmse) if rebuilt else (NAN,) * 3
    metrics = ("distance", "missed", "false", "rmse", "cardinality", "label_switches",
               "track_length", "nees", "coverage68", "coverage95", "cpu_ms")  # fmt: skip
    return (
        method,
        study.mean("gospa", method),
        study.spread("gospa", method),
        *study.interval("gospa", method),
        *map(mean, metrics),
        PAPER[name].get(tracker_name(method), NAN),
        *reference,
    )


def _order(study: Study) -> list[str]:
    lines = []
    claims = [("svalse", "ssbl"), ("ssbl", "sbl"), ("svalse", "valse"), ("svalse", "peaks_gnn")]
    if "svalse as printed" in study.methods:
        claims.append(("svalse as printed", "ssbl"))
    for better, worse in claims:
        d = study.paired("gospa", better, worse)
        numbers = (
            f"paired difference {d.mean:.2f} ± {d.error:.2f} standard error, "
            f"below 0 in {d.n_below} of {d.n_runs} runs"
        )
        fact = negative(d.mean, d.error)
        lines.append(verdict(f"{better} has a lower GOSPA than {worse}", fact, numbers))
    return lines


def _as_rebuilt(study: Study, name: str) -> list[str]:
    """Compare the methods that are the rebuilt ones with the rebuilt values."""
    lines = []
    for method in study.methods:
        its = REBUILT[name].get(tracker_name(method))
        if its is None or method in ("valse", "svalse"):  # these improve on the paper's
            continue
        gospa = study.mean("gospa", method)
        numbers = f"GOSPA {gospa:.2f}, rebuilt {its.gospa:.2f} ± {its.std:.2f}"
        fact = abs(gospa - its.gospa) <= 2 * its.std
        lines.append(
            verdict(f"{method} is within two deviations of its rebuilt form", fact, numbers)
        )
    return lines


def _calibration(study: Study) -> list[str]:
    """Check the stated standard deviations of each method that has them."""
    lines = []
    for method in study.methods:
        try:
            nees, c68, c95 = (study.mean(m, method) for m in ("nees", "coverage68", "coverage95"))
        except ValueError:  # no standard deviations
            continue
        numbers = (
            f"errors {np.sqrt(nees):.1f} times as large as stated, in rms; the 68 % and 95 % "
            f"intervals cover {100 * c68:.0f} % and {100 * c95:.0f} %"
        )
        fact = CONSERVATIVE.holds(c68, c95)
        lines.append(
            verdict(f"{method} states the standard deviations of its errors", fact, numbers)
        )
    return lines


def _bound(scenario: Scenario, runs: int, seed: int) -> str:
    bound = line_bound(scenario, min(runs, 6), seed)  # type: ignore[arg-type]  # a LineScenario
    return (
        f"Scale: an efficient estimator from one snapshot with a known number of sources would "
        f"have a GOSPA of {bound.gospa:.2f} and an RMSE of {bound.rmse:.2f} (deterministic "
        f"Cramér-Rao bound, capped at the cut-off)."
    )


# -- Fig. 7 ------------------------------------------------------------------------------------


def fig7(runs: int, seed: int, out: Path | None = None) -> Report:
    """Extreme probabilities of birth and death, on the scenario of Fig. 6."""
    panels = {f"p_d {death:g}, p_a {birth:g}": (death, birth) for death, birth in ACTIVATION}
    trackers = [
        svalse_as_printed(label, p_deactivate=death, p_activate=birth)
        for label, (death, birth) in panels.items()
    ]
    scenario = create("svalse_fig6")
    settings = StudySettings(out=out, batch=1)
    study = compute_study({"svalse_fig6": scenario}, trackers, runs, seed, settings)
    rows = [_activation_row(study, label, *pair) for label, pair in panels.items()]
    columns = ("p_deactivate", "p_activate", "GOSPA", "std of runs", "missed", "false", "RMSE",
               "converged", "paper's run", "paper's RMSE", "rebuilt", "its std",
               "rebuilt RMSE")  # fmt: skip
    paper = [reference.paper for reference in ACTIVATION.values()]
    figures = {"tracks": draw_runs(scenario, seed, trackers[:4], paper)}
    title = f"Fig. 7: probabilities of activation, svalse as printed, {runs} runs at 20 dB, degrees"
    return Report(title, columns, rows, [*_activation_claims(study), FORCED], figures)


CLAIMS = (
    ("without deaths there are false sources", "false"),
    ("without memory sources are missed", "missed"),
    ("without births sources are missed", "missed"),
    ("with certain births there are false sources", "false"),
)


def _activation_claims(study: Study) -> list[str]:
    default, lines = study.methods[-1], []
    for label, (claim, metric) in zip(study.methods, CLAIMS, strict=False):
        here, usual = study.mean(metric, label), study.mean(metric, default)
        numbers = f"{metric} {here:.2f}, by default {usual:.2f}"
        lines.append(verdict(f"{claim} ({label})", here > usual + 1, numbers))
    for label, reference in zip(study.methods, ACTIVATION.values(), strict=True):
        gospa = study.mean("gospa", label)
        numbers = f"GOSPA {gospa:.2f}, rebuilt {reference.gospa:.2f} ± {reference.std:.2f}"
        fact = abs(gospa - reference.gospa) <= 2 * reference.std
        lines.append(
            verdict(f"{label} is within two deviations of the rebuilt form", fact, numbers)
        )
    return lines


FORCED = (
    "With certain births every component is active; merging removes most of them, and the rest "
    "depends on the integration over the angles: the published program uses mixtures "
    '(`posterior="mixture"`) in place of quadrature.'
)


def _activation_row(study: Study, label: str, death: float, birth: float) -> tuple[Any, ...]:
    reference = ACTIVATION[death, birth]
    means = [study.mean(metric, label) for metric in ("missed", "false", "rmse", "converged")]
    return (death, birth, study.mean("gospa", label), study.spread("gospa", label), *means,
            reference.paper, reference.paper_rmse, reference.gospa, reference.std,
            reference.rmse)  # fmt: skip
