"""Arrays from the keys of an array file.

`kind` says which other keys it has:

===========  ==============================================================
kind         keys
===========  ==============================================================
ula          `n_sensors`, `spacing`
uca          `n_sensors`, `radius`: element 1 at 0 degrees
symmetric    `distances`: of the sensors on either side of the centre
positions    `positions`: a list of numbers, of [x, y] or of [x, y, z], or the
             name of a table beside the file; or
             `latitude` and `longitude`, degrees, and, if known, `height`
stations     `stations`: a table or StationXML, see `arrays.stations`
a preset     those that its file leaves open, such as `radius`
===========  ==============================================================

and all may have

* `speed`: of the waves, m/s
* `unit`: m (without it), cm, mm, km, in, ft
* `rotation`: degrees by which the array is turned; added to all directions
* `clockwise = true`: directions are compass bearings, clockwise from north, the y axis
* `missing`: numbers of elements that do not work
* `channels`: the recording's channel of each element of the whole array, or of each not missing

Elements and channels are counted from 1, as they are labelled on the hardware.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np

from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.measurement_models.arrays.positions import compass, in_metres, turned
from arrivals.measurement_models.arrays.presets import preset_names, preset_text
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurements import real_numbers
from arrivals.messages import nearest, shown
from arrivals.validation import count

MAX_SENSORS = 100_000
KEYS = {  # the last one is a length
    "ula": ("n_sensors", "spacing"),
    "uca": ("n_sensors", "radius"),
    "symmetric": ("distances",),
    "positions": ("positions",),
}
GEOGRAPHIC = ("latitude", "longitude")  # in place of positions, with `height` if known
COMMON = ("speed", "missing", "channels", "rotation", "clockwise", "unit")


def from_description(description: Mapping[str, Any]) -> SensorArray:
    """Make the array that the keys of an array file describe.

    Parameters
    ----------
    description : mapping of str to object
        Keys and values as in an array file.

    Returns
    -------
    SensorArray

    Raises
    ------
    ValueError, TypeError
        If a key is missing or unknown, or a value is invalid.

    Examples
    --------
    >>> from_description({"kind": "ula", "n_sensors": 3, "spacing": 0.1, "missing": [2]}).channels
    (0, 2)
    >>> from_description({"kind": "uca", "n_sensors": 8})
    Traceback (most recent call last):
    ValueError: an array of kind 'uca' needs the key 'radius'
    """
    kind, keys = _kind_and_keys(dict(description))
    common = {name: keys.pop(name, None) for name in COMMON}
    n = keys.get("n_sensors")
    if isinstance(n, int) and n > MAX_SENSORS:
        raise ValueError(f"n_sensors must be at most {MAX_SENSORS}; got {n}")
    unit = "m" if common["unit"] is None else common["unit"]
    length = "height" if GEOGRAPHIC[0] in keys else KEYS[kind][-1]
    if length in keys:
        keys[length] = in_metres(length, keys[length], unit)
    array = _positions(**keys) if kind == "positions" else getattr(SensorArray, kind)(**keys)
    array = _oriented(array, kind, common["rotation"], common["clockwise"])
    array = SensorArray(array.positions, common["speed"])
    return _wired(array, common["missing"], common["channels"])


def _kind_and_keys(keys: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return one of `KEYS` and its keys; those of a preset are completed by its file."""
    name, known = keys.pop("kind", None), (*KEYS, *preset_names())
    if not isinstance(name, str) or name not in known:
        wanted = f"one of {', '.join(KEYS)}, or a preset in `arrivals list`"
        if name is None:
            raise ValueError(f"the key 'kind' is missing; it is {wanted}")
        hint = f": {nearest(name, known)}" if isinstance(name, str) else ""
        raise ValueError(f"kind must be {wanted}; got {shown(name)}{hint}")
    preset = {"kind": name} if name in KEYS else tomllib.loads(preset_text(name))
    kind = preset.pop("kind")
    is_geographic = kind == "positions" and not keys.keys().isdisjoint(GEOGRAPHIC)
    required = [key for key in (GEOGRAPHIC if is_geographic else KEYS[kind]) if key not in preset]
    common = COMMON if required else COMMON[:-1]  # the lengths of a complete preset have a unit
    allowed = (*required, *common, *(("height",) if is_geographic else ()))
    for key in keys:
        if key not in allowed:
            others = GEOGRAPHIC if "positions" in required else ()
            hint = nearest(key, (*allowed, *others))
            raise ValueError(f"an array of kind {name!r} has no key {key!r}: {hint}")
    if preset.get("clockwise") and keys.get("clockwise") is False:
        raise ValueError(f"clockwise must be true for {name!r}, as its elements are numbered")
    for key in required:
        if key not in keys:
            choice = ", or 'latitude' and 'longitude'" if key == "positions" else ""
            raise ValueError(f"an array of kind {name!r} needs the key {key!r}{choice}")
    return kind, preset | keys


def _positions(
    positions: Any = None, latitude: Any = None, longitude: Any = None, height: Any = None
) -> SensorArray:
    """Return sensors by coordinates, or by latitude, longitude and height: x east, y north."""
    if positions is not None:
        return SensorArray(real_numbers("positions", positions))
    lat, lon = real_numbers("latitude", latitude), real_numbers("longitude", longitude)
    heights = np.zeros((lat.size, 0)) if height is None else real_numbers("height", height)
    if lat.ndim != 1 or lat.shape != lon.shape or len(heights) != len(lat):
        shapes = f"{lat.shape}, {lon.shape}" + ("" if height is None else f", {heights.shape}")
        names = "latitude and longitude" if height is None else "latitude, longitude and height"
        raise ValueError(f"{names} must be lists of one length; got shapes {shapes}")
    if not (np.isfinite(lat) & np.isfinite(lon)).all():
        raise ValueError("latitude and longitude must be finite")
    plane = LocalPlane.around(lat, lon)
    return SensorArray(np.column_stack([*plane.to_xy(lat, lon), heights]))


def _oriented(array: SensorArray, kind: str, rotation: Any, clockwise: Any) -> SensorArray:
    """Return the array in the coordinates in which its directions are counted."""
    if clockwise is not None and not isinstance(clockwise, bool):
        raise ValueError(f"clockwise must be true or false; got {shown(clockwise)}")
    for name, value in (("rotation", rotation), ("clockwise", clockwise)):
        if value and array.dim == 1:
            raise ValueError(
                f"{name} must be left out for a line, whose directions are counted from broadside; "
                f"got {shown(value)}: reverse the order of channels to change their sign"
            )
    positions = array.positions
    if clockwise and kind == "positions":  # a circle is numbered in the sense of its directions
        positions = compass(positions)
    if rotation:
        positions = turned(positions, rotation)
    return SensorArray(positions)


def _wired(array: SensorArray, missing: Any, channels: Any) -> SensorArray:
    """Return the array without its missing elements, its channels renumbered from 0."""
    for name, value in (("missing", missing), ("channels", channels)):
        if value is not None and not isinstance(value, list):
            raise ValueError(f"{name} must be a list of numbers; got {value!r}")
    gone = [count("missing", element) - 1 for element in missing or []]
    if max(gone, default=0) >= array.n_sensors:
        raise ValueError(f"missing names element {max(gone) + 1} of {array.n_sensors}")
    whole = array.without(gone)
    if channels is None:
        return whole
    wires = tuple(count("channels", channel) - 1 for channel in channels)
    if len(set(wires)) != len(wires):
        raise ValueError(f"channels must differ from each other; got {channels}")
    if len(wires) == array.n_sensors:
        return SensorArray(array.positions, array.speed, wires).without(gone)
    return SensorArray(whole.positions, whole.speed, wires)
