"""Draw the decision figure of `choose.md`: `python docs/site_tools/decision.py`."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

QUESTION, ANSWER = "#e8eef7", "#d9f0dd"
# text, column, row, and the row of the box to the left that leads to it
QUESTIONS = [
    ("What do you\nmeasure?", 0, 4.5, None),
    ("samples or snapshots\nof one array", 1, 6.5, 4.5),
    ("snapshots or bearings\nof several arrays", 1, 2.0, 4.5),
    ("signal strength\nat many sensors", 1, 1.0, 4.5),
    ("anything with h and R", 1, 0.0, 4.5),
    ("talkers,\nwideband sound", 2, 9.0, 6.5),
    ("one frequency,\nor a few", 2, 6.5, 6.5),
    ("one source that\nfills a band", 2, 4.0, 6.5),
    ("signals to be\nseparated", 2, 3.0, 6.5),
    ("unknown number,\ntracks over time", 3, 8.0, 6.5),
    ("unknown number,\neach step by itself", 3, 7.0, 6.5),
    ("known number,\nhigh resolution", 3, 6.0, 6.5),
    ("a spectrum, quickly", 3, 5.0, 6.5),
]
TRACKERS = [
    ("wideband_mixture", 3, 9.0, 9.0),
    ("svalse", 4, 8.0, 8.0),
    ("valse", 4, 7.0, 7.0),
    ("music, root_music,\nesprit, past", 4, 6.0, 6.0),
    ("cbf, mvdr", 4, 5.0, 5.0),
    ("interpolation_ekf", 3, 4.0, 4.0),
    ("ar_kalman_qrd_rls", 3, 3.0, 3.0),
    ("fused", 2, 2.0, 2.0),
    ("rss_vb, rss_ml", 2, 1.0, 1.0),
    ("kalman, ekf, ukf,\nparticle, imm", 2, 0.0, 0.0),
]
WIDTH, HEIGHT, STEP = 1.9, 0.72, 2.5


def box(ax: Axes, text: str, x: float, y: float, colour: str) -> None:
    """Draw a box about a text, centred at x and y."""
    from matplotlib.patches import FancyBboxPatch

    corner = (x - WIDTH / 2, y - HEIGHT / 2)
    ax.add_patch(FancyBboxPatch(corner, WIDTH, HEIGHT, boxstyle="round,pad=0.02", fc=colour))
    family = "monospace" if colour == ANSWER else None
    ax.text(x, y, text, ha="center", va="center", fontsize=9, family=family)


def connect(ax: Axes, start: tuple[float, float], stop: tuple[float, float]) -> None:
    """Draw an elbow from the right of one box to the left of another."""
    (x0, y0), (x1, y1) = (start[0] + WIDTH / 2, start[1]), (stop[0] - WIDTH / 2, stop[1])
    middle = x1 - 0.3
    ax.plot([x0, middle, middle, x1], [y0, y0, y1, y1], color="#606060", linewidth=1, zorder=0)


def draw() -> Figure:
    """Return the figure."""
    figure = Figure(figsize=(11, 7), layout="constrained")
    ax = figure.add_subplot()
    for colour, boxes in ((QUESTION, QUESTIONS), (ANSWER, TRACKERS)):
        for text, column, row, parent in boxes:
            box(ax, text, STEP * column, row, colour)
            if parent is not None:
                connect(ax, (STEP * (column - 1), parent), (STEP * column, row))
    ax.set(xlim=(-WIDTH / 2 - 0.1, 4 * STEP + WIDTH / 2 + 0.1), ylim=(-0.5, 9.5))
    ax.set_axis_off()
    return figure


if __name__ == "__main__":
    draw().savefig(Path(__file__).parents[1] / "choose.png", dpi=110)
