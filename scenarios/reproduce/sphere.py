"""SVALSE in azimuth and elevation: GOSPA on six arrays beside the specification's figures.

No results are published: the figures beside ours are those of the prototype from which the method
was specified, means of 2 or 3 runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.scenarios.base import Trial
from arrivals.scenarios.bounds.two_unknowns import sphere_bound
from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.metrics.assignment import label_switches
from arrivals.scenarios.metrics.registry import CUT_OFF, gospa_of, pairs_of
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decision, below
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.simulations.sources_on_sphere import ArrayName, SourcesOnSphere
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = ("svalse", "valse")
SNR_DB = (0.0, 10.0, 20.0, 30.0)
N_STEPS = 50
# GOSPA of svalse and valse at each SNR, by array, bins and snapshots (specification, section 9)
PROTOTYPE: dict[tuple[str, int, int], tuple[tuple[float, float], ...]] = {
    ("ura4", 1, 1): ((24.5, 22.1), (13.7, 21.1), (8.4, 12.6), (4.3, 8.0)),
    ("ura8", 1, 1): ((10.3, 14.6), (5.1, 8.9), (2.6, 4.5), (1.4, 2.7)),
    ("uca8", 1, 1): ((30.3, 24.9), (18.7, 22.9), (11.4, 20.7), (9.8, 18.8)),
    ("uca6", 1, 1): ((23.5, 22.5), (18.3, 20.5), (11.9, 18.0), (5.7, 16.0)),
    ("tetra4", 1, 1): ((19.2, 15.7), (18.4, 15.5), (12.4, 14.2), (10.9, 13.7)),
    ("sph12", 1, 1): ((26.9, 20.6), (18.1, 23.1), (8.8, 16.3), (4.3, 10.0)),
    ("ura4", 1, 10): ((10.9, 20.1), (5.8, 11.4), (2.9, 5.7), (1.4, 3.9)),
    ("ura8", 1, 10): ((3.9, 7.2), (2.0, 4.4), (0.8, 3.0), (0.2, 2.1)),
    ("uca8", 1, 10): ((17.7, 22.9), (7.4, 13.1), (3.8, 5.8), (1.9, 2.7)),
    ("uca6", 1, 10): ((15.0, 20.8), (6.2, 12.7), (3.3, 5.0), (1.3, 3.9)),
    ("tetra4", 1, 10): ((15.5, 15.9), (6.7, 10.9), (2.8, 3.9), (1.1, 1.6)),
    ("sph12", 1, 10): ((15.3, 25.7), (8.6, 11.4), (2.8, 4.4), (0.9, 1.8)),
    ("ura4", 10, 1): ((13.7, 24.8), (7.0, 12.9), (3.4, 5.3), (1.5, 3.0)),
    ("ura8", 10, 1): ((5.3, 6.8), (2.5, 3.8), (1.1, 1.7), (0.3, 0.3)),
    ("uca8", 10, 1): ((20.7, 26.6), (10.6, 17.9), (5.6, 8.6), (3.1, 5.7)),
    ("uca6", 10, 1): ((19.3, 23.4), (9.7, 16.0), (4.8, 8.0), (2.2, 3.8)),
    ("tetra4", 10, 1): ((14.4, 17.1), (10.9, 14.8), (4.2, 8.9), (1.7, 6.5)),
    ("sph12", 10, 1): ((19.8, 28.5), (8.7, 15.6), (4.2, 5.2), (1.3, 2.2)),
}
ARRAYS = tuple(dict.fromkeys(array for array, _, _ in PROTOTYPE))
COLUMNS = (
    "scene", "method", "GOSPA", "distance", "missed", "false", "std error", "prototype",
    "median error", "median bound", "label changes",
)  # fmt: skip
TOTAL, ERROR, BOUND, CHANGES = 0, 4, 5, 6  # of the scores of a trial


def name_of(array: str, n_bins: int, n_snapshots: int, snr_db: float) -> str:
    """Return the name of a scene.

    Examples
    --------
    >>> name_of("ura4", 1, 10, 20.0)
    'ura4, 1 x 10, 20 dB'
    """
    return f"{array}, {n_bins} x {n_snapshots}, {snr_db:g} dB"


def sphere(runs: int, seed: int) -> Report:
    """Mean GOSPA of every scene and method, and one run as a figure."""
    scenes = {
        name_of(*key, snr_db): (SourcesOnSphere(key[0], snr_db, key[1], key[2], N_STEPS), figures)  # type: ignore[arg-type]  # names of arrays
        for key, of_all in PROTOTYPE.items()
        for snr_db, figures in zip(SNR_DB, of_all, strict=True)
    }
    cases = [(scene, seed + n) for scene, _ in scenes.values() for n in range(runs)]
    scores = np.array(parallel_map(score, cases)).reshape(len(scenes), runs, len(METHODS), -1)
    rows = [
        (name, method, *of[:, m, :ERROR].mean(axis=0).tolist(),
         float(standard_error(of[:, m, TOTAL])), figures[m],
         *of[:, m, ERROR:].mean(axis=0).tolist())
        for (name, (_, figures)), of in zip(scenes.items(), scores, strict=True)
        for m, method in enumerate(METHODS)
    ]  # fmt: skip
    results = {
        (name, method): of[:, m]
        for name, of in zip(scenes, scores, strict=True)
        for m, method in enumerate(METHODS)
    }
    remarks = (
        "Scenes are array, frequencies x snapshots of a step, and SNR: 4 x 4 and 8 x 8 sensors, "
        "circles of 8 and 6, a tetrahedron, 12 on a sphere. GOSPA in degrees along great circles, "
        "with a cut-off of 10 degrees: the sum of distance, missed and false, its parts by errors "
        "of directions, missed sources and false estimates. Std error: standard error of the mean "
        "of the runs. The prototype's figures are means of 2 or 3 runs. Median error: of the "
        "detected sources, degrees; median bound: of the Cramér-Rao bounds of all sources, from "
        "one step alone. Label changes: share of the detections, %, where a source has another "
        "label than before.",
    )
    title = f"Azimuth and elevation: GOSPA over {runs} runs"
    return Report(title, COLUMNS, rows, remarks, {"sky": _draw(seed)}, results=results,
                  captions={"sky": "SVALSE on 4 x 4 sensors and on 12 on a sphere"})  # fmt: skip


def score(scene: SourcesOnSphere, seed: int) -> list[tuple[float, ...]]:
    """Return GOSPA and its parts, median error and bound, degrees, and label changes, %."""
    trial = scene.sample(np.random.default_rng(seed))
    bound = np.rad2deg(np.nanmedian(_bounds(scene, trial, seed)))
    scores: list[tuple[float, ...]] = []
    for method in METHODS:
        run = trial.tracker(method).run(trial.measurements)
        g, pairs = gospa_of(trial, run), pairs_of(trial, run)
        error = np.rad2deg(np.linalg.norm(pairs.error, axis=-1))
        median = float(np.median(error)) if len(error) else CUT_OFF
        changes = np.nan
        if method == "svalse":
            changes = 100 * label_switches(pairs, run.label) / max(len(error), 1)
        scores.append((g.total, g.distance, g.missed, g.false, median, float(bound), changes))
    return scores


def _bounds(scene: SourcesOnSphere, trial: Trial, seed: int) -> Float:
    """Return standard deviations along great circles, rad, of the sources of all steps."""
    amplitude, std = scene.amplitudes(np.random.default_rng(seed)), []
    if trial.elevation is None:
        raise ValueError("trial must have elevations; got None")
    for doa, elevation, w in zip(trial.truth, trial.elevation, amplitude, strict=True):
        on = ~np.isnan(doa)
        C = sphere_bound(scene.measurement, doa[on], elevation[on], w[..., on], scene.noise)
        std.append(np.sqrt(np.trace(C, axis1=1, axis2=2)))
    return np.concatenate(std)


def _within(name: str, limit: float, results: Any) -> Decision:
    """Decide that SVALSE has a mean GOSPA of at most a limit."""
    mean = float(results[name, "svalse"][:, TOTAL].mean())
    return Decision(mean <= limit, f"{mean:.2f} degrees, {limit:g} allowed")


def _below_valse(n_bins: int, n_snapshots: int, results: Any) -> Decision:
    """Decide by the means over arrays of each run, at 20 dB."""
    names = [name_of(array, n_bins, n_snapshots, 20.0) for array in ARRAYS]
    means = [
        np.mean([results[name, method][:, TOTAL] for name in names], axis=0) for method in METHODS
    ]
    return below(means[0], means[1], "degrees", ("SVALSE", "VALSE"))


def _efficient(data: Sequence[tuple[int, int]], results: Any) -> Decision:
    names = [name_of(array, *each, 20.0) for array in ARRAYS for each in data]
    ratio = np.mean([
        np.mean(results[name, "svalse"][:, ERROR] / results[name, "svalse"][:, BOUND])
        for name in names
    ])  # fmt: skip
    return Decision(bool(ratio <= 1), f"{ratio:.2f} of it, mean over arrays, 1 allowed")


def _keeps_labels(name: str, limit: float, results: Any) -> Decision:
    changes = float(results[name, "svalse"][:, CHANGES].mean())
    return Decision(changes <= limit, f"{changes:.2f} %, {limit:g} % allowed")


LIMITS = (("ura4, 1 x 10, 20 dB", 3.6), ("sph12, 1 x 10, 20 dB", 3.4), ("ura8, 1 x 1, 20 dB", 3.2))
DATA = {(1, 1): "one snapshot", (1, 10): "ten snapshots", (10, 1): "ten frequencies"}
CLAIMS = (
    *(
        Claim("sphere", "", f"SVALSE has a lower GOSPA than VALSE with {text}",
              by_ours=partial(_below_valse, *key), source="ours")
        for key, text in DATA.items()
    ),
    *(
        Claim("sphere", "", f"the GOSPA of SVALSE is within the limit of {name}",
              by_ours=partial(_within, name, limit), source="check")
        for name, limit in LIMITS
    ),
    Claim("sphere", "", "labels stay with sources that cross in azimuth, 4 x 4 sensors",
          by_ours=partial(_keeps_labels, LIMITS[0][0], 3.0), source="check"),
    Claim("sphere", "", "with ten looks the median error is at most the median bound of one step",
          by_ours=partial(_efficient, [(1, 10), (10, 1)]), source="check"),
)  # fmt: skip


def _draw(seed: int) -> Figure:
    """Draw one run of SVALSE on a plane and on a sphere."""
    from matplotlib.figure import Figure

    from arrivals.plots.sky import plot_sky

    figure = Figure(figsize=(10.0, 5.2), layout="constrained")
    panels = figure.subplots(1, 2)
    arrays: tuple[ArrayName, ...] = ("ura4", "sph12")
    for ax, array in zip(panels, arrays, strict=True):
        trial = SourcesOnSphere(array).sample(np.random.default_rng(seed))
        run = trial.tracker("svalse").run(trial.measurements)
        plot_sky(run, ax=ax)
        if trial.elevation is not None:
            azimuth, radius = trial.truth[::5], 90 - np.rad2deg(trial.elevation[::5])
            x, y = radius * np.cos(azimuth), radius * np.sin(azimuth)
            ax.plot(x, y, linestyle="none", marker="+", markersize=4, color="black", zorder=5)
        ax.set_title(f"{array}, 10 snapshots, 20 dB; crosses: truth, circles: ends", fontsize=11)
    return figure
