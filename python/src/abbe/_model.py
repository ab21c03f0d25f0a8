"""Identified models."""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _abbe
from ._errors import SessionError
from ._machine import Machine
from ._missing import absent
from ._shown import Shown, rows_of, write_whole
from .results import ValidationResult

if TYPE_CHECKING:
    from ._session import Session


class ModelParameter(NamedTuple):
    """A parameter of an identified model."""

    id: str
    """Identifier: ``EX0C``, ``EZC~C:h2.cos``."""
    value: float
    """Its value, in ``unit``."""
    u: float
    """Standard uncertainty, in ``unit``."""
    unit: str
    """Its unit."""
    held: bool
    """Whether it is held at nominal, since the readings do not separate it from other parameters."""


class Compensated(NamedTuple):
    """Corrected commands."""

    positions: NDArray[np.float64]
    """Positions to command: one column for each axis, mm or degrees."""
    states: tuple[str, ...]
    """What became of each command: ``corrected``, ``position-only``, ``near-singular``, ``beyond-travel``, ..."""
    remaining_um: NDArray[np.float64]
    """Distance of the tool point from its nominal place at the corrected command."""
    remaining_arcsec: NDArray[np.float64]
    """Angle of the tool from its nominal orientation at the corrected command."""


class Model:
    """An identified model: machine, errors with covariance, effects, noise and range.

    :meth:`Fit.model` and :meth:`Trace.model` make it.

    Parameters
    ----------
    path : path-like
        A file of ``--save``, as for :meth:`read`.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        if not isinstance(path, (str, os.PathLike)):
            raise TypeError(
                f"a model is read from a file of `abbe fit --save`, not made of {type(path).__name__}: "
                f"Model(\"model.json\"), session.fit().model() or session.trace().model()"
            )
        self._handle = _abbe.Model.read(path)

    @classmethod
    def _of(cls, handle: _abbe.Model) -> Model:
        model = cls.__new__(cls)
        model._handle = handle
        return model

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Model:
        """Read a file of ``--save``.

        Parameters
        ----------
        path : path-like
            The file.
        """
        return cls._of(_abbe.Model.read(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model as ``--save`` does.

        Parameters
        ----------
        path : path-like
            The file. It is replaced if it exists.
        """
        write_whole(path, self._handle.text())

    def to_dict(self) -> dict[str, Any]:
        """Return the model file as a dict."""
        model: dict[str, Any] = json.loads(self._handle.text())
        return model

    @property
    def machine(self) -> Machine:
        """The machine."""
        return Machine._of(self._handle.machine)

    @property
    def parameters(self) -> tuple[ModelParameter, ...]:
        """The parameters."""
        return tuple(ModelParameter(*row) for row in self._handle.parameters())

    def validate(self, session: Session) -> Validation:
        """Test the model on readings that it never saw, as ``abbe validate``.

        Parameters
        ----------
        session : Session
            A session of the same machine. Only its set-up is estimated.
        """
        return Validation((self, session), {})

    def export(
        self,
        format: str,
        path: str | os.PathLike[str] | None = None,
        *,
        tool_mm: tuple[float, float, float] | None = None,
        entries: str = "best",
        travel: Mapping[str, tuple[float, float]] | None = None,
        patch: str | os.PathLike[str] | None = None,
        tip: str | None = None,
        convention: str = "modified",
        dh: str | os.PathLike[str] | None = None,
        places: int | None = None,
        reference: Mapping[str, float] | None = None,
    ) -> str | dict[str, str]:
        """Return the calibrated machine for other programs and for controls, as ``abbe export``.

        Compensation tables are several files: a dictionary of their names and texts.

        Parameters
        ----------
        format : str
            ``"table"``, ``"urdf"``, ``"dh"``, ``"linuxcnc"``, ``"fanuc"``, ``"beckhoff"``, ``"linuxcnc-tables"``,
            ``"heidenhain-tables"`` or ``"beckhoff-tables"``.
        path : path-like, optional
            A file to write it to, which is replaced if it exists. With tables: a folder, which is made if it does not exist.
        tool_mm : tuple of three floats, optional
            The tool point in the tool frame, for ``"urdf"``, ``"dh"`` and controls; that of the instrument by default.
        entries : str, optional
            Which entries of ``"linuxcnc"`` and ``"fanuc"`` are written: ``"best"``, which leave the least volumetric error
            over the travel, or ``"plain"``, the displacements of the axis lines themselves.
        travel : mapping of axis to two floats, optional
            Travel of axes over which the error of the entries counts, mm or degrees; the measured range by default.
        patch : path-like, optional
            With ``"urdf"``: the URDF file of the robot, of which only the origins are changed.
        tip : str, optional
            The link at which the chain of `patch` ends; the end of the arm by default.
        convention : str
            With ``"dh"``: ``"standard"`` or ``"modified"``.
        dh : path-like, optional
            With ``"dh"``: the maker's table (CSV), near whose frames the calibrated ones lie.
        places : int, optional
            With tables: the number of places along the axis; 37 by default.
        reference : mapping of axis to float, optional
            With tables: the position of an axis at which the control has its zero, mm or degrees. There the entries are 0.
        """
        ranges = [(axis, (float(low), float(high))) for axis, (low, high) in (travel or {}).items()]
        zeros = [(axis, float(position)) for axis, position in (reference or {}).items()]
        found = self._handle.export(format, tool_mm, entries, ranges, patch, tip, convention, dh, places, zeros)
        files = {name: text.decode() for name, text in found if name is not None}
        if not files:
            text = found[0][1].decode()
            if path is not None:
                write_whole(path, text)
            return text
        if path is not None:
            folder = pathlib.Path(path)
            folder.mkdir(parents=True, exist_ok=True)
            for name, text in files.items():
                write_whole(folder / name, text)
        return files

    def compensate(
        self,
        positions: Mapping[str, ArrayLike] | ArrayLike,
        *,
        tool_mm: tuple[float, float, float] | None = None,
        time_s: ArrayLike | None = None,
        temperature_c: ArrayLike | None = None,
    ) -> Compensated:
        """Return commands that cancel the errors of the machine, as ``abbe compensate``.

        Parameters
        ----------
        positions : mapping or array
            Commanded positions: by name (``{"x_mm": ..., "c_deg": ...}``; other axes are at zero), or one column for
            each axis in the order of ``machine.axes``; mm and degrees.
        tool_mm : tuple of three floats, optional
            The tool point in the tool frame; that of the instrument by default.
        time_s, temperature_c : array, optional
            Time and temperature, if errors depend on them.
        """
        driven = _column(time_s, "time_s"), _column(temperature_c, "temperature_c")
        found = self._handle.correct(self._positions(positions), tool_mm, *driven)
        return Compensated(found[0], tuple(found[1]), found[2], found[3])

    def pose_errors(
        self,
        positions: Mapping[str, ArrayLike] | ArrayLike,
        *,
        tool_mm: tuple[float, float, float] | None = None,
        time_s: ArrayLike | None = None,
        temperature_c: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """Return the errors of the tool's pose in the table frame, as ``abbe compensate --inverse``.

        Parameters
        ----------
        positions, tool_mm, time_s, temperature_c
            As in :meth:`compensate`.

        Returns
        -------
        ndarray
            Six columns: displacements along X, Y, Z in µm, rotations about them in arcsec.
        """
        driven = _column(time_s, "time_s"), _column(temperature_c, "temperature_c")
        return self._handle.pose_errors(self._positions(positions), tool_mm, *driven)

    def _positions(self, positions: Mapping[str, ArrayLike] | ArrayLike) -> NDArray[np.float64]:
        if not isinstance(positions, Mapping):
            absent(positions, "positions")
            return np.atleast_2d(np.asarray(positions, dtype=np.float64))
        known = [name.lower() for name in self._handle.columns()]
        columns = [np.zeros(1) for _ in known]
        for name, values in positions.items():
            if name.lower() not in known:
                raise SessionError(f"no axis position `{name}`", help=f"known: {', '.join(known)}")
            absent(values, name)
            columns[known.index(name.lower())] = np.atleast_1d(np.asarray(values, dtype=np.float64))
        return np.stack(np.broadcast_arrays(*columns), axis=1)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_of_text, (self._handle.text(),))

    def __repr__(self) -> str:
        return f"<abbe.Model of {self.machine.name!r}: {len(self.parameters)} parameters>"


def _of_text(text: str) -> Model:
    return Model._of(_abbe.Model.from_text(text))


def _column(values: ArrayLike | None, name: str) -> NDArray[np.float64] | None:
    if values is None:
        return None
    absent(values, name)
    return np.asarray(values, dtype=np.float64)


class Validation(Shown, ValidationResult):
    """A validated model: the result of ``abbe validate``. :meth:`Model.validate` makes it."""

    _analysis = "validate"
    _called = "abbe.Model.validate"
    _inputs: tuple[Model, Session]

    def residuals(self, test: str) -> NDArray[np.float64]:
        """Return the residuals of the model.

        Parameters
        ----------
        test : str
            The test.

        Returns
        -------
        ndarray
            Observed less predicted in µm, one row for each reading.
        """
        coordinates = next((count for name, _, count in self._inputs[1]._handle.tests() if name == test), 1)
        residuals: NDArray[np.float64] = rows_of(self._handle.residuals_um(test), coordinates)
        return residuals

    def __repr__(self) -> str:
        return f"<abbe.Validation: {self.verdict}>"
