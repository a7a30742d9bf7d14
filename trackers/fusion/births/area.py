"""Rectangle of the map in which sources are expected."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.typing import Bool, Float
from arrivals.validation import shaped


class Area(NamedTuple):
    """Rectangle x0 <= x <= x1, y0 <= y <= y1, m.

    Examples
    --------
    >>> area = Area.around([[0.0, 0.0], [100.0, 20.0]])
    >>> area, area.size
    (Area(x0=-50.0, y0=-50.0, x1=150.0, y1=70.0), 200.0)
    >>> area.contains(np.array([[155.0, 0.0], [170.0, 0.0]]), margin=0.05)
    array([ True, False])
    """

    x0: float
    y0: float
    x1: float
    y1: float

    @classmethod
    def checked(cls, area: ArrayLike) -> Area:
        """Return an area given as (x0, y0, x1, y1).

        Raises
        ------
        ValueError
            If it is empty.
        """
        x0, y0, x1, y1 = (float(each) for each in shaped("area", area, 4))
        if not (x0 < x1 < np.inf and y0 < y1 < np.inf and x0 > -np.inf and y0 > -np.inf):
            raise ValueError(
                f"area must be (x0, y0, x1, y1) with x0 < x1, y0 < y1; got {shown(area)}"
            )
        return cls(x0, y0, x1, y1)

    @classmethod
    def around(cls, places: Sequence[ArrayLike] | Float) -> Area:
        """Return the bounding box of places, wider by half of its longer side at each end.

        Raises
        ------
        ValueError
            If all are at one place.
        """
        points = np.array(places, dtype=np.float64)
        low, high = points.min(axis=0), points.max(axis=0)
        more = 0.5 * (high - low).max()
        if not more > 0:
            raise ValueError("area must be given where all stations and sensors are at one place")
        return cls.checked([*(low - more), *(high + more)])

    @property
    def size(self) -> float:
        """Longer side, m."""
        return max(self.x1 - self.x0, self.y1 - self.y0)

    @property
    def square(self) -> float:
        """Area, m²."""
        return (self.x1 - self.x0) * (self.y1 - self.y0)

    def contains(self, position: Float, margin: float) -> Bool:
        """Return True for positions (..., 2) inside, or outside by less than a share of `size`."""
        m, (x, y) = margin * self.size, np.moveaxis(position, -1, 0)
        inside = (x > self.x0 - m) & (x < self.x1 + m) & (y > self.y0 - m) & (y < self.y1 + m)
        return np.asarray(inside)
