"""Select the compiled functions or the array program for a problem."""

from __future__ import annotations

import warnings
from functools import cache, lru_cache
from importlib import import_module
from typing import Literal

from arrivals.measurement_models.manifolds.fourier import FourierManifold
from arrivals.measurement_models.manifolds.manifold import Manifold, is_angle_manifold
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.trackers.compiler import compiler_error

CompiledChoice = Literal["auto"] | bool


@lru_cache(maxsize=16)
def is_compiled(choice: CompiledChoice, manifold: Manifold, n_moments: int = 0) -> bool:
    """Return True if problems are solved by compiled functions.

    Parameters
    ----------
    choice : {"auto", True, False}
    manifold : Manifold
    n_moments : int
        Moments of the angles' densities that are kept.

    Raises
    ------
    ValueError
        If the choice is True and they have no compiled form, or numba cannot be used.

    Warns
    -----
    RuntimeWarning
        Once, if the choice is "auto" and numba is installed but cannot be used.
    """
    if choice is False:
        return False
    missing = missing_kernel(manifold, n_moments)
    error = kernel_error() if missing is None else None
    if choice is True:
        require_kernel(missing, error)
    elif missing is None and error:
        warn_of_compiler(error)
    return missing is None and error is None


def missing_kernel(manifold: Manifold, n_moments: int = 0) -> str | None:
    """Return the case without a compiled form; None if there is one."""
    if not is_angle_manifold(manifold):
        return "manifolds of points"
    if n_moments or len(manifold.nuisance_weights) > 1:
        return "coordinate ascent"
    if not isinstance(manifold, FourierManifold | UniformLineManifold):
        return f"a {type(manifold).__name__}"
    return None


def require_kernel(missing: str | None, error: str | None) -> None:
    """Raise ValueError without a compiled form, or if numba cannot be used."""
    if missing is not None:
        raise ValueError(f'compiled must be "auto" or False for {missing}; got True')
    if error is not None:
        hint = error or 'install "arrivals[fast]"'
        raise ValueError(f'compiled must be "auto" or False without numba; got True: {hint}')


@cache
def kernel_error() -> str | None:
    """Return why the compiled functions cannot be used: "" without numba, None if they can."""
    error = compiler_error()
    if error is None:
        try:
            import_module("arrivals.trackers.svalse.newton.compiled.solve")
        except Exception as failure:  # such as of a file system without a place for the cache
            error = str(failure)
    return error


@cache
def warn_of_compiler(error: str) -> None:
    """Warn once that numba cannot be used."""
    warnings.warn(
        f"numba cannot be used, so SVALSE runs on arrays: {error}", RuntimeWarning, stacklevel=2
    )
