"""Spacing of the uniform grid that the sensors of a line lie on."""

import numpy as np
from numpy.typing import ArrayLike


def grid_spacing(coordinates: ArrayLike, tolerance: float = 1e-3) -> float | None:
    """Return the largest spacing of a uniform grid that holds all coordinates, or None.

    A coordinate may lie off the grid by `tolerance` of its spacing, or the nth part of that if
    the smallest gap has n spacings: a fine enough grid fits anything. Grids of more than 4096
    points are not searched.

    Examples
    --------
    >>> grid_spacing([0.0, 1.5, 3.5]), grid_spacing([0.0, 1.0, 2.7183]), grid_spacing([0.0])
    (0.5, None, None)
    """
    points = np.unique(np.asarray(coordinates, dtype=np.float64))
    points = points - points[0]
    gaps = sorted(np.diff(points).tolist())
    finest = int(4096 * gaps[0] / points[-1]) if gaps else 0
    for parts in range(1, finest + 1):
        spacing, span, n_points = gaps[0] / parts, 0.0, 0
        for gap in gaps:  # larger gaps count more points and make the spacing more exact
            n_points += round(gap / spacing)
            span += gap
            spacing = span / n_points
        off = np.abs(points - spacing * np.rint(points / spacing)).max()
        if off <= tolerance / parts * spacing:
            return float(spacing)
    return None
