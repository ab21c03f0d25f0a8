"""Comparisons of sessions and models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ._fit import Fit
from ._model import Model
from ._shown import Shown
from ._trace import Trace
from .results import ComparisonResult

if TYPE_CHECKING:
    from ._session import Session


class Comparison(Shown, ComparisonResult):
    """Differences between sessions or models of one machine: the result of ``abbe compare``. :func:`compare` makes it."""

    _analysis = "compare"
    _called = "abbe.compare"

    def __repr__(self) -> str:
        significant = sum(pair.significant for pair in self.pairs)
        return f"<abbe.Comparison: {significant} significant differences>"


def compare(
    *inputs: Session | Fit | Trace | Model,
    names: Sequence[str] | None = None,
    significance: float = 0.05,
    shared: Sequence[str] | None = None,
    places: int = 5,
    seed: int = 1,
) -> Comparison:
    """State the differences between sessions or models of one machine, as ``abbe compare``.

    Parameters
    ----------
    *inputs : Session, Fit, Trace or Model
        What is compared with the first one. Sessions are fitted with the errors and effects that any of them declares;
        a fit and a trace stand for their models.
    names : sequence of str, optional
        Names of the inputs in the result; ``"1"``, ``"2"``, ... by default.
    significance : float, optional
        Probability of any false claim of a difference between two inputs.
    shared : sequence of str, optional
        Set-up quantities that were not mounted again: ``"bar"``, ``"workpiece_ball"``, ``"spindle_ball"``.
    places : int, optional
        Places along each axis at which the volumetric error is evaluated; 0 for none.
    seed : int, optional
        Seed of the folds of a fit.
    """
    if len(inputs) < 2:
        raise TypeError(f"compare() needs at least two inputs, {len(inputs)} given")
    labels = list(names) if names is not None else [str(number) for number in range(1, len(inputs) + 1)]
    if len(labels) != len(inputs):
        raise ValueError(f"{len(labels)} names for {len(inputs)} inputs")
    given = [item.model() if isinstance(item, (Fit, Trace)) else item for item in inputs]
    options = {"names": labels, "significance": significance, "shared": shared, "places": places}
    return Comparison(given, options, seed)
