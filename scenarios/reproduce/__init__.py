"""The experiments of the papers, with our numbers beside the published ones."""

from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.studies import STUDIES, reproduce

__all__ = ["STUDIES", "Report", "reproduce"]
