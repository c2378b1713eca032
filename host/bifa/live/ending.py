"""A closed terminal or a `kill` ends a command as cleanly as Ctrl-C does: with all valves off."""

import signal


def end_like_ctrl_c() -> None:
    """From now on SIGHUP (unless `nohup` asked to ignore it) and SIGTERM raise KeyboardInterrupt."""
    for name in ("SIGHUP", "SIGTERM"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)
