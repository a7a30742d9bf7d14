"""Sound field of a tone in shallow water as a sum of normal modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.scenarios.ocean_acoustics.waveguide import Waveguide, nepers
from arrivals.typing import Complex, Float
from arrivals.validation import positive, real


@dataclass(frozen=True, eq=False)
class Modes:
    """Normal modes of a waveguide at one frequency.

    Parameters
    ----------
    wavenumber : ndarray, shape (n_modes,)
        Horizontal wavenumbers, 1/m, sorted by descending real part; a negative imaginary part is
        loss, for the time convention exp(+jωt).
    depth : ndarray, shape (n_depths,)
        Grid, m, from the surface to the lower end.
    shape : ndarray, shape (n_modes, n_depths)
        Mode functions ψ, normalised so that ∫ ψ²/ρ dz = 1.
    """

    wavenumber: Complex
    depth: Float
    shape: Float

    def at(self, depth: ArrayLike) -> Float:
        """Interpolate the mode functions at depths (n,), m: (n_modes, n)."""
        depth, end = np.atleast_1d(real("depth", depth)), self.depth[-1]
        if not ((depth >= 0) & (depth <= end)).all():
            raise ValueError(f"depth must lie in [0, {end:g}] m; got {depth.tolist()}")
        right = np.clip(np.searchsorted(self.depth, depth), 1, len(self.depth) - 1)
        weight = (depth - self.depth[right - 1]) / (self.depth[right] - self.depth[right - 1])
        return np.asarray((1 - weight) * self.shape[:, right - 1] + weight * self.shape[:, right])


def modes(
    guide: Waveguide, frequency: float, step: float = 0.125, steepest: float | None = None
) -> Modes:
    """Solve (ψ'/ρ)' + (ω²/c² - k²) ψ/ρ = 0 by finite differences.

    ψ is 0 at the surface, and ψ or its slope is 0 at the lower end. Each layer is divided into
    equal cells, so that interfaces are nodes and ψ'/ρ is continuous across them. Loss is a
    first-order perturbation: Im k = -∫ α ω/c ψ²/ρ dz / k.

    Parameters
    ----------
    guide : Waveguide
        Sound speeds and layers.
    frequency : float
        Frequency, Hz.
    step : float
        Largest cell, m; choose about a sixtieth of the wavelength.
    steepest : float, optional
        Largest phase speed of the modes, m/s; by default just below the highest speed at the top
        of a layer, which excludes modes that propagate in the last layer, or unlimited without
        layers.

    Returns
    -------
    Modes
        Wavenumbers and mode functions.

    Raises
    ------
    ValueError
        If no mode propagates.

    References
    ----------
    Jensen, Kuperman, Porter and Schmidt, *Computational Ocean Acoustics*, 2nd ed., 2011, sections
    5.3 (equations), 5.7.1 (finite differences) and 5.8 (loss).

    Examples
    --------
    The modes of ideal water have vertical wavenumbers (n - 1/2) π/depth over a rigid floor.

    >>> guide = Waveguide([0.0, 100.0], [1500.0, 1500.0], rigid=True)
    >>> k = modes(guide, frequency=30.0).wavenumber.real
    >>> vertical = np.sqrt((2 * np.pi * 30 / 1500) ** 2 - k**2)
    >>> (vertical * 100 / np.pi).round(3)
    array([0.5, 1.5, 2.5, 3.5])
    """
    from scipy.linalg import eigh_tridiagonal

    omega = 2 * np.pi * positive("frequency", frequency)
    depth, density, loss = _cells(guide, positive("step", step))
    h = np.diff(depth)
    k_medium = omega / guide.speed([depth[:-1] + h / 4, depth[1:] - h / 4])  # of half cells
    mass = _nodes(h / density / 2)
    spring = 1 / (density * h)
    diagonal = (_nodes(h / density / 2, k_medium**2) - _nodes(spring)) / mass
    off_diagonal = spring / np.sqrt(mass[:-1] * mass[1:])
    inner = slice(1, None if guide.rigid else -1)  # ψ = 0 at the other nodes
    fastest = _fastest(guide) if steepest is None else positive("steepest", steepest)
    k2, u = eigh_tridiagonal(
        diagonal[inner], off_diagonal[inner], select="v",
        select_range=((omega / fastest) ** 2, k_medium.max() ** 2),
    )  # fmt: skip
    if len(k2) == 0:
        raise ValueError(f"no mode propagates at {frequency} Hz below {fastest} m/s")
    k = np.sqrt(k2[::-1])
    shape = np.zeros((len(k), len(depth)))
    shape[:, inner] = u.T[::-1] / np.sqrt(mass[inner])
    alpha = _nodes(nepers(loss, frequency) * h / density / 2, k_medium)
    return Modes(k - 1j * (shape**2 @ alpha) / k, depth, shape)


def _fastest(guide: Waveguide) -> float:
    """Return a phase speed evanescent in the lowest layer; infinite without layers."""
    tops = [layer.speed_top for layer in guide.layers]
    return 0.9995 * max(tops) if tops else np.inf


def _cells(guide: Waveguide, step: float) -> tuple[Float, Float, Float]:
    """Return the nodes (n + 1,), m, and density and attenuation of the cells (n,)."""
    parts = [(0.0, guide.water_depth, 1.0, 0.0)]
    parts += [(b.top, b.bottom, b.density, b.attenuation) for b in guide.layers]
    counts = [int(np.ceil((bottom - top) / step - 1e-9)) for top, bottom, _, _ in parts]
    pieces = [
        np.linspace(top, bottom, n, endpoint=False)
        for (top, bottom, _, _), n in zip(parts, counts, strict=True)
    ]
    density, loss = np.repeat([part[2:] for part in parts], counts, axis=0).T
    return np.concatenate([*pieces, [guide.depth]]), density, loss


def _nodes(cell: Float, factor: Float | None = None) -> Float:
    """Sum the contributions of the half cells (n,) at the nodes: (n + 1,).

    `factor` (2, n) weights the upper and the lower half of each cell.
    """
    upper, lower = (cell, cell) if factor is None else cell * factor
    return np.asarray(np.append(upper, 0.0) + np.insert(lower, 0, 0.0))


def mode_field(modes: Modes, source_depth: float, depths: ArrayLike, ranges: ArrayLike) -> Complex:
    """Return the pressure of a tonal source at an array.

    p = e^{-jπ/4}/√(8π) Σ ψ(z_s) ψ(z) e^{-j k r}/√(k r), in a unit in which free space has 1/(4π)
    at 1 m. Valid some wavelengths away from the source.

    Parameters
    ----------
    modes : Modes
        Modes of the waveguide at the tone's frequency.
    source_depth : float
        Depth of the source, in the water, m.
    depths : array_like, shape (n_sensors,)
        Depths of the sensors, in the water, m.
    ranges : array_like, shape (n_steps,)
        Horizontal distances, m.

    Returns
    -------
    ndarray, shape (n_steps, n_sensors)
        Complex pressure.

    References
    ----------
    Jensen et al., *Computational Ocean Acoustics*, 2011, (5.14), conjugated.

    Examples
    --------
    >>> guide = Waveguide([0.0, 100.0], [1500.0, 1500.0], rigid=True)
    >>> mode_field(modes(guide, 30.0), 20.0, [40.0, 60.0], [1000.0]).shape
    (1, 2)
    """
    ranges = real("ranges", ranges)
    if not (np.isfinite(ranges) & (ranges > 0)).all():
        raise ValueError(f"ranges must be finite and positive, m; got {ranges.tolist()}")
    k = modes.wavenumber
    propagation = np.exp(-1j * ranges[:, None] * k) / np.sqrt(ranges[:, None] * k.real)
    p = (propagation * modes.at(source_depth)[:, 0]) @ modes.at(depths)
    return np.asarray(np.exp(-1j * np.pi / 4) / np.sqrt(8 * np.pi) * p)  # (5.14), conjugated
