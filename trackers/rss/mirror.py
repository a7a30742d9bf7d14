"""Sensors on a line: the mirror image of a position explains the readings as well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.typing import Float

MAX_RELATIVE_WIDTH = 1e-2  # of a line of sensors, of its length


@dataclass(frozen=True, eq=False)
class Line:
    """Line through sensors.

    Parameters
    ----------
    centre, normal : ndarray, shape (2,)
        A point, m, and the unit vector across.
    length : float
        Root mean square distance of the sensors from the centre, m.
    """

    centre: Float
    normal: Float
    length: float

    @classmethod
    def through(cls, sensors: Float) -> Line | None:
        """Return the line of all sensors (n_sensors, 2); None if they are not on one.

        Examples
        --------
        >>> Line.through(np.array([[0.0, 1.0], [5.0, 1.0], [9.0, 1.0]])).normal.round(6) + 0.0
        array([0., 1.])
        >>> Line.through(np.array([[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]])) is None
        True
        """
        if len(sensors) < 2:
            return None
        centre = sensors.mean(axis=0)
        along = np.linalg.svd(sensors - centre, full_matrices=False)[2][0]
        length = float(np.sqrt(np.square(sensors - centre).sum(axis=1).mean()))
        line = cls(centre, np.array([-along[1], along[0]]) * np.sign(along[0] or 1.0), length)
        return line if line.contains(sensors) else None

    def contains(self, sensors: Float) -> bool:
        """Return True if all sensors (n_sensors, 2) are on the line.

        Examples
        --------
        >>> Line(np.zeros(2), np.array([0.0, 1.0]), 10.0).contains(np.array([[90.0, 0.0]]))
        True
        """
        off = np.abs((sensors - self.centre) @ self.normal)
        return bool(off.max(initial=0.0) <= MAX_RELATIVE_WIDTH * self.length)

    def with_mirror(self, covariance: Float, position: Float) -> Float:
        """Return covariances about positions that contain the equally likely mirror images.

        Parameters
        ----------
        covariance, position : ndarray, shape (n_sources, 2, 2), (n_sources, 2)

        Examples
        --------
        >>> axis = Line(np.zeros(2), np.array([0.0, 1.0]), 10.0)
        >>> axis.with_mirror(np.zeros((1, 2, 2)), np.array([[7.0, 3.0]]))
        array([[[ 0.,  0.],
                [ 0., 18.]]])
        """
        # mirror image: Δ = -2 n n' (θ - p); covariance Σ + ½ ΔΔ'
        step = 2 * ((position - self.centre) @ self.normal)[:, None] * self.normal
        return covariance + 0.5 * step[:, :, None] * step[:, None, :]
