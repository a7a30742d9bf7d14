"""Parts of the report's figures and statements: scenes, forms of the method, runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from arrivals.motion_models import AutoregressiveSources
from arrivals.scenarios.base import Trial
from arrivals.scenarios.simulations.autoregressive_sources import (
    BROAD,
    AutoregressiveField,
    FastSource,
    MoreSensors,
    MovingSource,
    NoisySources,
    SourceField,
    ThirdOrder,
    ThreeOnThree,
)
from arrivals.scenarios.simulations.speech import SpeechField, SpeechOfOrderTwo
from arrivals.trackers.run import Run

OURS, REPORT, LITERAL = "ours", "report's form", "word for word"
INNER = {OURS: "ours, inner pair", REPORT: "report's form, inner pair"}
SPEECH = {"regression__forgetting": 0.98, "regression__ar_forgetting": 0.99,
          "regression__ridge": 5.0, "gate": 0.3, "noise__adapt_process_noise": False}  # fmt: skip
STATIC, NOISY = {"regression__forgetting": 0.95}, {"regression__forgetting": 0.99}
FAST = {"regression__forgetting": 0.9, "interval": 3}
WIDE = (30.0, 60.0, 75.0)  # degrees, of a pair of sources on both sides
STILL, MOVING = 100 * 30, 40 * 30  # snapshots before the first one that is scored


class Experiment(NamedTuple):
    """One part of a figure or statement: scenario, the tracker's parameters, initial error.

    Parameters
    ----------
    figure : int
        Of the report; 0 for a statement without a figure.
    name : str
        Unique.
    scene : SourceField
    params : dict of str to object
        Parameters of the tracker, of all forms.
    offset_deg : float
        Error of the initial directions.
    first : int
        First snapshot that is scored.
    motion : AutoregressiveSources, optional
        Initial AR models; those of the scene if None.
    """

    figure: int
    name: str
    scene: SourceField
    params: dict[str, Any]
    offset_deg: float
    first: int = STILL
    motion: AutoregressiveSources | None = None

    @property
    def interval(self) -> int:
        """N, snapshots of an interval."""
        return int(self.params.get("interval", 30))

    def n_compared(self, n_runs: int) -> int:
        """Return the number of runs by subspace methods, which process single snapshots.

        Few where no claim depends on them; none with AR models that they do not use.
        """
        if "order 2" in self.name or not (self.figure or "apart" in self.name):
            return 0
        decisive = self.name in ("30 dB", "N = 3, d = .5, 1", "N = 30, d = .5, 1")
        many = decisive or "apart" in self.name or n_runs > 9
        return 4 if many and "speech" not in self.name else 1

    def forms(self) -> dict[str, dict[str, Any]]:
        """Return the parameters of the forms that know this array, by their names."""
        outer = max(self.scene.distances)
        plain: dict[str, Any] = {"regression__correction": False}
        mean = {"regression__pairs": "mean"} if outer <= 0.5 else {}
        forms = {OURS: {}, REPORT: plain | mean}
        if self.figure and outer <= 0.5:
            literal = {"regression__angles": "ratio", "regression__rows": "estimated"}
            forms[LITERAL] = forms[REPORT] | literal
        if self.name == "M = 2":
            inner = {"regression__pairs": "inner"}
            forms |= {INNER[OURS]: inner, INNER[REPORT]: plain | inner}
        return {form: self.params | params for form, params in forms.items()}


def cases() -> list[Experiment]:
    """Return the parts of the report's figures and statements."""
    doubled = (0.5, 0.5)
    fast, slow = FAST, STATIC
    parts = [
        Experiment(1, "30 dB", AutoregressiveField(), STATIC, 10),
        Experiment(3, "N = 3, d = .5, .5", FastSource(distances=doubled), fast, 5, 120),
        Experiment(3, "N = 3, d = .5, 1", FastSource(), fast, 5, 120),
        Experiment(4, "N = 30, d = .5, .5", MovingSource(distances=doubled), slow, 5, MOVING),
        Experiment(4, "N = 30, d = .5, 1", MovingSource(), slow, 5, MOVING),
    ]
    for snr_db in (10.0, 5.0, 1.0):
        parts.append(Experiment(5, f"{snr_db:g} dB", NoisySources(snr_db=snr_db), NOISY, 10))
    for m in (2, 3, 4):
        array = MoreSensors(distances=tuple(0.25 * n for n in range(1, m + 1)))
        parts.append(Experiment(6, f"M = {m}", array, {"regression__forgetting": 0.97}, 10))
    parts.append(Experiment(7, "order 3", ThirdOrder(), STATIC, 10))
    for snr_db in (30.0, 10.0, 5.0):
        speech = SpeechField(snr_db=snr_db)
        parts.append(Experiment(8, f"speech, {snr_db:g} dB", speech, SPEECH, 5))
    for snr_db in (30.0, 10.0):
        speech = SpeechOfOrderTwo(snr_db=snr_db)
        parts.append(Experiment(9, f"speech, order 2, {snr_db:g} dB", speech, SPEECH, 5))
    return [*parts, *_of_statements()]


def _of_statements() -> list[Experiment]:
    """Return the parts for statements without a figure."""
    noisy, three = NoisySources(), ThreeOnThree()
    apart = {d: noisy.replace(doa_deg=(10 - d / 2, 10 + d / 2)) for d in (10, 5)}
    low: list[tuple[float, ...]] = [
        (row[0] / (1 - row[1]),) for row in BROAD[:2]
    ]  # the best models of order 1
    high: list[tuple[float, ...]] = [(*row, 0.0) for row in BROAD[:2]]
    zero: list[tuple[float, ...]] = [(0.0, 0.0)] * 2
    models = {"order 1 for 2": low, "order 3 for 2": high, "a = 0 at the start": zero}
    return [
        Experiment(0, "2 sources, 2 sensors", noisy.replace(centre=False), NOISY, 10),
        Experiment(
            0, "3 sources, 2 sensors", three.replace(distances=(0.25,), centre=False), NOISY, 10
        ),
        Experiment(0, "3 sources, 3 sensors", three, NOISY, 3),
        *(Experiment(0, f"{d} degrees apart", apart[d], NOISY, d / 4) for d in apart),
        Experiment(
            0, "close, 30 dB", AutoregressiveField(doa_deg=apart[10].doa_deg), STATIC, 2.5
        ),
        *(
            Experiment(0, f"±{d:g}, {one.snr_db:g} dB", one.replace(doa_deg=(-d, d)), params, 10)
            for one, params in ((AutoregressiveField(), STATIC), (noisy, NOISY)) for d in WIDE
        ),
        Experiment(0, "still, N = 3", noisy, NOISY | {"interval": 3}, 10),
        Experiment(0, "fast, N = 30", FastSource(), FAST | {"interval": 30}, 5, 120),
        *(
            Experiment(
                0, name, noisy, NOISY, 10,
                motion=AutoregressiveSources(rows).scaled(1.0),
            )
            for name, rows in models.items()
        ),
    ]  # fmt: skip


def start_of(truth: Sequence[float], offset_deg: float) -> Any:
    """Return initial directions, rad, off by ± `offset_deg` in turn from the lowest one on.

    Examples
    --------
    >>> np.rad2deg(start_of(np.deg2rad([30.0, -20.0]), 10)).round(6)
    array([ 40., -30.])
    """
    order = np.argsort(np.argsort(truth))
    return np.asarray(truth) + np.deg2rad(offset_deg) * np.where(order % 2, 1, -1)


def run_tracker(trials: Sequence[Trial], case: Experiment, params: dict[str, Any]) -> list[Run]:
    """Run the tracker on trials of one scenario, from wrong initial directions."""
    start = start_of(trials[0].truth[0], case.offset_deg)
    tracker = trials[0].tracker("ar_kalman_qrd_rls", doa=start).set_params(**params)
    made = tracker.get_params(deep=False)
    if case.motion is not None:
        made["motion"] = case.motion
    return type(tracker)(**made).run_batch(np.array([trial.measurements for trial in trials]))
