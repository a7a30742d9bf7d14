"""Range-independent waveguide: water over fluid layers of sea floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import instance, not_negative, positive, real

NEPER_DB = 20 / np.log(10)


@dataclass(frozen=True)
class BottomLayer(FrozenModel):
    """Fluid layer of the sea floor with a sound speed linear in depth.

    Parameters
    ----------
    top, bottom : float
        Depths of its ends below the surface, m.
    speed_top, speed_bottom : float
        Sound speeds at its ends, m/s.
    density : float
        Density relative to that of water.
    attenuation : float
        Attenuation, dB per metre and kilohertz.
    """

    top: float
    bottom: float
    speed_top: float
    speed_bottom: float
    density: float = 1.0
    attenuation: float = 0.0

    def __post_init__(self) -> None:
        for name in ("top", "bottom", "speed_top", "speed_bottom", "density"):
            positive(name, getattr(self, name))
        not_negative("attenuation", self.attenuation)
        if self.bottom <= self.top:
            raise ValueError(f"bottom must lie below top, {self.top} m; got {self.bottom} m")


@dataclass(frozen=True, eq=False)
class Waveguide(FrozenModel):
    """Water with a sound-speed profile, a free surface, and layers of sea floor.

    Parameters
    ----------
    depths : array_like, shape (n,)
        Depths of the profile, m, increasing from 0 to the sea floor.
    speeds : array_like, shape (n,)
        Sound speeds at `depths`, m/s; linear in between.
    layers : sequence of BottomLayer
        Contiguous layers from the sea floor down; the waveguide ends at the floor if empty.
    rigid : bool
        Whether the lower end is rigid; pressure release otherwise.

    Raises
    ------
    ValueError
        If depths do not increase from 0, speeds are not positive, or layers leave a gap.

    Examples
    --------
    >>> guide = Waveguide([0.0, 50.0, 100.0], [1520.0, 1500.0, 1490.0])
    >>> guide.water_depth, guide.speed([25.0, 75.0])
    (100.0, array([1510., 1495.]))
    """

    depths: Float
    speeds: Float
    layers: Sequence[BottomLayer] = field(default=())
    rigid: bool = False

    def __post_init__(self) -> None:
        depths, speeds = (
            np.array(real("depths", self.depths)),
            np.array(real("speeds", self.speeds)),
        )
        if depths.ndim != 1 or len(depths) < 2 or depths[0] != 0 or not (np.diff(depths) > 0).all():
            raise ValueError(
                f"depths must be two or more, increasing from 0; got {depths.tolist()}"
            )
        if speeds.shape != depths.shape or not (np.isfinite(speeds) & (speeds > 0)).all():
            raise ValueError(
                f"speeds must be {len(depths)} positive numbers; got {speeds.tolist()}"
            )
        above = depths[-1]
        for layer in self.layers:
            if instance("layers", layer, BottomLayer).top != above:
                raise ValueError(f"top of a layer must be {above} m; got {layer.top} m")
            above = layer.bottom
        for array in (depths, speeds):
            array.setflags(write=False)
        object.__setattr__(self, "depths", depths)
        object.__setattr__(self, "speeds", speeds)
        object.__setattr__(self, "layers", tuple(self.layers))

    @property
    def water_depth(self) -> float:
        """Depth of the sea floor, m."""
        return float(self.depths[-1])

    @property
    def depth(self) -> float:
        """Depth at which the lowest layer ends, m."""
        return self.layers[-1].bottom if self.layers else self.water_depth

    def speed(self, depth: ArrayLike) -> Float:
        """Return the sound speed, m/s, at depths (...), m; above the interface where two meet.

        Raises
        ------
        ValueError
            If a depth lies above the surface or below the lowest layer.
        """
        depth = real("depth", depth)
        if not ((depth >= 0) & (depth <= self.depth)).all():
            raise ValueError(f"depth must lie in [0, {self.depth}] m; got {depth.tolist()}")
        speed = np.interp(depth, self.depths, self.speeds)
        for layer in self.layers:
            ends = [layer.top, layer.bottom], [layer.speed_top, layer.speed_bottom]
            speed = np.where(depth > layer.top, np.interp(depth, *ends), speed)
        return np.asarray(speed)

    def in_water(self, name: str, depth: ArrayLike) -> Float:
        """Return depths, m, after checking that they are in the water.

        Examples
        --------
        >>> Waveguide([0.0, 100.0], [1500.0, 1500.0]).in_water("source_depth", 120.0)
        Traceback (most recent call last):
        ValueError: source_depth must lie in the water, 0 to 100 m; got 120.0
        """
        depth = real(name, depth)
        if not ((depth >= 0) & (depth <= self.water_depth)).all():
            given = depth.tolist()
            raise ValueError(
                f"{name} must lie in the water, 0 to {self.water_depth:g} m; got {given}"
            )
        return depth


def nepers(attenuation: ArrayLike, frequency: float) -> Float:
    """Convert attenuations from dB per metre and kilohertz to nepers per metre at a frequency, Hz.

    Examples
    --------
    >>> float(nepers(0.2, 1000.0).round(4))
    0.023
    """
    return np.asarray(np.asarray(attenuation) * frequency / 1e3 / NEPER_DB)
