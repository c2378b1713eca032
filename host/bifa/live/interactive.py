"""The interactive console: prompt with history and completion, telemetry in the status line."""

import os
import threading
import time
from pathlib import Path

from prompt_toolkit import PromptSession
from prompt_toolkit.completion import Completer, Completion
from prompt_toolkit.history import FileHistory
from prompt_toolkit.key_binding import KeyBindings
from prompt_toolkit.patch_stdout import patch_stdout

from bifa.link import Sample, Uno, WallClock
from bifa.link.table import CHAMBER_STATES, CHAMBERS, CONSOLE_COMMANDS, PARAMETERS
from bifa.link.terminal import type_line
from bifa.link.uno import CLOCK_EVERY_S

POLL_S = 0.05
STATE_COLOURS = {"running": "ansigreen", "holding": "ansiyellow", "stopped": "ansired", "fault": "ansired"}


def words_after(words: list[str], presets: list[str]) -> list[str]:
    """What may come next in a line whose complete words are `words`."""
    commands = [name for name, _, _ in CONSOLE_COMMANDS]
    parameters = [parameter.name for parameter in PARAMETERS]
    if not words:
        return commands
    second = {
        "help": commands + parameters,
        "show": parameters,
        "set": parameters,
        "hold": list(CHAMBERS),
        "stream": ["on", "off"],
        "plot": ["on", "off"],
        "echo": ["on", "off"],
        "load": presets,
        "save": presets,
        "forget": presets,
        "defaults": ["confirm"],
        "zero": ["confirm", "factory"],
    }
    if len(words) == 1:
        return second.get(words[0], [])
    return list(CHAMBER_STATES) if len(words) == 2 and words[0] == "hold" else []


class _Completer(Completer):
    def __init__(self, conversation: "_Conversation") -> None:
        self._conversation = conversation

    def get_completions(self, document, complete_event):
        before = document.text_before_cursor
        words = before.split()
        begun = "" if not words or before.endswith(" ") else words.pop()
        for word in words_after(words, self._conversation.presets):
            if word.startswith(begun):
                yield Completion(word, start_position=-len(begun))


class _Conversation:
    """The Uno, shared between the prompt and the thread that keeps telemetry flowing."""

    def __init__(self, uno: Uno, rig) -> None:
        self.uno = uno
        self.rig = rig
        self.lock = threading.Lock()
        self.presets: list[str] = list(uno.presets())
        self.sample: Sample | None = None
        self.error: Exception | None = None
        self._ended = threading.Event()
        self._virtual = not isinstance(rig.clock, WallClock)

    def keep_going(self) -> None:
        """Until the end: take samples, print what the Uno says by itself; a virtual rig is kept to the wall clock."""
        while not self._ended.is_set():
            began_s = time.monotonic()
            try:
                with self.lock:
                    samples = self.uno.samples(POLL_S)
                    lines = list(self.uno.session.lines)
                    self.uno.session.lines.clear()
            except Exception as error:
                self.error = error
                return
            self.sample = samples[-1] if samples else self.sample
            if lines:
                print("\n".join(lines))
            spare_s = POLL_S - (time.monotonic() - began_s)
            time.sleep(spare_s if self._virtual and spare_s > 0 else 0.001)

    def end(self) -> None:
        self._ended.set()

    def type(self, line: str) -> list[str]:
        with self.lock:
            lines = type_line(self.uno, line, self.rig.clock)
            if line.split()[:1] in (["save"], ["forget"], ["defaults"]):
                self.presets = list(self.uno.presets())
        return lines

    def toolbar(self):
        sample, counters = self.sample, self.uno.counters
        if sample is None:
            return "no telemetry yet"
        chambers = "   ".join(
            f"{name} {pressure:+6.2f} psi {'+' if command == 1 else '-' if command == 0 else '.'}"
            for name, pressure, command in zip(CHAMBERS, sample.pressure_psi, sample.command, strict=True)
        )
        colour = STATE_COLOURS.get(sample.state, "ansiwhite")
        link = f"lost {counters.lost}  bad {counters.bad}  sent again {counters.resent}"
        return [(f"fg:{colour}", f" {sample.state} "), ("", f"  {chambers}   {link}")]


def _history() -> FileHistory:
    folder = Path(os.environ.get("XDG_STATE_HOME", Path.home() / ".local/state")) / "bifa"
    folder.mkdir(parents=True, exist_ok=True)
    return FileHistory(str(folder / "console-history"))


def converse(uno: Uno, rig) -> None:
    """Prompt until Ctrl-D; raises what ended the link, if something did."""
    uno.stream(True)
    conversation = _Conversation(uno, rig)
    keys = KeyBindings()

    @keys.add("!")
    def _(event) -> None:
        uno.stop()

    session = PromptSession(
        "uno> ",
        history=_history(),
        completer=_Completer(conversation),
        complete_while_typing=True,
        key_bindings=keys,
        bottom_toolbar=conversation.toolbar,
        refresh_interval=0.2,
    )
    print("type help; ! stops at once; Ctrl-D leaves, with all valves off")
    thread = threading.Thread(target=conversation.keep_going, daemon=True)
    thread.start()
    try:
        with patch_stdout():
            while conversation.error is None:
                try:
                    line = session.prompt()
                except KeyboardInterrupt:
                    continue
                except EOFError:
                    break
                print("\n".join(conversation.type(line)))
    finally:
        conversation.end()
        thread.join(timeout=2 * CLOCK_EVERY_S)
    if conversation.error is not None:
        raise conversation.error
