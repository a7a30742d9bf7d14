"""filterpy's constructors, for scripts that set F, H, Q, R, x and P one by one."""

from typing import Any

from arrivals.trackers.filterpy.extended import ExtendedKalmanFilter
from arrivals.trackers.filterpy.kalman_filter import KalmanFilter
from arrivals.trackers.filterpy.unscented import UnscentedKalmanFilter
from arrivals.trackers.gaussian.imm import IMM as IMMEstimator  # noqa: N811  (the same arguments)

__all__ = ["ExtendedKalmanFilter", "IMMEstimator", "KalmanFilter", "UnscentedKalmanFilter"]


def __getattr__(name: str) -> Any:
    """Return sigma points of filterpy, which is imported only then."""
    if name in ("MerweScaledSigmaPoints", "JulierSigmaPoints"):
        import filterpy.kalman

        return getattr(filterpy.kalman, name)
    raise AttributeError(
        f"arrivals.trackers.filterpy has no {name!r}; it has {', '.join(__all__)}: import other "
        "names from filterpy"
    )
