"""Words for the numbers in messages, also for those that the table does not know."""

from collections.abc import Sequence


def word(words: Sequence[str], number: int) -> str:
    """The word for `number`; a number that another version of the firmware may use is shown as it is."""
    return words[number] if number < len(words) else f"unknown ({number})"
