"""Levels in dB, dBm and neper: readings and source powers are natural logarithms of amplitudes."""

import math

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float
from arrivals.validation import real

NEPER_PER_DB = math.log(10) / 20


def db_to_neper(level_db: ArrayLike) -> Float:
    """Return levels in neper: 20 log₁₀ of an amplitude becomes its natural logarithm.

    The same factor serves levels in dB of a power, which are the same number of dB.

    Parameters
    ----------
    level_db : array_like
        Levels, dB.

    Returns
    -------
    ndarray
        Np.

    References
    ----------
    ISO 80000-3: 1 dB = ln(10)/20 Np.

    Examples
    --------
    >>> db_to_neper([80.0, 3.0]).round(6)
    array([9.21034 , 0.345388])
    """
    return np.asarray(real("level_db", level_db) * NEPER_PER_DB)


def neper_to_db(level: ArrayLike) -> Float:
    """Return levels in dB of levels in neper.

    Parameters
    ----------
    level : array_like
        Levels, Np.

    Returns
    -------
    ndarray
        dB.

    Examples
    --------
    >>> float(neper_to_db(np.log(100.0)))
    40.0
    """
    return np.asarray(real("level", level) / NEPER_PER_DB)


def dbm_to_neper(level_dbm: ArrayLike) -> Float:
    """Return log amplitudes in neper, over that of 1 mW, of power levels in dBm.

    Parameters
    ----------
    level_dbm : array_like
        Power levels, dBm.

    Returns
    -------
    ndarray
        Np.

    Examples
    --------
    A hundred times the amplitude, 40 dB:

    >>> round(float(np.exp(dbm_to_neper(-50.0) - dbm_to_neper(-90.0))), 6)
    100.0
    """
    return db_to_neper(level_dbm)


def neper_to_dbm(level: ArrayLike) -> Float:
    """Return power levels in dBm of log amplitudes in neper over that of 1 mW.

    Examples
    --------
    >>> float(neper_to_dbm(dbm_to_neper(-97.0)).round(9))
    -97.0
    """
    return neper_to_db(level)


def watt_to_neper(power: ArrayLike) -> Float:
    """Return log amplitudes in neper, over that of 1 mW, of powers in W.

    Examples
    --------
    >>> float(neper_to_dbm(watt_to_neper(1.0)).round(9))
    30.0
    """
    with np.errstate(divide="ignore"):
        return np.asarray(0.5 * np.log(real("power", power) * 1e3))
