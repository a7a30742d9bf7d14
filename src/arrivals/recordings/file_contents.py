"""Contents of a recording file."""

from typing import Any, NamedTuple

from numpy.typing import NDArray

from arrivals.typing import Float


class FileContents(NamedTuple):
    """Array as stored in a file, its rate in Hz and times in s, None if unknown."""

    array: NDArray[Any]
    rate: float | None = None
    time: Float | None = None
