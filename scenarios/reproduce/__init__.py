"""The experiments of the papers, with our numbers beside the published ones."""

from arrivals.scenarios.reproduce.studies import STUDIES, Report, reproduce

__all__ = ["STUDIES", "Report", "reproduce"]
