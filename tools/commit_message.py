"""Check a commit message: python tools/commit_message.py FILE, called by git as a commit-msg hook."""

import re
import sys
from pathlib import Path

LONGEST = 72
_FORM = re.compile(r"[\w./+, -]+: \S")
_BY_GIT = ("Merge ", 'Revert "', "fixup! ", "squash! ")


def main() -> int:
    """Print what is wrong with the message, if anything; return the exit status."""
    wrong = fault_of(Path(sys.argv[1]).read_text("utf-8"))
    if wrong:
        print(f"commit message: {wrong}", file=sys.stderr)
    return 1 if wrong else 0


def fault_of(message: str) -> str | None:
    """What is wrong with the message, or None."""
    lines = [line for line in message.splitlines() if not line.startswith("#")]
    subject = lines[0] if lines else ""
    if subject.startswith(_BY_GIT):
        return None
    if not _FORM.match(subject):
        return f"the subject must have the form `module: what and why`, not {subject!r}"
    if len(subject) > LONGEST:
        return f"the subject has {len(subject)} characters; keep it to {LONGEST} and put the rest in the body"
    if len(lines) > 1 and lines[1].strip():
        return "the second line must be empty"
    return None


if __name__ == "__main__":
    sys.exit(main())
