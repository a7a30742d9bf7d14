"""Values in messages."""

import difflib
import reprlib
from collections.abc import Iterable
from typing import Any

import numpy as np

LONGEST = 200  # characters
REPR = reprlib.Repr()
REPR.maxlist = REPR.maxtuple = 12
REPR.maxstring = REPR.maxother = REPR.maxlong = LONGEST


def shown(value: Any) -> str:
    """Return a value as one line of a message, shortened.

    Examples
    --------
    >>> shown(np.eye(2)), shown([1, [2, [3]]])
    ('[[1.0, 0.0], [0.0, 1.0]]', '[1, [2, [3]]]')
    >>> shown(10**5000)
    'an int'
    """
    try:
        is_small = isinstance(value, np.ndarray) and value.size <= 100
        text = " ".join(REPR.repr(value.tolist() if is_small else value).split())
    except Exception:  # of the value's own repr
        return with_article(type(value).__name__)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def in_line(error: Exception) -> str:
    r"""Return the message of an error in one line, shortened.

    Examples
    --------
    >>> in_line(ValueError("truncated:\n  no data"))
    'truncated: no data'
    """
    text = " ".join(str(error).split())
    return text if len(text) <= 2 * LONGEST else f"{text[: 2 * LONGEST - 3]}..."


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a hint about an unknown name: up to three similar names, or all if none is similar.

    Examples
    --------
    >>> nearest("kapa", ["kappa", "mu"]), nearest("x", ["kappa", "mu"])
    ('did you mean kappa?', 'known: kappa, mu')
    """
    names = sorted(set(known))
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.6)
    return f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(names) or 'none'}"


def with_article(noun: str) -> str:
    """Return a noun with its indefinite article.

    Examples
    --------
    >>> with_article("animal"), with_article("tracker")
    ('an animal', 'a tracker')
    """
    return f"an {noun}" if noun[0].lower() in "aeiou" else f"a {noun}"
