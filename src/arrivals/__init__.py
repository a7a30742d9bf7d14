"""Track directions of arrival, and positions from signal strength.

The parts live in four subpackages: `arrivals.motion_models`, `arrivals.measurement_models`,
`arrivals.trackers` and `arrivals.scenarios`.
"""

__version__ = "0.1.0"
