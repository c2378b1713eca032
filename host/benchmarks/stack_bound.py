"""An upper bound of the firmware's stack depth, from the image's instructions and call graph.

`python -m benchmarks.stack_bound` prints the deepest chain. Link-time optimisation merges functions across
files, after -fstack-usage has written its figures; so the frames are read from the final image.

The bound is the sum of the main program's deepest chain, the tick's (the only interrupt that allows others), the next
tick, which finds the first one running and returns, and the deepest of the other interrupts, which do not nest.
"""

import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.parts import FIRMWARE, sections

RAM_BYTES = 2048
RETURN_ADDRESS = 2
SAVED_BY_PROLOGUE = 18  # r2 to r17, r28, r29 by libgcc's common prologue; entered later, it saves fewer
TICK = "__vector_11"
LIBGCC = ("__prologue_saves__", "__epilogue_restores__", "__tablejump2__")

# Functions called through a pointer, by caller; a caller that is not listed is an error.
THROUGH_POINTERS = {
    "_ZN4bifa7Console11with_preset": ("_ZN4bifa8Commands4save", "_ZN4bifa8Commands4load", "_ZN4bifa8Commands6forget"),
    "__vector_24": ("_ZN7TwoWire16onReceiveService", "_ZN7TwoWire16onRequestService"),  # as a slave: never addressed
    "_ZN7TwoWire5write": ("_ZN7TwoWire5writeEh",),
    "_ZN7TwoWire": (),  # user callbacks; there are none
    "_ZN5Print": ("_ZN7TwoWire5write",),
    "main": ("_ZN7TwoWire5write",),  # the DAC's library
}


@dataclass
class Function:
    """One function of the image: its own bytes on the stack, and its callees."""

    name: str
    frame: int = 0
    calls: set[str] = field(default_factory=set)
    through_pointer: bool = False


def functions(listing: str) -> dict[str, Function]:
    """The functions of an `avr-objdump -d` listing."""
    found: dict[str, Function] = {}
    current = None
    before: list[str] = []
    for line in listing.splitlines():
        if head := re.fullmatch(r"[0-9a-f]+ <(.+)>:", line):
            current = found.setdefault(head[1], Function(head[1]))
            before = []
        elif current is not None and (code := re.match(r"\s+[0-9a-f]+:\t(?:[0-9a-f]{2} )+\s*\t(.*)", line)):
            _take(current, code[1].replace("\t", " "), before)
            before.append(code[1].replace("\t", " "))
    return found


def _take(function: Function, code: str, before: list[str]) -> None:
    word = code.split()[0]
    target = re.search(r"<(.+?)(?:\+0x([0-9a-f]+))?>", code)
    if word == "push":
        function.frame += 1
    elif word == "rcall" and ".+0 " in f"{code} ":
        function.frame += 2  # two bytes of room, not a call
    elif target and target[1] == "__prologue_saves__":
        function.frame += SAVED_BY_PROLOGUE - int(target[2] or "0", 16) // 2 + _room_for_prologue(before)
    elif word in ("icall", "eicall"):
        function.through_pointer = True
    elif word in ("call", "rcall", "jmp", "rjmp") and target and target[1] not in LIBGCC:
        if word.endswith("call") or target[1] != function.name:  # a jump may be a tail call
            function.calls.add(target[1])
    elif word in ("sbiw", "subi", "sbci") and "r2" in code and (room := _room(code, before)):
        function.frame += room


def _room(code: str, before: list[str]) -> int:
    """Bytes that an instruction subtracts from the stack pointer, copied into r28 and r29 just before."""
    number = int(re.search(r"0x([0-9a-f]+)", code, re.IGNORECASE)[1], 16)
    if before and before[-1].startswith("in r29, 0x3e") and code.startswith(("sbiw r28", "subi r28")):
        return number
    if len(before) > 1 and before[-2].startswith("in r29, 0x3e") and code.startswith("sbci r29"):
        return number << 8
    return 0


def _room_for_prologue(before: list[str]) -> int:
    """Bytes of locals that libgcc's common prologue reserves, passed in r26 and r27."""
    room = 0
    for register, shift in (("r26", 0), ("r27", 8)):
        value = next(code for code in reversed(before) if code.startswith(f"ldi {register},"))
        room += int(re.search(r"0x([0-9a-f]+)", value, re.IGNORECASE)[1], 16) << shift
    return room


def with_pointers(found: dict[str, Function]) -> None:
    """Add the calls through pointers (THROUGH_POINTERS); ValueError for a function that is not listed there."""
    for function in found.values():
        if not function.through_pointer:
            continue
        targets = next((to for name, to in THROUGH_POINTERS.items() if function.name.startswith(name)), None)
        if targets is None:
            raise ValueError(f"{function.name} calls through a pointer: add its targets to THROUGH_POINTERS")
        function.calls |= {name for name in found if name.startswith(targets or "-")}


def deepest(found: dict[str, Function], name: str, above: tuple[str, ...] = ()) -> tuple[int, list[str]]:
    """Deepest stack of a function and its callees, in bytes from its entry, and the chain of calls.

    ValueError if a function is recursive.
    """
    if name in above:
        raise ValueError(f"{name} calls itself through {', '.join(above)}")
    function = found[name]
    most, chain = 0, []
    for callee in function.calls & found.keys():
        depth, its_chain = deepest(found, callee, (*above, name))
        if depth + RETURN_ADDRESS > most:
            most, chain = depth + RETURN_ADDRESS, its_chain
    return function.frame + most, [f"{name} ({function.frame})", *chain]


def bound(firmware: Path = FIRMWARE) -> tuple[int, list[str]]:
    """The bound in bytes, and the chains that add up to it."""
    listing = subprocess.run(["avr-objdump", "-d", firmware], check=True, capture_output=True, text=True).stdout
    found = functions(listing)
    with_pointers(found)
    others = [name for name in found if name.startswith("__vector_") and name not in (TICK, "__vector_default")]
    parts = [
        deepest(found, "main"),
        deepest(found, TICK),
        (found[TICK].frame, ["the next tick"]),
        max(deepest(found, name) for name in others),
    ]
    return sum(depth + RETURN_ADDRESS for depth, _ in parts), [
        f"{depth:4}  {' > '.join(chain)}" for depth, chain in parts
    ]


def room() -> int:
    """Bytes that static data leaves for the stack."""
    _, data, bss = sections()
    return RAM_BYTES - data - bss


def main() -> int:
    """Print the bound and its chains; return 1 if the stack could reach the static data."""
    most, chains = bound()
    print(*chains, sep="\n")
    print(f"{most} bytes at most, of {room()}")
    return 0 if most <= room() else 1


if __name__ == "__main__":
    sys.exit(main())
