"""Text for the terminal: control characters from outside are shown instead of obeyed; and counted nouns."""


def printable(text: str, keep: str = "\n\t") -> str:
    """`text` with every character that is not printable, and is not in `keep`, as its escape: ESC as \\x1b.

    So neither an Uno, a file's name, a key nor a header can set a window's title, fill the clipboard or hide a line.
    """
    if text.isprintable():
        return text
    return "".join(c if c in keep or c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def counted(number: int, one: str) -> str:
    """`number` with its noun: 1 trial, 2 trials."""
    return f"{number} {one}{'' if number == 1 else 's'}"
