"""Numbers of arithmetic operations of one iteration, by formulas from the shapes of its arrays.

A real multiplication, addition or division counts as one, a logarithm or exponential as 20, as in
Table 2 of the study of interpolated delays.
"""

from __future__ import annotations

TRANSCENDENTAL = 20
NEWTON_STEPS = 5  # for the mode of a position, at most
LINE_POINTS = 2  # a line search of BFGS: 1.5 to 2.8 measured at K = 1, 5 and 50


def cycle_operations(n_sources: int, n_sensors: int, newton_steps: int = NEWTON_STEPS) -> int:
    """Return the operations of a cycle of Algorithm 1.

    Parameters
    ----------
    n_sources, n_sensors : int
    newton_steps : int
        Newton steps of each position.

    Examples
    --------
    >>> round(cycle_operations(50, 400) / cycle_operations(5, 400), 1)
    9.9
    """
    powers = 8  # λ², W λ (r + λ u) and their sums, (10), (11)
    residual = 5 + TRANSCENDENTAL + 5  # range, its logarithm, ρ and φ, (12)
    derivatives = 28  # gradient and Hessian, (13), (14)
    each = powers + newton_steps * (residual + derivatives) + residual + derivatives
    return _levels(n_sources, n_sensors) + n_sources * n_sensors * each


def search_operations(n_sources: int, n_sensors: int, differences: bool) -> int:
    """Return the operations of an iteration of ML: of BFGS by differences, or Levenberg-Marquardt.

    Parameters
    ----------
    n_sources, n_sensors : int
    differences : bool
        Whether the gradient is by differences: one more evaluation for each unknown.

    Examples
    --------
    >>> search_operations(1, 400, differences=True) < 2 * cycle_operations(1, 400)
    True
    """
    unknowns = 3 * n_sources
    value = _levels(n_sources, n_sensors) + 4 * n_sensors  # misfit
    if differences:
        return LINE_POINTS * (unknowns + 1) * value + 10 * unknowns**2  # update of the Hessian
    slopes = 10 * n_sources * n_sensors
    return value + slopes + 2 * (n_sensors + unknowns) * unknowns**2  # QR decomposition


def _levels(n_sources: int, n_sensors: int) -> int:
    """Return the operations of the levels (1) and the shares λ (9) at all sensors."""
    pair = 5 + 2 * TRANSCENDENTAL + 4  # range, logarithm, exponential, sum and share
    return n_sensors * (n_sources * pair + TRANSCENDENTAL + 2)
