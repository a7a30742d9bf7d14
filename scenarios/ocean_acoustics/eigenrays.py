"""Eigenrays between a source and the sensors of an array."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.scenarios.ocean_acoustics.rays import Fan, floor_reflection, trace_rays
from arrivals.scenarios.ocean_acoustics.waveguide import Waveguide
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import count, number, positive, real


@dataclass(frozen=True, eq=False)
class Eigenrays:
    """Rays from a source to sensors, one array element a ray.

    Parameters
    ----------
    path : ndarray of str, shape (n_rays,)
        Bounces in order of travel: B bottom, S surface, or turning points there; D for none.
    step, sensor : ndarray of int, shape (n_rays,)
        Index of the range and of the depth.
    doa : ndarray, shape (n_rays,)
        Elevation at the sensor, rad, positive from above.
    time : ndarray, shape (n_rays,)
        Travel time, s.
    pressure : ndarray, shape (n_rays,)
        Complex pressure, in the unit of `normal_modes.mode_field`.
    """

    path: NDArray[np.str_]
    step: Int
    sensor: Int
    doa: Float
    time: Float
    pressure: Complex

    def field(self, n_steps: int, n_sensors: int) -> Complex:
        """Return the sum of all rays, (n_steps, n_sensors)."""
        index = self.step * n_sensors + self.sensor
        re, im = (
            np.bincount(index, part, n_steps * n_sensors)
            for part in (self.pressure.real, self.pressure.imag)
        )
        return np.asarray((re + 1j * im).reshape(n_steps, n_sensors))


def path_names(n_bottom: int) -> list[str]:
    """Return the names of the paths with at most `n_bottom` bottom bounces.

    Examples
    --------
    >>> path_names(1)
    ['D', 'S', 'B', 'BS', 'SB', 'SBS']
    """
    names = ["D", "S"]
    for n in range(1, n_bottom + 1):
        middle = "S".join("B" * n)
        names += [middle, middle + "S", "S" + middle, "S" + middle + "S"]
    return names


def eigenrays(
    guide: Waveguide,
    frequency: float,
    source_depth: float,
    depths: ArrayLike,
    ranges: ArrayLike,
    *,
    n_bottom: int = 6,
    n_rays: int = 4000,
    steepest: float = np.deg2rad(60.0),
) -> Eigenrays:
    """Compute the rays from a source to each depth and range, by a fan and interpolation.

    Parameters
    ----------
    guide : Waveguide
        Sound-speed profile and layers.
    frequency : float
        Frequency, Hz.
    source_depth : float
        Depth of the source, in the water, m.
    depths : array_like, shape (n_sensors,)
        Depths of the sensors, in the water, m.
    ranges : array_like, shape (n_steps,)
        Horizontal distances, m.
    n_bottom : int
        Maximum number of bottom bounces.
    n_rays : int
        Number of rays in the fan.
    steepest : float
        Largest grazing angle of the fan at the source, rad, below π/2.

    Returns
    -------
    Eigenrays
        Paths, angles, times and pressures.

    Raises
    ------
    ValueError
        If a depth is not in the water, or a range is not positive.

    Notes
    -----
    The fan excludes the horizontal: a direct ray along it is not computed. Ray theory
    overestimates the level near a caustic.

    References
    ----------
    Jensen, Kuperman, Porter and Schmidt, *Computational Ocean Acoustics*, 2nd ed., 2011, sections
    3.3 and 3.5.2 (levels).

    Examples
    --------
    At constant sound speed, rays are straight lines from the images of the source.

    >>> guide = Waveguide([0.0, 100.0], [1500.0, 1500.0])
    >>> rays = eigenrays(guide, 100.0, 20.0, [60.0], [300.0], n_bottom=1)
    >>> for path, doa, time in zip(rays.path, np.rad2deg(rays.doa), rays.time):
    ...     print(f"{path:3} {doa:6.2f} {time:.4f}", round(1500 * time * np.cos(np.deg2rad(doa))))
    D     7.59 0.2018 300
    S    14.93 0.2070 300
    B   -21.80 0.2154 300
    BS   38.66 0.2561 300
    SB  -28.07 0.2267 300
    SBS  43.03 0.2736 300
    """
    positive("frequency", frequency)
    source = float(guide.in_water("source_depth", number("source_depth", source_depth)))
    depths = np.atleast_1d(guide.in_water("depths", depths))
    ranges = np.atleast_1d(real("ranges", ranges))
    if not (np.isfinite(ranges) & (ranges > 0)).all():
        raise ValueError(f"ranges must be finite and positive, m; got {ranges.tolist()}")
    if not 0 < number("steepest", steepest) < np.pi / 2:
        raise ValueError(f"steepest must lie in (0, π/2) rad; got {steepest}")
    angle = steepest * (np.arange(count("n_rays", n_rays, minimum=2)) + 1) / n_rays
    fan = trace_rays(guide, angle, source, depths)
    floor = floor_reflection(guide, frequency, fan.slowness)
    parts = [
        _path(name, fan, guide, floor, source, depths, ranges)
        for name in path_names(count("n_bottom", n_bottom, minimum=0))
    ]
    path, step, sensor, doa, time, amplitude = (np.concatenate(p) for p in zip(*parts, strict=True))
    pressure = amplitude * np.exp(-2j * np.pi * frequency * time)
    return Eigenrays(path, step, sensor, doa, time, pressure)


def _path(
    name: str,
    fan: Fan,
    guide: Waveguide,
    floor: Complex,
    source_depth: float,
    depths: Float,
    ranges: Float,
) -> tuple[NDArray[Any], ...]:
    """Return path, step, sensor, doa, time and amplitude of the rays of one path."""
    (x_source, t_source), (x_sensor, t_sensor) = fan.at(source_depth), fan.at(depths)
    x = _path_sum(name, x_source, x_sensor, fan.whole_range)
    t = _path_sum(name, t_source, t_sensor, fan.whole_time)
    sensor, ray, step = _crossings(x, ranges)
    before, after = x[sensor, ray], x[sensor, ray + 1]
    r, weight = ranges[step], (ranges[step] - before) / (after - before)

    def between(low: NDArray[Any], high: NDArray[Any]) -> NDArray[Any]:
        return np.asarray((1 - weight) * low + weight * high)

    angle = between(fan.angle[ray], fan.angle[ray + 1])
    time = between(t[sensor, ray], t[sensor, ray + 1])
    reflected = between(floor[ray], floor[ray + 1])
    slope = (after - before) / (fan.angle[ray + 1] - fan.angle[ray])
    c_source, c = (np.interp(z, guide.depths, guide.speeds) for z in (source_depth, depths[sensor]))
    sine = np.sqrt(np.maximum(1 - (np.cos(angle) * c / c_source) ** 2, 1e-9))  # Snell
    down = depths[sensor] > source_depth if name == "D" else name.endswith("S")
    doa = np.where(down, 1, -1) * np.arcsin(sine)
    # conservation of power in a ray tube
    spread = c / c_source * np.cos(angle) / (r * np.maximum(np.abs(slope), 1e-3) * sine)
    reflection = _reflection(name, fan.turns_above[ray], fan.turns_below[ray], reflected, slope)
    amplitude = np.sqrt(spread) / (4 * np.pi) * reflection
    return np.full(len(step), name), step, sensor, doa, time, amplitude


def _path_sum(name: str, source: Float, sensor: Float, whole: Float) -> Float:
    """Sum range or time over the legs of a path, (n_sensors, n_rays).

    `source` and `sensor` are the values from the upper end of the rays to these depths, `whole`
    those between the ends. Legs: to the first bounce, between bounces, from the last bounce.
    """
    if name == "D":
        return np.abs(sensor - source)
    first = source if name[0] == "S" else whole - source
    last = sensor if name[-1] == "S" else whole - sensor
    return first + (len(name) - 1) * whole + last


def _reflection(name: str, above: Bool, below: Bool, floor: Complex, slope: Float) -> Complex:
    """Return the factor of bounces and of a caustic on the pressure of rays (n_rays,).

    The surface reverses the sign. A turning point, `above` or `below`, has no loss. Range
    decreases with the angle, or increases after an odd number of turning points, up to a
    caustic, after which the phase leads by π/2 in the convention exp(+jωt).
    """
    n_surface, n_floor = name.count("S"), name.count("B")
    turned = n_surface * above + n_floor * below
    caustic = np.where((slope > 0) == (turned % 2 == 1), 1.0, 1j)
    return np.asarray(
        caustic * np.where(above, 1.0, -1.0) ** n_surface * np.where(below, 1.0, floor) ** n_floor
    )


def _crossings(x: Float, ranges: Float) -> tuple[Int, Int, Int]:
    """Return the crossings of x (n_sensors, n_rays) with a range between neighbouring rays.

    Returns
    -------
    sensor, ray, step : ndarray of int, shape (n_crossings,)
        ranges[step] lies between x[sensor, ray] and x[sensor, ray + 1].

    Examples
    --------
    >>> _crossings(np.array([[3.0, 1.0, np.nan, 0.0, 2.0]]), np.array([2.5, 1.5]))
    (array([0, 0, 0]), array([0, 0, 3]), array([1, 0, 1]))
    """
    order = np.argsort(ranges)
    rank = np.searchsorted(ranges[order], x)
    first = np.minimum(rank[:, :-1], rank[:, 1:])
    n = np.abs(np.diff(rank, axis=1))
    n[np.isnan(x[:, :-1]) | np.isnan(x[:, 1:])] = 0
    sensor, ray = np.nonzero(n)
    n, first = n[sensor, ray], first[sensor, ray]
    within = np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n)
    step = order[np.repeat(first, n) + within]
    return np.repeat(sensor, n), np.repeat(ray, n), step
