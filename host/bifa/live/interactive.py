"""The interactive console: prompt with history and completion, telemetry and link in the status lines."""

import os
from pathlib import Path

from prompt_toolkit import PromptSession
from prompt_toolkit.application import Application, get_app
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.patch_stdout import patch_stdout

from bifa.link import Uno
from bifa.live.completion import LineCompleter
from bifa.live.conversation import Conversation
from bifa.ranges import CHAMBERS
from bifa.rig import Rig

STATE_STYLES = {"running": "bg:ansigreen", "holding": "bg:ansiyellow", "stopped": "bg:ansired", "fault": "bg:ansired"}


_WIDE = 80


def status_lines(conversation: Conversation, columns: int = _WIDE) -> StyleAndTextTuples:
    """Return two lines, one for the robot and one for the link; shorter below 80 columns."""
    sample, link = conversation.latest.sample, conversation.uno.counters.text()
    if sample is None:
        return [("", " no telemetry yet\n"), ("", f" link: {link}")]
    is_wide = columns >= _WIDE
    chambers = "  ".join(
        f"{name} {pressure:+6.2f} {connected:8}" if is_wide else f"{name} {pressure:+5.1f} {connected[:3]:3}"
        for name, pressure, connected in zip(CHAMBERS, sample.pressure_psi, sample.connected, strict=True)
    )
    return [
        (STATE_STYLES.get(sample.state, ""), f" {sample.state:7} "),
        ("", f" psi: {chambers}\n" if is_wide else f" {chambers}\n"),
        ("", f" link: {link}  {conversation.latest.warning}"),
    ]


def _history() -> History:
    """Return the history of earlier consoles, or of this one alone if no file can be kept."""
    try:
        folder = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "bifa"
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / "console-history").open("a+b"):
            return FileHistory(str(folder / "console-history"))
    except (OSError, RuntimeError) as error:  # RuntimeError: no home directory
        print(f"history is not kept: {error}")
        return InMemoryHistory()


def _keys(conversation: Conversation) -> KeyBindings:
    """Bind keys to their usual actions: the prompt reads the terminal raw, so that none of them sends a signal."""
    keys = KeyBindings()

    @keys.add("!")
    def _(event: KeyPressEvent) -> None:
        conversation.stop()

    @keys.add("c-z")
    def _(event: KeyPressEvent) -> None:
        conversation.stop()
        event.app.suspend_to_background()  # by the signal, so that the program ends when resumed

    @keys.add("c-c")  # also during a search of the history
    @keys.add("c-\\")
    def _(event: KeyPressEvent) -> None:
        conversation.stop()
        event.app.exit(exception=KeyboardInterrupt(), style="class:aborting")

    return keys


def _prompt(conversation: Conversation) -> PromptSession[str]:
    session: PromptSession[str] = PromptSession(
        "uno> ",
        history=_history(),
        completer=LineCompleter(conversation.known),
        complete_while_typing=True,
        key_bindings=_keys(conversation),
        bottom_toolbar=lambda: status_lines(conversation, get_app().output.get_size().columns),
        refresh_interval=0.2,
    )

    def exit_when_ended(app: Application[str]) -> None:
        if conversation.ended.is_set() and app.future is not None and not app.future.done():
            app.exit(exception=EOFError())

    session.app.after_render += exit_when_ended
    return session


def converse(uno: Uno, rig: Rig) -> None:
    """Prompt until Ctrl-D, Ctrl-C, Ctrl-Z or Ctrl-\\; raises the error that ended the link, if any."""
    print("type help; Tab completes; ! stops at once; Ctrl-D leaves, all valves off")
    conversation = Conversation(uno, rig)
    try:
        session = _prompt(conversation)
        with patch_stdout():
            try:
                while True:
                    conversation.type(session.prompt())
            except EOFError:
                conversation.leave()
    except KeyboardInterrupt:
        pass
    finally:
        conversation.abandon()
    if conversation.error is not None:
        raise conversation.error
