"""Values that their owner marks as missing: masks of NumPy, `None`, `pandas.NA`, nulls of polars and pyarrow.

NaN is missing only where nothing else can say so: in a Series of pandas. Elsewhere NaN is a number that is not one,
which no session accepts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def separated(values: Any) -> tuple[Any, list[bool] | None]:
    """The values of a column, and which of them are missing: ``None`` if none is. A missing value gets any number."""
    if type(values) is np.ndarray and values.dtype != object:
        return values, None
    if isinstance(values, np.ma.MaskedArray):
        plain, missing = np.ma.getdata(values), np.ma.getmaskarray(values)
    else:
        marks = next((name for name in ("is_null", "isna") if callable(getattr(values, name, None))), None)
        if marks is not None:
            missing = np.asarray(getattr(values, marks)(), dtype=bool)
            plain = np.asarray(values)
        else:
            plain = _array(values)
            missing = np.zeros(plain.shape, dtype=bool)
    if plain.dtype == object and plain.ndim == 1:
        missing = missing | np.fromiter(map(_is_mark, plain), dtype=bool, count=plain.size)
    if not missing.any():
        return values, None
    return _filled(plain, missing), missing.ravel().tolist()


def absent(values: Any, name: str) -> None:
    """Refuse missing values where there is no reading that could be left out."""
    missing = separated(values)[1] if np.ndim(values) else None
    if missing is not None:
        from ._errors import SessionError

        count = f"{sum(missing)} of {len(missing)} values are missing"
        raise SessionError(f"`{name}`: {count}, the first in item {missing.index(True)}", help="leave them out")


def _array(values: Any) -> NDArray[Any]:
    """An array, in which marks stay what they are."""
    if isinstance(values, (list, tuple)) and any(map(_is_mark, values)):
        array = np.empty(len(values), dtype=object)
        array[:] = values
        return array
    return np.asarray(values)


def _is_mark(value: Any) -> bool:
    return value is None or value is np.ma.masked or type(value).__name__ in ("NAType", "NaTType")


def _filled(plain: NDArray[Any], missing: NDArray[np.bool_]) -> NDArray[Any]:
    """The array with some other value of it in place of each missing one."""
    present = plain[~missing]
    if plain.dtype != object:
        filled = plain.copy()
        filled[missing] = present[0] if present.size else np.zeros(1, dtype=plain.dtype)[0]
        return filled
    other = present[0] if present.size else 0.0
    return np.asarray([other if mark else value for value, mark in zip(plain, missing, strict=True)])
