"""TOML from untrusted sources: tomllib, guarded against input that would exhaust memory or the stack."""

import re
import tomllib
from typing import Any

MAX_KEY_PARTS = 100  # in a dotted key; tomllib's time and memory grow with the square of their number
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w\\-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_KEY_PARTS},}}+", re.ASCII)


def parse_toml(text: str) -> dict[str, Any]:
    """Parse the document in `text`, ignoring a leading byte order mark. Raises tomllib.TOMLDecodeError, whatever is
    wrong with it."""
    text = text.removeprefix("\ufeff")
    if long := _LONG_KEY.search(text):
        line = text.count("\n", 0, long.start()) + 1
        raise tomllib.TOMLDecodeError(f"A key of over {MAX_KEY_PARTS} parts (at line {line})")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise tomllib.TOMLDecodeError("Nested too deeply") from None
    except ValueError as error:  # an integer of over 4300 digits
        raise tomllib.TOMLDecodeError(str(error)) from None
