# SPDX-License-Identifier: GPL-3.0-or-later
"""Symbol addresses of an AVR ELF image (ELF32, little-endian; System V ABI chapter 4)."""

import struct
from pathlib import Path

DATA_SPACE = 0x800000  # the GNU tools put data addresses here


def symbols(path: Path) -> dict[str, tuple[int, int]]:
    """Name -> (address, size) of every named symbol; data addresses are offset by 0x800000 from the chip's."""
    image = path.read_bytes()
    if image[:4] != b"\x7fELF" or image[4:6] != b"\x01\x01":
        raise ValueError(f"{path} is not a 32-bit little-endian ELF file")
    section_offset, *_, entry_size, count, _ = struct.unpack_from("<I I H H H H H H", image, 32)
    sections = [struct.unpack_from("<10I", image, section_offset + i * entry_size) for i in range(count)]
    table: dict[str, tuple[int, int]] = {}
    for _, kind, _, _, offset, size, link, *_ in sections:
        if kind != 2:  # SHT_SYMTAB
            continue
        names = sections[link][4]
        for at in range(offset, offset + size, 16):
            name_at, value, length = struct.unpack_from("<III", image, at)
            end = image.index(b"\0", names + name_at)
            name = image[names + name_at : end].decode()
            if name:
                table[name] = (value, length)
    return table
