"""Generate the files derived from the tables in this folder; `--check` only reports whether they are up to date.

python schema/generate.py
"""

import sys
from pathlib import Path

import cpp_commands
import cpp_constants
import cpp_parameters
import doc_parameters
import doc_tables
import phrases
import py_ranges
import py_tables
import py_version
from tables import WIRE_BYTES, command_table, constants, parameter_table, table_hash

ROOT = Path(__file__).parent.parent


def generated() -> dict[Path, str]:
    """Return the text of every generated file, by path."""
    parameters = parameter_table()
    commands = command_table()
    set_size = sum(WIRE_BYTES[p.wire] for p in parameters.parameters)
    agreed = table_hash(parameters, commands)
    protocol = ROOT / "docs/protocol.md"
    common, packed = phrases.packed_texts(parameters, commands)
    return {
        protocol: doc_tables.page(protocol.read_text(), commands),
        ROOT / "docs/parameters.md": doc_parameters.page(parameters, commands),
        ROOT / "lib/parameters/parameter_table.h": cpp_parameters.header(parameters),
        ROOT / "lib/parameters/parameter_table.cpp": cpp_parameters.source(parameters, packed),
        ROOT / "lib/constants/constants.h": cpp_constants.header(constants()),
        ROOT / "lib/commands/command_table.h": cpp_commands.command_header(commands),
        ROOT / "lib/commands/command_table.cpp": cpp_commands.command_source(commands, packed),
        ROOT / "lib/text/phrase_table.cpp": cpp_commands.phrase_source(common),
        ROOT / "lib/link/message_table.h": cpp_commands.message_header(commands, set_size, agreed),
        ROOT / "lib/link/message_table.cpp": cpp_commands.message_source(commands, set_size),
        ROOT / "host/bifa/version.py": py_version.module(commands),
        ROOT / "host/lacuna/version.py": py_version.module(commands),
        ROOT / "host/virtual_robot/version.py": py_version.module(commands, py_version.GPL),
        ROOT / "host/bifa/ranges.py": py_ranges.module(parameters, commands, constants()),
        ROOT / "host/bifa/link/table.py": py_tables.module(parameters, commands, constants(), agreed),
    }


def main() -> int:
    stale = []
    for path, text in generated().items():
        if not path.exists() or path.read_text() != text:
            stale.append(path.relative_to(ROOT))
            if "--check" not in sys.argv:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
    if "--check" in sys.argv and stale:
        print("out of date:", *stale, "- run: python schema/generate.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
