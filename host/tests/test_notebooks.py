"""The notebooks run unchanged, their closing assertions hold, and they are committed with their outputs."""

import re
from itertools import count

import pytest
from nbclient.exceptions import CellExecutionError

from harness.notebooks import EMPS, NAMES, NOTEBOOKS, read, run, shape

LARGEST = 400_000  # bytes, with pictures
by_name = pytest.mark.parametrize("name", NAMES)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["your-own-system", pytest.param("robot", marks=pytest.mark.uno), "emps"])
def test_a_notebook_runs_and_gives_what_it_is_kept_with(name, tmp_path):
    if name == "emps" and not EMPS.exists():
        pytest.skip("the EMPS benchmark's records are not beside the checkout")
    assert shape(run(name, tmp_path)) == shape(read(name)), "run `make notebooks`"


def test_every_notebook_is_run():
    assert {file.stem for file in NOTEBOOKS.glob("*.ipynb")} == set(NAMES)


@by_name
def test_it_is_kept_as_it_ran_once_from_top_to_bottom(name):
    cells = [cell for cell in read(name).cells if cell.cell_type == "code"]
    for number, cell in zip(count(1), cells, strict=False):
        assert cell.execution_count == number
        assert not [output for output in cell.outputs if output.output_type == "error"]
    pictures = [cell for cell in cells if "plot(" in cell.source]
    assert pictures
    assert all(any("image/png" in output.get("data", {}) for output in cell.outputs) for cell in pictures)


@by_name
def test_it_is_small_names_its_front_end_and_no_place_of_the_computer_that_it_ran_on(name):
    file = NOTEBOOKS / f"{name}.ipynb"
    assert file.stat().st_size < LARGEST
    assert "`jupyter lab docs/notebooks`" in read(name).cells[0].source
    assert not re.search(r"/(home|root|tmp|work|Users)/", file.read_text())


def test_the_robot_is_optimized_to_the_fastest_that_is_printed():
    """The optimized speed is the highest printed in the committed notebook; running it asserts the same."""
    text = (NOTEBOOKS / "robot.ipynb").read_text()
    speeds = [float(speed) for speed in re.findall(r"(\d+\.\d) mm/s", text)]
    (optimised,) = re.findall(r"(\d+\.\d) mm/s, [\d.]+ times as fast", text)
    assert len(speeds) > 1
    assert float(optimised) == max(speeds)


def test_without_its_records_the_emps_notebook_ends_with_a_sentence(tmp_path):
    with pytest.raises(CellExecutionError) as ended:
        run("emps", tmp_path, emps=tmp_path)
    (error,) = [
        output for cell in ended.value.notebook.cells for output in cell.get("outputs", []) if "ename" in output
    ]
    assert error.ename == "SystemExit"
    assert error.evalue.startswith(f"There is no DATA_EMPS.mat in {tmp_path}: get it from ")
    assert not any("File" in line for line in error.traceback), "no traceback"
