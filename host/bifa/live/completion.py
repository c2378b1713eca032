"""Completion of console lines, with a description of each word: a parameter's meaning, range and value."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document

from bifa.link.table import CHAMBER_STATES, CONSOLE_COMMANDS, PARAMETERS
from bifa.link.units import BY_NAME, range_text
from bifa.ranges import CHAMBERS

ON_OFF = {"on": "", "off": ""}
SECOND = {
    "stream": ON_OFF,
    "plot": ON_OFF,
    "echo": ON_OFF,
    "hold": dict.fromkeys(CHAMBERS, ""),
    "defaults": {"confirm": "erases everything saved"},
    "zero": {"confirm": "take the present pressures as zero", "factory": "undo that"},
}


@dataclass
class Known:
    """What the Uno last reported about itself; presets: True for saved ones, False for factory ones."""

    parameters: Mapping[str, float] = field(default_factory=dict)
    presets: Mapping[str, bool] = field(default_factory=dict)


def words_after(words: list[str], known: Known) -> dict[str, str]:
    """Return the words that may follow the complete words of a line, each with its description."""
    now = {name: f", now {value:.10g}" for name, value in known.parameters.items()}
    parameters = {p.name: f"{range_text(p)}{now.get(p.name, '')}; {p.help}" for p in PARAMETERS}
    commands = {name: text for name, _, text in CONSOLE_COMMANDS}
    presets = {name: "saved" if is_saved else "factory" for name, is_saved in known.presets.items()}
    match words:
        case []:
            return commands
        case ["help"]:
            return commands | parameters
        case ["show" | "set"]:
            return parameters
        case ["set", name] if name in known.parameters:
            return {f"{known.parameters[name]:.10g}": f"now; {range_text(BY_NAME[name])}"}
        case ["load"]:
            return presets
        case ["save" | "forget"]:
            return {name: "saved" for name, is_saved in known.presets.items() if is_saved}
        case ["hold", chamber] if chamber in CHAMBERS:
            return dict.fromkeys(CHAMBER_STATES, "")
        case [command]:
            return SECOND.get(command, {})
        case _:
            return {}


class LineCompleter(Completer):
    """words_after() for prompt_toolkit."""

    def __init__(self, known: Known) -> None:
        self._known = known

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterator[Completion]:
        """See Completer."""
        before = document.text_before_cursor
        words = before.split()
        prefix = "" if not words or before.endswith(" ") else words.pop()
        for word, meta in words_after(words, self._known).items():
            if word.startswith(prefix):
                yield Completion(word, start_position=-len(prefix), display_meta=meta)
