"""Everything that `import bifa` and `import lacuna` offer is typed, so that users can type-check their own code."""

import subprocess
import sys
from pathlib import Path

import bifa
import lacuna

HOST = Path(__file__).resolve().parent.parent


def test_every_name_at_the_front_doors_has_a_type(tmp_path):
    script = tmp_path / "theirs.py"
    names = [*(f"bifa.{name}" for name in bifa.__all__), *(f"lacuna.{name}" for name in lacuna.__all__)]
    answers = ["bifa.Robot().diagnose(bifa.load_dataset(''))", "bifa.Robot().optimize().gait"]
    asked = "".join(f"reveal_type({name})\n" for name in (*names, *answers))
    script.write_text(f"import bifa\nimport lacuna\n\n{asked}", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", str(script)], cwd=HOST, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    revealed = [line for line in done.stdout.splitlines() if "Revealed type" in line]
    assert len(revealed) == len(names) + len(answers)
    assert not [line for line in revealed if line.endswith('"Any"')]


def test_both_packages_say_that_they_have_types():
    for package in (bifa, lacuna):
        assert (Path(package.__file__).parent / "py.typed").is_file()
