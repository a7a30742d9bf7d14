"""Directions of a line on a uniform grid from the angles found in each of several bins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.messages import shown
from arrivals.trackers.subspace.base import Subspaces
from arrivals.typing import Float, Int

MAX_SPECTRUM = 1e10  # without noise the spectrum is infinite at the sources
ENDFIRE_TOLERANCE = 0.1  # electrical angles up to this fraction beyond endfire count as endfire
RELATIVE_BANDWIDTH = 0.15  # of the density of directions, in units of λ / aperture
N_REFINEMENTS = 5


def uniform_line(model: ArraySnapshot) -> UniformLineManifold:
    """Return the array of a measurement model as a line on a uniform grid.

    Raises
    ------
    ValueError
        If it is not such a line, or its grid is wider than half the wavelength.
    """
    if model.slowness is not None:
        raise ValueError(
            f"slowness must be None for a method of a uniform grid; got {shown(model.slowness)}: "
            "music and mvdr scan it"
        )
    if model.coherence is not None:
        raise ValueError(
            "noise_coherence must be 'white' for a method of a uniform grid; got coherent noise: "
            "music and mvdr whiten it"
        )
    model.check_one_unknown("a method of a uniform grid")
    line, limit = model.manifold(), model.array.alias_limit
    if limit is not None and model.wavelengths[0] < limit * (1 - 1e-6):
        raise ValueError(
            f"wavelength must be at least {limit:.6g} m, two grid spacings, for unambiguous "
            f"directions; got {model.wavelengths[0]:.6g} m"
        )
    if not isinstance(line, UniformLineManifold):
        raise ValueError(
            "this method requires a line of sensors on a uniform grid (gaps are allowed); "
            f"got {model.array.n_sensors} sensors in {model.array.dim} dimension(s)"
        )
    return line


@dataclass(frozen=True, eq=False)
class LineOfBins:
    """A line on a uniform grid at several wavelengths.

    Parameters
    ----------
    grid_index : ndarray of int, shape (n_sensors,)
        Grid points of the sensors, in their order.
    steps : ndarray, shape (n_bins,)
        Largest electrical angle of a plane wave in each bin, 2π d/λ, rad; above π beyond the
        alias limit.

    Examples
    --------
    >>> line = LineOfBins(np.arange(5), np.array([1.5, 2.0]))
    >>> line.shortest.step
    2.0
    """

    grid_index: Int
    steps: Float

    @classmethod
    def of_model(cls, model: ArraySnapshot) -> LineOfBins:
        """Return the line of a measurement model with several bins.

        Raises
        ------
        ValueError
            If it is not such a line, or its grid is wider than half of every wavelength.
        """
        longest = max(model.wavelengths)
        line = uniform_line(model.replace(wavelength=longest))
        ratio = longest / np.asarray(model.wavelengths)
        return cls(line.grid_index, line.step * ratio)

    @property
    def shortest(self) -> UniformLineManifold:
        """The line at the shortest wavelength within the alias limit."""
        step = float(self.steps[self.steps <= np.pi * (1 + 1e-6)].max())
        return UniformLineManifold(self.grid_index, step, 0.0)

    def directions(self, phases: Float, shift: int, subspaces: Subspaces) -> Float:
        """Return directions at which the angles of the bins agree, rad.

        A direction is the mode of the density of sin β over the bins. The next one is found
        without the angle of each bin that is nearest to it, and so on. Angles are weighted by the
        MUSIC spectrum there, relative to its maximum in the bin, and by frequency squared, the
        information of a phase on sin β. Beyond the alias limit a phase has several directions, of
        which those of the sources are the ones that the bins have in common.

        Parameters
        ----------
        phases : ndarray, shape (n_bins, n_sources)
            Phase steps between sensors `shift` grid points apart, rad; NaN where there is none.
        shift : int
            Distance in grid points.
        subspaces : Subspaces
            Of each bin.

        Returns
        -------
        ndarray, shape (n,)
            At most n_sources directions.

        References
        ----------
        Pavlidi, Griffin, Puigt and Mouchtaris, "Real-time multiple sound source localization and
        counting using a circular microphone array", IEEE Trans. Audio Speech Lang. Process.
        21(10), 2013, sec. III: matching pursuit on the histogram of directions of the bins.
        """
        sine, weight = self._candidates(phases, shift, subspaces)
        frequency = float(np.sqrt((self.steps**2).mean()))
        aperture = frequency * (np.ptp(self.grid_index) + 1) / (2 * np.pi)  # wavelengths
        width = RELATIVE_BANDWIDTH / aperture
        found = []
        for _ in range(phases.shape[1]):
            if not weight.any():
                break
            found.append(_refined(_mode(sine, weight, width), sine, weight, width))
            distance = np.where(weight > 0, np.abs(sine - found[-1]), np.inf).min(axis=2)
            nearest = distance.argmin(axis=1)  # the source of each bin, with all its aliases
            weight[np.arange(len(nearest)), nearest] = 0.0
        return np.asarray(np.arcsin(np.array(found)), dtype=np.float64)

    def _candidates(self, phases: Float, shift: int, subspaces: Subspaces) -> tuple[Float, Float]:
        """Return sin β of all aliases of the phases and their weights, (n_bins, n_sources, n)."""
        steps = self.steps[:, None, None]
        limit = 1 + ENDFIRE_TOLERANCE
        n_turns = int((shift * self.steps.max() * limit + np.pi) / (2 * np.pi))
        turns = 2 * np.pi * np.arange(-n_turns, n_turns + 1)
        theta = (np.nan_to_num(phases)[..., None] + turns) / shift
        sine = theta / steps
        possible = ~np.isnan(phases)[..., None] & (np.abs(sine) <= limit)
        spectrum = self._spectrum(theta, subspaces)
        spectrum = np.where(possible, spectrum, 0.0)
        largest = np.maximum(spectrum.max(axis=(1, 2), keepdims=True), 1.0)
        return np.clip(sine, -1, 1), steps**2 * spectrum / largest

    def _spectrum(self, theta: Float, subspaces: Subspaces) -> Float:
        """Return MUSIC's spectrum of each bin at its own electrical angles."""
        flat = theta.reshape(len(theta), 1, -1)
        a = np.exp(1j * self.grid_index[:, None] * flat)  # (n_bins, n_sensors, n)
        inside = np.swapaxes(subspaces.noise.conj(), 1, 2) @ a
        null = (inside.real**2 + inside.imag**2).sum(axis=1) / len(self.grid_index)
        return np.asarray(1 / np.maximum(null, 1 / MAX_SPECTRUM)).reshape(theta.shape)


def _mode(sine: Float, weight: Float, width: float) -> float:
    """Return the mode of a weighted density with a Gaussian kernel, to a third of its width."""
    n = int(np.ceil(6 / width)) + 1
    cell = np.rint((sine + 1) * (n - 1) / 2).astype(np.int64).ravel()
    histogram = np.bincount(cell, weight.ravel(), minlength=n)
    offsets = np.arange(-9, 10)
    kernel = np.exp(-0.5 * (offsets / (width * (n - 1) / 2)) ** 2)
    density = np.convolve(histogram, kernel)[9:-9]
    return float(2 * np.argmax(density) / (n - 1) - 1)


def _refined(mode: float, sine: Float, weight: Float, width: float) -> float:
    """Return the mean of the angles about a mode, that of each bin nearest to it."""
    flat, weights = sine.reshape(len(sine), -1), weight.reshape(len(weight), -1)
    for _ in range(N_REFINEMENTS):
        apart = np.where(weights > 0, np.abs(flat - mode), np.inf)
        nearest = apart.argmin(axis=1)[:, None]
        u, w, d = (np.take_along_axis(x, nearest, axis=1) for x in (flat, weights, apart))
        w = w * np.exp(-0.5 * (np.minimum(d, 1e9) / (2 * width)) ** 2)
        mode = float((w * u).sum() / max(w.sum(), 1e-300))
    return mode
