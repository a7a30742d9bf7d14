"""Registry of scenarios: available, create, find, register."""

from arrivals.registry import Registry
from arrivals.scenarios.base import Scenario

SCENARIOS: Registry[Scenario] = Registry(Scenario, "arrivals.scenarios", "scenario")  # type: ignore[type-abstract]  # only its subclasses are made
available, create, find, register = (
    SCENARIOS.available,
    SCENARIOS.create,
    SCENARIOS.find,
    SCENARIOS.register,
)
