"""Generate the tables in docs/protocol.md, between the markers `<!-- table NAME -->` and `<!-- end -->`."""

import re

from tables import CommandTable, Message


def _messages(messages: list[Message], usages: dict[str, str | None]) -> str:
    lines = ["| number | name | kind | fields | console | meaning |", "|---|---|---|---|---|---|"]
    for m in messages:
        fields = ", ".join(f"{f.name}: {f.wire}{f'[{f.count}]' if f.count > 1 else ''}" for f in m.fields) or "-"
        usage = f"`{usages[m.name]}`".replace("|", "\\|") if usages.get(m.name) else "-"
        lines.append(f"| 0x{m.number:02X} | `{m.name}` | {m.kind} | {fields} | {usage} | {m.help} |")
    return "\n".join(lines)


def page(text: str, commands: CommandTable) -> str:
    """Return `text` with its tables regenerated. Raises ValueError unless it has exactly one place for each table."""
    usages = {c.name: c.usage for c in commands.commands}
    results = [f"| {i} | `{name}` | {words} |" for i, (name, words) in enumerate(commands.results)]
    tables = {
        "commands": _messages([c.message for c in commands.commands if c.message], usages),
        "reports": _messages(list(commands.reports), {}),
        "results": "\n".join(["| number | name | words |", "|---|---|---|", *results]),
        "words": "\n".join(
            f"- {name}: " + ", ".join(f"{i} {word}" for i, word in enumerate(words))
            for name, words in commands.words.items()
        ),
    }
    for name, table in tables.items():
        pattern = rf"(<!-- table {name} -->\n).*?(<!-- end -->)"
        text, count = re.subn(pattern, lambda m, table=table: f"{m[1]}{table}\n{m[2]}", text, flags=re.S)
        if count != 1:
            raise ValueError(f"docs/protocol.md: expected the markers of table {name} once, found them {count} times")
    return text
