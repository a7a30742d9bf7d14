"""Run the command line: python -m arrivals."""
