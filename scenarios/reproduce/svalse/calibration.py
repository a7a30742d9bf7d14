"""Calibration of SVALSE: coverage of its intervals and reliability of its existence.

Each scene is tracked twice: as the scenario says, and with a walk that never stops.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from arrivals.scenarios.base import Trial
from arrivals.scenarios.experiments.statistics import Difference, jackknife, paired_difference
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.calibration import Reliability, reliability
from arrivals.scenarios.metrics.consistency import circular_nees, coverage
from arrivals.scenarios.metrics.registry import METRICS, existence_and_hits, pairs_of
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decide, Decision, all_of, negative
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.calibration_scenes import (
    SCENES,
    CalibrationScene,
    Coverage,
)
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Float, Int

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVELS = (0.50, 0.68, 0.90, 0.95)
SETTLED, FEW_RUNS = 5, 8  # steps after which errors count; fewer runs decide nothing


class Statements(NamedTuple):
    """What a tracker stated in some runs, and what was true.

    Attributes
    ----------
    error, std : ndarray, shape (n_pairs,)
        rad.
    existence : ndarray, shape (n_estimates,)
    hit : ndarray of bool, shape (n_estimates,)
    gospa : ndarray, shape (n_runs,)
        Degrees.
    of_pair, of_estimate : ndarray of int, shape (n_pairs,), (n_estimates,)
        Index of the run.
    """

    error: Float
    std: Float
    existence: Float
    hit: Bool
    gospa: Float
    of_pair: Int
    of_estimate: Int

    def select(self, runs: Int) -> Statements:
        """Return what was stated in some runs."""
        pairs, estimates = np.isin(self.of_pair, runs), np.isin(self.of_estimate, runs)
        return Statements(
            self.error[pairs], self.std[pairs], self.existence[estimates], self.hit[estimates],
            self.gospa, self.of_pair[pairs], self.of_estimate[estimates],
        )  # fmt: skip


class Paired(NamedTuple):
    """Statements of the scenario's tracker, and of one with a walk that never stops.

    Attributes
    ----------
    default, never_stops : Statements
    """

    default: Statements
    never_stops: Statements


Pooled = Mapping[CalibrationScene, Paired]


def paired(scene: CalibrationScene, seed: int) -> Paired:
    """Return the statements of both trackers on the data of one seed."""
    scenario = create(scene.scenario, snr_db=scene.snr_db, **scene.parameters)
    trial = scenario.sample(np.random.default_rng(seed))
    motion: Any = trial.tracker_arguments()["motion"]
    each = (motion, motion.replace(still=0.0))
    return Paired(
        *(
            statements(trial, trial.tracker("svalse", motion=m).run(trial.measurements))
            for m in each
        )
    )


def statements(trial: Trial, run: Run) -> Statements:
    """Return what was stated in a run."""
    pairs = pairs_of(trial, run)
    late = pairs.step >= SETTLED
    std = run.fields["std"][pairs.step, pairs.slot]
    existence, hit = existence_and_hits(trial, run)
    gospa = np.array([METRICS["gospa"](trial, run)])
    return Statements(
        pairs.error[late], std[late], existence, hit, gospa, np.zeros(late.sum(), dtype=int),
        np.zeros(len(hit), dtype=int),
    )  # fmt: skip


def calibration(runs: int, seed: int) -> Report:
    """Coverage, NEES, reliability and GOSPA of SVALSE in every scene."""
    jobs = [(scene, seed + n) for scene in SCENES for n in range(runs)]
    each = parallel_map(paired, jobs)
    pooled = {
        scene: Paired(
            *(_pooled(parts) for parts in zip(*each[n * runs : (n + 1) * runs], strict=True))
        )
        for n, scene in enumerate(SCENES)
    }
    columns = ("scene", "50 %", "68 %", "90 %", "95 %", "NEES", "GOSPA", "ECE", "Brier",
               "log score", "68 %, never stops", "95 %, never stops", "GOSPA, change",
               "its error")  # fmt: skip
    remarks = (
        "Share of errors within the stated intervals, %, of estimates within 10 degrees of a "
        f"source, from step {SETTLED} on; NEES is the squared error over the stated variance. "
        "GOSPA in degrees, cut-off 10. Existence is the stated probability that an "
        "estimate is within 10 degrees of a source. ECE, the expected calibration error, is the "
        "mean distance of stated probability and observed share over ten bins; Brier the mean "
        "squared error of the probability, log score its mean negative log likelihood, nats. "
        "'Never stops': by a walk that never stops, `still=0`; the change of GOSPA from that to "
        "the default is paired, with its standard error.",
    )
    return Report(
        f"SVALSE: stated deviations and existence over {runs} runs",
        columns,
        [_row(scene, result) for scene, result in pooled.items()],
        remarks,
        _figures(pooled),
        ("scene", "68 %", "95 %", "NEES", "GOSPA", "GOSPA, change", "its error", "ECE"),
        pooled,
    )


def _pooled(parts: Sequence[Statements]) -> Statements:
    numbered = [
        part._replace(of_pair=part.of_pair + n, of_estimate=part.of_estimate + n)
        for n, part in enumerate(parts)
    ]
    return Statements(*(np.concatenate(values) for values in zip(*numbered, strict=True)))


def spread(statistic: Callable[[Statements], float], stated: Statements) -> float:
    """Return the standard error of a statistic, by leaving out groups of runs."""
    n = len(stated.gospa)
    return np.nan if n < FEW_RUNS else jackknife(lambda runs: statistic(stated.select(runs)), n)[1]


def share_errors(result: Statements) -> list[float]:
    """Return the standard errors of the coverage at `LEVELS`."""
    return [
        spread(lambda part, level=level: coverage(part.error, part.std, level), result)  # type: ignore[misc]
        for level in LEVELS
    ]


def shares(result: Statements) -> list[float]:
    """Return the coverage at `LEVELS`."""
    return [coverage(result.error, result.std, level) for level in LEVELS]


def change(result: Paired) -> Difference:
    """Return the paired change of GOSPA due to a walk that may stand still."""
    first, second = (dict(enumerate(form.gospa.tolist())) for form in result)
    return paired_difference(first, second)


def _row(scene: CalibrationScene, result: Paired) -> tuple[Any, ...]:
    stated = result.default
    r = reliability(stated.existence, stated.hit)
    covered = [100 * share for share in shares(stated)]
    gospa, (_, c68, _, c95) = float(stated.gospa.mean()), shares(result.never_stops)
    scores = (circular_nees(stated.error, stated.std), gospa, r.ece, r.brier, r.log_score)
    return (scene.label, *covered, *scores, 100 * c68, 100 * c95, *change(result)[:2])


def reliability_of(pooled: Pooled, loud: bool) -> Reliability:
    """Return the reliability of all scenes at 10 dB and more, or below, pooled."""
    parts = [result.default for scene, result in pooled.items() if (scene.snr_db >= 10) == loud]
    return reliability(
        np.concatenate([part.existence for part in parts]),
        np.concatenate([part.hit for part in parts]),
    )


# -- claims --------------------------------------------------------------------------------------


def covers(scene: CalibrationScene, limits: Coverage, form: int, pooled: Pooled) -> Decision | None:
    """Decide that the intervals of a form, 0 or 1 of `Paired`, cover within limits."""
    if scene not in pooled:
        return None
    stated = pooled[scene][form]
    _, c68, _, c95 = shares(stated)
    _, e68, _, e95 = share_errors(stated)
    sides = [
        negative(side, error)
        for share, error, (low, high) in ((c68, e68, limits.share68), (c95, e95, limits.share95))
        for side in (low - share, share - high)
    ]
    numbers = f"of 68 %: {c68:.1%} ± {e68:.1%}, of 95 %: {c95:.1%} ± {e95:.1%} of the errors"
    return Decision(all_of(sides), numbers)


def changes(scene: CalibrationScene, limit: float, pooled: Pooled) -> Decision | None:
    """Decide that GOSPA changes by at most a limit."""
    if scene not in pooled:
        return None
    mean, error, *_ = change(pooled[scene])
    error = np.nan if len(pooled[scene].default.gospa) < FEW_RUNS else error
    return Decision(negative(mean - limit, error), f"change {mean:+.2f} ± {error:.2f} degrees")


def existence_everywhere(pooled: Pooled) -> Decision:
    """Decide on the calibration error of the existence in every scene at 10 dB and more."""
    parts = {scene.label: result.default for scene, result in pooled.items() if scene.snr_db >= 10}
    eces = {label: _ece(part) for label, part in parts.items()}
    worst = max(eces, key=lambda label: eces[label])
    error = spread(_ece, parts[worst])
    return Decision(
        negative(eces[worst] - 0.05, error), f"at most {eces[worst]:.3f} ± {error:.3f}: {worst}"
    )


def _ece(stated: Statements) -> float:
    return reliability(stated.existence, stated.hit).ece


def existence_score(name: str, limit: float, pooled: Pooled) -> Decision:
    """Decide on a score of the existence at 10 dB and more, pooled."""
    n = len(next(iter(pooled.values())).default.gospa)

    def score(runs: Int) -> float:
        some = {scene: Paired(*(part.select(runs) for part in result))
                for scene, result in pooled.items()}  # fmt: skip
        return float(getattr(reliability_of(some, loud=True), name))

    value, error = jackknife(score, n) if n >= FEW_RUNS else (score(np.arange(n)), np.nan)
    return Decision(negative(value - limit, error), f"{value:.4f} ± {error:.4f}")


def _claims() -> Iterator[tuple[str, Decide]]:
    for scene in SCENES:
        forms = (("", scene.limits), (" by a walk that never stops", scene.never_stops))
        for form, (note, limits) in enumerate(forms):
            if limits is not None:
                text = f"{scene.label}: 68 and 95 % intervals{note} cover {limits} of the errors"
                yield text, partial(covers, scene, limits, form)
        if scene.change is not None:
            text = (
                f"{scene.label}: by a walk that may stand still GOSPA changes by at most "
                f"{scene.change:+g} degrees"
            )
            yield text, partial(changes, scene, scene.change)
    yield (
        "existence in every scene at 10 dB and more: expected calibration error below 0.05",
        existence_everywhere,
    )
    scores = (("brier", "mean squared error (Brier score)", "", 0.007),
              ("log_score", "mean negative log likelihood", " nats", 0.04))  # fmt: skip
    for name, words, unit, limit in scores:
        text = f"existence at 10 dB and more, pooled: {words} at most {limit:g}{unit}"
        yield text, partial(existence_score, name, limit)


CLAIMS = tuple(
    Claim("calibration", "", text, by_ours=decide, source="check") for text, decide in _claims()
)


def _figures(pooled: Pooled) -> dict[str, Figure]:
    """Draw the coverage of every scene, and two reliability diagrams."""
    from matplotlib.figure import Figure

    from arrivals.plots.calibration import plot_coverage, plot_reliability

    first = Figure(figsize=(9.6, 1.6 + 0.24 * len(pooled)), layout="constrained")
    stated = {scene.label: result.default for scene, result in pooled.items()}
    covered, errors = ({label: of(part) for label, part in stated.items()}
                       for of in (shares, share_errors))  # fmt: skip
    plot_coverage(covered, LEVELS, errors=errors, ax=first.subplots())
    second = Figure(figsize=(6.2, 4.6), layout="constrained")
    ax = second.subplots()
    for label, loud in (("10 dB and more", True), ("0 dB", False)):
        plot_reliability(reliability_of(pooled, loud).table, label=label, ax=ax)
    return {"coverage": first, "reliability": second}
