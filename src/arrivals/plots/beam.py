"""Image of the beam power over time, computed column by column."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from arrivals.measurement_models import ArraySnapshot
from arrivals.plots.tracks import N_STEPS
from arrivals.trackers.beamforming.spectrum import bartlett_power, mean_beam_power, scan_directions
from arrivals.typing import Complex, Float, Int

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Normalize: TypeAlias = Literal["run", "step"]

NORMALIZE: tuple[Normalize, ...] = ("run", "step")
N_DIRECTIONS, N_COLUMNS = 361, 1500  # maximum size of the image
ELEVATION_STEP = 10.0  # degrees, of the power on the sphere


def draw_beam(
    ax: Axes,
    at: Float,
    snapshots: Any,
    measurement: ArraySnapshot,
    range_db: float,
    normalize: Normalize = "run",
) -> None:
    """Draw the beam power in grey, light enough for the tracks to stand out.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes of directions over time.
    at : ndarray, shape (n_steps,)
        Times.
    snapshots : array_like or iterable, shape (n_steps, *measurement.shape)
        Snapshots, iterated over once.
    measurement : ArraySnapshot
        Array and wavelengths.
    range_db : float
        Power shown, down from the highest, dB.
    normalize : {"run", "step"}
        Whether the highest is that of all steps, or of each step.

    Raises
    ------
    ValueError
        If the shape of the snapshots does not fit.
    """
    from matplotlib.colors import LinearSegmentedColormap

    doa = scan_directions(measurement.array, N_DIRECTIONS)
    starts = np.arange(0, len(at), max(1, -(-len(at) // N_COLUMNS)))
    every = max(1, -(-len(at) // N_STEPS))
    power_of, powers, has_power = _beam(measurement, doa), [], False
    for block in _blocks(snapshots, np.diff(np.append(starts, len(at))), measurement.shape):
        block = block[::every]
        has_power = has_power or bool((np.isfinite(block) & (block != 0)).any())
        powers.append(power_of(block))
    if not has_power:
        return
    level = relative_level(np.array(powers), normalize)
    light = LinearSegmentedColormap.from_list("light", ["#ffffff", "#c3c8cf", "#4d5560"])
    image = ax.pcolormesh(
        _edges(at[starts]), np.rad2deg(_edges(doa)), level.T,
        cmap=light, vmin=-range_db, vmax=0, rasterized=True,
    )  # fmt: skip
    bar = ax.figure.colorbar(image, ax=ax, pad=0.015, aspect=25, extend="min")
    bar.set_label("beam power, dB re maximum" + " of the step" * (normalize == "step"))
    bar.outline.set_visible(False)


def relative_level(power: Float, normalize: Normalize) -> Float:
    """Return powers (n_steps, n_directions) in dB re the highest of all steps, or of each.

    Steps without power have the level of the smallest number that is drawn, -300 dB.

    Examples
    --------
    >>> power = np.array([[1.0, 0.01], [1e-4, 1e-6], [0.0, 0.0]])
    >>> relative_level(power, "run")[:2]
    array([[  0., -20.],
           [-40., -60.]])
    >>> relative_level(power, "step")
    array([[   0.,  -20.],
           [   0.,  -20.],
           [-300., -300.]])
    """
    highest = power.max(axis=1, keepdims=True) if normalize == "step" else power.max()
    share = np.divide(power, highest, out=np.zeros_like(power), where=highest > 0)
    return np.asarray(10 * np.log10(np.maximum(share, 1e-30)))


def _blocks(snapshots: Any, sizes: Int, shape: tuple[int, ...]) -> Iterator[Complex]:
    """Yield so many snapshots of an array, or of another iterable, at a time."""
    if hasattr(snapshots, "__array__") or isinstance(snapshots, Sequence):
        snapshots = np.asarray(snapshots)
    steps = iter(snapshots)
    for size in sizes:
        block = np.array(list(islice(steps, size)))
        if block.shape != (size, *shape):
            break
        yield block
    else:
        if next(steps, None) is None:
            return
    got = getattr(snapshots, "shape", "another number or shape")
    raise ValueError(f"snapshots must have shape {(int(sizes.sum()), *shape)}; got {got}")


def _beam(measurement: ArraySnapshot, doa: Float) -> Callable[[Complex], Float]:
    """Return the highest power in each direction of the steps of a block, as a function.

    On the sphere it is the highest over elevations, too.
    """
    if measurement.unknowns == "sphere":
        lowest = 0.0 if measurement.half_space else -90.0
        elevation = np.deg2rad(np.arange(lowest, 90.0, ELEVATION_STEP))
        measurement = measurement.replace(unknowns="azimuth", elevation=elevation)
    isotropic = measurement.response is None
    if measurement.is_single and isotropic and measurement.coherence is None:
        single = measurement.steering_vector(doa)
        return lambda block: np.asarray(bartlett_power(single, block).max(axis=0))
    steering = measurement.waves.steering(doa)

    def power(block: Complex) -> Float:
        frames = block.reshape(len(block), measurement.n_bins, measurement.n_snapshots, -1)
        frames = np.swapaxes(frames, 2, 3)  # (n_steps, n_bins, n_sensors, n_snapshots)
        if measurement.coherence is None:
            return np.asarray(mean_beam_power(steering, frames).max(axis=0))
        pairs = (measurement.whitened(Y, steering) for Y in frames)
        return np.asarray(np.max([mean_beam_power(A, Y) for Y, A in pairs], axis=0))

    return power


def _edges(centres: Float) -> Float:
    """Return the edges of cells about their centres: one more than there are centres.

    Examples
    --------
    >>> _edges(np.array([0.0, 1.0, 3.0]))
    array([-0.5,  0.5,  2. ,  4. ])
    """
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = (centres[1:] + centres[:-1]) / 2
    first, last = 2 * centres[0] - middle[0], 2 * centres[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])
