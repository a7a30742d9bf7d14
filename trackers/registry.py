"""Registry of trackers, including those of other packages."""

from arrivals.parameters import FINDERS, NAMERS
from arrivals.registry import Registry
from arrivals.trackers.base import Tracker

TRACKERS: Registry[Tracker] = Registry(Tracker, "arrivals.trackers", "tracker")  # type: ignore[type-abstract]  # only subclasses are instantiated
FINDERS.append(TRACKERS.find)
NAMERS.append(TRACKERS.name_of)
available, create, find, register = (
    TRACKERS.available,
    TRACKERS.create,
    TRACKERS.find,
    TRACKERS.register,
)
