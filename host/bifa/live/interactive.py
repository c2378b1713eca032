"""The interactive console: prompt with history and completion, telemetry and link in the status lines."""

import os
from pathlib import Path

from prompt_toolkit import PromptSession
from prompt_toolkit.history import FileHistory
from prompt_toolkit.key_binding import KeyBindings
from prompt_toolkit.patch_stdout import patch_stdout

from bifa.link import Uno
from bifa.link.table import CHAMBERS
from bifa.live.completion import LineCompleter
from bifa.live.conversation import Conversation

STATE_STYLES = {"running": "bg:ansigreen", "holding": "bg:ansiyellow", "stopped": "bg:ansired", "fault": "bg:ansired"}


def status_lines(conversation: Conversation) -> list[tuple[str, str]]:
    """Two lines, in 80 columns: the robot; the link."""
    sample, link = conversation.latest.sample, conversation.uno.counters.text()
    if sample is None:
        return [("", " no telemetry yet\n"), ("", f" link: {link}")]
    chambers = "  ".join(
        f"{name} {pressure:+6.2f} {connected:8}"
        for name, pressure, connected in zip(CHAMBERS, sample.pressure_psi, sample.connected, strict=True)
    )
    return [
        (STATE_STYLES.get(sample.state, ""), f" {sample.state:7} "),
        ("", f" psi: {chambers}\n"),
        ("", f" link: {link}  {conversation.latest.warning}"),
    ]


def _history() -> FileHistory:
    folder = Path(os.environ.get("XDG_STATE_HOME", Path.home() / ".local/state")) / "bifa"
    folder.mkdir(parents=True, exist_ok=True)
    return FileHistory(str(folder / "console-history"))


def _prompt(conversation: Conversation) -> PromptSession:
    keys = KeyBindings()

    @keys.add("!")
    def _(event) -> None:
        conversation.stop()

    session = PromptSession(
        "uno> ",
        history=_history(),
        completer=LineCompleter(conversation.known),
        complete_while_typing=True,
        key_bindings=keys,
        bottom_toolbar=lambda: status_lines(conversation),
        refresh_interval=0.2,
    )

    def leave_with_the_link(app) -> None:
        if conversation.ended.is_set() and app.future is not None and not app.future.done():
            app.exit(exception=EOFError())

    session.app.after_render += leave_with_the_link
    return session


def converse(uno: Uno, rig) -> None:
    """Prompt until Ctrl-D or Ctrl-C; raises what ended the link, if something did."""
    print("type help; Tab completes; ! stops at once; Ctrl-D leaves, all valves off")
    conversation = Conversation(uno, rig)
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
