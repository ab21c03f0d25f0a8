"""A JSON object as a Python object."""

from __future__ import annotations

import copy
import difflib
import keyword
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

_HEAD = ("schema_version", "tool_version", "command", "session", "inputs", "seed", "options")
"""The keys of a document before its result."""

_OURS = {
    "chi2": "chi_square",
    "chisq": "chi_square",
    "chisqr": "chi_square",
    "cov": "covariance",
    "dof": "degrees_of_freedom",
    "nfree": "degrees_of_freedom",
    "params": "parameters",
    "popt": "parameters",
    "pcov": "covariance",
    "resid": "residuals",
    "rms": "rms_um",
    "std": "u",
    "stderr": "u",
    "summary": "print(result)",
    "to_csv": "table.to_csv()",
    "to_dataframe": "table.to_pandas()",
    "to_html": "report(path)",
    "to_json": "to_dict",
    "to_pandas": "table.to_pandas()",
    "uncertainty": "u",
}
"""What other packages call it, and what it is called here."""


class Record:
    """A JSON object with its keys as attributes.

    Lists are tuples, and objects are records. A key that the object omits has its default: ``None``, or no items. A key
    that is a keyword of Python has an underscore at its end.
    """

    _nested: ClassVar[dict[str, type[Record]]] = {}
    """The class of each key that holds an object or a list of objects."""
    _array: ClassVar[str | None] = None
    """The key that holds the matrix of the object."""

    _source: Mapping[str, Any]

    def __init__(self, source: Mapping[str, Any]) -> None:
        self.__dict__["_source"] = source
        # A whole document has a head before the result.
        head = _HEAD if "schema_version" in source else ()
        for name, value in source.items():
            if name in head:
                continue
            self.__dict__[name + "_" * keyword.iskeyword(name)] = _wrapped(value, self._nested.get(name))

    def __setattr__(self, name: str, value: object) -> None:
        if name.startswith("_"):
            self.__dict__[name] = value
        else:
            raise AttributeError(f"`{name}` cannot be set: results do not change")

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            message = f"{type(self).__name__!r} has no attribute {name!r}"
            if not name.startswith("_"):
                own = [known for known in dir(self) if not known.startswith("_")]
                ours = _OURS.get(name, "")
                if re.split(r"[.(]", ours)[0] in [*own, "print"]:
                    message += f"; use {ours}"
                elif alike := difflib.get_close_matches(name, own, 3):
                    message += f"; alike: {', '.join(alike)}"
            raise AttributeError(message)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object as a dict.

        Returns
        -------
        dict
            A copy of the object, as the command writes it.
        """
        return copy.deepcopy(dict(self._source))

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and isinstance(other, Record) and self._source == other._source

    def __hash__(self) -> int:
        return hash(repr(self._source))

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (dict(self._source),))

    def __repr__(self) -> str:
        items = ", ".join(f"{name}={_short(value)}" for name, value in self._source.items())
        return f"{type(self).__name__}({items})"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[np.float64]:
        if self._array is None:
            raise TypeError(f"{type(self).__name__} is no matrix")
        return np.array(self._source[self._array], dtype=dtype or np.float64)


def _wrapped(value: Any, of: type[Record] | None) -> Any:
    if isinstance(value, list):
        return tuple(_wrapped(item, of) for item in value)
    if isinstance(value, dict) and of is not None:
        return of(value)
    return value


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
