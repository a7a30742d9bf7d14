"""Talkers in reverberant rooms: the mixture over bins beside SVALSE and the beamformer."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.scenarios.base import Trial
from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.assignment import label_switches, matches
from arrivals.scenarios.metrics.gospa import mean_gospa
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decision, below
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.simulations.rooms import RoomRecording, TalkersInRoom
from arrivals.trackers import NewtonSolver
from arrivals.trackers.run import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CUT_OFF = 10.0  # degrees
BINS = 32  # of SVALSE
LINE = "line, two talkers, one moving, 0.5 s"
SCENES = {
    "circle, one talker, 0.25 s": TalkersInRoom(),
    "circle, two talkers, 0.25 s": TalkersInRoom(n_talkers=2),
    LINE: TalkersInRoom("line", 2, 1, rt60=0.5),
    "square, two talkers, 0.25 s, 10 dB": TalkersInRoom("square", 2, snr_db=10.0),
}
MIXTURE, DIFFUSE, WHITE, BEAMFORMER = METHODS = (
    "wideband_mixture", "svalse, diffuse noise", "svalse, white noise", "cbf"
)  # fmt: skip
COLUMNS = ("scene", "method", "GOSPA", "distance", "missed", "false", "std error", "label switches")


def rooms(runs: int, seed: int) -> Report:
    """Mean GOSPA of every scene and method, and one run on the line as a figure."""
    cases = [(name, seed + n) for name in SCENES for n in range(runs)]
    scores = np.array(parallel_map(_scores, cases)).reshape(len(SCENES), runs, len(METHODS), 5)
    rows = [
        (name, method, *of[:, m, :4].mean(axis=0).tolist(), float(standard_error(of[:, m, 0])),
         float(of[:, m, 4].mean()))
        for name, of in zip(SCENES, scores, strict=True) for m, method in enumerate(METHODS)
    ]  # fmt: skip
    results = {
        (name, method): of[:, m, 0]
        for name, of in zip(SCENES, scores, strict=True)
        for m, method in enumerate(METHODS)
    }
    remarks = (
        "GOSPA in degrees, with a cut-off of 10 degrees: the sum of distance, missed and false, "
        "its parts by errors of directions, missed talkers and false estimates. Std error: "
        "standard error of the mean of the runs. Talkers pause between utterances; the truth has "
        "none in the steps without speech. Trials of 8 s, reflections up to order 10, 20 dB "
        f"unless stated otherwise. SVALSE has {BINS} frequencies, 32 snapshots that count as one, "
        "and noise that is white over the microphones, or diffuse; the others have all "
        "frequencies of the band. `python benchmarks/rooms.py` has more exact rooms, and other "
        "packages.",
    )
    title = f"Talkers in rooms: GOSPA over {runs} runs"
    return Report(title, COLUMNS, rows, remarks, {"line": _draw(seed)}, results=results,
                  captions={"line": f"{LINE}: one trial"})  # fmt: skip


def _scores(scene: str, seed: int) -> list[tuple[float, ...]]:
    """Return GOSPA, its parts and the label switches, NaN without labels, of every method."""
    scores: list[tuple[float, ...]] = []
    recording = SCENES[scene].record(np.random.default_rng(seed))
    for method in METHODS:
        trial, run = _run(SCENES[scene], method, recording)
        truth, doa = np.rad2deg(trial.truth), np.rad2deg(run.doa)
        g = mean_gospa(truth, doa, c=CUT_OFF, period=360.0)
        switches = label_switches(matches(truth, doa, CUT_OFF, 360.0), run.label)
        labelled = np.nan if method == BEAMFORMER else float(switches)
        scores.append((g.total, g.distance, g.missed, g.false, labelled))
    return scores


def _run(scene: TalkersInRoom, method: str, recording: RoomRecording) -> tuple[Trial, Run]:
    params: dict[str, Any] = {}
    name, _, noise = method.partition(", ")
    if name == "svalse":
        scene = scene.replace(n_bins=BINS)
        model = scene.measurement.replace(noise_coherence=noise.removesuffix(" noise"))
        params = {"measurement": model, "solver": NewtonSolver(tempering=32.0, power_floor=1.0)}
    trial = scene.trial(recording)
    return trial, trial.tracker(name, **params).run(trial.measurements)


def _decided(low: str, high: str, results: Any) -> Decision:
    """Decide by the mean over the scenes of each run that one method's GOSPA is below another's."""
    means = [
        np.mean([results[scene, method] for scene in SCENES], axis=0) for method in (low, high)
    ]
    return below(means[0], means[1], "degrees", (low, high))


CLAIMS = tuple(
    Claim("rooms", "", text, by_ours=partial(_decided, low, high), source="ours")
    for low, high, text in (
        (DIFFUSE, WHITE, "SVALSE has a lower GOSPA with diffuse noise in its model than white"),
        (MIXTURE, DIFFUSE, "the mixture has a lower GOSPA than SVALSE with diffuse noise"),
        (MIXTURE, BEAMFORMER, "the mixture has a lower GOSPA than the beamformer"),
    )
)


def _draw(seed: int) -> Figure:
    """Draw one run of the mixture and of SVALSE on the line."""
    from matplotlib.figure import Figure

    from arrivals.plots.bearing_time import plot_bearing_time

    scene = SCENES[LINE]
    recording = scene.record(np.random.default_rng(seed))
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    for ax, method in zip(figure.subplots(2, sharex=True), (MIXTURE, DIFFUSE), strict=True):
        trial, run = _run(scene, method, recording)
        plot_bearing_time(run, ax=ax)
        ax.plot(np.rad2deg(trial.truth), linestyle="none", marker="+", markersize=4,
                color="black", zorder=5)  # fmt: skip
        ax.set_title(f"{method}; crosses: truth", fontsize=11)
        ax.label_outer()
    return figure
