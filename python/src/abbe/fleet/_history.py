"""The machines of a fleet over time."""

from __future__ import annotations

import json
from typing import Any

from .. import _abbe
from ._work import Path


def history(
    out: Path,
    *,
    machine: str | None = None,
    false_discovery_rate: float = 0.05,
    tolerance_u: float = 4.0,
    compensations: Path | None = None,
) -> dict[str, Any]:
    """Return the parameters of every machine over time, as ``abbe fleet history``.

    Parameters
    ----------
    out : path-like
        The folder of :func:`run`.
    machine : str, optional
        Identifier of one machine; all machines by default.
    false_discovery_rate : float
        Rate of false claims among all claimed changes, over all parameters of all machines.
    tolerance_u : float
        Change of a parameter, in its standard uncertainties, before which the next check is due.
    compensations : path-like, optional
        CSV file of known compensations: ``machine_id``, ``date``, ``parameter``, ``change``, ``unit``.

    Returns
    -------
    dict
        The keys of ``abbe schema history``. Days count from 1970-01-01 UTC.
    """
    if not 0 < false_discovery_rate < 1 or not tolerance_u > 0:
        raise ValueError("false_discovery_rate lies between 0 and 1, tolerance_u is positive")
    found: dict[str, Any] = json.loads(
        _abbe.fleet_history(out, machine, false_discovery_rate, tolerance_u, compensations)
    )
    return found
