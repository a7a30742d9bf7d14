"""Grids of scan directions, and the peaks of spectra there: a line, and the circle."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from arrivals.trackers.beamforming.spectrum import highest_first, parabolic_peak
from arrivals.typing import Float

TINY = np.finfo(np.float64).tiny

Level = Callable[[Float], Float]  # of powers, in which peaks are parabolas


def log_level(power: Float) -> Float:
    """Return the logarithm of powers, in which the peak of a beam is nearly a parabola.

    Examples
    --------
    >>> log_level(np.array([1.0, np.e]))
    array([0., 1.])
    """
    return np.asarray(np.log(np.maximum(power, TINY)))


def inverse_level(power: Float) -> Float:
    """Return -1 / power, in which the peak of a null spectrum is nearly a parabola.

    Examples
    --------
    >>> inverse_level(np.array([1.0, 2.0]))
    array([-1. , -0.5])
    """
    return -1 / power


class ScanGrid(ABC):
    """Directions of a scan, and the search for peaks of a spectrum there.

    Attributes
    ----------
    directions : ndarray, shape (n_unknowns, n_directions)
        Directions, or azimuths and elevations, rad: the arguments of `steering_vector`.
    """

    directions: Float

    @property
    def doa(self) -> Float:
        """Directions, of the sphere the azimuths, rad, (n_directions,)."""
        return np.asarray(self.directions[0])

    @abstractmethod
    def peaks(
        self,
        power: Float,
        level: Level,
        power_at: Callable[[Float], Float],
        n: int,
        joined: bool = False,
    ) -> tuple[Float, Float]:
        """Return the directions of the peaks of a spectrum between grid points, highest first.

        Parameters
        ----------
        power : ndarray, shape (n_directions,)
            Spectrum on the grid.
        level : function
            Level whose peaks are parabolas, of one angle.
        power_at : function
            Spectrum at directions (n_unknowns, n), rad; on the sphere.
        n : int
            Largest number of peaks.
        joined : bool
            True if the ends of a line are one direction.

        Returns
        -------
        directions : ndarray, shape (n_unknowns, n_peaks)
            Directions, rad.
        power : ndarray, shape (n_peaks,)
            Powers: at the nearest grid points, on the sphere at the directions.
        """


@dataclass(frozen=True, eq=False)
class AngleGrid(ScanGrid):
    """Equally spaced directions of a line, or on the circle.

    Parameters
    ----------
    directions : ndarray, shape (1, n_directions)
        Directions, rad.
    circular : bool
        True if the first direction follows the last.

    Examples
    --------
    >>> grid = AngleGrid(np.arange(4.0)[None], circular=False)
    >>> grid.peaks(np.exp([3.0, 4.0, 4.0, 3.0]), log_level, np.zeros_like, 1)[0]
    array([[1.5]])
    """

    directions: Float
    circular: bool

    def peaks(
        self,
        power: Float,
        level: Level,
        power_at: Callable[[Float], Float],
        n: int,
        joined: bool = False,
    ) -> tuple[Float, Float]:
        """Return the vertices of parabolas through the peaks and their neighbours."""
        index = highest_first(power, circular=self.circular, joined=joined)[:n]
        return parabolic_peak(self.directions[0], level(power), index)[None], power[index]
