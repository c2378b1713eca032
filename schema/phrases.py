"""Pack texts for the Uno's flash: a frequent phrase is replaced by one byte, 0x80 and up.

Packed texts are expanded in a single pass (lib/text/print.cpp), so phrases contain only plain characters.
"""

import re
from collections import Counter
from collections.abc import Sequence

from tables import CommandTable, ParameterTable

FIRST = 0x80
MOST = 0x100 - FIRST


def packed_texts(parameters: ParameterTable, commands: CommandTable) -> tuple[list[str], dict[str, str]]:
    """Return the phrases, and the packed form of each text that the Uno does nothing with but print: helps, results."""
    helps = [c.help for c in commands.commands if c.usage] + [p.help for p in parameters.parameters]
    texts = [*helps, *(text for _, text in commands.results)]
    phrases, packed = pack(texts)
    return phrases, dict(zip(texts, packed, strict=True))


def pack(texts: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the phrases in the order of their codes, and the texts with the phrases replaced by those codes.

    Greedy: each round takes the phrase that saves most (in a tie, the first alphabetically), until none saves a byte
    or all codes are in use. Raises ValueError for a text that is not printable ASCII.
    """
    for text in texts:
        if not (text.isascii() and text.isprintable()):
            raise ValueError(f"only plain ASCII can be packed: {text!r}")
    packed, phrases = list(texts), []
    while len(phrases) < MOST:
        saving, phrase = max(_savings(packed), key=lambda found: (found[0], [-ord(c) for c in found[1]]))
        if saving <= 0:
            break
        code = chr(FIRST + len(phrases))
        phrases.append(phrase)
        packed = [text.replace(phrase, code) for text in packed]
    return phrases, packed


def _savings(packed: list[str]) -> list[tuple[int, str]]:
    """Return the bytes each phrase would save: its length less 1 at every occurrence, minus its text and terminator."""
    plain = [run for text in packed for run in re.split(f"[{chr(FIRST)}-{chr(FIRST + MOST - 1)}]", text)]
    seen = Counter(run[i:end] for run in plain for i in range(len(run)) for end in range(i + 2, len(run) + 1))
    often = (phrase for phrase, count in seen.items() if count > 1)
    return [(sum(run.count(p) for run in plain) * (len(p) - 1) - len(p) - 1, p) for p in often] or [(0, "")]
