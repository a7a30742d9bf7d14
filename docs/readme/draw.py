"""Draw the four pictures of the README: a room, a tow, the sky, a map; and those of the demos.

`python docs/readme/draw.py` writes room.png, tow.png, sky.png, map.png and the moving map.gif
beside this file, all of simulated data with the seeds given here; and demo.png and infrasound.png,
the first panels of `arrivals demo`, in the folder above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import KDTree

from arrivals.plots import plot_bearing_time, plot_map, plot_sky
from arrivals.plots.colours import NEUTRAL, PALETTE
from arrivals.scenarios import create
from arrivals.scenarios.demos.infrasound import brp2012
from arrivals.scenarios.demos.infrasound import tracker as infrasound_tracker
from arrivals.scenarios.demos.swellex96 import AXES, swellex96
from arrivals.scenarios.simulations.rooms import TalkersInRoom
from arrivals.trackers import create as create_tracker
from arrivals.trackers.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FOLDER = Path(__file__).parent
WIDE, WIDE_DPI = (9.0, 3.6), 130  # of the demos
SIZE, DPI = (4.0, 3.1), 200  # in, dots an inch: shown 400 pixels wide, at half the resolution
SHADES, GREYS = 12, 60  # of each colour down to white, and of grey, in the pictures' palette
FRAMES, FRAME_MS, LAST_MS, FRAME_DPI = 40, 120, 2500, 100
STYLE: dict[str, Any] = {
    "font.size": 8.0, "axes.labelsize": 8.0, "xtick.labelsize": 7.5, "ytick.labelsize": 7.5,
}  # fmt: skip
TRUTH: dict[str, Any] = {"color": NEUTRAL, "linewidth": 0.9, "linestyle": ":", "zorder": 5}


def new_axes(size: tuple[float, float] = SIZE) -> Axes:
    """Return the axes of a picture."""
    return Figure(figsize=size, layout="constrained").subplots()


def name(ax: Axes, title: str, settings: str) -> None:
    """Write the title, and below it what the data are."""
    ax.set_title("")
    ax.set_title(title, loc="left", fontsize=10, fontweight="bold", pad=16)
    ax.text(0.0, 1.02, settings, transform=ax.transAxes, fontsize=7.5, color="0.35")


def without_bars(ax: Axes) -> Axes:
    """Remove the colour bars, which have no room in a small picture."""
    for image in ax.collections:
        if image.colorbar is not None:
            image.colorbar.remove()
    return ax


def room() -> Axes:
    """Draw two talkers in a room, one of whom moves, by the beam power of each step."""
    trial = TalkersInRoom("circle", 2, 1, rt60=0.4, duration=12.0).sample(np.random.default_rng(0))
    run = trial.tracker("wideband_mixture").run(trial.measurements)
    time = 0.128 * (np.arange(len(run)) + 0.5)  # s, of steps of 128 ms
    ax = new_axes()
    plot_bearing_time(run, snapshots=trial.measurements, time=time, normalize="step",
                      dynamic_range_db=5.0, ax=ax)  # fmt: skip
    ax.plot(time, np.rad2deg(trial.truth), **TRUTH)
    name(
        without_bars(ax),
        "Talkers in a room",
        "6 microphones, 0.4 s reverberation, simulated; dotted: truth",
    )
    return ax


def tow() -> Axes:
    """Draw the paths from a towed source to a vertical line of hydrophones."""
    measurement, snapshots, time = swellex96()
    run = create_tracker("svalse", measurement=measurement).run(snapshots)
    ax = new_axes()
    plot_bearing_time(run, snapshots=snapshots, measurement=measurement, time=time / 60, ax=ax)
    ax.set(ylim=(-50, 50), yticks=np.arange(-45, 46, 15), xlabel="time, minutes")
    ax.set_ylabel("elevation, degrees")
    name(
        without_bars(ax),
        "A tow past hydrophones",
        "63 hydrophones, 198 Hz, simulated; every path a track",
    )
    return ax


def sky() -> Axes:
    """Draw azimuth and elevation of four sources."""
    trial = create("sphere").sample(np.random.default_rng(0))
    run = trial.tracker("svalse").run(trial.measurements)
    ax = plot_sky(run, ax=new_axes())
    ax.set(ylim=(-106, 106))
    name(ax, "Azimuth and elevation", "16 antennas in a plane, simulated; zenith in the middle")
    return ax


def demo() -> Axes:
    """Draw the tow as the demo does, with the settings as title."""
    measurement, snapshots, time = swellex96()
    run = create_tracker("svalse", measurement=measurement).run(snapshots).at(time)
    ax = plot_bearing_time(run, snapshots=snapshots, time=time, ax=new_axes(WIDE))
    ax.set(**AXES)
    return ax


def infrasound() -> Axes:
    """Draw recorded infrasound as the demo does, with the beam power of each step."""
    measurement, steps, time = brp2012()
    run = infrasound_tracker("svalse", measurement).run(steps).at(time)
    ax = plot_bearing_time(run, snapshots=steps, time=time, normalize="step",
                           dynamic_range_db=6.0, ax=new_axes(WIDE))  # fmt: skip
    ax.set_ylabel("azimuth from north, degrees")
    return ax


def placed() -> tuple[Any, Run]:
    """Return a trial with four stations and three transmitters, and the run of the fusion."""
    trial: Any = create("stations_radio", n_sources=3, snr_db=15.0).sample(np.random.default_rng(2))
    return trial, trial.tracker("fused").run(trial.measurements)


def first_steps(run: Run, n: int) -> Run:
    """Return the first steps of a run."""
    fields = {key: values[:n] for key, values in run.fields.items()}
    return replace(run, fields=fields, x=run.x[:n], n_found=run.n_found[:n], time=run.time[:n])


def on_map(trial: Any, run: Run) -> Axes:
    """Draw positions by four stations, with the true paths."""
    ax = plot_map(run, stations=trial.stations, truth=trial.truth, n_ellipses=4, ax=new_axes())
    legend = ax.get_legend()
    if legend is not None:
        legend.remove()
    places = np.array([station.position for station in trial.stations])
    points = np.concatenate([places, trial.truth[np.isfinite(trial.truth).all(axis=-1)]])
    middle, half = (
        (points.max(axis=0) + points.min(axis=0)) / 2,
        np.ptp(points, axis=0)[1] / 2 + 110,
    )
    ax.autoscale_view()
    ax.set_ylim(middle[1] - half, middle[1] + half, auto=True)
    ax.set_xlim(middle[0] - half, middle[0] + half, auto=True)  # widened to the equal scale
    name(
        ax, "Positions on a map", "4 stations (▲) of 8 antennas, 433 MHz, simulated; dotted: truth"
    )
    return ax


def palette() -> NDArray[np.uint8]:
    """Return the colours of labels, and greys, down to white: (n, 3), 0 to 255."""
    share = np.linspace(0, 1, SHADES + 1)[:-1, None]
    shades = [(1 - share) * np.array(to_rgb(colour)) + share for colour in PALETTE]
    dark, light = np.array(to_rgb(NEUTRAL)), np.ones(3)
    greys = dark + np.linspace(0, 1, GREYS)[:, None] * (light - dark)
    return np.rint(255 * np.concatenate([*shades, greys])).astype(np.uint8)


def image_of(ax: Axes, dpi: int) -> Image.Image:
    """Return the pixels of a picture, each in the nearest colour of the palette."""
    file, colours = BytesIO(), palette()
    ax.figure.savefig(file, format="png", dpi=dpi)  # type: ignore[union-attr]
    pixels = np.asarray(Image.open(file).convert("RGB"))
    different, where = np.unique(pixels.reshape(-1, 3), axis=0, return_inverse=True)
    nearest = KDTree(colours).query(different)[1].astype(np.uint8)
    image = Image.fromarray(nearest[where].reshape(pixels.shape[:2]), mode="P")
    image.putpalette(colours.ravel().tolist())
    return image


def save_moving(frames: Sequence[Image.Image], path: Path) -> None:
    """Write frames as a GIF that runs for ever, and rests at the last one."""
    times = [FRAME_MS] * (len(frames) - 1) + [LAST_MS]
    first, *others = frames
    first.save(path, save_all=True, append_images=others, duration=times, loop=0, optimize=True)


def main() -> None:
    """Draw all pictures."""
    with rc_context(STYLE):
        for draw in (room, tow, sky):
            image_of(draw(), DPI).save(FOLDER / f"{draw.__name__}.png", optimize=True)
        for draw in (demo, infrasound):
            path = FOLDER.parent / f"{draw.__name__}.png"
            image_of(draw(), WIDE_DPI).save(path, optimize=True)
        trial, run = placed()
        image_of(on_map(trial, run), DPI).save(FOLDER / "map.png", optimize=True)
        steps = np.unique(np.linspace(1, len(run), FRAMES).round().astype(int)).tolist()
        frames = [image_of(on_map(trial, first_steps(run, n)), FRAME_DPI) for n in steps]
        save_moving(frames, FOLDER / "map.gif")


if __name__ == "__main__":
    main()
