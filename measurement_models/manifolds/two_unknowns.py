"""Choice of the manifold of two unknowns a source, and arrays that do not resolve them."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurement_models.manifolds.line_phase import fresnel_line
from arrivals.measurement_models.manifolds.manifold import PointManifold
from arrivals.measurement_models.manifolds.phase import direction_cosines
from arrivals.measurement_models.manifolds.spherical_line import spherical_line
from arrivals.measurement_models.manifolds.tangent_plane import tangent_planes
from arrivals.typing import Float
from arrivals.validation import one_of, positive

Unknowns = Literal["azimuth", "sphere", "range"]
FLAT = 1e-3  # of the largest extent of an array: what is thinner is a plane, or a line


def check_unknowns(
    waves: PlaneWaves, unknowns: Unknowns, nearest: float | None, is_white: bool = True
) -> None:
    """Raise a ValueError if an array cannot give these unknowns of a source.

    Parameters
    ----------
    waves : PlaneWaves
        Array and wavelengths.
    unknowns : {"azimuth", "sphere", "range"}
        Direction; azimuth and elevation; direction and range.
    nearest : float or None
        Distance of the nearest source, m.
    is_white : bool
        False if the noise is coherent between sensors.

    Examples
    --------
    >>> check_unknowns(PlaneWaves(SensorArray.ula(4, 0.5), [1.0]), "sphere", None)
    Traceback (most recent call last):
    ValueError: array must be in a plane or in space for unknowns='sphere'; got a line
    """
    one_of("unknowns", unknowns, ("azimuth", "sphere", "range"))
    array, wanted = waves.array, f"unknowns={unknowns!r}"
    if nearest is not None:
        positive("nearest", nearest)
        if unknowns != "range":
            raise ValueError(f"nearest must be None unless unknowns='range'; got {unknowns!r}")
    if unknowns == "azimuth":
        return
    if not is_white:
        raise ValueError(f"noise_coherence must be 'white' for {wanted}; got coherent noise")
    if waves.response is not None:
        raise ValueError(f"response must be None for {wanted}; got gains by azimuth alone")
    for name in ("slowness", "elevation"):
        if getattr(waves, name) is not None:
            raise ValueError(f"{name} must be None for {wanted}; got a grid of a third unknown")
    if unknowns == "range":
        _check_range(array, nearest)
        return
    if array.dim == 1:
        raise ValueError(f"array must be in a plane or in space for {wanted}; got a line")
    if array.n_sensors < 4:
        raise ValueError(f"array must have at least 4 sensors for {wanted}; got {array.n_sensors}")
    _, second, _ = _extents(array)
    if second:
        return
    what = f"array must not be collinear for {wanted}"
    raise ValueError(f"{what}; got {array.n_sensors} sensors in a line")


def _check_range(array: SensorArray, nearest: float | None) -> None:
    if array.dim != 1:
        raise ValueError(
            "array must be a line, with positions of one coordinate, for unknowns='range'; got "
            f"sensors in {array.dim} dimensions"
        )
    if array.n_sensors < 3:
        got = array.n_sensors
        raise ValueError(f"array must have at least 3 sensors for unknowns='range'; got {got}")
    extent = float(np.ptp(array.positions))
    if nearest is not None and nearest < extent / 4 * (1 - 1e-9):
        raise ValueError(
            f"nearest must be at least a quarter of the array's extent of {extent:g} m; "
            f"got {nearest:g}"
        )


@lru_cache(maxsize=64)
def _extents(array: SensorArray) -> tuple[bool, bool, bool]:
    """Return which of the principal extents of an array are not zero."""
    size = np.zeros(3)
    centred: Float = array.positions - array.positions.mean(axis=0)
    values = np.linalg.svd(centred, compute_uv=False)[:3]
    size[: len(values)] = values
    first, second, third = (size > FLAT * size[0]).tolist()
    return first, second, third


def is_planar(array: SensorArray) -> bool:
    """Return True if the sensors are in a plane, not in a line.

    Examples
    --------
    >>> is_planar(SensorArray.uca(5, 1.0)), is_planar(SensorArray.ula(5, 1.0))
    (True, False)
    """
    return array.dim > 1 and _extents(array)[1:] == (True, False)


def fraunhofer_distance(waves: PlaneWaves) -> float:
    """Return 2 extent²/λ of a line at the shortest wavelength, m: the far field begins there.

    Examples
    --------
    >>> fraunhofer_distance(PlaneWaves(SensorArray.ula(16, 0.08), [0.1715]))
    16.793...
    """
    return float(2 * np.ptp(waves.array.positions) ** 2 / min(waves.wavelengths))


def two_unknowns_manifold(
    waves: PlaneWaves, unknowns: Unknowns, nearest: float | None
) -> PointManifold:
    """Return the manifold of an array that has passed `check_unknowns`.

    Parameters
    ----------
    waves : PlaneWaves
        Array and wavelengths.
    unknowns : {"sphere", "range"}
        Azimuth and elevation, or direction and range.
    nearest : float or None
        Distance of the nearest source, m; a quarter of the Fraunhofer distance if None. From there
        on, wavefronts are parabolic; below, spherical.

    Raises
    ------
    ValueError
        If the array resolves too many points for a grid.

    Examples
    --------
    >>> waves = PlaneWaves(SensorArray.ula(16, 0.08), (0.1715,))
    >>> [type(two_unknowns_manifold(waves, "range", each)).__name__ for each in (None, 0.5)]
    ['FresnelLine', 'SphericalLine']
    """
    manifold: PointManifold
    limit = fraunhofer_distance(waves) / 4
    if unknowns == "sphere":
        manifold = direction_cosines(waves) if is_planar(waves.array) else tangent_planes(waves)
    elif nearest is not None and nearest < limit:
        manifold = spherical_line(waves, 1 / nearest)
    else:
        manifold = fresnel_line(waves, 1 / (nearest or limit))
    manifold.candidates()  # refuses too many
    return manifold
