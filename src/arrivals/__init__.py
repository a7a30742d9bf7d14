"""Track directions of arrival, and positions from signal strength.

The parts live in four subpackages: `arrivals.motion_models`, `arrivals.measurement_models`,
`arrivals.trackers` and `arrivals.scenarios`. For recordings, `arrivals.read` reads one,
`arrivals.check` checks its channels and the wiring of its array, `arrivals.track` tracks it in one
call, `arrivals.locate` locates sources by readings of signal strength, `arrivals.fuse` by several
arrays, `arrivals.plot` draws the result.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from arrivals.plots.runs import plot
    from arrivals.recordings.check import check
    from arrivals.recordings.fusion.fusing import fuse
    from arrivals.recordings.networks.locating import locate
    from arrivals.recordings.readers import read
    from arrivals.recordings.tracking import track

__version__ = "0.2.0"
__all__ = ["__version__", "check", "fuse", "locate", "plot", "read", "track"]

LAZY = {
    "check": "arrivals.recordings.check",
    "fuse": "arrivals.recordings.fusion.fusing",
    "locate": "arrivals.recordings.networks.locating",
    "plot": "arrivals.plots.runs",
    "read": "arrivals.recordings.readers",
    "track": "arrivals.recordings.tracking",
}


def __getattr__(name: str) -> Any:
    if name not in LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(LAZY[name]), name)
