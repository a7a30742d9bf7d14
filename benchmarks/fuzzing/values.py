"""Malformed values, as expressions: a report prints the expression that a fault was found with.

`whatever` draws a value that has nothing to do with the valid one, `changed` a variation of the
valid one, and `same` one that means the same. In expressions the valid value is `a`.
"""

from __future__ import annotations

import datetime
import warnings
from collections.abc import Iterator, Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np


def _words(text: str) -> list[str]:
    return text.split()


SCALARS = _words("""
None nan inf -inf 0 -1 1 2 7 0.5 -0.5 1e-9 1e6 1e139 1e141 1e200 1e308 -1e308 -0.0 5e-324 1e-200
1e-320 True np.True_ 10**9 3*10**7 2**31 2**63 2**64 -2**70 10**30 10**400 -10**5000 1j
complex(1,nan) complex(inf,0) Decimal('0.5') Decimal('NaN') Decimal('sNaN') Decimal('1e999')
Fraction(1,3) Fraction(10**400,3) np.float64(1.5) np.float32(nan) np.float16(6e4)
np.longdouble('1e4000') np.int8(-128) np.uint64(2**64-1) np.complex64(1j)
np.datetime64('2020-01-01') np.timedelta64(1,'s') np.datetime64('NaT') datetime.date(2020,1,1)
np.str_('a') np.void(b'ab') np.ma.masked np.array(1.0) np.array(nan) np.array(1.5,dtype='>f8')
np.array(None) np.array('a') np.array(1j)
""")

THINGS = _words("""
'' 'text' '1.0' 'a\\nb' b'bytes' bytearray(b'ab') memoryview(b'ab') ... NotImplemented object() int
len (lambda:1) slice(1) Path('x') np.random.default_rng(0) [] () {} {'a':1} {'type':'kalman'}
set() {1.0,2.0} frozenset({1.0}) range(3) iter([1.0]) generated() [[]] [[[]]] [None] [nan] [inf]
[1.0] [1.0,2.0] [1.0,None] [1.0,'a'] [1.0,1j] [[1.0,2.0],[3.0]] [[1.0,2.0],None] [[1.0],[1.0]]
[10**400] [1e200,1e200] [-1.0,-1.0] [0.0,0.0] [True,False] nested(3) nested(40) nested(3000)
cyclic() np.zeros(0) np.zeros((0,3)) np.zeros((3,0)) np.zeros((1,)*20) np.ones(3) np.ones((2,2))
-np.eye(2) np.eye(3) np.full((2,2),nan) np.full((2,2),1e308) np.full((4,4),inf) np.eye(4)*1e200
np.eye(4)*1e-200 np.triu(np.ones((4,4))) np.array([1.0,None]) np.array(['a','b']) np.array([b'a'])
np.zeros(2,dtype='f8,i4') np.array(['2020'],dtype='M8[s]') Framed([1.0]) Framed([1.0,None])
Framed([[1.0,2.0]]) Framed('text') Arraylike(np.ones(2)) np.matrix([[1.0,2.0]])
np.ma.array([1.0,2.0],mask=[1,0]) np.ma.array(np.ones((2,2)),mask=np.eye(2)) np.ma.masked_all(3)
np.array([[1.0],[2.0,3.0]],dtype=object) np.array([np.ones(2),None],dtype=object)
""")

VARIATIONS = _words("""
a[None] a[...,None] np.ravel(a)[:-1] np.stack([a,a]) np.concatenate([np.ravel(a)]*2) a.T a[:0]
a[...,:0] a*0 a*-1 a*1e3 a*1e8 a*1e30 a*1e100 a*1e150 a*1e200 a*1e306 a*1e-30 a*1e-200 a*1e-320
a+0j a*1j a.astype(str) a.astype('S8') a>0 np.full_like(a,nan) np.full_like(a,inf)
np.zeros_like(a) np.full_like(a,1e308) np.full_like(a,-1e154) a.real.astype(np.int8)
a.real.astype(np.uint64) a.real.astype(np.float16) np.abs(a) set(np.ravel(a).tolist())
dict(enumerate(a)) iter(np.ravel(a)) str(a) a.tobytes() ragged(a) put(a,{k},nan) put(a,{k},inf)
put(a,{k},-inf) put(a,{k},1e200) put(a,{k},1e308) put(a,{k},0) put(a,{k},1e-310) put(a,{k},1e20)
put(a,{k},None) put(a,{k},'text') put(a,{k},1j) put(a,{k},Decimal('0.5')) put(a,{k},2**70)
put(a,{k},10**400) put(a,{k},Fraction(1,3)) put(a,{k},np.ma.masked) put(a,{k},b'x')
put(a,{k},[1.0]) put(a,{k},True) masked(a,{k}) np.ma.masked_all_like(a) np.where(a>=0,a,nan)
row(a,{k},nan) row(a,{k},0) row(a,{k},1e308) put(row(a,{k},nan),{k},1.0) a.astype('f8,f8')
""")

EQUAL = _words("""
a.tolist() tuple(a.tolist()) np.asfortranarray(a) a.astype(a.dtype.newbyteorder('>'))
a.astype(object) read_only(a) strided(a) Framed(a) Arraylike(a) np.array(a,ndmin=1) np.ma.array(a)
list(a) subclass(a) a.astype(np.result_type(a,np.longdouble))
""")


class Framed:
    """Values in the manner of a data frame: there is `to_numpy`."""

    def __init__(self, values: Any) -> None:
        self.values = values

    def to_numpy(self) -> Any:
        """Return the values."""
        return np.asarray(self.values)


class Arraylike:
    """Values in the manner of an array of another library: there is `__array__`."""

    def __init__(self, values: Any) -> None:
        self.values = values

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.asarray(self.values, dtype=dtype)


class _Subclass(np.ndarray[Any, Any]):
    """A subclass of ndarray, as units of measurement have it."""


def nested(depth: int) -> list[Any]:
    """Return a number in nested lists."""
    value: list[Any] = [1.0]
    for _ in range(depth - 1):
        value = [value]
    return value


def cyclic() -> list[Any]:
    """Return a list that contains itself."""
    value: list[Any] = [1.0]
    value.append(value)
    return value


def generated() -> Iterator[float]:
    """Return a generator of numbers."""
    return (i * 1.0 for i in range(3))


def ragged(a: Any) -> list[Any]:
    """Return the values in rows of different lengths."""
    flat = np.ravel(a).tolist()
    return [flat, flat[:-1]]


def put(a: Any, k: int, value: Any) -> Any:
    """Return a copy with one other entry; of objects where the entry is no number of its type."""
    fits = (
        isinstance(value, float | int)
        and abs(value) <= float(np.finfo(np.float64).max)
        and np.ndim(a)
    )
    copy = np.array(a) if fits else np.array(a, dtype=object, ndmin=1)
    flat = copy.reshape(-1)
    if flat.size:
        flat[k % flat.size] = value
    return copy if fits else copy.tolist()


def row(a: Any, k: int, value: float) -> Any:
    """Return a copy with one entry of the last axis set throughout."""
    copy = np.array(a, ndmin=1)
    if copy.size:
        copy[..., k % copy.shape[-1]] = value
    return copy


def masked(a: Any, k: int) -> Any:
    """Return the values with one of them masked."""
    a = np.array(a, ndmin=1)
    mask = np.arange(a.size).reshape(a.shape) == k % max(a.size, 1)
    return np.ma.array(np.where(mask, 99.0, a), mask=mask)


def read_only(a: Any) -> Any:
    """Return a copy that may not be written to."""
    copy = np.array(a)
    copy.setflags(write=False)
    return copy


def strided(a: Any) -> Any:
    """Return the values with gaps between them in memory."""
    return np.repeat(np.array(a, ndmin=1), 2, axis=-1)[..., ::2]


def subclass(a: Any) -> Any:
    """Return the values as a subclass of ndarray."""
    return np.array(a).view(_Subclass)


SPACE: dict[str, Any] = {
    **{name: value for name, value in globals().items() if not name.startswith("_")},
    "Decimal": Decimal,
    "Fraction": Fraction,
    "Path": Path,
    "nan": np.nan,
    "inf": np.inf,
    "datetime": datetime,
}


def value_of(expression: str, a: Any = None) -> Any:
    """Return what an expression of this module stands for; `a` is the valid value.

    Where the valid value has no such variation (a text has no transpose), it stands for 'text'.
    """
    try:
        valid = np.asarray(a)
    except ValueError:
        valid = np.array([np.asarray(each) for each in a], dtype=object)
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return eval(expression, SPACE, {"a": valid})
    except (TypeError, ValueError, AttributeError, IndexError, OverflowError):
        return "text"


def _one(rng: np.random.Generator, expressions: Sequence[str]) -> str:
    chosen = expressions[int(rng.integers(len(expressions)))]
    return chosen.replace("{k}", str(rng.integers(9)))


def whatever(rng: np.random.Generator) -> str:
    """Draw the expression of any value at all."""
    return _one(rng, SCALARS if rng.random() < 0.5 else THINGS)


def scalar(rng: np.random.Generator) -> str:
    """Draw the expression of a scalar; now and then of something else."""
    return _one(rng, SCALARS if rng.random() < 0.8 else THINGS)


def changed(rng: np.random.Generator) -> str:
    """Draw the expression of a variation of `a`; now and then of something else."""
    return _one(rng, VARIATIONS) if rng.random() < 0.75 else whatever(rng)


def same(rng: np.random.Generator) -> str:
    """Draw the expression of another form of `a`."""
    return _one(rng, EQUAL)


def malformed(rng: np.random.Generator, valid: Any) -> str:
    """Draw an expression in place of a valid value: a variation where it is an array."""
    is_array = isinstance(valid, np.ndarray | list | tuple) and len(valid) > 0
    return changed(rng) if is_array else scalar(rng)


def all_expressions() -> Iterator[str]:
    """Iterate over all expressions."""
    for expression in (*SCALARS, *THINGS, *VARIATIONS, *EQUAL):
        yield expression.replace("{k}", "1")
