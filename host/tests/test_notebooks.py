"""The notebooks run as they stand, and what they assert at their ends holds."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = ROOT / "docs" / "notebooks"
EMPS = ROOT.parent / "shared" / "data" / "emps"
LONGEST_S = 900  # a cell, on a machine that others load as well


@pytest.mark.parametrize("name", ["your-own-system", pytest.param("robot", marks=pytest.mark.uno), "emps"])
def test_notebook_runs(name, tmp_path, monkeypatch):
    if name == "emps" and not (EMPS / "DATA_EMPS.mat").exists():
        pytest.skip(f"the EMPS benchmark's records are not in {EMPS.relative_to(ROOT.parent)} beside the checkout")
    monkeypatch.setenv("EMPS_DATA", str(EMPS))
    for own in ("IPYTHONDIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR"):  # else in a home that one may not have
        monkeypatch.setenv(own, str(tmp_path / own))
    monkeypatch.setenv("PYTHONPATH", f"{ROOT / 'host'}:{ROOT / 'docs' / 'examples'}")
    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
    NotebookClient(notebook, timeout=LONGEST_S, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert all(cell.get("outputs") for cell in notebook.cells if "verdict.plot()" in cell.source)


def test_every_notebook_is_run():
    assert {file.stem for file in NOTEBOOKS.glob("*.ipynb")} == {"your-own-system", "robot", "emps"}


def test_notebooks_are_kept_without_outputs():
    for file in NOTEBOOKS.glob("*.ipynb"):
        assert not any(cell.get("outputs") for cell in nbformat.read(file, as_version=4).cells), file.name
