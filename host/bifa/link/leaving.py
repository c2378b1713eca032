"""Leaving: however a command ends, the robot is stopped before the port closes.

All code that talks to an Uno runs inside `with Uno(...)`. The end of that block stops the robot, repeats the stop
until the Uno reports that no valve is on, and raises StillMovingError if that report does not come. Ctrl-C, Ctrl-\\,
`kill` and a closed terminal end the block like an exception, wherever it is; the stop is sent before any clean-up, and
nothing interrupts a stop under way. Ctrl-Z stops the robot, then suspends the program, which ends when it is resumed.
On Linux, the end of the parent process, which by itself sends no signal (SIGKILL of a script, for instance), ends the
program as well, unless it runs under `nohup`.
"""

import contextlib
import ctypes
import functools
import os
import signal
import sys
import threading
from collections.abc import Callable
from types import CodeType, FrameType
from typing import Any, ParamSpec, Protocol, TypeVar

from bifa.link.errors import NoAnswerError, RestartedError, StillMovingError
from bifa.link.frames import Report
from bifa.link.session import Session
from bifa.link.table import STATES

Given = ParamSpec("Given")
Result = TypeVar("Result")

CONFIRMED_WITHIN_S = 5.0
FIRST_ATTEMPT_S = 0.25  # doubled at each further attempt: the computer may be slow rather than the cable bad
STOPPED_STATES = (STATES.index("stopped"), STATES.index("fault"))


class Mover(Protocol):
    """A robot that can be stopped from a signal handler."""

    def send_stop(self) -> None:
        """Send the stop, without waiting for anything."""


_active_robots: list[Mover] = []
_earlier_handlers: dict[int, Any] = {}
_earlier_hook: list[Callable[..., Any]] = []
_deferred_signals: list[int] = []
_retry_timers: list[threading.Timer] = []
_parents: list[int] = []  # the parent's process id, while its death ends this program
_uninterruptible: set[CodeType] = set()  # code of the functions that must not be interrupted
AGAIN_AFTER_S = 0.01
OFF, UNCONNECTED = "valves off", "no robot was connected"
UNANSWERED = "a stop was sent, but no Uno had answered yet"
UNCONFIRMED = "a stop was sent, but the Uno did not confirm it"
_valves = [UNCONNECTED]
_SET_DEATH_SIGNAL, _GET_DEATH_SIGNAL = 1, 2  # PR_SET_PDEATHSIG, PR_GET_PDEATHSIG of prctl(2)
_DEATH: Any = getattr(signal, "SIGUSR2", None)  # a separate signal: it also comes if only a thread of the parent ends


def enter(robot: Mover) -> None:
    """From now on, until `leave`, signals that end or suspend a program stop `robot` at once and raise
    KeyboardInterrupt.

    Signals that the program or `nohup` already handles differently are left alone. Outside the main thread, the only
    one that receives signals, no handlers are installed.
    """
    is_first = not _active_robots and threading.current_thread() is threading.main_thread()
    if is_first:
        for name, handler in _HANDLERS.items():
            number = getattr(signal, name, None)  # Windows has the first two, and SIGBREAK
            if number is not None and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                _earlier_handlers[number] = signal.signal(number, handler)
        _earlier_hook.append(sys.unraisablehook)
        sys.unraisablehook = _retry_interrupt
    _active_robots.append(robot)
    note_valves(UNCONFIRMED)
    if is_first:
        _watch_parent()


def leave(robot: Mover) -> None:
    """Restore the earlier signal handlers; `robot` has been stopped."""
    _active_robots.remove(robot)
    if not _active_robots and threading.current_thread() is threading.main_thread():
        if _parents:
            _prctl(_SET_DEATH_SIGNAL, 0)
            signal.signal(_DEATH, signal.SIG_DFL)
            _parents.pop()
        while _earlier_handlers:
            signal.signal(*_earlier_handlers.popitem())
        sys.unraisablehook = _earlier_hook.pop()
        if _retry_timers:
            _cancel_retries()
            _deferred_signals.append(signal.SIGINT)


def uninterrupted(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Decorate a function that must run to its end: a signal during it raises KeyboardInterrupt only afterwards. If it
    fails after such a signal, its error is raised from a KeyboardInterrupt, so that the caller does not retry."""

    def wrapper(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        try:
            result = function(*args, **kwargs)
        except Exception as error:
            if not _deferred_signals:
                raise
            _deferred_signals.clear()
            raise error from KeyboardInterrupt()
        if _deferred_signals:
            _deferred_signals.clear()
            raise KeyboardInterrupt
        return result

    _uninterruptible.add(wrapper.__code__)
    return functools.update_wrapper(wrapper, function)


def _end(number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code in _uninterruptible:
            _deferred_signals.append(number)
            return
        frame = frame.f_back
    _deferred_signals.clear()
    _cancel_retries()
    # Stop first: unwinding to the end of the command may take long, or block on a full pipe.
    _stop_all()
    raise KeyboardInterrupt


def _suspend(number: int, frame: FrameType | None) -> None:
    _stop_all()
    signal.raise_signal(signal.SIGSTOP)
    _end(number, frame)


def _stop_all() -> None:
    for robot in _active_robots:
        with contextlib.suppress(ConnectionError):
            robot.send_stop()


_HANDLERS = {"SIGINT": _end, "SIGTERM": _end, "SIGHUP": _end, "SIGQUIT": _end, "SIGBREAK": _end, "SIGTSTP": _suspend}


def _on_parent_death(number: int, frame: FrameType | None) -> None:
    if os.getppid() != _parents[-1]:  # otherwise only the parent's thread has ended
        _end(number, frame)


def _watch_parent() -> None:
    if sys.platform != "linux" or signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        return
    if death_signal() != 0 or signal.getsignal(_DEATH) is not signal.SIG_DFL:
        return
    _parents.append(os.getppid())
    signal.signal(_DEATH, _on_parent_death)
    _prctl(_SET_DEATH_SIGNAL, int(_DEATH))
    if os.getppid() != _parents[-1]:  # it died before it was watched
        signal.raise_signal(_DEATH)


def death_signal() -> int | None:
    """Signal that this process gets when its parent dies, 0 for none; None where the system has no such setting."""
    now = ctypes.c_int()
    return now.value if _prctl(_GET_DEATH_SIGNAL, ctypes.byref(now)) == 0 else None


def _prctl(option: int, value: Any) -> int:
    try:
        return ctypes.CDLL(None).prctl(option, value)
    except (OSError, AttributeError):  # a C library without it
        return -1


def _cancel_retries() -> None:
    while _retry_timers:
        _retry_timers.pop().cancel()


def _retry_interrupt(lost: "sys.UnraisableHookArgs") -> None:
    """Raise a KeyboardInterrupt again that Python dropped, as it does in clean-up (`__del__`, a generator's end)."""
    if lost.exc_type is KeyboardInterrupt:
        _retry_timers.append(threading.Timer(AGAIN_AFTER_S, _interrupt_main_thread))
        _retry_timers[-1].start()
    else:
        _earlier_hook[-1](lost)


def _interrupt_main_thread() -> None:
    if hasattr(signal, "pthread_kill"):  # wakes it if it is blocked, for example asleep
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


def raise_if_unconfirmed(last: BaseException) -> None:
    """Raise the StillMovingError that `last` replaced, if any: a Ctrl-C during the clean-up after an unconfirmed stop,
    or output that fails there, must not hide it. Whoever ends on a KeyboardInterrupt calls this first."""
    replaced = last.__context__
    while replaced is not None:
        if isinstance(replaced, StillMovingError):
            raise replaced from last
        replaced = replaced.__context__


def note_valves(known: str) -> None:
    """Note what is known of the valves as a robot is left; nothing but a confirmed stop is `OFF`."""
    _valves[0] = known


def valves() -> str:
    """Return what is known of the valves, in words."""
    return _valves[0]


def valves_at(interrupt: KeyboardInterrupt) -> str:
    """Return what is known of the valves, in words, when a command ends on `interrupt`. Raises the StillMovingError
    that `interrupt` replaced (raise_if_unconfirmed)."""
    raise_if_unconfirmed(interrupt)
    return valves()


def stop_until_confirmed(session: Session, ask: Callable[[float], Report]) -> Report:
    """Send the stop repeatedly until the status returned by `ask(timeout_s)` shows that no valve is on; return it.

    Raises NoAnswerError after CONFIRMED_WITHIN_S, and a ConnectionError if the port is gone.
    """
    deadline, attempt_s = session.clock.now() + CONFIRMED_WITHIN_S, FIRST_ATTEMPT_S
    reason = NoAnswerError("the Uno acknowledged the stop but still reports open valves")
    while True:
        session.send_stop()
        try:
            status = ask(attempt_s)
            if status["state"] in STOPPED_STATES and status["valves"] == 0:
                return status
        except NoAnswerError as error:
            reason = error
        attempt_s = min(2 * attempt_s, deadline - session.clock.now())
        if attempt_s <= 0:
            raise reason


def stop_in_new_session(session: Session) -> None:
    """Call stop_until_confirmed() in a new session, which neither awaits nor resends anything of an interrupted one."""
    new = session.successor()

    def ask(attempt_s: float) -> Report:
        try:
            new.connect(attempt_s)
            return new.call("status", timeout_s=attempt_s)
        except RestartedError as error:  # the Uno has greeted again
            raise NoAnswerError(str(error)) from None

    stop_until_confirmed(new, ask)
