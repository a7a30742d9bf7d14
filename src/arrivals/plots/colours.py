"""Colours of tracks and methods that colour-blind readers can separate."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

# The colours of Okabe and Ito without black and yellow, and four of Tol's schemes. CIELAB distance
# of any two at least 16, also as seen with deuteranopia, protanopia and tritanopia.
PALETTE = (
    "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7",
    "#56B4E9", "#882255", "#332288", "#DDCC77", "#661100",
)  # fmt: skip
NEUTRAL = "#202020"
METHOD_COLOURS = {
    "svalse": PALETTE[1], "valse": PALETTE[3], "ssbl": PALETTE[0], "sbl": PALETTE[5],
    "peaks_gnn": PALETTE[2], "cbf": PALETTE[9],
}  # fmt: skip


def label_colours(labels: Iterable[int]) -> dict[int, str]:
    """Return the colour of each label, the same in every plot of a run.

    A label takes the colour of its remainder by 10; or the next free one, if a smaller label has
    that colour and there are free ones left. Negative labels are dark.

    Parameters
    ----------
    labels : iterable of int
        Labels of a run, in any order.

    Returns
    -------
    dict of int to str
        Colours by label.

    Examples
    --------
    >>> colours = label_colours([0, 1, 11, -1])
    >>> colours[0] == PALETTE[0], colours[1] == PALETTE[1], colours[11] == PALETTE[2]
    (True, True, True)
    >>> colours[-1] == NEUTRAL
    True
    """
    colours: dict[int, str] = {}
    free = set(range(len(PALETTE)))
    for label in np.unique(np.fromiter(labels, dtype=np.int64)).tolist():
        place = label % len(PALETTE)
        if free and place not in free:
            place = min(free, key=lambda each, at=place: (each - at) % len(PALETTE))  # type: ignore[misc]
        if label >= 0:
            free.discard(place)
        colours[label] = PALETTE[place] if label >= 0 else NEUTRAL
    return colours
