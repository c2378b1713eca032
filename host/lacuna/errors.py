"""The root of every error that the engine expects: its text says what is wrong and what to do."""


class LacunaError(Exception):
    """An error meant for the user: one sentence, to be shown without a traceback."""

    for_the_user = True
