"""Sound fields of a tone in layered shallow water, by normal modes and by rays."""

from arrivals.scenarios.ocean_acoustics.eigenrays import Eigenrays, eigenrays
from arrivals.scenarios.ocean_acoustics.normal_modes import Modes, mode_field, modes
from arrivals.scenarios.ocean_acoustics.waveguide import BottomLayer, Waveguide

__all__ = ["BottomLayer", "Eigenrays", "Modes", "Waveguide", "eigenrays", "mode_field", "modes"]
