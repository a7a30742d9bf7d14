"""Source signals that are autoregressive: model, companion form, estimation."""

from arrivals.motion_models.autoregressive.estimation import select_order, yule_walker
from arrivals.motion_models.autoregressive.sources import AutoregressiveSources

__all__ = ["AutoregressiveSources", "select_order", "yule_walker"]
