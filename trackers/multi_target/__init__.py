"""Detection followed by data association."""
