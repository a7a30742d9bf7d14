"""Reference rooms, peers and scores of the benchmark of talkers in rooms."""
