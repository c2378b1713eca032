"""The README's story is that of docs/demo.md, shortened."""

import re

from harness.native import ROOT


def printed(page: str) -> list[str]:
    return re.search(r"^```\n(verdict: .*?)^```", (ROOT / page).read_text("utf-8"), re.MULTILINE | re.DOTALL)[
        1
    ].splitlines()


def test_every_line_of_the_readmes_story_is_one_of_the_demos_in_its_order():
    rest = iter(printed("docs/demo.md"))
    assert [line for line in printed("README.md") if line not in rest] == []
