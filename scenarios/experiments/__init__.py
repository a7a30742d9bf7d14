"""Monte Carlo studies: many runs, several trackers, one resumable results file.

`TrackerEstimator` is in `arrivals.scenarios.experiments.estimator`, which imports scikit-learn.
"""

from arrivals.scenarios.experiments.methods import Method, grid
from arrivals.scenarios.experiments.monte_carlo import monte_carlo
from arrivals.scenarios.experiments.statistics import Difference
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.experiments.workers import parallel_map

__all__ = ["Difference", "Method", "Study", "grid", "monte_carlo", "parallel_map"]
