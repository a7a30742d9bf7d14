"""Calibration of SVALSE: coverage of its intervals and reliability of its existence.

Each scene is tracked twice: as the scenario says, and with a walk that never stops.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from arrivals.scenarios.base import Trial
from arrivals.scenarios.experiments.statistics import Difference, paired_difference
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.calibration import Reliability, reliability
from arrivals.scenarios.metrics.consistency import circular_nees, coverage
from arrivals.scenarios.metrics.registry import METRICS, existence_and_hits, pairs_of
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.claims import Claim, Decide, Decision
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.calibration_scenes import (
    SCENES,
    CalibrationScene,
    Coverage,
)
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVELS = (0.50, 0.68, 0.90, 0.95)
SETTLED = 5  # steps after which errors count


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
    """

    error: Float
    std: Float
    existence: Float
    hit: Bool
    gospa: Float


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
    return Statements(pairs.error[late], std[late], existence, hit, gospa)


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
        "GOSPA in degrees, cut-off 10. ECE, Brier and log score compare the stated existence "
        "with the share of estimates within 10 degrees of a source. 'Never stops': by a walk that "
        "never stops, `still=0`; the change of GOSPA from that to the default is paired, with its "
        "standard error.",
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
    return Statements(*(np.concatenate(values) for values in zip(*parts, strict=True)))


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
    nees = circular_nees(stated.error, stated.std)
    gospa = float(stated.gospa.mean())
    _, c68, _, c95 = shares(result.never_stops)
    before = (100 * c68, 100 * c95, *change(result)[:2])
    return (scene.label, *covered, nees, gospa, r.ece, r.brier, r.log_score, *before)


def reliability_of(pooled: Pooled, loud: bool) -> Reliability:
    """Return the reliability of all scenes at 10 dB and more, or below, pooled."""
    parts = [result.default for scene, result in pooled.items() if (scene.snr_db >= 10) == loud]
    together = _pooled(parts)
    return reliability(together.existence, together.hit)


# -- claims --------------------------------------------------------------------------------------


def covers(scene: CalibrationScene, limits: Coverage, form: int, pooled: Pooled) -> Decision | None:
    """Decide that the intervals of a form, 0 or 1 of `Paired`, cover within limits."""
    if scene not in pooled:
        return None
    _, c68, _, c95 = shares(pooled[scene][form])
    return Decision(limits.holds(c68, c95), f"{c68:.1%} and {c95:.1%}")


def changes(scene: CalibrationScene, limit: float, pooled: Pooled) -> Decision | None:
    """Decide that GOSPA changes by at most a limit."""
    if scene not in pooled:
        return None
    mean, error, *_ = change(pooled[scene])
    return Decision(mean <= limit, f"{mean:+.2f} ± {error:.2f}")


def existence_everywhere(pooled: Pooled) -> Decision:
    """Decide on the calibration error of the existence in every scene at 10 dB and more."""
    parts = {scene.label: result.default for scene, result in pooled.items() if scene.snr_db >= 10}
    eces = {label: reliability(p.existence, p.hit).ece for label, p in parts.items()}
    worst = max(eces, key=lambda label: eces[label])
    return Decision(eces[worst] < 0.05, f"at most {eces[worst]:.3f}: {worst}")


def existence_score(name: str, limit: float, pooled: Pooled) -> Decision:
    """Decide on a score of the existence at 10 dB and more, pooled."""
    value = float(getattr(reliability_of(pooled, loud=True), name))
    return Decision(value <= limit, f"{value:.4f}")


def _claims() -> Iterator[tuple[str, Decide]]:
    for scene in SCENES:
        forms = (("", scene.limits), (" by a walk that never stops", scene.never_stops))
        for form, (note, limits) in enumerate(forms):
            if limits is not None:
                text = f"{scene.label}: 68 and 95 % intervals{note} cover {limits}"
                yield text, partial(covers, scene, limits, form)
        if scene.change is not None:
            text = f"{scene.label}: GOSPA changes by at most {scene.change:+g} degrees"
            yield text, partial(changes, scene, scene.change)
    yield "existence in every scene at 10 dB and more: ECE below 0.05", existence_everywhere
    for name, limit in (("brier", 0.007), ("log_score", 0.04)):
        text = f"existence at 10 dB and more, pooled: {name} at most {limit:g}"
        yield text, partial(existence_score, name, limit)


CLAIMS = tuple(
    Claim("calibration", "", text, by_ours=decide, source="ours") for text, decide in _claims()
)


def _figures(pooled: Pooled) -> dict[str, Figure]:
    """Draw the coverage of every scene, and two reliability diagrams."""
    from matplotlib.figure import Figure

    from arrivals.plots.calibration import plot_coverage, plot_reliability

    first = Figure(figsize=(8.0, 1.2 + 0.24 * len(pooled)), layout="constrained")
    labelled = {scene.label: shares(result.default) for scene, result in pooled.items()}
    plot_coverage(labelled, LEVELS, ax=first.subplots())
    second = Figure(figsize=(5.0, 4.6), layout="constrained")
    ax = second.subplots()
    for label, loud in (("10 dB and more", True), ("0 dB", False)):
        plot_reliability(reliability_of(pooled, loud).table, label=label, ax=ax)
    return {"coverage": first, "reliability": second}
