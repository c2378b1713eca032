"""Generate lib/constants/constants.h."""

from cpp_parameters import C_TYPE, NOTICE, constant
from tables import Constant


def header(constants: tuple[Constant, ...]) -> str:
    lines = "\n".join(f"const {C_TYPE[c.wire]} {_name(c)} = {c.value};  ///< {c.help}" for c in constants)
    return f"""{NOTICE}#pragma once

#include <stdint.h>

namespace bifa {{

{lines}

}}  // namespace bifa
"""


def _name(given: Constant) -> str:
    """Return the C++ name with its unit, such as `kDeadTime_ms`."""
    return "_".join(part for part in (constant(given.name), given.unit) if part)
