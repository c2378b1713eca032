"""The stack bound is computed from the image: frames, calls, and calls through pointers."""

import pytest

from benchmarks import bench_uno, parts, stack_bound

pytestmark = pytest.mark.uno

LISTING = """
00000100 <leaf>:
     100:\t08 95       \tret

00000110 <pushes>:
     110:\tcf 93       \tpush\tr28
     112:\tdf 93       \tpush\tr29
     114:\tcd b7       \tin\tr28, 0x3d\t; 61
     116:\tde b7       \tin\tr29, 0x3e\t; 62
     118:\t2c 97       \tsbiw\tr28, 0x0c\t; 12
     11a:\tf2 df       \trcall\t.-28     \t; 0x100 <leaf>
     11c:\t08 95       \tret

00000120 <common>:
     120:\ta0 e0       \tldi\tr26, 0x20\t; 32
     122:\tb0 e0       \tldi\tr27, 0x01\t; 1
     124:\t0c 94 71 30 \tjmp\t0x60e2\t; 0x60e2 <__prologue_saves__+0x1c>
     128:\t00 d0       \trcall\t.+0      \t; 0x12a <common+0xa>
     12a:\t0e 94 88 00 \tcall\t0x110\t; 0x110 <pushes>
"""


def test_frames_are_pushes_locals_and_what_the_common_prologue_saves_and_the_deepest_chain_adds_return_addresses():
    found = stack_bound.functions(LISTING)
    assert found["leaf"].frame == 0
    assert found["pushes"].frame == 2 + 12
    assert found["common"].frame == (18 - 14) + 0x120 + 2
    depth, chain = stack_bound.deepest(found, "common")
    assert depth == found["common"].frame + 2 + 14 + 2
    assert [link.split()[0] for link in chain] == ["common", "pushes", "leaf"]


def test_recursion_and_a_pointer_of_which_nothing_is_known_are_errors():
    recursive = stack_bound.functions(LISTING.replace("<leaf>", "<pushes>").replace("0x100", "0x110"))
    with pytest.raises(ValueError, match="calls itself"):
        stack_bound.deepest(recursive, "common")
    found = stack_bound.functions(LISTING.replace("ret\n\n00000110", "icall\n\n00000110"))
    with pytest.raises(ValueError, match="leaf calls through a pointer"):
        stack_bound.with_pointers(found)


def test_stack_of_the_image_cannot_meet_its_data():
    most, _ = stack_bound.bound()
    assert most > 300
    _, ram = bench_uno.image_sizes()
    assert stack_bound.RAM_BYTES - ram - most >= bench_uno.STACK_FREE_LIMIT


def test_image_keeps_its_budgets_and_its_parts_are_all_of_it():
    flash, ram = bench_uno.image_sizes()
    more_flash, more_ram = bench_uno.beyond_the_stand_in()
    assert flash <= bench_uno.FLASH_LIMIT
    assert ram <= bench_uno.RAM_LIMIT
    costs = parts.costs()
    assert sum(in_flash for in_flash, _ in costs.values()) == flash - more_flash
    assert sum(in_ram for _, in_ram in costs.values()) == ram - more_ram
    assert costs[parts.REST][0] < 1000, "bytes that no symbol claims"
