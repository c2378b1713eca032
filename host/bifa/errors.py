"""The root of every error that bifa expects: its text says what is wrong and what to do."""


class BifaError(Exception):
    """Shown to the user as one sentence, without a traceback; exit status 2."""
