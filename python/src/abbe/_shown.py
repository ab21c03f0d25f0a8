"""Tables and figures of a result, and its report."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from . import _abbe
from ._errors import SessionError
from ._record import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ._model import Model
    from ._session import Session


class Table:
    """A table as the command prints it, with all digits of its numbers.

    A table goes to pandas, polars and Arrow: ``table.to_pandas()``, ``polars.DataFrame(table)``,
    ``pyarrow.table(table)``. The latter two need pyarrow.
    """

    def __init__(self, handle: _abbe.Table) -> None:
        self._handle = handle
        self._columns: dict[str, list[Any]] | None = None

    @property
    def title(self) -> str:
        """What the table shows."""
        return self._handle.title

    @property
    def columns(self) -> dict[str, list[Any]]:
        """The cells below each heading. A column has numbers, or texts if one of its cells is a text."""
        if self._columns is None:
            columns: dict[str, list[Any]] = {}
            for heading, cells in self._handle.columns():
                name = heading or "mark"
                while name in columns:
                    name += "_"
                mixed = len({isinstance(cell, str) for cell in cells}) > 1
                columns[name] = [str(cell) for cell in cells] if mixed else cells
            self._columns = columns
        return self._columns

    def to_pandas(self) -> Any:
        """Return the table as a pandas DataFrame. Needs pandas."""
        import pandas

        return pandas.DataFrame(self.columns)

    def to_csv(self) -> str:
        """Return the table as CSV, as the command writes it."""
        return self._handle.csv().decode()

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        import pyarrow

        return pyarrow.table(self.columns).__arrow_c_stream__(requested_schema)

    def __len__(self) -> int:
        return max((len(cells) for cells in self.columns.values()), default=0)

    def __str__(self) -> str:
        return self._handle.text()

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return self._handle.html()


class Figure:
    """A figure of a report: its drawing, and its data as a table.

    A notebook shows the drawing of the report. :meth:`plot` draws the data with matplotlib.
    """

    def __init__(self, handle: _abbe.Figure) -> None:
        self._handle = handle

    @property
    def name(self) -> str:
        """The name of its file in ``--plots``."""
        return self._handle.name

    @property
    def title(self) -> str:
        """Its title."""
        return self._handle.title

    @property
    def caption(self) -> str:
        """Its caption."""
        return self._handle.caption

    @property
    def table(self) -> Table:
        """The data: one row for each mark, the unit of a column in its heading."""
        return Table(self._handle.table())

    def svg(self) -> str:
        """Return the drawing of the report as SVG."""
        return self._handle.svg()

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the data with matplotlib.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; new axes by default.

        Returns
        -------
        matplotlib.axes.Axes
            The axes with the drawing.
        """
        import matplotlib.pyplot as plt

        if ax is None:
            ax = plt.subplots()[1]
        columns = self.table.columns
        names = list(columns)
        labels = [name for name in names if all(isinstance(cell, str) for cell in columns[name])]
        numbers = [name for name in names if name not in labels]
        ax.set_title(self.title, fontsize="medium")
        if self._handle.kind == "matrix":
            self._plot_matrix(ax, columns, names)
        elif self._handle.kind in ("values", "bars") or len(numbers) < 2:
            self._plot_rows(ax, columns, labels, numbers)
        else:
            x, y = numbers[:2]
            groups = list(zip(*(columns[name] for name in labels))) or [()] * len(columns[x])
            for group in dict.fromkeys(groups):
                rows = [row for row, other in enumerate(groups) if other == group]
                points = [(columns[x][row], columns[y][row]) for row in rows]
                label = ", ".join(word for word in group if word)
                ax.plot(*np.array(points, dtype=float).T, ".", markersize=2, label=label)
            ax.set_xlabel(x)
            ax.set_ylabel(y)
            if 1 < len(set(groups)) <= 12:
                ax.legend(fontsize="small")
        return ax

    @staticmethod
    def _plot_matrix(ax: Axes, columns: dict[str, list[Any]], names: list[str]) -> None:
        first, second, value = names[:3]
        ids = list(dict.fromkeys([*columns[first], *columns[second]]))
        matrix = np.full((len(ids), len(ids)), np.nan)
        for a, b, cell in zip(columns[first], columns[second], columns[value]):
            if not isinstance(cell, str):
                matrix[ids.index(a), ids.index(b)] = matrix[ids.index(b), ids.index(a)] = cell
        image = ax.imshow(matrix, vmin=-1, vmax=1, cmap="RdBu_r")
        ax.set_xticks(range(len(ids)), ids, rotation=90, fontsize="x-small")
        ax.set_yticks(range(len(ids)), ids, fontsize="x-small")
        ax.figure.colorbar(image, ax=ax, label=value)

    @staticmethod
    def _plot_rows(ax: Axes, columns: dict[str, list[Any]], labels: list[str], numbers: list[str]) -> None:
        if not numbers:
            ax.set_axis_off()
            return
        rows = [" ".join(cells) for cells in zip(*(columns[name] for name in labels))]
        places = np.arange(len(rows))
        ax.barh(places, columns[numbers[0]])
        ax.set_yticks(places, rows, fontsize="x-small")
        ax.invert_yaxis()
        ax.set_xlabel(numbers[0])

    def _repr_html_(self) -> str:
        return f"<figure>{self.svg()}<figcaption>{_escaped(self.title)}</figcaption></figure>"

    def __repr__(self) -> str:
        return f"Figure({self.name!r}, {self.title!r})"


class Figures(tuple[Figure, ...]):
    """Figures by number or by name."""

    def __getitem__(self, key: Any) -> Any:
        if not isinstance(key, str):
            return super().__getitem__(key)
        for figure in self:
            if figure.name == key:
                return figure
        raise KeyError(f"no figure {key!r}; the figures are {', '.join(figure.name for figure in self)}")


class Shown(Record):
    """The result of an analysis, which is shown as tables, figures and a report."""

    _analysis: str
    """The name of the command."""
    _called: ClassVar[str]
    """What was called in Python."""

    def __init__(
        self,
        inputs: Sequence[Session | Model],
        options: Mapping[str, Any],
        seed: int = 1,
        source: Mapping[str, Any] | None = None,
        progress: Callable[[str], object] | None = None,
    ) -> None:
        self._inputs, self._options, self._seed = tuple(inputs), options, seed
        self._known = self._analysed(progress) if source is None else None
        super().__init__(json.loads(self._handle.json()) if source is None else source)

    def _analysed(self, progress: Callable[[str], object] | None = None) -> _abbe.Analysis:
        for name, value in self._options.items():
            if isinstance(value, float) and not math.isfinite(value):
                raise SessionError(f"`{name}` is {value}", help="a finite number is expected")
        # Numbers of NumPy become those of Python.
        options = json.dumps(self._options, default=lambda value: value.tolist())
        handles = [given._handle for given in self._inputs]
        return _abbe.Analysis.run(self._analysis, handles, options, self._seed, progress)

    @property
    def _handle(self) -> _abbe.Analysis:
        # A result from another process is computed again when an array or a figure is needed: it is deterministic.
        if self._known is None:
            self._known = self._analysed()
        return self._known

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self._inputs, self._options, self._seed, dict(self._source)))

    @property
    def tables(self) -> tuple[Table, ...]:
        """The tables of the result."""
        return tuple(Table(table) for table in self._handle.tables())

    @property
    def table(self) -> Table:
        """The first table of the result."""
        return self.tables[0]

    @property
    def figures(self) -> Figures:
        """The figures of the report, by number or name."""
        return Figures(Figure(figure) for figure in self._handle.figures())

    def plot(self, name: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw a figure of the report with matplotlib.

        Parameters
        ----------
        name : str, optional
            The figure, as in ``figures``; the first by default.
        ax : matplotlib.axes.Axes, optional
            Where to draw; new axes by default.

        Returns
        -------
        matplotlib.axes.Axes
            The axes with the drawing.
        """
        figures = self.figures
        figure: Figure = figures[0 if name is None else name]
        return figure.plot(ax)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the report as one HTML file, as ``--report`` does.

        Parameters
        ----------
        path : path-like
            The file. It is replaced if it exists.
        """
        write_whole(path, self._handle.page(self._called))

    def __str__(self) -> str:
        return self._handle.shown()[0]

    def _repr_html_(self) -> str:
        return self._handle.shown()[1]


def write_whole(path: str | os.PathLike[str], contents: str | bytes) -> None:
    """Write a file whole or not at all."""
    path = Path(path)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with open(descriptor, "wb") as file:
            file.write(contents.encode() if isinstance(contents, str) else contents)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def rows_of(values: Any, coordinates: int) -> Any:
    """An array of one row for each reading: of one dimension for one coordinate, else of two."""
    return values if coordinates == 1 else values.reshape(-1, coordinates)
