"""Rays in layered water: how far and how long they travel from depth to depth."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from arrivals.scenarios.ocean_acoustics.waveguide import Waveguide, nepers
from arrivals.typing import Bool, Complex, Float


@dataclass(frozen=True, eq=False)
class Fan:
    """Rays that leave a source, and how far they get from depth to depth.

    A ray keeps its ray parameter a = cos θ/c (Snell). Where c reaches 1/a it turns; between its
    upper and its lower end it goes down and up for ever.

    Parameters
    ----------
    angle : ndarray, shape (n_rays,)
        Grazing angles at the source, rad; up or down makes no difference here.
    slowness : ndarray, shape (n_rays,)
        Ray parameters a, s/m.
    depth : ndarray, shape (n_nodes,)
        Depths, m: those of the profile, of the source and of the receivers.
    range, time : ndarray, shape (n_nodes, n_rays)
        Horizontal distance, m, and time, s, from the upper end to each depth; NaN where the
        ray does not come.
    whole_range, whole_time : ndarray, shape (n_rays,)
        The same from the upper to the lower end.
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
    """Trace rays through water whose speed is linear between the nodes.

    Parameters
    ----------
    guide : Waveguide
    angle : array_like, shape (n_rays,)
        Grazing angles at the source, rad, in (0, π/2).
    source_depth : float
        m.
    depths : array_like, shape (n_receivers,)
        Of the receivers, m.

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
    x, t = (_from_the_top(part) for part in _cells(np.diff(depth), c, a, reached))
    nowhere = np.where(reached, 0.0, np.nan)
    ends = ~reached[0], ~reached[-1]
    return Fan(angle, a, depth, x + nowhere, t + nowhere, x[-1], t[-1], *ends)


def _reached(slow: Bool, source: int) -> Bool:
    """Tell which nodes (n_nodes, n_rays) a ray reaches from the source through slow ones."""
    up = np.logical_and.accumulate(slow[source::-1], axis=0)[::-1]
    down = np.logical_and.accumulate(slow[source:], axis=0)
    return np.asarray(np.concatenate([up, down[1:]]))


def _cells(h: Float, c: Float, a: Float, reached: Bool) -> tuple[Float, Float]:
    """Return range and time (n_nodes - 1, n_rays) in the cells, zero where a ray does not come.

    With s = sin θ and a slope g of the speed, a ray advances by x = a h (c₀ + c₁)/(s₀ + s₁) in
    the time (artanh s₀ - artanh s₁)/g = artanh(a g x/(1 - s₀s₁))/g. In the cell in which it
    turns, at c = 1/a, it has the part of h up to there, and s = 0.
    """
    g = (np.diff(c) / h)[:, None]
    c0, c1 = np.minimum(c[:-1, None], 1 / a), np.minimum(c[1:, None], 1 / a)
    s0, s1 = np.sqrt(1 - (a * c0) ** 2), np.sqrt(1 - (a * c1) ** 2)
    turning = reached[:-1] != reached[1:]
    height = np.where(turning, (c1 - c0) / np.where(turning, g, 1.0), h[:, None])
    there = reached[:-1] | reached[1:]
    x = np.where(there, a * height * (c0 + c1) / np.where(there, s0 + s1, 1.0), 0.0)
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


def _from_the_top(cells: Float) -> Float:
    """Add up (n - 1, ...) cells to (n, ...) nodes."""
    return np.concatenate([np.zeros((1, *cells.shape[1:])), np.cumsum(cells, axis=0)])


def floor_reflection(guide: Waveguide, frequency: float, slowness: ArrayLike) -> Complex:
    """Return the reflection coefficient of the sea floor for plane waves of ray parameters a.

    Fluid layers, each with its mean speed; the lowest one goes on for ever at the speed of its top.
    For sound that turns as exp(+jωt).

    Parameters
    ----------
    guide : Waveguide
    frequency : float
        Hz.
    slowness : array_like, shape (...)
        Ray parameters cos θ/c, s/m.

    Returns
    -------
    ndarray, shape (...)
        Without layers -1, or 1 if the floor is rigid.

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
    for n in range(len(guide.layers), 0, -1):
        r = (density[n] * q[n - 1] - density[n - 1] * q[n]) / (
            density[n] * q[n - 1] + density[n - 1] * q[n]
        )
        below = R * np.exp(-2j * q[n] * height[n]) if n < len(guide.layers) else R
        R = (r + below) / (1 + r * below)
    return R


def ray_line(
    guide: Waveguide, source_depth: float, depth: float, path: str, doa: float
) -> tuple[Float, Float]:
    """Return a ray as a line to be drawn: distances from the source and depths, m, (n_points,).

    Parameters
    ----------
    guide : Waveguide
    source_depth, depth : float
        Of the source and of the sensor, m.
    path : str
        Its bounces, B bottom, S surface, or turning points there; D for none.
    doa : float
        Its elevation at the sensor, rad.

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
    there = ~np.isnan(fan.range[:, 0])
    z, y = fan.depth[there], fan.range[there, 0]
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
