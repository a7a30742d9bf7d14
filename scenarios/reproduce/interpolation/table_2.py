"""Table 2 of the paper on the interpolation-delay filter: execution times of the three methods."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.decisions import Decision, negative
from arrivals.scenarios.reproduce.interpolation.beamformers import Method
from arrivals.scenarios.reproduce.interpolation.decisions import Results
from arrivals.scenarios.reproduce.interpolation.plots import COLOURS, make_figure
from arrivals.scenarios.reproduce.interpolation.trials import (
    SOURCES,
    draws,
    filter_directions,
)
from arrivals.scenarios.reproduce.report import Report
from arrivals.trackers.beamforming.covariance import diagonal_loading
from arrivals.typing import Complex, Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RECORD, SNAPSHOT = "one spectrum a record", "one spectrum a snapshot"
# Filters, and what they update the delay by at once
UPDATES = {"frozen": "every sensor", "B": "every sensor", "C": "all sensors", "D": "every sensor",
           "E": "all sensors"}  # fmt: skip
READINGS = (RECORD, SNAPSHOT)
SCANS: tuple[Method, ...] = ("conventional", "mvdr")
PAPER_S = {"frozen": 0.156034, "conventional": 0.261068, "mvdr": 1.573982}  # 100 simulations
N_SIMULATIONS = 100
TRIGONOMETRIC = 20  # operations that a sine counts as
SYSTEMATIC = 0.1  # of a time: differences between machines and loads
GRID = np.deg2rad(np.arange(-90.0, 91.0))


def table2(runs: int, seed: int) -> Report:
    """CPU times of 100 simulations, by two readings of the scans, and numbers of operations."""
    scenario = SOURCES["tone"]
    samples = draws(scenario, N_SIMULATIONS, seed)
    timed: dict[tuple[str, str], Callable[[Float], Any]] = {
        **{(method, update): partial(_filter, method) for method, update in UPDATES.items()},
        **{(method, reading): partial(final_scans, method=method, reading=reading)
           for method in SCANS for reading in READINGS},
    }  # fmt: skip
    results: dict[tuple[Any, ...], Float] = {}
    for case, function in timed.items():
        results[(*case, "together")] = _seconds(function, samples, runs)
        results[(*case, "one by one")] = _seconds(function, samples[:2, None], runs)
    rows = [
        (*case, *(float(results[(*case, way)].mean()) for way in ("together", "one by one")),
         operations(*case), PAPER_S.get(case[0], np.nan))
        for case in timed
    ]  # fmt: skip
    remarks = (
        "CPU seconds for 100 simulations of 10 sensors and 100 snapshots, as one array program "
        f"or one by one (two of them): means of {runs} timings. These programs are interpreted: "
        "times of one by one are mostly those of calls. The scans search whole degrees, 181 "
        f"directions, without interpolation. Differences below {2 * SYSTEMATIC:.0%} of a time "
        "decide nothing: they depend on the machine.",
        "Operations a snapshot: real multiplications and additions, a trigonometric function as "
        f"{TRIGONOMETRIC}, for the paper's two taps and the scans. frozen is the paper's loop, "
        "whose coefficients are renewed once a snapshot; as printed (literal) it has as many.",
        "The paper omits how often the scans are evaluated. Its text gives 0.261 s to MVDR, its "
        "table to the conventional method; we follow the table.",
    )
    columns = ("method", "update", "s, together", "s, one by one", "operations", "paper, s")
    title = f"Table 2: execution times of 100 simulations, {runs} timings"
    return Report(
        title, columns, rows, remarks, {"times": _draw(results)}, results=results,
        captions={"times": f"means of {runs} timings, two standard errors"},
    )  # fmt: skip


def _filter(method: str, samples: Float) -> Float:
    return filter_directions(SOURCES["tone"], samples, method, 50.0)[..., -1]


def final_scans(samples: Float, *, method: Method, reading: str) -> Float:
    """Return the directions of maximum power after records (..., n_steps, n_sensors), degrees."""
    from scipy.signal import hilbert

    z = hilbert(samples, axis=-2)
    model = SOURCES["tone"].measurement
    wavelength = model.array.wavelength(model.correlation.highest * model.rate)
    A = model.array.steering_vector(GRID, wavelength)
    if reading == RECORD:
        R = np.swapaxes(z, -1, -2) @ z.conj() / z.shape[-2]
        return np.asarray(np.rad2deg(GRID[_power(R, A, method).argmax(axis=-1)]))
    R = np.zeros((*z.shape[:-2], z.shape[-1], z.shape[-1]), dtype=complex)
    power = np.zeros((*z.shape[:-2], len(GRID)))
    for k in range(z.shape[-2]):
        snapshot = z[..., k, :]
        if method == "conventional":  # power of the beams, without a covariance
            power = power + np.abs(snapshot @ A.conj().T) ** 2
        else:
            R = R + snapshot[..., :, None] * snapshot[..., None, :].conj()
            power = _power(R, A, method)
        best = power.argmax(axis=-1)
    return np.asarray(np.rad2deg(GRID[best]))


def _power(R: Complex, A: Complex, method: Method) -> Float:
    """Return the power of beams, (..., n_directions)."""
    if method == "conventional":
        return np.asarray(((A.conj() @ R) * A).sum(axis=-1).real)
    inverse = np.linalg.inv(diagonal_loading(R, 0.01))
    return np.asarray(1 / ((A.conj() @ inverse) * A).sum(axis=-1).real)


def operations(method: str, update: str) -> float:
    """Return the number of operations a snapshot, 10 sensors, 100 snapshots; NaN if not counted.

    Examples
    --------
    >>> operations("frozen", "every sensor") < operations("conventional", RECORD)
    True
    """
    n, steps, directions, product = 10, 100, len(GRID), 8  # a complex product and sum
    coefficients = 8 * TRIGONOMETRIC + 20  # a, b and their derivatives, (4)
    scalar = 20  # residual, slope, gain, mean and variance of one sensor, (20)-(23)
    if method == "frozen":
        return float(coefficients + (n - 1) * scalar)
    if method == "B":
        return float((n - 1) * (coefficients + scalar))
    if method not in SCANS:
        return float("nan")
    covariance, beams = product * n * n, product * directions * (n * n + n)
    inverse = product * n**3 if method == "mvdr" else 0
    if update == RECORD:
        return covariance + (inverse + beams) / steps
    if method == "conventional":
        return float(product * directions * n + 3 * directions)
    return float(covariance + inverse + beams)


def _seconds(function: Callable[[Float], Any], samples: Float, runs: int) -> Float:
    """Return CPU seconds for 100 simulations: of all at once, or of each of (n, 1, ...) alone."""
    alone = samples.ndim == 4
    groups = list(samples) if alone else [samples]
    function(groups[0])
    taken = []
    for _ in range(runs):
        started = time.process_time()
        for group in groups:
            function(group)
        taken.append(time.process_time() - started)
    return np.array(taken) * N_SIMULATIONS / len(samples)


def faster(
    method: str, results: Results, *, than: Method, reading: str, way: str = "together"
) -> Decision | None:
    """Decide that a filter takes less time than a scan."""
    first = results.get((method, UPDATES.get(method, ""), way))
    second = results.get((than, reading, way))
    if first is None or second is None:
        return None
    return _less(method, first, than, second)


def mvdr_slower(results: Results) -> Decision | None:
    """Decide that the conventional scan of every snapshot takes less time than that of MVDR."""
    first, second = (results.get((name, SNAPSHOT, "together")) for name in SCANS)
    if first is None or second is None:
        return None
    return _less("conventional", first, "mvdr", second)


def _less(name: str, first: Float, other: str, second: Float) -> Decision:
    means = float(first.mean()), float(second.mean())
    error = float(np.hypot(standard_error(first), standard_error(second)))
    error = float(np.hypot(error, SYSTEMATIC * min(means)))
    numbers = f"{name} {means[0]:.3g}, {other} {means[1]:.3g} s"
    return Decision(negative(means[0] - means[1], error), numbers)


def fewer_operations(_: Results, *, method: str, than: str, reading: str) -> Decision:
    """Decide that a filter takes fewer operations a snapshot than a scan."""
    first, second = operations(method, "every sensor"), operations(than, reading)
    return Decision(first < second, f"{method} {first:,.0f}, {than} {second:,.0f} a snapshot")


def real_time(method: str, results: Results) -> Decision | None:
    """Return the sampling rates that are possible; the paper names none to decide by."""
    alone = results.get((method, UPDATES.get(method, ""), "one by one"))
    if alone is None:
        return None
    steps = N_SIMULATIONS * SOURCES["tone"].n_steps
    together = results[method, UPDATES[method], "together"]
    rates = [steps / 1e3 / float(times.mean()) for times in (alone, together)]
    return Decision(
        None, f"{method} up to {rates[0]:.3g} kHz for one record, {rates[1]:.3g} kHz for 100"
    )  # fmt: skip


def _draw(results: dict[tuple[Any, ...], Float]) -> Figure:
    figure, (ax,) = make_figure(1, 1, (7.4, 4.2))
    cases = list(dict.fromkeys(key[:2] for key in results))
    for y, (method, update) in enumerate(cases):
        for way, marker in (("together", "o"), ("one by one", "s")):
            times = results[method, update, way]
            ax.errorbar(times.mean(), y, xerr=2 * standard_error(times), marker=marker,
                        color=COLOURS[method])  # fmt: skip
        if method in PAPER_S:
            ax.plot(PAPER_S[method], y, marker="|", markersize=14, color="black")
    for marker, label in (("o", "all trials together"), ("s", "one by one"), ("|", "the paper's")):
        ax.plot([], [], marker=marker, linestyle="", color="black", label=label)
    ax.set_yticks(range(len(cases)), [f"{method}, {update}" for method, update in cases])
    ax.invert_yaxis()
    ax.set(xscale="log", xlabel="CPU seconds for 100 simulations", title="Table 2")
    ax.grid(axis="x", which="both", linewidth=0.3)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
    return figure
