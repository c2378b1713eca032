"""docs/architecture.md names every room, from the top down, as the layers contract has them."""

import re
import tomllib

from harness.native import ROOT


def test_the_rooms_of_the_page_are_those_of_the_contract_in_their_order():
    contracts = tomllib.loads((ROOT / "host/pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["containers"] == ["bifa"])
    page = (ROOT / "docs/architecture.md").read_text("utf-8").split("## Rooms")[1].split("Beside it")[0]
    rows = [cells.split("|") for cells in page.splitlines() if cells.startswith("| ")][1:]
    named = [re.findall(r"`(\w+)`", cells[2 if cells[1].strip() == "single files" else 1]) for cells in rows]
    held = [name for layer in layers for name in layer.split(" | ")]
    assert [name for names in named for name in names] == held
    folders = {path.parent.name for path in (ROOT / "host/bifa").glob("*/__init__.py")}
    assert folders <= set(held)
