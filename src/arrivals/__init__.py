"""Track directions of arrival, and positions from signal strength.

The parts live in four subpackages: `arrivals.motion_models`, `arrivals.measurement_models`,
`arrivals.trackers` and `arrivals.scenarios`. `arrivals.read` reads a recording, `arrivals.track`
tracks one in one call, `arrivals.locate` sources by readings of signal strength; `arrivals.plot`
draws the result.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from arrivals.plots.runs import plot
    from arrivals.recordings.readers import read
    from arrivals.recordings.readings.locating import locate
    from arrivals.recordings.tracking import track

__version__ = "0.1.0"
__all__ = ["__version__", "locate", "plot", "read", "track"]

LAZY = {
    "locate": "arrivals.recordings.readings.locating",
    "plot": "arrivals.plots.runs",
    "read": "arrivals.recordings.readers",
    "track": "arrivals.recordings.tracking",
}


def __getattr__(name: str) -> Any:
    if name not in LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(LAZY[name]), name)
