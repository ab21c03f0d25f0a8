"""The model of a session as a function of its parameters, for other solvers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _abbe
from ._errors import SessionError
from ._fit import Fit
from ._missing import absent


class SessionParameter(NamedTuple):
    """A parameter that a session estimates."""

    id: str
    """Identifier: ``EX0C``, ``bar[C150]``, ``EZC~C:h2.cos``."""
    unit: str
    """Its unit: ``um``, ``arcsec``, ..."""
    prior_u: float | None
    """Standard uncertainty of its prior about zero, in ``unit``; ``None`` without a prior."""


class Predicting:
    """The model of a session as a function of its parameters."""

    _handle: _abbe.Session

    @property
    def parameters(self) -> tuple[SessionParameter, ...]:
        """The parameters that a fit estimates, in the order of :meth:`predict` and :meth:`jacobian`."""
        return tuple(SessionParameter(*row) for row in self._handle.parameters())

    @property
    def observed(self) -> NDArray[np.float64]:
        """All readings in mm, in the order of :meth:`predict`."""
        return self._handle.observed()

    @property
    def slices(self) -> dict[str, slice]:
        """The items of each test in :meth:`predict`. Tests without readings have none."""
        slices: dict[str, slice] = {}
        start = 0
        for name, rows, coordinates in self._handle.tests():
            slices[name] = slice(start, start + rows * coordinates)
            start += rows * coordinates
        return slices

    def predict(self, parameters: Fit | Mapping[str, float] | ArrayLike | None = None) -> NDArray[np.float64]:
        """Return the readings of the model.

        Parameters
        ----------
        parameters : Fit, mapping or array, optional
            Values of the parameters in their units: of a fit of this session, by name (others are zero), or all of
            them in the order of ``parameters``. The nominal machine by default.

        Returns
        -------
        ndarray
            The readings in mm: test by test, row by row, coordinate by coordinate.
        """
        return self._handle.predict(self._values(parameters))

    def jacobian(self, parameters: Fit | Mapping[str, float] | ArrayLike | None = None) -> NDArray[np.float64]:
        """Return the derivatives of :meth:`predict`.

        Parameters
        ----------
        parameters : Fit, mapping or array, optional
            As in :meth:`predict`.

        Returns
        -------
        ndarray
            One row for each item of :meth:`predict`, one column for each of ``parameters``: mm per unit of the
            parameter.
        """
        return self._handle.jacobian(self._values(parameters))

    def _values(self, parameters: Fit | Mapping[str, float] | ArrayLike | None) -> NDArray[np.float64]:
        if isinstance(parameters, Fit):
            return parameters.solution
        if parameters is None:
            parameters = {}
        if isinstance(parameters, Mapping):
            ids = [parameter.id for parameter in self.parameters]
            values = np.zeros(len(ids))
            for name, value in parameters.items():
                if name not in ids:
                    raise SessionError(f"no parameter `{name}`", help=f"the session has {', '.join(ids)}")
                values[ids.index(name)] = value
            return values
        absent(parameters, "parameters")
        return np.ascontiguousarray(parameters, dtype=np.float64)
