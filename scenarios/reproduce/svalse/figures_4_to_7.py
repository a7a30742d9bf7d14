"""Figs 4 to 7 of the paper on SVALSE: tracks of single runs, and tables over many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.bounds.snapshot import line_bound
from arrivals.scenarios.experiments.methods import Method, tracker_name
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.registry import METRICS
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.decisions import results_of
from arrivals.scenarios.reproduce.svalse.factor_graph import draw_factor_graph
from arrivals.scenarios.reproduce.svalse.forms import (
    FORMS,
    FORMS_SEEN,
    NAN,
    PAPER_FORM,
    PRINTED_7D,
    STARTS,
    activation_label,
    batch_of,
    started_at,
    svalse_as_printed,
    svalse_paper_form,
    table_methods,
    unmerged_7d,
    valse_as_printed,
    valse_paper_form,
)
from arrivals.scenarios.reproduce.svalse.plots import (
    DrawnRun,
    draw_activation,
    draw_parts,
    draw_scene,
)
from arrivals.scenarios.reproduce.svalse.published_values import ACTIVATION, PAPER, REBUILT
from arrivals.scenarios.reproduce.svalse.step_metrics import STEP_METRICS
from arrivals.trackers.run import Run
from arrivals.trackers.svalse.coordinate.angle_posterior import fold, mixture, quadrature
from arrivals.typing import Float

MEASURED = METRICS | STEP_METRICS
START_RUNS = 5  # of noise that starts at several levels: 25 s each in the paper's form
COLUMNS = ("method", "GOSPA", "std of runs", "from", "to", "distance", "missed", "false", "RMSE",
           "std of steps", "found near endfire", "wrong number", "converged", "label switches",
           "track length", "NEES", "in 68 %", "in 95 %", "CPU ms a step", "paper's run", "rebuilt",
           "its std", "rebuilt RMSE")  # fmt: skip
SHOWN = ("method", "GOSPA", "std of runs", "missed", "false", "RMSE", "std of steps", "paper's run")
RUN_METRICS = ("gospa", "distance", "missed", "false", "rmse", "gospa_std", "found_near_endfire",
               "cardinality", "converged")  # fmt: skip


def fig4(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """Six sources, of which two move and cross, 20 dB; and the factor graph of SVALSE."""
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
    settings = StudySettings(MEASURED, out, batch=batch_of(runs))
    compared = table_methods(quick)
    if name == "svalse_fig4" and not quick:
        compared.append(started_at(20.0, ours=False))
    study = compute_study({name: scenario}, compared, runs, seed, settings)
    rows = [_row(study, name, method) for method in study.methods]
    drawn = first_runs(scenario, seed, quick)
    rows += [_run_row(one, name) for one in drawn if one.method not in study.methods]
    results = results_of(study)
    lines = [*remarks, SPREADS, FORMS_SEEN, _scale(scenario, runs, seed)]
    figures = {"tracks": draw_scene(drawn, PAPER[name]), "gospa": draw_parts(study, name)}
    heading = f"{title}, {runs} runs at 20 dB, degrees"
    captions = {"tracks": f"{title}, run 0 at 20 dB", "gospa": heading}
    if name == "svalse_fig4":
        lines[lines.index(FORMS_SEEN)] = FORMS
        figures["graph"] = draw_factor_graph()
        captions["graph"] = "Figs 1 to 3: sketch of the factor graph and of the schedule"
        results |= start_results(scenario, min(runs, START_RUNS), seed, out, quick)
        results |= mixture_results(drawn[0].trial)
    return Report(heading, COLUMNS, rows, lines, figures, SHOWN, results, captions)


def iterations(trial: Trial, run: Run) -> float:
    """Return the mean number of iterations of a step."""
    return float(np.mean(run.iterations))


def start_results(
    scenario: Scenario, runs: int, seed: int, out: Path | None, quick: bool
) -> dict[tuple[str, str, str], Float]:
    """Return missed sources and iterations of VALSE by the SNR from which its noise starts."""
    settings = StudySettings({"missed": METRICS["missed"], "iterations": iterations}, out, batch=1)
    forms = (True,) if quick else (True, False)
    started = [started_at(snr_db, ours) for ours in forms for snr_db in STARTS]
    study = compute_study({"svalse_fig4": scenario}, started, runs, seed, settings)
    return {(f"started, {metric}", method, case): values
            for (metric, method, case), values in results_of(study).items()}  # fmt: skip


def mixture_results(trial: Trial) -> dict[tuple[str, str, str], Float]:
    """Return mean and width of mixtures (38)-(48) beside the exact ones, for every true source.

    The densities are those of (32) with the amplitudes of least squares at the true directions:
    the difference of the means in exact deviations, and the ratio of the deviations.
    """
    shift, width = [], []
    model: Any = trial.measurement
    for y, doa in zip(np.asarray(trial.measurements), trial.truth, strict=True):
        A = model.array.steering_vector(doa, model.wavelength).T
        A = A / A[:1]  # phases from the first sensor
        w = np.linalg.lstsq(A, y, rcond=None)[0]
        rest = y - A @ w
        noise = (np.abs(rest) ** 2).sum() / (len(y) - len(w))
        for a, amplitude in zip(A.T, w, strict=True):
            # (32), (33)
            eta = 2 / noise * (rest + a * amplitude) * amplitude.conj()
            c = fold(eta, np.arange(len(eta)), len(eta) - 1)
            (exact, _), (_, mean) = quadrature(c), mixture(c)
            deviation = np.sqrt(-2 * np.log(np.abs(exact[1])))
            shift.append(abs(np.angle(mean / exact[1])) / deviation)
            width.append(np.sqrt(-2 * np.log(abs(mean))) / deviation)
    return {("shift", "mixture", ""): np.array(shift), ("width", "mixture", ""): np.array(width)}


def first_runs(scenario: Scenario, seed: int, quick: bool) -> list[DrawnRun]:
    """Return run 0 by VALSE and SVALSE as printed, and by ours; a quick study has only ours."""
    printed = [] if quick else [valse_as_printed(), svalse_as_printed()]
    shown = [*printed, Method("valse"), Method("svalse")]
    return parallel_map(drawn_run, [(scenario, method, seed) for method in shown])


def drawn_run(scenario: Scenario, method: Method, seed: int) -> DrawnRun:
    """Return run 0 of a study by a method."""
    seed_sequence = np.random.SeedSequence(seed, spawn_key=(0,))
    trial = scenario.sample(np.random.default_rng(seed_sequence))
    return DrawnRun(method.label, trial, method.make(trial, seed_sequence).run(trial.measurements))


SPREADS = (
    "From, to: 95 % bootstrap interval of the mean. Std of steps: of GOSPA over the steps of a "
    "run. Found near endfire: share of the sources from 50 degrees on with an estimate within 10 "
    "degrees. Label switches: number in a run. Track length: number of steps in which a source is "
    "detected with one label, without a gap. NEES: squared error over stated variance, 1 if "
    "consistent; in 68 %, in 95 %: fraction of errors within the stated intervals. Rebuilt: the "
    "published programs of SBL and SSBL; VALSE and SVALSE in the paper's form."
)


def _row(study: Study, name: str, method: str) -> tuple[Any, ...]:
    def mean(metric: str) -> float:
        try:
            return study.mean(metric, method)
        except ValueError:  # methods without memory have no labels
            return NAN

    rebuilt = REBUILT[name].get(tracker_name(method))
    reference = (rebuilt.gospa, rebuilt.std, rebuilt.rmse) if rebuilt else (NAN,) * 3
    stated = ("label_switches", "track_length", "nees", "coverage68", "coverage95", "cpu_ms")
    return (
        method,
        study.mean("gospa", method),
        study.spread("gospa", method),
        *study.interval("gospa", method),
        *map(mean, (*RUN_METRICS[1:], *stated)),
        PAPER[name].get(tracker_name(method), NAN),
        *reference,
    )


def _run_row(drawn: DrawnRun, name: str) -> tuple[Any, ...]:
    """Return the row of a single run."""
    gospa, *rest = (MEASURED[metric](drawn.trial, drawn.run) for metric in RUN_METRICS)
    paper = PAPER[name].get(tracker_name(drawn.method), NAN)
    return (f"{drawn.method}, run 0", gospa, *[NAN] * 3, *rest, *[NAN] * 6, paper, *[NAN] * 3)


def _scale(scenario: Scenario, runs: int, seed: int) -> str:
    bound = line_bound(scenario, min(runs, 6), seed)  # type: ignore[arg-type]  # a LineScenario
    return (
        f"Scale: an efficient estimator from one snapshot with a known number of sources would "
        f"have a GOSPA of {bound.gospa:.2f} and an RMSE of {bound.rmse:.2f} (deterministic "
        f"Cramér-Rao bound, capped at the cut-off); methods with memory may be below."
    )


# -- Fig. 7 ------------------------------------------------------------------------------------


def fig7(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """Extreme probabilities of birth and death, on the scenario of Fig. 6."""
    limit = 100 if quick else 1000
    trackers = [
        svalse_paper_form(
            activation_label(death, birth), limit, p_deactivate=death, p_activate=birth
        )
        for death, birth in ACTIVATION
    ]
    scenario = create("svalse_fig6")
    metrics = {name: MEASURED[name] for name in ("gospa", "missed", "false", "rmse", "converged")}
    settings = StudySettings(metrics, out, batch=1)
    compared = [*trackers, valse_paper_form()]
    study = compute_study({"svalse_fig6": scenario}, compared, runs, seed, settings)
    rows = [_activation_row(study, *pair) for pair in ACTIVATION]
    rows.append((PAPER_FORM["valse"], *_activation_means(study, PAPER_FORM["valse"]),
                 PAPER["svalse_fig6"]["valse"], *[NAN] * 4))  # fmt: skip
    results = results_of(study)
    if not quick:  # one run: as printed it takes ten minutes
        single = [svalse_as_printed(PRINTED_7D, p_activate=1.0), unmerged_7d()]
        printed = compute_study({"svalse_fig6": scenario}, single, 1, seed, settings)
        known = ACTIVATION[0.25, 1.0]
        rows += [(label, *_activation_means(printed, label), known.paper, known.paper_rmse,
                  *[NAN] * 3) for label in printed.methods]  # fmt: skip
        results |= results_of(printed)
    drawn = parallel_map(drawn_run, [(scenario, method, seed) for method in trackers[:4]])
    columns = ("p_deactivate, p_activate", "GOSPA", "std of runs", "missed", "false", "RMSE",
               "converged", "paper's run", "paper's RMSE", "rebuilt", "its std",
               "rebuilt RMSE")  # fmt: skip
    paper = [reference.paper for reference in ACTIVATION.values()]
    figures = {"tracks": draw_activation(drawn, paper)}
    title = f"Fig. 7: probabilities of activation, paper's form, {runs} runs at 20 dB, degrees"
    page = tuple(name for name in columns[:9] if name != "converged")
    remarks = [FORCED, *([FEWER] if quick else []), FORMS_SEEN]
    captions = {"tracks": "Fig. 7: probabilities of activation, paper's form, run 0 at 20 dB"}
    return Report(title, columns, rows, remarks, figures, page, results, captions)


FORCED = (
    "With certain births every component is active; merging removes most of them, and the rest "
    "depends on the integration over the angles: the published program has mixtures in place of "
    "quadrature. The paper does not mention merging; one run is without."
)


FEWER = "This quick study has at most 100 iterations a step."


def _activation_means(study: Study, label: str) -> tuple[float, ...]:
    means = (study.mean(metric, label) for metric in ("missed", "false", "rmse", "converged"))
    return (study.mean("gospa", label), study.spread("gospa", label), *means)


def _activation_row(study: Study, death: float, birth: float) -> tuple[Any, ...]:
    known, label = ACTIVATION[death, birth], activation_label(death, birth)
    return (label, *_activation_means(study, label), known.paper, known.paper_rmse, known.gospa,
            known.std, known.rmse)  # fmt: skip
