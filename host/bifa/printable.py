"""Text for the terminal: control characters from outside are shown rather than obeyed; also counted nouns."""


def printable(text: str, keep: str = "\n\t") -> str:
    """Return `text` with characters that are neither printable nor in `keep` replaced by their escapes: ESC by \\x1b.

    This prevents an Uno, a file name, a key or a header from setting the window's title, filling the clipboard or
    hiding a line.
    """
    if text.isprintable():
        return text
    return "".join(c if c in keep or c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def counted(number: int, one: str) -> str:
    """Return `number` with its noun: 1 trial, 2 trials."""
    return f"{number} {one}{'' if number == 1 else 's'}"
