"""Signal strength."""
