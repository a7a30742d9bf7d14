"""Settings of all tests."""

import os

from hypothesis import settings

# A first call may import scipy; and CI judges a change, not the luck of a draw.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")
