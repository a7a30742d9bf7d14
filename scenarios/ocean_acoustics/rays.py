"""Ray tracing in layered water: ranges and travel times between depths."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from arrivals.scenarios.ocean_acoustics.waveguide import Waveguide, nepers
from arrivals.typing import Bool, Complex, Float


@dataclass(frozen=True, eq=False)
class Fan:
    """Fan of rays from a source, with ranges and travel times between depths.

    The ray parameter a = cos θ/c is constant along a ray (Snell). A ray turns where c reaches
    1/a, and cycles between its upper and its lower end.

    Parameters
    ----------
    angle : ndarray, shape (n_rays,)
        Grazing angles at the source, rad, upward and downward alike.
    slowness : ndarray, shape (n_rays,)
        Ray parameters a, s/m.
    depth : ndarray, shape (n_nodes,)
        Depths of the profile, the source and the receivers, m.
    range, time : ndarray, shape (n_nodes, n_rays)
        Horizontal distance, m, and time, s, from the upper end to each depth; NaN at depths that
        the ray does not reach.
    whole_range, whole_time : ndarray, shape (n_rays,)
        Distance and time from the upper to the lower end.
    turns_above, turns_below : ndarray of bool, shape (n_rays,)
        Whether the upper end is a turning point, not the surface; the lower, not the floor.
    """

    angle: Float
    slowness: Float
    depth: Float
    range: Float
    time: Float
    whole_range: Float
    whole_time: Float
    turns_above: Bool
    turns_below: Bool

    def at(self, depth: ArrayLike) -> tuple[Float, Float]:
        """Return range and time from the upper end to depths (...) among the nodes."""
        node = np.searchsorted(self.depth, depth)
        return self.range[node], self.time[node]


def trace_rays(guide: Waveguide, angle: ArrayLike, source_depth: float, depths: ArrayLike) -> Fan:
    """Trace rays through water with a sound speed linear between the nodes.

    Parameters
    ----------
    guide : Waveguide
        Sound-speed profile.
    angle : array_like, shape (n_rays,)
        Grazing angles at the source, rad, in (0, π/2).
    source_depth : float
        Depth of the source, m.
    depths : array_like, shape (n_receivers,)
        Depths of the receivers, m.

    Returns
    -------
    Fan
        Ranges and times at all depths.

    Examples
    --------
    >>> guide = Waveguide([0.0, 100.0], [1500.0, 1500.0])
    >>> fan = trace_rays(guide, np.deg2rad([45.0]), 30.0, [60.0])
    >>> fan.depth, fan.range[:, 0].round(6)
    (array([  0.,  30.,  60., 100.]), array([  0.,  30.,  60., 100.]))
    """
    angle = np.asarray(angle, dtype=np.float64)
    depth = np.unique(np.concatenate([guide.depths, np.ravel(depths), [source_depth]]))
    c = np.interp(depth, guide.depths, guide.speeds)
    source = int(np.searchsorted(depth, source_depth))
    a = np.cos(angle) / c[source]
    reached = _reached(c[:, None] * a < 1, source)
    x, t = (_cumulative(part) for part in _cells(np.diff(depth), c, a, reached))
    unreached = np.where(reached, 0.0, np.nan)
    ends = ~reached[0], ~reached[-1]
    return Fan(angle, a, depth, x + unreached, t + unreached, x[-1], t[-1], *ends)


def _reached(slow: Bool, source: int) -> Bool:
    """Return True for the nodes (n_nodes, n_rays) connected to the source by slow ones."""
    up = np.logical_and.accumulate(slow[source::-1], axis=0)[::-1]
    down = np.logical_and.accumulate(slow[source:], axis=0)
    return np.asarray(np.concatenate([up, down[1:]]))


def _cells(h: Float, c: Float, a: Float, reached: Bool) -> tuple[Float, Float]:
    """Return range and time (n_nodes - 1, n_rays) in the cells, zero in cells that are not reached.

    With s = sin θ and a slope g of the speed, a ray advances by x = a h (c₀ + c₁)/(s₀ + s₁) in
    the time (artanh s₀ - artanh s₁)/g = artanh(a g x/(1 - s₀s₁))/g. In the cell of its turning
    point, c = 1/a, only the part of h up to there counts, and s = 0.
    """
    g = (np.diff(c) / h)[:, None]
    c0, c1 = np.minimum(c[:-1, None], 1 / a), np.minimum(c[1:, None], 1 / a)
    s0, s1 = np.sqrt(1 - (a * c0) ** 2), np.sqrt(1 - (a * c1) ** 2)
    turning = reached[:-1] != reached[1:]
    height = np.where(turning, (c1 - c0) / np.where(turning, g, 1.0), h[:, None])
    passed = reached[:-1] | reached[1:]
    x = np.where(passed, a * height * (c0 + c1) / np.where(passed, s0 + s1, 1.0), 0.0)
    u = a * x / (1 - s0 * s1)
    return x, u * _artanhc(g * u)


def _artanhc(u: Float) -> Float:
    """Return artanh(u)/u.

    Examples
    --------
    >>> _artanhc(np.array([0.0, 0.5])).round(4)
    array([1.    , 1.0986])
    """
    small = np.abs(u) < 1e-3
    v = np.where(small, 0.5, u)
    return np.where(small, 1 + u**2 / 3 + u**4 / 5, np.arctanh(v) / v)


def _cumulative(cells: Float) -> Float:
    """Return the sums of (n - 1, ...) cells from the top to (n, ...) nodes."""
    return np.concatenate([np.zeros((1, *cells.shape[1:])), np.cumsum(cells, axis=0)])


def floor_reflection(guide: Waveguide, frequency: float, slowness: ArrayLike) -> Complex:
    """Return the reflection coefficient of the sea floor for plane waves of ray parameters a.

    Fluid layers, each with its mean speed; the lowest is a half-space with the speed of its top.
    Time convention exp(+jωt).

    Parameters
    ----------
    guide : Waveguide
        Layers of the sea floor.
    frequency : float
        Frequency, Hz.
    slowness : array_like, shape (...)
        Ray parameters cos θ/c, s/m.

    Returns
    -------
    ndarray, shape (...)
        Complex coefficient; without layers -1, or 1 for a rigid floor.

    References
    ----------
    Jensen et al., *Computational Ocean Acoustics*, 2011, section 1.6.2, from the lowest layer up.

    Examples
    --------
    >>> abs(floor_reflection(Waveguide([0.0, 9.0], [1500.0, 1500.0]), 100.0, [6e-4]))
    array([1.])
    """
    omega, a = 2 * np.pi * frequency, np.asarray(slowness, dtype=np.float64)
    if not guide.layers:
        return np.full(a.shape, 1.0 if guide.rigid else -1.0, dtype=np.complex128)
    lowest = guide.layers[-1]
    speeds = [(b.speed_top + b.speed_bottom) / 2 for b in guide.layers[:-1]] + [lowest.speed_top]
    k = [omega / guide.speeds[-1]]
    k += [omega / c - 1j * nepers(b.attenuation, frequency)
          for c, b in zip(speeds, guide.layers, strict=True)]  # fmt: skip
    density = [1.0] + [b.density for b in guide.layers]
    height = [0.0] + [b.bottom - b.top for b in guide.layers]
    # vertical wavenumbers; the root that decays downwards
    q = [np.conj(np.sqrt(np.conj(kn**2 - (omega * a) ** 2 + 0j))) for kn in k]
    R = np.zeros(a.shape, dtype=np.complex128)
    for n in range(len(guide.layers), 0, -1):  # section 1.6.2, upwards
        r = (density[n] * q[n - 1] - density[n - 1] * q[n]) / (
            density[n] * q[n - 1] + density[n - 1] * q[n]
        )
        below = R * np.exp(-2j * q[n] * height[n]) if n < len(guide.layers) else R
        R = (r + below) / (1 + r * below)
    return R


def ray_line(
    guide: Waveguide, source_depth: float, depth: float, path: str, doa: float
) -> tuple[Float, Float]:
    """Return the polyline of a ray: distances from the source and depths, m, (n_points,).

    Parameters
    ----------
    guide : Waveguide
        Sound-speed profile.
    source_depth, depth : float
        Depths of the source and the sensor, m.
    path : str
        Bounces: B bottom, S surface, or turning points there; D for none.
    doa : float
        Elevation at the sensor, rad.

    Returns
    -------
    x, z : ndarray, shape (n_points,)
        Distances and depths, m.

    Examples
    --------
    >>> guide = Waveguide([0.0, 100.0], [1500.0, 1500.0])
    >>> x, z = ray_line(guide, 20.0, 60.0, "B", -np.pi / 4)
    >>> x.round(6), z
    (array([  0.,  40.,  80.,  80., 120.]), array([ 20.,  60., 100., 100.,  60.]))
    """
    c_source, c = np.interp([source_depth, depth], guide.depths, guide.speeds)
    angle = np.arccos(np.clip(c_source / c * np.cos(doa), -1, 1))
    fan = trace_rays(guide, [angle], source_depth, [depth])
    reached = ~np.isnan(fan.range[:, 0])
    z, y = fan.depth[reached], fan.range[reached, 0]
    if fan.turns_above[0]:  # between two nodes: drawn at the nearer one
        z, y = np.append(z[0], z), np.append(0.0, y)
    if fan.turns_below[0]:
        z, y = np.append(z, z[-1]), np.append(y, fan.whole_range[0])
    ends = {"S": z[0], "B": z[-1]}
    stops = [source_depth, *(ends[bounce] for bounce in path if bounce != "D"), depth]
    x, line = [np.zeros(1)], [np.array([source_depth])]
    for first, last in pairwise(stops):
        leg = np.flatnonzero((z >= min(first, last)) & (z <= max(first, last)))
        leg = leg if last > first else leg[::-1]
        x.append(x[-1][-1] + np.abs(y[leg] - y[leg[0]]))
        line.append(z[leg])
    return np.concatenate(x[1:]), np.concatenate(line[1:])
