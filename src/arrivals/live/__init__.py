"""Live view of a run: a page in a browser, lines in a terminal, JSON lines; live input."""
