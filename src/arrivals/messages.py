"""Values in messages."""

import difflib
import reprlib
from collections.abc import Iterable
from typing import Any

import numpy as np

LONGEST = 200  # characters
LEAST_SIMILARITY, SAME = 0.65, 0.05  # of names in a hint; less than the best by this at most
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
    """Return a hint about an unknown name: up to three similar names, or all that are not nested.

    Examples
    --------
    >>> nearest("kapa", ["motion__kappa", "memory"]), nearest("x", ["kappa", "mu"])
    ('did you mean motion__kappa?', 'known: kappa, mu')
    """
    names = sorted(set(known))
    listed = [each for each in names if "__" not in each] or names
    return similar(name, names).removeprefix(": ") or f"known: {', '.join(listed) or 'none'}"


def similar(name: object, known: Iterable[object]) -> str:
    """Return the end of a message about an unknown name, empty if no name is similar.

    The last part of a nested name counts as a name. A name that is a part of another, or begins
    with the same four letters, is similar.

    Examples
    --------
    >>> similar("svasle", ["svalse", "cbf"]), similar("fig6", ["svalse-fig6"]), similar("x", ["y"])
    (': did you mean svalse?', ': did you mean svalse-fig6?', '')
    """
    if not isinstance(name, str):
        return ""
    scores = {each: _similarity(name, each) for each in known if isinstance(each, str)}
    best = max(scores.values(), default=0.0)
    near = [each for each in scores if scores[each] >= max(LEAST_SIMILARITY, best - SAME)]
    near = sorted(near, key=lambda each: -scores[each])[:3]
    return f": did you mean {' or '.join(near)}?" if near else ""


def _similarity(one: str, other: str) -> float:
    """Return a number from 0 to 1; capitals, and what joins words, do not count."""
    is_nested = "__" in other
    joint = "__" if is_nested else "."
    one, other = (each.lower().replace("-", "_").replace(".", joint) for each in (one, other))
    pairs = [(one, other)]
    if is_nested:
        pairs.append((one.rpartition("__")[2], other.rpartition("__")[2]))
    ratio = max(difflib.SequenceMatcher(None, *pair).ratio() for pair in pairs)
    is_part = min(len(one), len(other)) >= 3 and (one in other or other in one)
    is_start = len(one) >= 4 and other.startswith(one[:4])
    return max(ratio, LEAST_SIMILARITY if is_part or is_start else 0.0)


def with_article(noun: str) -> str:
    """Return a noun with its indefinite article.

    Examples
    --------
    >>> with_article("animal"), with_article("tracker")
    ('an animal', 'a tracker')
    """
    return f"an {noun}" if noun[0].lower() in "aeiou" else f"a {noun}"
