"""The virtual robot and the host's model share nothing but the contracts."""

import ast
import re
from pathlib import Path

import bifa
import virtual_robot

ROBOT = Path(virtual_robot.__file__).parent
HOST = Path(bifa.__file__).parent


def imports(file: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add((node.module or "").split(".")[0])
    return names


def code_lines(folder: Path, pattern: str) -> dict[str, str]:
    """Lines that compute something, without spaces and names of the language, mapped to where they stand."""
    lines = {}
    for file in folder.rglob(pattern):
        for line in file.read_text(errors="ignore").splitlines():
            text = re.sub(r"\s+", "", line.split("//")[0].split("#")[0]).rstrip(";")
            if len(text) >= 40 and re.search(r"[*/+-]", text) and not text.startswith(("import", "from", "def", '"')):
                lines[text] = f"{file.name}: {line.strip()}"
    return lines


def test_neither_imports_the_other():
    assert all("bifa" not in imports(file) for file in ROBOT.rglob("*.py"))
    assert all("virtual_robot" not in imports(file) for file in HOST.rglob("*.py"))
    assert all("bifa" not in file.read_text() for file in ROBOT.rglob("plant/src/*"))


def test_no_line_of_the_models_arithmetic_stands_in_both():
    host = {}
    for part in ("robot", "simulate", "effects"):
        host |= code_lines(HOST / part, "*.py")
    plant = code_lines(ROBOT / "plant", "*.c") | code_lines(ROBOT / "plant", "*.py")
    assert len(host) > 50
    assert len(plant) > 50
    shared = {where for text, where in plant.items() if text in host}
    assert not shared


def test_the_springs_are_tables_and_the_hosts_are_polynomials():
    assert "polynomial" not in (ROBOT / "plant" / "src" / "spring.c").read_text().lower()
    assert (ROBOT / "plant" / "curves" / "body.csv").read_text().count("\n") > 100
