"""Exceptions, with the text of the command."""

from __future__ import annotations


class Error(Exception):
    """An error of Abbe.

    Attributes
    ----------
    message : str
        What was found and what was expected.
    help : str or None
        What to do.
    """

    def __init__(self, message: str, *, help: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.help = help

    def __str__(self) -> str:
        return self.message if self.help is None else f"{self.message}\nhelp: {self.help}"


class SessionError(Error, ValueError):
    """A machine, a session, its readings or an argument that cannot be used.

    Attributes
    ----------
    file : str or None
        The file.
    line, column : int or None
        The place in the file, from 1.

    Examples
    --------
    >>> import abbe
    >>> abbe.Machine.from_code("w C b")
    Traceback (most recent call last):
        ...
    abbe.SessionError: structural code `w C b`: the code does not end with t, the tool; ...
    """

    def __init__(
        self,
        message: str,
        *,
        help: str | None = None,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        super().__init__(message, help=help)
        self.file = file
        self.line = line
        self.column = column

    def __reduce__(self) -> tuple[object, ...]:
        return (_session_error, (self.message, self.help, self.file, self.line, self.column))


class IdentificationError(Error, RuntimeError):
    """An identification that has no result, such as a fit that does not converge."""


class EquationError(Error, RuntimeError):
    """An equation that cannot be made or printed."""


def _session_error(
    message: str, help: str | None, file: str | None, line: int | None, column: int | None
) -> SessionError:
    return SessionError(message, help=help, file=file, line=line, column=column)


for _class in (Error, SessionError, IdentificationError, EquationError):
    _class.__module__ = "abbe"
