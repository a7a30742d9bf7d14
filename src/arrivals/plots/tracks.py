"""Tracks over time: lines by label, thin lines over pauses, bands of one standard deviation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.plots.colours import label_colours
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Float, Int
from arrivals.validation import instance, shaped

if TYPE_CHECKING:
    from matplotlib.axes import Axes

N_STEPS = 6000  # maximum number of steps that are drawn
BAND_OPACITY = 0.25
PAUSE_WIDTH, TRACK_WIDTH, HALO_WIDTH = 0.7, 1.7, 3.4  # points


class TrackOrder(NamedTuple):
    """Estimates by label and step, (n,), and relations of neighbours, (n - 1,).

    Parameters
    ----------
    step, slot : ndarray of int
        Place of each estimate in the run.
    joined : ndarray of bool
        Neighbours of one label in successive steps.
    paused : ndarray of bool
        Neighbours of one label with steps between them.
    """

    step: Int
    slot: Int
    joined: Bool
    paused: Bool

    @property
    def alone(self) -> Bool:
        """Estimates that are joined with no neighbour."""
        alone = np.ones(len(self.step), dtype=np.bool_)
        alone[:-1][self.joined] = False
        alone[1:][self.joined] = False
        return alone

    def near(self, near: Bool) -> TrackOrder:
        """Return the same order, joined only between neighbours that are near, (n - 1,)."""
        return self._replace(joined=self.joined & near, paused=self.paused & near)

    def only(self, keep: Bool) -> TrackOrder:
        """Return the order of some estimates; those beside one that is left out are not joined."""
        at = np.flatnonzero(keep)
        step, slot = self.step[at], self.slot[at]
        if len(at) < 2:
            none = np.zeros(0, dtype=np.bool_)
            return TrackOrder(step, slot, none, none)
        label = np.cumsum(np.append(0, ~(self.joined | self.paused)))[at]  # number of the track
        joined = np.append(self.joined, False)[at[:-1]] & (np.diff(at) == 1)
        return TrackOrder(step, slot, joined, (np.diff(label) == 0) & ~joined)


def require_field(run: Run, name: str, words: str) -> None:
    """Raise a TypeError unless a run has a field of its sources."""
    if name not in instance("run", run, Run).fields:
        raise TypeError(f"run must contain {words}; got {run.kind.__name__}")


def step_times(run: Run, time: ArrayLike | None) -> Float:
    """Return the times of the steps, s, increasing; their numbers if None."""
    if time is None:
        return np.arange(len(run), dtype=np.float64)
    at = shaped("time", time, len(run))
    if not np.isfinite(at).all() or (np.diff(at) <= 0).any():
        raise ValueError(f"time must be finite and increasing; got {shown(at)}")
    return at


def time_limits(ax: Axes, at: Float) -> None:
    """Set the limits of the axis of time to half a step beyond the first and the last."""
    if len(at) > 0:
        half = (at[-1] - at[0]) / max(1, len(at) - 1) / 2 or 0.5
        ax.set_xlim(at[0] - half, at[-1] + half)


def track_order(run: Run, value: Float) -> TrackOrder:
    """Return the order of the estimates by label and step, of the slots whose value is not NaN.

    Of more than 6000 steps, every n-th is taken.

    Examples
    --------
    >>> from arrivals.trackers import CBF
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0)
    >>> run = CBF(model, max_sources=1).run([model.steering_vector(0.5), None])
    >>> track_order(run, run.doa).step
    array([0])
    """
    every = max(1, -(-len(run) // N_STEPS))
    step, slot = np.nonzero(~np.isnan(value[::every]))
    label = labels_of(run)[::every][step, slot]
    order = np.lexsort([step, label])
    step, slot, label = step[order], slot[order], label[order]
    same = (np.diff(label) == 0) & (label[1:] >= 0)
    apart = np.diff(step)
    return TrackOrder(step * every, slot, same & (apart == 1), same & (apart > 1))


def labels_of(run: Run) -> Int:
    """Return the labels of the slots, (n_steps, n_slots); their numbers if there are none."""
    if "label" in run.fields:
        return run.label
    n_slots = run.x.shape[1]
    return np.broadcast_to(np.arange(n_slots), (len(run), n_slots))


def track_colours(run: Run, order: TrackOrder, colour: str | None = None) -> Float:
    """Return RGBA rows: the colour from the label, the opacity from the existence.

    Parameters
    ----------
    run : Run
        Run of a tracker.
    order : TrackOrder
        Estimates.
    colour : str, optional
        One colour for all labels; directions without a label stay dark.

    Returns
    -------
    ndarray, shape (n, 4)
    """
    from matplotlib.colors import to_rgba_array

    labels = labels_of(run)
    of = label_colours(np.unique(labels).tolist())
    if colour is not None:
        of = {label: each if label < 0 else colour for label, each in of.items()}
    label = labels[order.step, order.slot]
    rgba = np.array([to_rgba_array(of[each])[0] for each in sorted(of)]).reshape(-1, 4)
    colours = rgba[np.searchsorted(sorted(of), label)] if len(label) else np.zeros((0, 4))
    if "existence" in run.fields:
        existence = run.existence[order.step, order.slot]
        colours[:, 3] = np.where(np.isnan(existence), 1.0, np.clip(existence, 0.0, 1.0))
    return np.asarray(colours)


def draw_tracks(ax: Axes, point: Float, colour: Float, order: TrackOrder) -> None:
    """Draw points (n, 2): lines between joined neighbours, thin over pauses, and isolated dots."""
    from matplotlib.collections import LineCollection

    def draw(name: str, pairs: Bool, paint: str | Float, width: float, zorder: int) -> None:
        lines = list(np.stack([point[:-1][pairs], point[1:][pairs]], axis=1))
        style: dict[str, Any] = {
            "colors": paint,
            "linewidths": width,
            "zorder": zorder,
            "label": name,
        }
        ax.add_collection(LineCollection(lines, **style))

    joined, paused, ends = order.joined, order.paused, colour[1:]
    draw("_pauses", paused, ends[paused], PAUSE_WIDTH, 2)
    draw("_halo", joined, "white", HALO_WIDTH, 3)
    draw("_tracks", joined, ends[joined], TRACK_WIDTH, 3)
    x, y = point[order.alone].T
    ax.scatter(x, y, s=9, c=colour[order.alone], edgecolors="white", linewidths=0.4, zorder=2,
               label="_dots")  # fmt: skip


def draw_bands(
    ax: Axes, x: Float, ends: tuple[Float, Float], colour: Float, order: TrackOrder
) -> None:
    """Draw areas between the low and high ends of joined neighbours, and bars of isolated ones.

    Estimates whose ends are NaN have none.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    low, high = ends
    pale = colour * [1, 1, 1, BAND_OPACITY]
    stated = np.isfinite(low) & np.isfinite(high)
    pairs, single = order.joined & stated[1:] & stated[:-1], order.alone & stated
    lower, upper = np.stack([x, low], 1), np.stack([x, high], 1)
    corners = [lower[:-1], lower[1:], upper[1:], upper[:-1]]
    areas = list(np.stack([each[pairs] for each in corners], axis=1))
    ax.add_collection(
        PolyCollection(areas, facecolors=pale[1:][pairs], edgecolors="none", label="_bands")
    )
    bars = list(np.stack([lower, upper], axis=1)[single])
    ax.add_collection(LineCollection(bars, colors=pale[single], linewidths=1.2, label="_bars"))
