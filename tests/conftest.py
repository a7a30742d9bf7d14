"""Settings of all tests."""

from hypothesis import settings

settings.register_profile("unhurried", deadline=None)  # a first call may import scipy
settings.load_profile("unhurried")
