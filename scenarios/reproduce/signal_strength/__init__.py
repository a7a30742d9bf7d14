"""The statistic of signal strength, moving sources, and networks: beyond Table 1."""
