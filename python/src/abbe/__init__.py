"""Abbe: geometric errors of machine tools, robots and other serial chains.

A session is a machine, its tests and their readings:

- :class:`Machine`: a kinematic chain; :class:`Session`: tests and readings, from files or from arrays;
- :class:`Fit`, :class:`Trace`, :class:`Plan`: results of a session; :class:`Model`: an identified machine, with
  :class:`Validation` and :class:`Compensated`; :class:`Equation`: a closed form; :func:`compare`: differences;
- :func:`analyse`: any analysis by the name of its command;
- :func:`import_readings`: foreign files of readings as a session;
- :class:`Table`, :class:`Figure`: what results show;
- :class:`Error` and its subclasses.

Lengths are in mm, angles in degrees, errors in µm and arcsec, unless a name states otherwise. The results are those of
the command ``abbe``: ``to_dict()`` returns its JSON.
"""

from ._abbe import __version__, set_threads, threads
from ._analyse import Analysis, analyse
from ._compare import Comparison, compare
from ._equation import Equation
from ._errors import EquationError, Error, IdentificationError, SessionError
from ._fit import ByTest, Fit
from ._import import Imported, import_readings
from ._machine import Machine
from ._model import Compensated, Model, ModelParameter, Validation
from ._plan import Plan
from ._predicting import SessionParameter
from ._session import Session
from ._shown import Figure, Figures, Table
from ._trace import Trace

__all__ = [
    "Analysis",
    "ByTest",
    "Comparison",
    "Compensated",
    "Equation",
    "EquationError",
    "Error",
    "Figure",
    "Figures",
    "Fit",
    "IdentificationError",
    "Imported",
    "Machine",
    "Model",
    "ModelParameter",
    "Plan",
    "Session",
    "SessionError",
    "SessionParameter",
    "Table",
    "Trace",
    "Validation",
    "__version__",
    "analyse",
    "compare",
    "import_readings",
    "set_threads",
    "threads",
]
