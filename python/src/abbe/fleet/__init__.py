"""Many sessions of many machines: run them on Dask, keep the results as Parquet, follow the machines over time.

- :func:`run`: analyse sessions, on a local cluster or on any scheduler of Dask;
- :func:`analyse` and :func:`map_in_pandas`: the unit of work as a pure function, for other engines;
- :func:`write_dataset`: the results as a data set in Parquet; :data:`SCHEMAS`: its tables;
- :func:`history`: the parameters of every machine over time.

``pip install abbe[fleet]`` adds Dask, PyArrow and DuckDB.
"""

from ._dataset import SCHEMA_VERSION, SCHEMAS, Dataset, write_dataset
from ._history import history
from ._run import Failure, Run, run
from ._work import analyse, map_in_pandas

__all__ = [
    "SCHEMAS",
    "SCHEMA_VERSION",
    "Dataset",
    "Failure",
    "Run",
    "analyse",
    "history",
    "map_in_pandas",
    "run",
    "write_dataset",
]
