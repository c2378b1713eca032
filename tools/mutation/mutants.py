"""The mutants of a C++ source: changed constants, comparisons, logic and arithmetic, and removed statements.

A mutant is one edit of one file. The sources are read as tokens, not as text: comments, strings, preprocessor lines and
template brackets are left alone. This relies on the project's formatting, with spaces around binary operators.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

TOKEN = re.compile(
    r"""
      (?P<skip> //[^\n]* | /\*.*?\*/ | ^[ \t]*\#(?:\\\n|[^\n])* | "(?:\\.|[^"\\])*" | '(?:\\.|[^'\\])*' )
    | (?P<number> \b(?:0[xX][0-9a-fA-F]+|[0-9]+)(?:[uUlL]*)\b )
    | (?P<word> [A-Za-z_]\w* )
    | (?P<operator> <<=|>>=|->|\+\+|--|&&|\|\||<=|>=|==|!=|\+=|-=|\|=|&=|\^=|::|[-+*/%<>=!&|^~?:;,.(){}\[\]] )
    """,
    re.VERBOSE | re.DOTALL | re.MULTILINE,
)

BINARY = {
    "<": ("<=", ">="),
    "<=": ("<", ">"),
    ">": (">=", "<="),
    ">=": (">", "<"),
    "==": ("!=",),
    "!=": ("==",),
    "&&": ("||",),
    "||": ("&&",),
    "+": ("-",),
    "-": ("+",),
    "*": ("/",),
    "/": ("*",),
    "%": ("/",),
    "<<": (">>",),
    ">>": ("<<",),
    "&": ("|",),
    "|": ("&",),
    "^": ("|",),
    "+=": ("-=",),
    "-=": ("+=",),
    "|=": ("&=",),
    "&=": ("|=",),
}
UNARY = {"++": "--", "--": "++", "!": ""}
WORDS = {"true": "false", "false": "true"}
NO_STATEMENT = {
    "using",
    "static_assert",
    "friend",
    "template",
    "case",
    "default",
    "else",
    "if",
    "for",
    "while",
    "switch",
}
BLOCK_WORDS = {"else", "do", "const", "try"}  # before the brace of a block, besides a closing parenthesis


@dataclass(frozen=True)
class Token:
    """One token and its place in the text."""

    kind: str
    text: str
    begin: int
    end: int


@dataclass(frozen=True)
class Mutant:
    """`source[begin:end]` of `file` replaced by `to`. line: its number; before, after: the line without and with it.

    function: the enclosing one, if any; turn: how many identical mutants precede it there. With file, before and after
    these identify the mutant, even if its line moves.
    """

    file: str
    function: str
    begin: int
    end: int
    to: str
    line: int
    before: str
    after: str
    turn: int = 0

    @property
    def key(self) -> tuple[str, str, str, str, int]:
        return self.file, self.function, self.before, self.after, self.turn

    def applied(self, source: str) -> str:
        return source[: self.begin] + self.to + source[self.end :]

    @property
    def name(self) -> str:
        place = f" in {self.function}()" if self.function else ""
        return f"{self.file}:{self.line}{place}: {self.before}  ->  {self.after or '(nothing)'}"


def mutants(file: str, source: str) -> list[Mutant]:
    """Every mutant of a source, in text order."""
    tokens = [
        Token(match.lastgroup, match[0], match.start(), match.end())
        for match in TOKEN.finditer(source)
        if match.lastgroup != "skip"
    ]
    edits = sorted({*_of_tokens(source, tokens), *_statements(tokens)})
    found = []
    alike: Counter[tuple] = Counter()
    for edit in edits:
        mutant = _mutant(file, source, *edit)
        found.append(replace(mutant, turn=alike[mutant.key]))
        alike[mutant.key] += 1
    return found


def _of_tokens(source: str, tokens: list[Token]) -> Iterator[tuple[int, int, str]]:
    for token in tokens:
        spaced = source[token.begin - 1 : token.begin].isspace() and source[token.end : token.end + 1].isspace()
        if token.kind == "number":
            for to in _other_numbers(token.text):
                yield token.begin, token.end, to
        elif token.text in WORDS:
            yield token.begin, token.end, WORDS[token.text]
        elif token.text in UNARY:
            yield token.begin, token.end, UNARY[token.text]
        elif token.text in BINARY and spaced:
            for to in BINARY[token.text]:
                yield token.begin, token.end, to


def _other_numbers(text: str) -> Iterator[str]:
    suffix = re.search(r"[uUlL]*$", text)[0]
    value = int(text[: len(text) - len(suffix)], 0)
    for other in (value - 1, value + 1):
        if other >= 0:
            yield f"{other:#X}".replace("X", "x") + suffix if "x" in text.lower() else f"{other}{suffix}"


def _statements(tokens: list[Token]) -> Iterator[tuple[int, int, str]]:
    """Simple statements within functions, from their first token to their semicolon, which stays."""
    blocks: list[bool] = []  # for each open brace, whether it opens a block of statements
    brackets = 0
    for at, token in enumerate(tokens):
        brackets += (token.text in ("(", "[")) - (token.text in (")", "]"))
        if token.text == "{":
            blocks.append(_opens_block(tokens, at))
        elif token.text == "}":
            blocks.pop()
        elif blocks and blocks[-1] and brackets == 0 and _begins_statement(tokens, at):
            end = _end_of_statement(tokens, at)
            if end is not None and not _is_declaration(tokens[at:end]):
                yield token.begin, tokens[end].begin, ""


def _opens_block(tokens: list[Token], at: int) -> bool:
    before = tokens[at - 1].text
    return before in (")", ";", "{", "}", ":") or before in BLOCK_WORDS


def _begins_statement(tokens: list[Token], at: int) -> bool:
    before = tokens[at - 1].text
    if tokens[at].text in NO_STATEMENT or not (tokens[at].kind == "word" or tokens[at].text in ("++", "--", "*")):
        return False
    if before == ":":
        return _closes_label(tokens, at - 1)
    return before in ("{", "}", ";", "else") or (before == ")" and _closes_condition(tokens, at - 1))


def _closes_label(tokens: list[Token], at: int) -> bool:
    while tokens[at].text not in (";", "{", "}"):
        if tokens[at].text in ("case", "default"):
            return True
        at -= 1
    return False


def _closes_condition(tokens: list[Token], at: int) -> bool:
    depth = 0
    while at >= 0:
        depth += (tokens[at].text == ")") - (tokens[at].text == "(")
        if depth == 0:
            return tokens[at - 1].text in ("if", "for", "while", "switch")
        at -= 1
    return False


def _end_of_statement(tokens: list[Token], at: int) -> int | None:
    """Index of the statement's semicolon; None if a block comes first."""
    depth = 0
    for place in range(at, len(tokens)):
        text = tokens[place].text
        if text in ("(", "[") or (text == "{" and not _opens_block(tokens, place)):
            depth += 1
        elif text in (")", "]", "}"):
            depth -= 1
        elif text == "{":
            return None
        if depth < 0:
            return None
        if text == ";" and depth == 0:
            return place
    return None


def _is_declaration(statement: list[Token]) -> bool:
    """Whether it declares a name that later code needs to compile; a guard (`Critical`) does not count."""
    words = [token.text for token in statement]
    if "Critical" in words:
        return False
    if words[0] in ("const", "static", "constexpr", "struct"):
        return True
    kinds = [token.kind for token in statement[:2]]
    return kinds == ["word", "word"] and words[0] not in ("return", "delete", "goto")


def _mutant(file: str, source: str, begin: int, end: int, to: str) -> Mutant:
    first = source.rfind("\n", 0, begin) + 1
    last = source.find("\n", end)
    before = source[first:last]
    after = source[first:begin] + to + source[end:last]
    return Mutant(
        file, _function(source[:last]), begin, end, to, source.count("\n", 0, begin) + 1, _flat(before), _flat(after)
    )


def _function(until: str) -> str:
    """The function whose body is open at the end of this text, recognized by the formatter's indentation."""
    head = r"^(?:  |    )?[A-Za-z][\w:<>&*, ]*?([\w~]+|operator\S+)\([^;{}]*\)[^;{}]*\{"
    for found in reversed(list(re.finditer(head, until, re.MULTILINE))):
        inside = until[found.end() :]
        if found[1] not in ("if", "for", "while", "switch") and inside.count("{") >= inside.count("}"):
            return found[1]
    return ""


def _flat(text: str) -> str:
    return " ".join(text.split())
