"""Analyses by their names."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ._shown import Shown

if TYPE_CHECKING:
    from ._model import Model
    from ._session import Session


class Analysis(Shown):
    """The result of an analysis: the JSON of its command, with its keys as attributes. :func:`analyse` makes it."""

    _called = "abbe.analyse"

    def __init__(self, name: str, *arguments: Any) -> None:
        self._analysis = name
        super().__init__(*arguments)

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self._analysis, *super().__reduce__()[1]))

    def __repr__(self) -> str:
        return f"<abbe.Analysis: {self._analysis}>"


def analyse(
    name: str,
    *inputs: Session | Model,
    seed: int = 1,
    progress: Callable[[str], object] | None = None,
    **options: Any,
) -> Analysis:
    """Run the analysis of a name, as the command with this name.

    Parameters
    ----------
    name : str
        The name, such as ``"validate"``.
    *inputs : Session or Model
        What is analysed, in the order of the arguments of the command.
    seed : int
        Seed of the random numbers.
    progress : callable, optional
        Called with words about the progress, such as ``print``.
    **options
        The options of the command by their long names, with ``_`` for ``-``.
    """
    return Analysis(name, inputs, options, seed, None, progress)
