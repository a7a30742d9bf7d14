"""Known log gains of sensors and paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import real


@dataclass(frozen=True, eq=False, init=False)
class LogGains(FrozenModel):
    """Known log gains of the sensors and of the paths from sources to sensors.

    Parameters
    ----------
    offsets : float or array_like, shape (n_sensors,)
        Log gains of the sensors, Np, of source and noise alike.
    paths : float or array_like, shape (n_sensors,) or (n_sources, n_sensors)
        Log gains of the paths, Np, of the sources only, as `doppler_log_gain` returns them.

    Raises
    ------
    ValueError
        If a gain is not finite.

    Examples
    --------
    >>> LogGains(offsets=[0.1, -0.1]).offsets
    array([ 0.1, -0.1])
    """

    offsets: float | Float
    paths: float | Float

    def __init__(self, offsets: ArrayLike = 0.0, paths: ArrayLike = 0.0) -> None:
        object.__setattr__(self, "offsets", _finite("offsets", offsets, max_ndim=1))
        object.__setattr__(self, "paths", _finite("paths", paths, max_ndim=2))

    def check(self, n_sensors: int) -> None:
        """Raise a ValueError if an array has another number of sensors."""
        for name in ("offsets", "paths"):
            shape = np.shape(getattr(self, name))
            if shape and shape[-1] != n_sensors:
                raise ValueError(f"{name} must have shape (..., {n_sensors}); got {shape}")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LogGains) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple[object, ...]:
        return tuple((np.shape(v), np.asarray(v).tobytes()) for v in (self.offsets, self.paths))


def _finite(name: str, value: ArrayLike, max_ndim: int) -> float | Float:
    """Return a finite number, or a finite array that cannot be written to."""
    array = np.array(real(name, value))
    if array.ndim > max_ndim:
        raise ValueError(f"{name} must have at most {max_ndim} dimensions; got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite; got {array.tolist()}")
    array.setflags(write=False)
    return array if array.ndim else float(array)
