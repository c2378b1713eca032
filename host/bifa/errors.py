"""The root of every error that bifa expects: its text says what is wrong and what to do."""

from bifa.printable import printable


class BifaError(Exception):
    """Shown to the user as one sentence, without a traceback; exit status 2. Its text is safe to show (printable)."""

    def __str__(self) -> str:
        return printable(super().__str__())
