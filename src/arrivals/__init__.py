"""Track directions of arrival, and positions from signal strength.

The parts live in four subpackages: `arrivals.motion_models`, `arrivals.measurement_models`,
`arrivals.trackers` and `arrivals.scenarios`. `arrivals.track` tracks a recording in one call.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from arrivals.recordings.tracking import track

__version__ = "0.1.0"
__all__ = ["__version__", "track"]


def __getattr__(name: str) -> Any:
    if name != "track":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from arrivals.recordings.tracking import track

    return track
