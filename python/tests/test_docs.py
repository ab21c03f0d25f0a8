"""The examples of the docstrings, the notebooks and the reference."""

import doctest
import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import abbe

ROOT = Path(__file__).parent.parent
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


@pytest.mark.parametrize("name", [module.name for module in pkgutil.iter_modules(abbe.__path__)])
def test_examples_of_docstrings(name):
    module = importlib.import_module(f"abbe.{name}")
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL
    assert doctest.testmod(module, optionflags=flags).failed == 0


def test_public_items_have_docstrings():
    for name in abbe.__all__:
        if name != "__version__":
            assert getattr(abbe, name).__doc__, name


def test_the_reference_is_current():
    subprocess.run([sys.executable, ROOT / "tools" / "reference.py", "--check"], check=True)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks(notebook, tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    cells = nbformat.read(notebook, as_version=4)
    resources = {"metadata": {"path": str(notebook.parent)}}
    nbclient.NotebookClient(cells, timeout=120, kernel_name="python3", resources=resources).execute()
    outputs = [output for cell in cells.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in outputs), "no figure"


def test_notebooks_have_types(tmp_path):
    """The code of the notebooks passes mypy --strict."""
    for module in ("mypy", "nbformat"):
        pytest.importorskip(module)
    import nbformat

    for notebook in NOTEBOOKS:
        cells = nbformat.read(notebook, as_version=4).cells
        code = "\n".join(cell.source for cell in cells if cell.cell_type == "code")
        lines = [line for line in code.splitlines() if not line.startswith("%")]
        (tmp_path / f"{notebook.stem}.py").write_text("\n".join(lines))
    checked = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", *tmp_path.glob("*.py")]
    done = subprocess.run(checked, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout
