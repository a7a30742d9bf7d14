"""Factor graph of SVALSE and its schedule of messages: Figs 1 to 3 of the paper.

The factors are those of the motion model and of the measurement, the operations the methods of the
tracker and of its solver, in the order in which they are called.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.reproduce.svalse.plots import panels
from arrivals.trackers.svalse.coordinate.multi_snapshot import MultiSnapshotAscent
from arrivals.trackers.svalse.svalse import SVALSE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Point = tuple[float, float]
BELIEF_PROPAGATION, MEAN_FIELD, PRIOR, LIKELIHOOD = "#1a8a3a", "#1f5fb4", "#cfe0f5", "#cdebd2"
WIDTH = 6.0  # of a time step
VARIABLES: dict[str, Point] = {"θ": (2.6, 3.3), "w": (2.6, 1.3), "s": (2.6, -1.0)}


class Factor(NamedTuple):
    """A factor of the joint density (15) in one time step.

    Parameters
    ----------
    label : str
        Density and its parameters.
    place : tuple of two float
        In the drawing of a time step.
    variables : tuple of str
        Variables of the same step.
    earlier : str
        Variable of the step before; empty for none.
    """

    label: str
    place: Point
    variables: tuple[str, ...]
    earlier: str = ""


class Operation(NamedTuple):
    """An operation of the schedule, and the messages that it passes.

    Parameters
    ----------
    method : callable
        Method that carries it out.
    text : str
        What it does, for the drawing.
    equations : str
    messages : tuple of tuple
        Ends of the arrows: variables, or places of factors.
    kind : str
        Colour: belief propagation or mean field.
    """

    method: Callable[..., Any]
    text: str
    equations: str
    messages: tuple[tuple[str, str], ...]
    kind: str


def factors(motion: BernoulliVonMises) -> dict[str, Factor]:
    r"""Return the factors of one component in one step, by name.

    Examples
    --------
    >>> factors(BernoulliVonMises())["walk"].label
    'walk (61)\nκ = 148'
    """
    walk = motion.walk
    step = f"κ = {walk.kappa:g}" if walk.kappa is not None else f"σ = {walk.sigma_doa:.3g} rad"
    chain = f"chain (11)\np_a = {motion.p_activate:g}\np_d = {motion.p_deactivate:g}"
    return {
        "walk": Factor(f"walk (61)\n{step}", (0.9, 3.3), ("θ",), "θ"),
        "chain": Factor(chain, (0.9, -1.0), ("s",), "s"),
        "amplitude": Factor("amplitude (6)\nCN(0, τ)", (2.6, 0.1), ("w", "s")),
        "likelihood": Factor("likelihood (13)\nν", (5.0, 2.3), ("θ", "w")),
    }


SCHEDULE = (
    Operation(SVALSE.predict_batch, "predict the angles and the probabilities of activity",
              "(62)-(65)", (("walk", "θ"), ("chain", "s")), BELIEF_PROPAGATION),
    Operation(MultiSnapshotAscent.initialize, "start the angles of new components by the residual",
              "(66)-(68)", (("likelihood", "θ"),), MEAN_FIELD),
    Operation(MultiSnapshotAscent.choose_support, "choose the active components; amplitudes follow",
              "(30), (31), (49)-(57)",
              (("likelihood", "w"), ("amplitude", "w"), ("amplitude", "s")), MEAN_FIELD),
    Operation(MultiSnapshotAscent.update_variances, "fit the variances of noise and amplitudes",
              "(58), (59)", (), MEAN_FIELD),
    Operation(MultiSnapshotAscent.update_angles, "update the angles of active components in turn",
              "(27), (28), (32)-(48)", (("likelihood", "θ"),), MEAN_FIELD),
    Operation(MultiSnapshotAscent.has_converged, "stop if the reconstruction no longer changes",
              "else repeat 3 to 6", (), MEAN_FIELD),
    Operation(SVALSE.store, "report the estimates; keep active and recent components",
              "q(θ), q(s) to the next step", (("θ", "next walk"), ("s", "next chain")),
              BELIEF_PROPAGATION),
)  # fmt: skip


def draw_factor_graph(motion: BernoulliVonMises | None = None) -> Figure:
    """Draw two time steps of the factor graph, and the schedule of messages of a step.

    Parameters
    ----------
    motion : BernoulliVonMises, optional
        The paper's if None.

    Examples
    --------
    >>> [ax.get_title() for ax in draw_factor_graph().axes]
    ['factor graph (16), two time steps', 'schedule of a time step: the numbers on the left']
    """
    figure, (graph, schedule) = panels(1, 2, (13.0, 5.4))
    _draw_steps(graph, factors(motion or BernoulliVonMises()))
    _draw_schedule(schedule, SCHEDULE)
    graph.set_title("factor graph (16), two time steps", fontsize=11)
    schedule.set_title("schedule of a time step: the numbers on the left", fontsize=11)
    return figure


def _draw_steps(ax: Axes, parts: dict[str, Factor]) -> None:
    from matplotlib.patches import FancyBboxPatch

    places = VARIABLES | {name: part.place for name, part in parts.items()}
    for step in (0, 1):
        for part in parts.values():
            ends = [_at(VARIABLES[name], step) for name in part.variables]
            if part.earlier and step:
                ends.append(_at(VARIABLES[part.earlier], step - 1))
            for x, y in ends:
                ax.plot([_at(part.place, step)[0], x], [part.place[1], y], color="0.6", zorder=1)
        for name, part in parts.items():
            colour = LIKELIHOOD if name == "likelihood" else PRIOR
            box = {"boxstyle": "round,pad=0.35", "facecolor": colour, "edgecolor": "0.3"}
            ax.text(*_at(part.place, step), part.label, bbox=box, ha="center", va="center",
                    fontsize=8, zorder=3)  # fmt: skip
        for name, place in VARIABLES.items():
            ax.plot(*_at(place, step), "o", markersize=25, color="white", markeredgecolor="0.2",
                    zorder=3)  # fmt: skip
            ax.text(*_at(place, step), f"${_latin(name)}_l$", ha="center", va="center", zorder=4)
        plate: dict[str, Any] = {"facecolor": "none", "edgecolor": "0.75", "linestyle": "--"}
        corner = _at((0.05, -2.0), step)
        ax.add_patch(FancyBboxPatch(corner, 3.35, 5.9, boxstyle="round,pad=0.1", **plate))
        ax.text(*_at((3.4, -2.0), step), "l = 1 ... L", ha="right", fontsize=8, color="0.4")
        ax.text(*_at((5.0, 1.45), step), f"step {('t', 't + 1')[step]}", ha="center", fontsize=9)
    places |= {f"next {name}": _at(parts[name].place, 1) for name in ("walk", "chain")}
    numbers: dict[tuple[str, str, str], list[str]] = {}
    for number, operation in enumerate(SCHEDULE, 1):
        for first, last in operation.messages:
            numbers.setdefault((first, last, operation.kind), []).append(f"{number}")
    for (first, last, colour), of_edge in numbers.items():
        _draw_message(ax, places[first], places[last], ", ".join(of_edge), colour)
    _name_boxes(ax)
    ax.set(xlim=(-0.4, 2 * WIDTH), ylim=(-3.4, 4.2))
    ax.set_axis_off()


def _name_boxes(ax: Axes) -> None:
    """Put the legend of boxes, circles and arrows below the graph."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    marks = [
        Patch(facecolor=PRIOR, edgecolor="0.3", label="prior densities, one a component"),
        Patch(facecolor=LIKELIHOOD, edgecolor="0.3", label="likelihood, one for all components"),
        Line2D([], [], marker="o", markersize=10, color="white", markeredgecolor="0.2",
               label="random variables"),
        Patch(facecolor="none", edgecolor="0.75", linestyle="--", label="for l = 1 ... L"),
        Line2D([], [], color=BELIEF_PROPAGATION, marker=">", label="belief propagation"),
        Line2D([], [], color=MEAN_FIELD, marker=">", label="mean field"),
    ]  # fmt: skip
    ax.legend(handles=marks, loc="lower center", ncols=3, fontsize=8, frameon=False)


def _draw_message(ax: Axes, start: Point, end: Point, number: str, colour: str) -> None:
    """Draw a message as an arrow beside its edge, upwards from it or left, and its number."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = (dx**2 + dy**2) ** 0.5
    side = 0.17 if dx > 0.0 or dy > 0.0 == dx else -0.17
    across = (-side * dy / length, side * dx / length)
    low, high = 0.45, 0.68
    tail, head = (
        (start[0] + part * dx + across[0], start[1] + part * dy + across[1]) for part in (low, high)
    )
    ax.annotate("", head, tail, zorder=5,
                arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.4})  # fmt: skip
    ax.text(tail[0] + 1.6 * across[0], tail[1] + 1.6 * across[1], number, color=colour,
            ha="center", va="center", fontsize=9, fontweight="bold", zorder=6)  # fmt: skip


def _draw_schedule(ax: Axes, schedule: Sequence[Operation]) -> None:
    """List the operations: number, what each does, and the name of the method and equations."""
    for number, operation in enumerate(schedule, 1):
        y = 1.04 - number / (len(schedule) + 0.8)
        ax.text(0.02, y, f"{number}  {operation.text}", fontsize=9.5, color=operation.kind)
        note = f"{operation.equations}   {operation.method.__qualname__}"
        ax.text(0.06, y - 0.045, note, fontsize=8.5, color="0.35")
    ax.set(xlim=(0, 1), ylim=(0, 1))
    ax.set_axis_off()


def _at(place: Point, step: int) -> Point:
    return place[0] + WIDTH * step, place[1]


def _latin(name: str) -> str:
    return r"\theta" if name == "θ" else name
