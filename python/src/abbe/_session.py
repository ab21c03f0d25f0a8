"""Sessions: a machine, its tests and their readings."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from . import _abbe
from ._arguments import quantity, texts, whole_session
from ._equation import Equation
from ._fit import Fit
from ._machine import Machine
from ._plan import Plan
from ._predicting import Predicting
from ._trace import Trace


class Session(Predicting):
    """A machine, an instrument, tests and their readings.

    Parameters
    ----------
    machine : Machine, str, path-like or mapping
        The machine, or its structural code. The path of a session file, as for :meth:`read`, or a mapping with the
        keys of a session file, whose tests may have arrays, gives the whole session.
    instrument : str
        ``"ballbar"`` (the default), ``"r-test"``, ``"probe"``, ``"distance"``, ``"laser"``, ``"angle"``, ``"tracker"``,
        ``"pose"``, ``"socket"`` or ``"pointing"``.
    noise_um : float, optional
        Standard deviation of one scalar reading of a length; estimated from the readings by default.
    resolution_um : float, optional
        Resolution of a reading of a length.
    noise_arcsec : float, optional
        Standard deviation of one scalar reading of an angle; estimated from the readings by default.
    resolution_arcsec : float, optional
        Resolution of a reading of an angle.
    errors : sequence of str, optional
        The errors to estimate, as in ``[unknowns]`` of a session file; the defaults of the instrument otherwise.
    constants : mapping, optional
        Named lengths in mm that tests may use in texts, such as ``"H - Z"``.
    about : mapping, optional
        Notes that reports repeat.

    Examples
    --------
    A turn of the table with a ball bar, as readings of a machine whose C axis lies 12 µm beside its nominal place:

    >>> import numpy as np
    >>> import abbe
    >>> c = np.arange(0.0, 360.0)
    >>> x, y = 0.012 - 100 * np.sin(np.radians(c)), 100 * np.cos(np.radians(c))
    >>> machine = abbe.Machine.from_code("w C A b Y X Z t")
    >>> session = abbe.Session(machine, noise_um=0.1, errors=["EX0C", "EY0C"])
    >>> session.add_test("C125", c_deg=c, z_mm=75.0, length_mm=np.sqrt(x**2 + y**2 + 75**2),
    ...                  bar_mm=125, workpiece_ball_mm=(0, 100, 0), spindle_ball_mm=(0, 0, 0))
    >>> fit = session.fit()
    >>> round(fit["EX0C"].value, 3)
    12.0
    """

    def __init__(
        self,
        machine: Machine | str | os.PathLike[str] | Mapping[str, Any],
        instrument: str | None = None,
        *,
        noise_um: float | None = None,
        resolution_um: float | None = None,
        noise_arcsec: float | None = None,
        resolution_arcsec: float | None = None,
        errors: Sequence[str] | None = None,
        constants: Mapping[str, float] | None = None,
        about: Mapping[str, str] | None = None,
    ) -> None:
        figures = {
            "noise_um": noise_um,
            "resolution_um": resolution_um,
            "noise_arcsec": noise_arcsec,
            "resolution_arcsec": resolution_arcsec,
        }
        known = whole_session(machine, (instrument, *figures.values(), errors, constants, about))
        if known is not None:
            self._handle = known
            return
        instrument = "ballbar" if instrument is None else instrument
        stated = {"kind": instrument, **figures}
        head: dict[str, Any] = {"instrument": {key: value for key, value in stated.items() if value is not None}}
        if errors is not None:
            head["unknowns"] = {"errors": list(errors)}
        if constants is not None:
            head["constants"] = dict(constants)
        if about is not None:
            head["about"] = dict(about)
        self._handle = _abbe.Session.new(Machine(machine)._handle, head)

    @classmethod
    def _of(cls, handle: _abbe.Session) -> Session:
        session = cls.__new__(cls)
        session._handle = handle
        return session

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        *,
        data: str | os.PathLike[str] | None = None,
        allow_outside: bool = False,
    ) -> Session:
        """Read a session file, its machine and its data.

        Parameters
        ----------
        path : path-like
            The session file.
        data : path-like, optional
            Folder of the data files, if they do not lie beside the session file.
        allow_outside : bool
            Allow files outside the folder of the session and of `data`.

        Raises
        ------
        SessionError
            With file, line and column of what cannot be used.
        """
        return cls._of(_abbe.Session.read(path, data, allow_outside))

    def add_test(self, name: str, **keywords: Any) -> None:
        """Add a test with its readings, or a planned test.

        Parameters
        ----------
        name : str
            The name of the test.
        **keywords
            - Arrays are columns of readings with the names of data files: positions of axes (``c_deg``, ``x_mm``),
              ``run``, ``time_s``, ``temperature_c``, and the readings (``length_mm`` or ``deviation_um`` for a ball
              bar). An array of float64 without gaps is not copied on its way in.
            - A number for the position of an axis is where the test holds it: ``z_mm=111.803``.
            - Everything else is a key of ``[[test]]`` of a session file: ``bar_mm``, ``workpiece_ball_mm``, ``setup``,
              ``bar_u_um``, ``sweep``, ...
            - ``None`` states nothing.

            A reading of which a value is missing is left out, and ``warnings`` tells how many they are and where:
            masked items of NumPy, ``None``, ``pandas.NA``, nulls of polars and pyarrow, NaN in a Series of pandas. NaN
            in an array of NumPy or in a list is an error.

        Raises
        ------
        SessionError
            If an argument cannot be used; the session is unchanged.

        Examples
        --------
        A planned test, with the keys of a session file:

        >>> import abbe
        >>> session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3)
        >>> session.add_test("C125", bar_mm=125, workpiece_ball_mm=(0, 100, 0), spindle_ball_mm=(0, 0, 0), z_mm=75,
        ...                  sweep={"axis": "C", "from_deg": 0, "to_deg": 360, "step_deg": 1})
        >>> session.tests
        ('C125',)
        """
        self._handle.add_test(name, keywords)

    def add_effect(self, **keys: Any) -> None:
        """Declare an effect.

        Parameters
        ----------
        **keys
            The keys of ``[[effect]]``: ``component="EZC", driver="C", shape="harmonic", order=2``.
        """
        self._handle.add("effect", keys)

    def add_socket_distance(self, **keys: Any) -> None:
        """State the distance of two sockets.

        Parameters
        ----------
        **keys
            The keys of ``[[socket_distance]]``: ``between=("0", "1"), mm=50.0, u_um=100``.
        """
        self._handle.add("socket_distance", keys)

    @property
    def machine(self) -> Machine:
        """The machine."""
        return Machine._of(self._handle.machine)

    @property
    def instrument(self) -> str:
        """The instrument: ``"ballbar"``, ..."""
        return self._handle.instrument

    @property
    def noise_um(self) -> float | None:
        """Standard deviation of one scalar reading; ``None`` if it is estimated."""
        return self._handle.noise_um

    @property
    def errors(self) -> tuple[str, ...]:
        """The errors to estimate."""
        return tuple(self._handle.errors)

    @property
    def effects(self) -> tuple[str, ...]:
        """The declared effects: ``EZC~C:h2``."""
        return tuple(self._handle.effects)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the readings."""
        return tuple(self._handle.warnings)

    @property
    def tests(self) -> tuple[str, ...]:
        """The names of the tests."""
        return tuple(name for name, _, _ in self._handle.tests())

    def readings(self, test: str) -> dict[str, NDArray[Any]]:
        """Return the columns of a test.

        Parameters
        ----------
        test : str
            The test.

        Returns
        -------
        dict of str to ndarray
            Positions in mm and degrees, readings in mm, and the run, time and temperature if the test has them. It is
            empty for a test without readings.
        """
        return self._handle.columns(test)

    def simulate(
        self,
        values: Mapping[str, float | str] | None = None,
        *,
        seed: int = 1,
        noise_um: float | None = None,
        noise_arcsec: float | None = None,
        draw_setups: bool = False,
        hide_effects: bool = False,
    ) -> Session:
        """Simulate readings at the planned states of the tests.

        Parameters
        ----------
        values : mapping, optional
            True values of errors, set-up parameters and effects: numbers in the unit of the parameter, or texts with
            a unit such as ``"0.01deg"``. Everything else is zero.
        seed : int
            Seed of the noise.
        noise_um : float, optional
            Standard deviation of the noise of lengths; that of the session by default.
        noise_arcsec : float, optional
            Standard deviation of the noise of angles; that of the session by default.
        draw_setups : bool
            Draw the set-up parameters from their priors.
        hide_effects : bool
            Omit the declared effects from the session that is returned.

        Returns
        -------
        Session
            The session with the simulated readings.

        Examples
        --------
        >>> import abbe
        >>> session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.1, errors=["EX0C", "EY0C"])
        >>> session.add_test("C125", bar_mm=125, workpiece_ball_mm=(0, 100, 0), spindle_ball_mm=(0, 0, 0), z_mm=75,
        ...                  sweep={"axis": "C", "from_deg": 0, "to_deg": 360, "step_deg": 1})
        >>> fit = session.simulate({"EX0C": 10.0}, seed=1).fit()
        >>> abs(fit["EX0C"].value - 10.0) < 4 * fit["EX0C"].u
        True
        """
        given = [(name, *quantity(name, value)) for name, value in (values or {}).items()]
        return Session._of(self._handle.simulate(given, seed, noise_um, noise_arcsec, draw_setups, hide_effects)[0])

    def fit(self, *, seed: int = 1, allow_implausible: bool = False) -> Fit:
        """Estimate the parameters from the readings, as ``abbe fit``.

        Parameters
        ----------
        seed : int
            Seed of the folds of cross-validation.
        allow_implausible : bool
            Accept estimates that mean nothing, though another reading of the file explains them.
        """
        return Fit([self], {"allow_implausible": allow_implausible}, seed)

    def trace(
        self,
        *,
        progress: Callable[[str], object] | None = None,
        max_effects: int | None = None,
        only: Sequence[str] = (),
        exclude: Sequence[str] = (),
        time_limit: float | None = None,
        seed: int = 1,
        allow_implausible: bool = False,
    ) -> Trace:
        """Find the unmodelled effect behind the residual, as ``abbe trace``.

        Ctrl-C raises ``KeyboardInterrupt`` at once.

        Parameters
        ----------
        progress : callable, optional
            Called with words about the progress, such as ``print``.
        max_effects : int, optional
            Maximum number of effects.
        only : sequence of str
            Search only effects whose identifier contains one of these texts.
        exclude : sequence of str
            Do not search effects whose identifier contains one of these texts.
        time_limit : float, optional
            Seconds after which the trace ends with the effects found so far; its verdict is then ``incomplete``.
        seed : int
            Seed of the folds and the null distribution.
        allow_implausible : bool
            Accept estimates that mean nothing, though another reading of the file explains them.
        """
        options = {
            "allow_implausible": allow_implausible,
            "max_effects": max_effects,
            "only": texts("only", only),
            "exclude": texts("exclude", exclude),
            "time_limit": time_limit,
        }
        return Trace([self], options, seed, progress=progress)

    def plan(self, *, noise_um: float | None = None, planned: bool = False, effects: bool = True) -> Plan:
        """Analyse identifiability and predicted uncertainty of the tests, as ``abbe plan``.

        Parameters
        ----------
        noise_um : float, optional
            Standard deviation of a reading, instead of the session's.
        planned : bool
            Use the planned movements even if there are readings.
        effects : bool
            Screen undeclared effects.
        """
        return Plan([self], {"noise_um": noise_um, "planned": planned, "no_effects": not effects})

    def equation(
        self,
        test: str,
        *,
        order: str = "exact",
        rotation: str | None = None,
        errors: Sequence[str] | None = None,
        notation: str = "literature",
        symbols: Sequence[str] | None = None,
    ) -> Equation:
        """Return the closed form of the readings of a test, as ``abbe equation``.

        Parameters
        ----------
        test : str
            The test.
        order : str
            ``"exact"``, ``"bilinear"`` or ``"first"``: the order in the errors.
        rotation : str, optional
            ``"exact"`` or ``"small-angle"``; as the machine states by default.
        errors : sequence of str, optional
            The parameters in the equation; those of the session by default.
        notation : str
            ``"literature"`` (``e_x0c``) or ``"iso"`` (``EX0C``).
        symbols : sequence of str, optional
            The axes that stay symbols where the test holds them. By default none in code, otherwise the rotary axes
            that are held at an angle that is no multiple of 90°.
        """
        return Equation(self._handle, test, order, rotation, errors, notation, symbols)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write the session as files that the command reads.

        Parameters
        ----------
        folder : path-like
            A new folder. It appears whole or not at all.

        Returns
        -------
        pathlib.Path
            The session file in it.
        """
        folder = Path(folder)
        if folder.exists():
            raise FileExistsError(f"{folder}: exists; name a new folder")
        files = self._handle.files()
        temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
        for name, contents in files:
            (temporary / name).parent.mkdir(parents=True, exist_ok=True)
            (temporary / name).write_bytes(contents)
        temporary.chmod(0o755)
        temporary.rename(folder)
        return folder / "session.toml"

    def to_toml(self) -> str:
        """Return the text of the session file."""
        return self._handle.text

    def __iter__(self) -> Iterator[str]:
        return iter(self.tests)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_unpickled, (_abbe.pickled(self._handle),))

    def __repr__(self) -> str:
        return f"<abbe.Session of {self.machine.name!r} with {self.instrument}: {', '.join(self.tests) or 'no tests'}>"


def _unpickled(state: dict[str, Any]) -> Session:
    return Session._of(_abbe.unpickled(state))
