"""Valid calls of functions of two unknowns a source."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios.bounds.two_unknowns import range_bound, sphere_bound

LINE = SensorArray.ula(4, spacing=0.5)
SPHERE = ArraySnapshot(SensorArray.uca(4, 0.3), wavelength=1.0, unknowns="sphere")
DOA, ELEVATION, DISTANCE = np.array([0.1]), np.array([0.6]), np.array([2.0])


def spherical_wave(array: Any, wavelength: Any, nearest: Any, **source: Any) -> Any:
    model = ArraySnapshot(array, wavelength, unknowns="range", nearest=nearest)
    return model.wave(**source), model.manifold().n_unknowns


def elevated_wave(array: Any, wavelength: Any, **source: Any) -> Any:
    model = ArraySnapshot(array, wavelength, unknowns="sphere")
    return model.wave(**source), model.manifold().n_unknowns


TWO_UNKNOWNS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "sphere_bound": (
        sphere_bound,
        {"measurement": SPHERE, "doa": DOA, "elevation": ELEVATION, "amplitude": np.ones(1),
         "noise": 0.1},
    ),
    "range_bound": (
        range_bound,
        {"measurement": ArraySnapshot(LINE, 1.0), "doa": DOA, "distance": DISTANCE,
         "amplitude": np.ones(1), "noise": 0.1},
    ),
    "spherical_wave": (
        spherical_wave,
        {"array": LINE, "wavelength": 1.0, "nearest": 0.7, "doa": DOA, "amplitude": np.ones(1),
         "distance": DISTANCE},
    ),
    "elevated_wave": (
        elevated_wave,
        {"array": SPHERE.array, "wavelength": 1.0, "doa": DOA, "amplitude": np.ones(1),
         "elevation": ELEVATION},
    ),
}  # fmt: skip
