"""Mean responses and priors of components: of angles, and of points with a chart."""

from arrivals.trackers.svalse.newton.charts.angle_chart import AngleChart
from arrivals.trackers.svalse.newton.charts.point_chart import PointChart

__all__ = ["AngleChart", "PointChart"]
