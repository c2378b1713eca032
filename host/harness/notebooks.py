"""The notebooks of docs/: run them, and store them with their outputs (`make notebooks`)."""

import os
import re
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = ROOT / "docs" / "notebooks"
EMPS = ROOT.parent / "shared" / "data" / "emps"
NAMES = ("your-own-system", "robot", "emps")
LONGEST_S = 900  # for one cell, on a busy machine
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def read(name: str) -> nbformat.NotebookNode:
    return nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)


def run(name: str, folder: Path, emps: Path = EMPS) -> nbformat.NotebookNode:
    """Run the notebook in `folder` and return it with fresh outputs; `emps`: folder of the benchmark's records. Times
    and output on stderr (progress) are dropped. Raises CellExecutionError, whose attribute `notebook` has the outputs
    so far."""
    notebook = read(name)
    with _environment(folder, emps):
        try:
            NotebookClient(notebook, timeout=LONGEST_S, resources={"metadata": {"path": str(folder)}}).execute()
        except CellExecutionError as error:
            error.notebook = notebook
            raise
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for cell in notebook.cells:
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
    return notebook


def shape(notebook: nbformat.NotebookNode) -> list[tuple[str, list[str]]]:
    """What does not depend on the machine: sources, and the kind and first line of each output."""
    return [(cell.source, [_kind(output) for output in cell.get("outputs", [])]) for cell in notebook.cells]


def _kind(output: nbformat.NotebookNode) -> str:
    text = output.get("text", output.get("data", {}).get("text/plain", ""))
    first = _NUMBER.sub("#", text.partition("\n")[0])
    return f"{output.output_type} {sorted(output.get('data', ()))} {first}"


@contextmanager
def _environment(folder: Path, emps: Path):
    own = {name: str(folder / name) for name in ("IPYTHONDIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR")}
    paths = f"{ROOT / 'host'}{os.pathsep}{ROOT / 'docs' / 'examples'}"
    with mock.patch.dict(os.environ, own | {"EMPS_DATA": str(emps), "PYTHONPATH": paths}):
        yield


def main() -> None:
    """Run the named notebooks, or all of them, and write them with their outputs."""
    for name in sys.argv[1:] or NAMES:
        if name == "emps" and not EMPS.exists():
            print(f"{name}: not run: its records are not in {EMPS}")
            continue
        with tempfile.TemporaryDirectory() as folder:
            nbformat.write(run(name, Path(folder)), NOTEBOOKS / f"{name}.ipynb")
        print(f"{name}: {(NOTEBOOKS / f'{name}.ipynb').stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
