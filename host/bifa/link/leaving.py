"""Leaving: however a command ends, the robot stands still before the port closes.

Whoever talks to an Uno does so inside `with Uno(...)`, and that is all: its end stops the robot, repeats the stop
until the Uno says that no valve is on, and raises StillMovingError if it does not say so. Ctrl-C, Ctrl-\\, `kill` and a
closed terminal end what is inside like any exception, wherever it is; their stop leaves before anything else is tidied
up, and once a robot is being stopped nothing interrupts that. Ctrl-Z stops the robot before it suspends the program,
which ends when it is resumed. On Linux the end of the program that started this one, which by itself sends no signal
(SIGKILL of a script, for instance), ends it as well, but for `nohup`, which asks for the opposite.
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

from bifa.link.errors import NoAnswerError, RestartedError
from bifa.link.frames import Report
from bifa.link.session import Session
from bifa.link.table import STATES

Given = ParamSpec("Given")
Result = TypeVar("Result")

CONFIRMED_WITHIN_S = 5.0
FIRST_ATTEMPT_S = 0.25  # the next one waits twice as long: the computer may be slow rather than the cable bad
STANDING = (STATES.index("stopped"), STATES.index("fault"))


class Mover(Protocol):
    """What can be stopped from a signal handler."""

    def send_stop(self) -> None:
        """Send the stop, without waiting for anything."""


_inside: list[Mover] = []
_earlier_handlers: dict[int, Any] = {}
_earlier_hook: list[Callable[..., Any]] = []
_held: list[int] = []
_again: list[threading.Timer] = []
_parents: list[int] = []  # who started this program, while their death ends it
_whole: set[CodeType] = set()  # code of the functions that nothing interrupts
AGAIN_AFTER_S = 0.01
_SET_DEATH_SIGNAL, _GET_DEATH_SIGNAL = 1, 2  # PR_SET_PDEATHSIG, PR_GET_PDEATHSIG of prctl(2)
_DEATH: Any = getattr(signal, "SIGUSR2", None)  # a signal of its own: it also comes when the parent's thread alone ends


def enter(robot: Mover) -> None:
    """From now on, until `leave`, signals that end a program, or suspend it, stop `robot` at once and raise
    KeyboardInterrupt.

    What the program or `nohup` has decided otherwise is left alone, and so is everything in other threads than the main
    one, which get no signals.
    """
    if not _inside and threading.current_thread() is threading.main_thread():
        for name, act in _ACTS.items():
            number = getattr(signal, name, None)  # Windows has the first two, and SIGBREAK
            if number is not None and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                _earlier_handlers[number] = signal.signal(number, act)
        _earlier_hook.append(sys.unraisablehook)
        sys.unraisablehook = _end_again
        _watch_parent()
    _inside.append(robot)


def leave(robot: Mover) -> None:
    """`robot` has been stopped; signals mean again what they meant before."""
    _inside.remove(robot)
    if not _inside and threading.current_thread() is threading.main_thread():
        _watch_parent_no_more()
        while _earlier_handlers:
            signal.signal(*_earlier_handlers.popitem())
        sys.unraisablehook = _earlier_hook.pop()
        if _again:
            _cancel_again()
            _held.append(signal.SIGINT)


def uninterrupted(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Decorates what must come to its end: a signal meanwhile raises KeyboardInterrupt only after it. If that end is an
    error, it is raised from the KeyboardInterrupt, so that nobody tries again."""

    def whole(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        try:
            result = function(*args, **kwargs)
        except Exception as error:
            if not _held:
                raise
            _held.clear()
            raise error from KeyboardInterrupt()
        if _held:
            _held.clear()
            raise KeyboardInterrupt
        return result

    _whole.add(whole.__code__)
    return functools.update_wrapper(whole, function)


def _end(number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code in _whole:
            _held.append(number)
            return
        frame = frame.f_back
    _held.clear()
    _cancel_again()
    # First of all: what lies between here and the end of the command may take long, or write to a pipe that is full.
    _stop_all()
    raise KeyboardInterrupt


def _suspend(number: int, frame: FrameType | None) -> None:
    _stop_all()
    signal.raise_signal(signal.SIGSTOP)
    _end(number, frame)


def _stop_all() -> None:
    for robot in _inside:
        with contextlib.suppress(ConnectionError):
            robot.send_stop()


_ACTS = {"SIGINT": _end, "SIGTERM": _end, "SIGHUP": _end, "SIGQUIT": _end, "SIGBREAK": _end, "SIGTSTP": _suspend}


def _orphaned(number: int, frame: FrameType | None) -> None:
    if os.getppid() != _parents[-1]:  # else only the thread that started this program has ended
        _end(number, frame)


def _watch_parent() -> None:
    if sys.platform != "linux" or signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        return
    if death_signal() != 0 or signal.getsignal(_DEATH) is not signal.SIG_DFL:
        return
    _parents.append(os.getppid())
    signal.signal(_DEATH, _orphaned)
    _prctl(_SET_DEATH_SIGNAL, int(_DEATH))


def _watch_parent_no_more() -> None:
    if _parents:
        _prctl(_SET_DEATH_SIGNAL, 0)
        signal.signal(_DEATH, signal.SIG_DFL)
        _parents.pop()


def death_signal() -> int | None:
    """What the parent's death sends to this process now, 0: nothing; None where that cannot be chosen."""
    now = ctypes.c_int()
    return now.value if _prctl(_GET_DEATH_SIGNAL, ctypes.byref(now)) == 0 else None


def _prctl(option: int, value: Any) -> int:
    try:
        return ctypes.CDLL(None).prctl(option, value)
    except (OSError, AttributeError):  # a C library without it
        return -1


def _cancel_again() -> None:
    while _again:
        _again.pop().cancel()


def _end_again(lost: "sys.UnraisableHookArgs") -> None:
    """Python drops what is raised while it clears up (`__del__`, a generator's end): raise it once more."""
    if lost.exc_type is KeyboardInterrupt:
        _again.append(threading.Timer(AGAIN_AFTER_S, signal.raise_signal, [signal.SIGINT]))
        _again[-1].start()
    else:
        _earlier_hook[-1](lost)


def stop_until_confirmed(session: Session, ask: Callable[[float], Report]) -> None:
    """Send the stop until the status that `ask(timeout_s)` gets shows that no valve is on.

    Raises NoAnswerError after CONFIRMED_WITHIN_S, and a ConnectionError if the port is gone.
    """
    deadline, attempt_s = session.clock.now() + CONFIRMED_WITHIN_S, FIRST_ATTEMPT_S
    reason = NoAnswerError("the Uno acknowledged the stop but still reports open valves")
    while True:
        session.send_stop()
        try:
            status = ask(attempt_s)
            if status["state"] in STANDING and status["valves"] == 0:
                return
        except NoAnswerError as error:
            reason = error
        attempt_s = min(2 * attempt_s, deadline - session.clock.now())
        if attempt_s <= 0:
            raise reason


def stop_in_new_session(session: Session) -> None:
    """stop_until_confirmed() in a session of its own: it waits for nothing of an interrupted one, and resends
    nothing."""
    new = session.successor()

    def ask(attempt_s: float) -> Report:
        try:
            new.connect(attempt_s)
            return new.call("status", timeout_s=attempt_s)
        except RestartedError as error:  # it greets once more
            raise NoAnswerError(str(error)) from None

    stop_until_confirmed(new, ask)
