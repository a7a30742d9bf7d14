"""Figures of the SWellEx-96 tow: environment, and directions over the steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_below
from arrivals.scenarios.ocean_acoustics.eigenrays import eigenrays
from arrivals.scenarios.ocean_acoustics.rays import ray_line
from arrivals.scenarios.reproduce.swellex96.field import beam
from arrivals.scenarios.simulations.swellex96 import TowPastLine, environment, line, track
from arrivals.typing import Complex, Float, Int

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from arrivals.trackers import Run

RANGE_DB = 20.0
SHOWN = {100: ("BSB", "BSBS"), 210: ("BS", "BSB"), 294: ("D", "B")}  # paths drawn, by step


def environment_figure() -> Figure:
    """Draw Fig. 11: paths, sound speed, range and track.

    Examples
    --------
    >>> [ax.get_xlabel() for ax in environment_figure().axes]
    ['range from the array, km', 'sound speed, m/s', 'step', 'east, km']
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 6.5), layout="constrained")
    grid = figure.add_gridspec(2, 3, width_ratios=(2.2, 1.2, 1.4))
    _draw_paths(figure.add_subplot(grid[:, 0]))
    _draw_speed(figure.add_subplot(grid[:, 1]))
    _draw_range(figure.add_subplot(grid[0, 2]))
    _draw_track(figure.add_subplot(grid[1, 2]))
    return figure


def _draw_paths(ax: Axes) -> None:
    """Draw selected paths from the source to the array's centre, the stronger ray of each pair."""
    guide, depths, ship = environment(), -line(missing=()).positions[:, 0], track()
    centre = float(depths.mean())
    for colour, (step, names) in zip(PALETTE, SHOWN.items(), strict=False):
        distance = float(ship["range_m"][step - 1])
        rays = eigenrays(guide, 198.0, 9.0, centre, [distance])
        for name, style in zip(names, ("-", "--"), strict=True):
            pair = np.flatnonzero(np.isin(rays.path, [name, f"S{name}".removesuffix("D")]))
            n = pair[np.argmax(np.abs(rays.pressure[pair]))]
            x, z = ray_line(guide, 9.0, centre, str(rays.path[n]), float(rays.doa[n]))
            label = f"step {step}, {name}: {np.rad2deg(rays.doa[n]):.1f}°"
            ax.plot((distance - x) / 1e3, z, style, color=colour, linewidth=1, label=label)
        ax.plot(distance / 1e3, 9.0, "o", color=colour)
    ax.plot(np.zeros(64), depths, ".", color="black", markersize=3)
    ax.axhline(guide.water_depth, color=PALETTE[9], linewidth=2)
    ax.set(xlabel="range from the array, km", ylabel="depth, m", ylim=(225, 0), title="(a) paths")
    legend_below(ax, 3)


def _draw_speed(ax: Axes) -> None:
    guide = environment()
    ax.plot(guide.speeds, guide.depths, color=PALETTE[0])
    ax.axhspan(94.125, 212.25, color="0.93", zorder=0)
    ax.annotate("array", (0.97, 0.3), xycoords="axes fraction", ha="right", fontsize=9)
    ax.set(xlabel="sound speed, m/s", ylabel="depth, m", ylim=(225, 0), title="(b) sound speed")


def _draw_range(ax: Axes) -> None:
    ship = track()
    ax.plot(ship["step"], ship["range_m"] / 1e3, color=PALETTE[0])
    ax.set(xlabel="step", ylabel="range, km", ylim=(0, None), title="(c) range")


def _draw_track(ax: Axes) -> None:
    """Draw the ship's track, with a mark every 50 steps."""
    ship = track()
    x, y = ship["east_m"] / 1e3, ship["north_m"] / 1e3
    ax.plot(x, y, color=PALETTE[0])
    marks = ship["step"] % 50 == 0
    ax.plot(x[marks], y[marks], "o", color=PALETTE[0], markersize=4)
    for step, point in zip(ship["step"][marks], np.stack([x, y], axis=1)[marks], strict=True):
        ax.annotate(f"{step:.0f}", point, (5, -3), textcoords="offset points", fontsize=7)
    ax.plot(0, 0, "^", color="black")
    ax.set(xlabel="east, km", ylabel="north, km", title="(c) track, the array at the origin")
    ax.set_aspect("equal", adjustable="datalim")


def field_figure(scenario: TowPastLine, valse: Run, svalse: Run, step: Int, seed: int) -> Figure:
    """Draw Fig. 12: beam power of three fields, and the estimates of VALSE and SVALSE.

    Examples
    --------
    >>> from arrivals.trackers import create
    >>> scenario = TowPastLine(ranges=(2000.0, 1990.0))
    >>> runs = [create(name, measurement=scenario.measurement).run(scenario.field())
    ...         for name in ("valse", "svalse")]
    >>> len(field_figure(scenario, *runs, np.array([1, 2]), 0).axes)
    7
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 8.2), layout="constrained")
    n_elements = len(scenario.measurement.array.positions)
    which = "all 64 elements" if n_elements == 64 else f"{n_elements} elements, as in the paper"
    figure.suptitle(f"Fig. 12, simulated: {which}", fontsize=12)
    axes = figure.subplots(3, 2, sharex=True, sharey=True).ravel()
    noisy = scenario.sample(np.random.default_rng([seed, 0])).measurements
    beams = (
        (0, f"(a) CBF, modes and noise, {scenario.snr_db:g} dB", noisy),
        (1, "(b) CBF, modes", scenario.field()),
        (3, "(d) CBF, rays", scenario.replace(model="rays").field()),
    )
    for n, title, snapshots in beams:
        image = _draw_beam(axes[n], scenario, np.asarray(snapshots, np.complex128), step)
        axes[n].set_title(title, fontsize=10)
    figure.colorbar(image, ax=list(axes), shrink=0.5, label="dB re the step's maximum", aspect=30)
    for n, title, run in ((2, "(c) VALSE", valse), (4, "(e) SVALSE", svalse)):
        _draw_levels(axes[n], step, run.doa, 20 * np.log10(np.abs(run.amplitude)))
        axes[n].set_title(title, fontsize=10)
    _names, doa, level_db = scenario.paths()
    _draw_levels(axes[5], step, doa, level_db)
    axes[5].set_title("paths of the ray model (not in the paper)", fontsize=10)
    for ax in axes:
        ax.set(ylim=(-60, 60), yticks=np.arange(-60, 61, 20))
    for ax in axes[::2]:
        ax.set_ylabel("elevation, degrees")
    for ax in axes[4:]:
        ax.set_xlabel("step")
    return figure


def _draw_beam(ax: Axes, scenario: TowPastLine, snapshots: Complex, step: Int) -> Any:
    """Draw the beam power in dB re the maximum of each step; return the image."""
    grid, power = beam(scenario, snapshots)
    level = 10 * np.log10(power / power.max(axis=1, keepdims=True))
    return ax.pcolormesh(step, np.rad2deg(grid), level.T, vmin=-RANGE_DB, vmax=0, cmap="viridis",
                         shading="nearest", rasterized=True)  # fmt: skip


def _draw_levels(ax: Axes, step: Int, doa: Float, level_db: Float) -> None:
    """Draw directions (n_steps, n) as dots, coloured by level, down to `RANGE_DB`."""
    level = level_db - np.nanmax(level_db, axis=1, keepdims=True)
    shown = level > -RANGE_DB
    x = np.broadcast_to(step[:, None], doa.shape)[shown]
    ax.scatter(x, np.rad2deg(doa[shown]), c=level[shown], s=6, cmap="viridis", vmin=-RANGE_DB,
               vmax=0, linewidths=0)  # fmt: skip
    ax.set_facecolor("#f4f4f4")
