"""Translates the integrator's Python into C that runs in lanes.

The functions of the simulator and of the effects are written once, in the plain Python that numba compiles. Here they
become C in which a number is a vector of lanes. Propagating the kinds of the arguments tells which values differ
between lanes and which are the same in all. Where a condition differs, both branches are executed, each for the lanes
in its mask, and a branch without lanes is skipped. `break`, `continue` and early returns remove lanes from the mask.

Supported Python: arithmetic, comparisons, `and`/`or`/`not`, conditional expressions, `if`, `for` over a range (no
`while`), calls of other such functions and of `math`, and numbers and arrays passed as arguments.

Kinds: `f`, `i`, `b` are a number, an integer, a truth value that is the same in all lanes; `F` and `B` are a number
(also an integer) and a truth value per lane. `F[n]` is an array of `F` (n may be omitted), `f[]` one of `f`; anything
else names a structure or a table (`Shapes`).
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

C_TYPES = {"f": "double", "i": "long", "b": "int", "F": "V", "B": "Mask", "f[]": "Series"}
_UNROLLED = 16  # most iterations of a loop that is unrolled
_SAME_IN_ALL = ("f", "i", "b")
_COMPARISONS = {ast.Lt: "lt", ast.LtE: "le", ast.Gt: "gt", ast.GtE: "ge", ast.Eq: "eq", ast.NotEq: "ne"}
_HOLDING = (("bi", "i"), ("bif", "f"), ("bB", "B"), ("bifF", "F"))  # kinds, and the least that can hold them all
_SELECT = {"F": "sel", "B": "sel_mask"}  # for the kinds that differ between lanes
_SIGNS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}
_ARITHMETIC = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
# Names in C's <math.h>, and in vectors.h with a leading "v_".
_MATH = {
    math.exp: "exp", math.log: "log", math.sqrt: "sqrt", math.sin: "sin", math.cos: "cos", math.tan: "tan",
    math.tanh: "tanh", math.atan: "atan", math.floor: "floor", math.ceil: "ceil", math.fabs: "fabs",
    math.copysign: "copysign", math.hypot: "hypot", math.atan2: "atan2", math.pow: "pow", abs: "fabs",
}  # fmt: skip


Kind = Any  # one of the kinds above; a tuple of them where a function returns several values
_Coded = tuple[str, Kind]  # an expression in C, and its kind


class UntranslatableError(Exception):
    """A function contains something that cannot be translated; the text says where and what."""


@dataclass(frozen=True)
class Shapes:
    """Layout of structures and tables in C.

    fields: for each structure, the kind of each field. sizes: C code for the size of a table along an axis, with `{}`
    for the table. tables: C code for an entry of each table, formatted with table, row and column, which may differ
    between lanes.
    """

    fields: Mapping[str, Mapping[str, str]]
    sizes: Mapping[tuple[str, int], str]
    tables: Mapping[str, str]


@dataclass(frozen=True)
class Intrinsic:
    """C code that replaces a function: `{m}` is the mask, `{0}` ... are the arguments (numbers as `F`)."""

    code: str
    returns: Kind


@dataclass
class Translated:
    """Translation of one function for one combination of argument kinds."""

    name: str
    returns: Kind
    text: str


def c_type(kind: Kind) -> str:
    if kind in C_TYPES:
        return C_TYPES[kind]
    if kind.startswith("F["):
        return "V *"
    if kind == "Active":
        return "Plant *"
    return f"{kind} *"


class Translator:
    """Translates the requested functions and all that they call. `apart`: whether a function is not inlined, because it
    is rarely called or has too many callers. `instead`: replacement for a function that cannot be translated; None to
    fail."""

    def __init__(
        self,
        shapes: Shapes,
        intrinsics: Mapping[Callable[..., Any], Intrinsic],
        apart: Callable[[Callable[..., Any]], bool] = lambda function: False,
        instead: Callable[[Callable[..., Any], UntranslatableError], Intrinsic | None] = lambda function, refusal: None,
    ):
        self.shapes, self.intrinsics, self.apart, self.instead = shapes, intrinsics, apart, instead
        self.texts: list[str] = []
        self._done: dict[tuple[Any, ...], Translated] = {}
        self._arrays: dict[str, str] = {}
        self._count = 0

    def function(self, function: Callable[..., Any], kinds: tuple[str, ...], whole: bool = True) -> Translated:
        """Translate a function for arguments of these kinds. `whole`: it always runs in all lanes; otherwise its first
        argument is the mask."""
        function = getattr(function, "py_func", function)
        key = (function, kinds, whole)
        if key not in self._done:
            self._count += 1
            body = _Body(self, function, kinds, whole, f"{function.__name__.lstrip('_')}_{self._count}")
            self._done[key] = body.translate("INNER" if self.apart(function) else "MERGED")
            self.texts.append(self._done[key].text)
        return self._done[key]

    def array(self, values: np.ndarray) -> str:
        """Name in C of a constant array."""
        numbers = ", ".join(repr(float(value)) for value in values)
        if numbers not in self._arrays:
            self._arrays[numbers] = name = f"array_{len(self._arrays)}"
            self.texts.append(f"static const double {name}[] = {{ {numbers} }};\n")
        return self._arrays[numbers]


@dataclass
class _Region:
    """Code that runs for the lanes in the variable `mask`. `full`: for all lanes, so no values need be preserved."""

    mask: str
    full: bool
    loop: _Loop | None


@dataclass
class _Loop:
    left: str  # lanes that have left the loop (break)
    skipped: str  # lanes that have left this iteration (continue)


class _Body:
    """Translation of one function in progress."""

    def __init__(
        self, translator: Translator, function: Callable[..., Any], kinds: tuple[Kind, ...], whole: bool, name: str
    ):
        self.translator, self.shapes, self.whole, self.name = translator, translator.shapes, whole, name
        self.function = function
        try:
            lines, self.first_line = inspect.getsourcelines(function)
            source = textwrap.dedent("".join(lines))
            self.tree = next(node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef))
        except (OSError, StopIteration, SyntaxError) as e:
            raise UntranslatableError(f"{function.__module__}.{function.__name__}: its source is not available") from e
        self.parameters = [argument.arg for argument in self.tree.args.args]
        if len(self.parameters) != len(kinds):
            raise self._no(self.tree, f"takes {len(self.parameters)} arguments, not {len(kinds)}")
        self.given = dict(zip(self.parameters, kinds, strict=True))
        self.kinds: dict[str, Kind] = dict(self.given)
        self.returned: list[Kind] | None = None
        self.single = True

    def _no(self, node: ast.AST, what: str) -> UntranslatableError:
        line = self.first_line + getattr(node, "lineno", 1) - 1
        return UntranslatableError(f"{inspect.getsourcefile(self.function)}:{line}: {self.function.__name__} {what}")

    def translate(self, inline: str) -> Translated:
        while True:  # repeat until no further variable turns out to differ between lanes
            before = (dict(self.kinds), list(self.returned or ()))
            self.lines: list[str] = []
            self.regions_of: dict[str, _Region] = {}
            self.count = 0
            self.jumped = False
            self.assigned_result = False
            self.region = self.top = _Region("m", self.whole, None)
            self._block(self.tree.body)
            if (self.kinds, list(self.returned or ())) == before:
                return self._finished(inline)

    def _finished(self, inline: str) -> Translated:
        returns: Kind = None if self.returned is None else (self.returned[0] if self.single else tuple(self.returned))
        many = isinstance(returns, tuple)
        result = "void" if returns is None else (f"{self.name}_result" if many else c_type(returns))
        arguments = [] if self.whole else ["const Mask m_in"]
        arguments += [f"{c_type(kind)} in_{name}" for name, kind in self.given.items()]
        head = []
        if many:
            fields = " ".join(f"{c_type(kind)} r{i};" for i, kind in enumerate(returns))
            head.append(f"typedef struct {{ {fields} }} {result};")
        head.append(f"{inline} {result} {self.name}({', '.join(arguments) or 'void'}) {{")
        for name, kind in self.kinds.items():
            start = f"in_{name}" if name in self.given else _nothing(kind)
            if name in self.given and kind != self.given[name]:
                start = _as(start, self.given[name], kind)
            head.append(f"  {c_type(kind)} x_{name} = {start};")
        head.append(f"  Mask m = {'all_lanes()' if self.whole else 'm_in'}, gone = no_lanes();")
        head += [f"  {c_type(kind)} ret{i} = {_nothing(kind)};" for i, kind in enumerate(self.returned or ())]
        head.append("  (void)m; (void)gone;" + "".join(f" (void)x_{name};" for name in self.kinds))
        tail = [f"  {self._return_code()}", "}", ""]
        lines = [line.replace("return@", self._return_code()) for line in self.lines]
        return Translated(self.name, returns, "\n".join([*head, *lines, *tail]))

    def _return_code(self) -> str:
        if self.returned is None:
            return "return;"
        if self.single:
            return "return ret0;"
        return f"return ({self.name}_result){{ {', '.join(f'ret{i}' for i in range(len(self.returned)))} }};"

    # -- statements ------------------------------------------------------------------------------------------

    def _emit(self, line: str) -> None:
        self.lines.append("  " + line)

    def _fresh(self, stem: str) -> str:
        self.count += 1
        return f"{stem}{self.count}_"

    def _block(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            method = getattr(self, f"_do_{type(statement).__name__.lower()}", None)
            if method is None:
                raise self._no(statement, f"has a {type(statement).__name__}, which is not supported")
            method(statement)

    def _do_expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):
            return  # a docstring
        code, _ = self._value(node.value)
        self._emit(f"{code};")

    def _do_pass(self, node: ast.Pass) -> None:
        pass

    def _do_annassign(self, node: ast.AnnAssign) -> None:
        if node.value is None:
            raise self._no(node, "declares a name without a value")
        self._store(node.target, *self._value(node.value))

    def _do_assign(self, node: ast.Assign) -> None:
        if len(node.targets) > 1:
            code, kind = self._value(node.value)
            name = self._fresh("t")
            self._emit(f"{c_type(kind)} {name} = {code};")
            for target in node.targets:
                self._store(target, name, kind)
            return
        target = node.targets[0]
        if not isinstance(target, ast.Tuple):
            self._store(target, *self._value(node.value))
            return
        parts = self._tuple(node.value)
        if len(parts) != len(target.elts):
            raise self._no(node, f"unpacks {len(parts)} values into {len(target.elts)} names")
        held = []
        for code, kind in parts:  # evaluate all before storing the first
            name = self._fresh("t")
            self._emit(f"{c_type(kind)} {name} = {code}; (void){name};")
            held.append((name, kind))
        for one, (code, kind) in zip(target.elts, held, strict=True):
            self._store(one, code, kind)

    def _tuple(self, node: ast.expr) -> list[_Coded]:
        if isinstance(node, ast.Tuple):
            return [self._value(one) for one in node.elts]
        if isinstance(node, ast.IfExp):
            truth, kind = self._truth(node.test)
            yes, no = self._tuple(node.body), self._tuple(node.orelse)
            return [self._chosen(truth, kind, a, b) for a, b in zip(yes, no, strict=True)]
        code, kind = self._value(node)
        if not isinstance(kind, tuple):
            raise self._no(node, "is one value, not several")
        return self._members(code, kind)

    def _members(self, code: str, kinds: tuple[Kind, ...]) -> list[_Coded]:
        """The members of the structure that a call returns."""
        name = self._fresh("r")
        self._emit(f"const __auto_type {name} = {code};")
        return [(f"{name}.r{i}", one) for i, one in enumerate(kinds)]

    def _do_augassign(self, node: ast.AugAssign) -> None:
        both = ast.BinOp(node.target, node.op, node.value)
        ast.copy_location(both, node)
        self._store(node.target, *self._value(both))

    def _store(self, target: ast.expr, code: str, kind: Kind) -> None:
        match target:
            case ast.Name(id=name):
                self._store_name(target, name, code, kind)
            case ast.Subscript(value=ast.Name() | ast.Attribute(), slice=ast.Slice(lower=None, upper=None, step=None)):
                array, array_kind = self._value(target.value)
                at, size = self._fresh("i"), self._size(target, array, array_kind)
                self._emit(f"for (long {at} = 0; {at} < {size}; {at}++)")
                self._assign(f"{array}[{at}]", _as(code, kind, "F"), "F", indent="  ")
            case ast.Subscript():
                self._assign(self._place(target), _as(code, kind, "F"), "F")
            case _:
                raise self._no(target, "has an unsupported assignment target")

    def _assign(self, place: str, code: str, kind: Kind, everywhere: bool = False, indent: str = "") -> None:
        """Assign in the lanes of the region, or `everywhere`."""
        if kind in _SELECT and not (everywhere or self.region.full):
            code = f"{_SELECT[kind]}({self.region.mask}, {code}, {place})"
        self._emit(f"{indent}{place} = {code};")

    def _store_name(self, node: ast.AST, name: str, code: str, kind: Kind) -> None:
        if isinstance(kind, tuple):
            raise self._no(node, f"assigns several values to {name}")
        if name == "_":
            self._emit(f"(void)({code});")
            return
        known = self.kinds.get(name)
        first = self.regions_of.setdefault(name, self.region if name not in self.given else self.top)
        if kind in _SAME_IN_ALL and self.region.mask != first.mask:  # the other lanes keep their values
            kind, code = _varying(kind), _as(code, kind, _varying(kind))
        joined = _joined(known, kind)
        if joined is None:
            raise self._no(node, f"assigns a {kind} to {name}, which was a {known}")
        self.kinds[name] = joined
        self._assign(f"x_{name}", _as(code, kind, joined), joined)

    def _do_return(self, node: ast.Return) -> None:
        parts = [] if node.value is None else self._returned_parts(node.value)
        if node.value is not None:
            self._remember_result(node, parts)
        plain = self.region.mask == "m" and self.region.loop is None
        for i, ((code, kind), joined) in enumerate(zip(parts, self.returned or (), strict=False)):
            self._assign(f"ret{i}", _as(code, kind, joined), joined, everywhere=plain and not self.assigned_result)
        self.assigned_result = self.assigned_result or not plain
        if plain:
            self._emit("return@")
        else:
            self._emit(f"gone = or_(gone, {self.region.mask});")
            self.jumped = True

    def _returned_parts(self, node: ast.expr) -> list[_Coded]:
        if isinstance(node.body if isinstance(node, ast.IfExp) else node, ast.Tuple):
            self.single = False
            return self._tuple(node)
        code, kind = self._value(node)
        if not isinstance(kind, tuple):
            return [(code, kind)]
        self.single = False
        return self._members(code, kind)

    def _remember_result(self, node: ast.AST, parts: list[_Coded]) -> None:
        differs = self.region.mask != "m" or self.jumped or self.region.loop is not None
        kinds = [_varying(kind) if differs and kind in _SAME_IN_ALL else kind for _, kind in parts]
        if self.returned is None:
            self.returned = kinds
            return
        joined = [_joined(old, new) for old, new in zip(self.returned, kinds, strict=True)]
        if None in joined:
            raise self._no(node, "returns values of incompatible kinds")
        self.returned = joined

    def _do_if(self, node: ast.If) -> None:
        truth, kind = self._truth(node.test)
        if kind == "b":
            if truth in ("0", "1"):
                self._block(node.body if truth == "1" else node.orelse)
                return
            self._emit(f"if ({truth}) {{")
            self._uniform(node.body)
            if node.orelse:
                self._emit("} else {")
                self._uniform(node.orelse)
            self._emit("}")
            return
        condition = self._fresh("c")
        self._emit(f"const Mask {condition} = {truth};")
        with self._inside() as outer:
            for statements, mask in ((node.body, "and_"), (node.orelse, "andnot")):
                if not statements:
                    continue
                name = self._fresh("m")
                self._emit("{")
                self._emit(f"Mask {name} = {mask}({condition}, {outer.mask});")
                self._emit(f"if (any({name})) {{")
                self.region = _Region(name, False, outer.loop)
                self._block(statements)
                self._emit("} }")

    def _uniform(self, statements: Sequence[ast.stmt]) -> None:
        """Translate a branch that either all lanes of the region take, or none."""
        with self._inside() as outer:
            self.region = _Region(outer.mask, outer.full, outer.loop)
            self._block(statements)
            outer.full = outer.full and self.region.full

    @contextmanager
    def _inside(self) -> Iterator[_Region]:
        """Translate regions inside the present one. Afterwards the lanes that have meanwhile left the function, the
        loop or its present iteration are removed from its mask."""
        outer, jumped, self.jumped = self.region, self.jumped, False
        yield outer
        self.region = outer
        if self.jumped:
            lost = f"or_(gone, or_({outer.loop.left}, {outer.loop.skipped}))" if outer.loop else "gone"
            self._emit(f"{outer.mask} = andnot({lost}, {outer.mask});")
            outer.full = False
        self.jumped = jumped or self.jumped

    def _do_for(self, node: ast.For) -> None:
        match node.iter:
            case ast.Call(func=ast.Name(id="range"), args=[last]) if isinstance(node.target, ast.Name):
                end, kind = self._value(last)
            case ast.Tuple(elts=elements) if isinstance(node.target, ast.Name):
                for element in elements:  # a few constants: unrolled
                    self._store_name(node, node.target.id, *self._value(element))
                    self._block(node.body)
                return
            case _:
                raise self._no(node, "loops over something other than a range")
        if kind != "i" or node.orelse:
            raise self._no(node, "has an unsupported loop: its count must be the same in all lanes, without an else")
        name = node.target.id
        if _joined(self.kinds.get(name), "i") != "i":
            raise self._no(node, f"loops over {name}, which is in use already")
        self.kinds[name] = "i"
        self.regions_of.setdefault(name, self.region)
        name = f"x_{name}"
        jumps = any(isinstance(part, (ast.Return, ast.Break, ast.Continue)) for part in ast.walk(node))
        if not jumps:
            if end.rstrip("L").isdigit() and int(end.rstrip("L")) <= _UNROLLED:
                self._emit(f'_Pragma("GCC unroll {_UNROLLED}")')
            self._emit(f"for ({name} = 0; {name} < {end}; {name}++) {{")
            self._block(node.body)
            self._emit("}")
            return
        loop = _Loop(self._fresh("left"), self._fresh("skipped"))
        mask = self._fresh("m")
        with self._inside() as outer:
            self._emit(f"Mask {loop.left} = no_lanes();")
            self._emit(f"for ({name} = 0; {name} < {end}; {name}++) {{")
            self._emit(f"Mask {loop.skipped} = no_lanes();")
            self._emit(f"Mask {mask} = andnot(or_(gone, {loop.left}), {outer.mask});")
            self._emit(f"if (!any({mask})) break;")
            self.region = _Region(mask, False, loop)
            self._block(node.body)
            self._emit(f"(void){mask}; }}")
            self.jumped = any(isinstance(part, ast.Return) for part in ast.walk(node))  # all others stay in the loop

    def _do_break(self, node: ast.Break | ast.Continue) -> None:
        if (loop := self.region.loop) is None:
            raise self._no(node, "uses break or continue outside a loop over a range")
        lanes = loop.left if isinstance(node, ast.Break) else loop.skipped
        self._emit(f"{lanes} = or_({lanes}, {self.region.mask});")
        self.jumped = True

    _do_continue = _do_break

    # -- expressions -----------------------------------------------------------------------------------------

    def _value(self, node: ast.expr) -> _Coded:
        method = getattr(self, f"_of_{type(node).__name__.lower()}", None)
        if method is None:
            raise self._no(node, f"has a {type(node).__name__}, which is not supported")
        return method(node)

    def _of_constant(self, node: ast.Constant) -> _Coded:
        return self._constant(node, node.value)

    def _constant(self, node: ast.expr, value: object) -> _Coded:
        if isinstance(value, (bool, np.bool_)):
            return str(int(value)), "b"
        if isinstance(value, (int, np.integer)):
            return f"({int(value)}L)" if value < 0 else f"{int(value)}L", "i"
        if isinstance(value, (float, np.floating)):
            if math.isnan(value):
                return "NAN", "f"
            return f"({float(value)!r})" if value < 0 else repr(float(value)), "f"
        raise self._no(node, f"uses {value!r}, which is not a number")

    def _of_name(self, node: ast.Name) -> _Coded:
        if node.id in self.kinds:
            return f"x_{node.id}", self.kinds[node.id]
        return self._constant(node, self._object(node))

    def _object(self, node: ast.expr) -> Any:
        """The constant, function or module that the source refers to."""
        if isinstance(node, ast.Attribute):
            return getattr(self._object(node.value), node.attr)
        if isinstance(node, ast.Name):
            for scope in (self.function.__globals__, vars(builtins)):
                if node.id in scope:
                    return scope[node.id]
        raise self._no(node, f"uses {ast.unparse(node)}, which is undefined")

    def _of_attribute(self, node: ast.Attribute) -> _Coded:
        root: ast.expr = node
        while isinstance(root, ast.Attribute):
            root = root.value
        if isinstance(root, ast.Name) and root.id not in self.kinds:
            return self._constant(node, self._object(node))
        code, kind = self._value(node.value)
        if node.attr == "size":
            return self._size(node, code, kind), "i"
        fields = self.shapes.fields.get(kind, {})
        if node.attr not in fields:
            raise self._no(node, f"reads {node.attr} of a {kind}")
        found = fields[node.attr]
        if found == "Active":
            return code, found
        direct = found in _SAME_IN_ALL or found == "F" or found.startswith("F[")
        return f"{code}->{node.attr}" if direct else f"&{code}->{node.attr}", found

    def _size(self, node: ast.expr, code: str, kind: Kind) -> str:
        if kind == "f[]":
            return f"{code}.size"
        if kind.startswith("F[") and kind != "F[]":
            return kind[2:-1]
        raise self._no(node, f"takes the size of a {kind}")

    def _of_subscript(self, node: ast.Subscript) -> _Coded:
        match node.value:
            case ast.Attribute(value=table, attr="shape"):
                code, kind = self._value(table)
                axis = ast.literal_eval(node.slice)
                if (kind, axis) not in self.shapes.sizes:
                    raise self._no(node, f"takes the shape of a {kind}")
                return self.shapes.sizes[kind, axis].format(f"({code})"), "i"
        if isinstance(node.value, ast.Name) and node.value.id not in self.kinds:
            array = self._object(node.value)
            if isinstance(array, np.ndarray) and array.ndim == 1:
                at, kind = self._value(node.slice)
                if kind == "i":
                    return f"{self.translator.array(array)}[{at}]", "f"
        code, kind = self._value(node.value)
        if isinstance(kind, tuple):
            at = ast.literal_eval(node.slice)
            return f"{code}.r{at}", kind[at]
        if kind in self.shapes.tables:
            row, column = (_as(*self._value(part), "F") for part in self._pair(node.slice))
            return self.shapes.tables[kind].format(f"({code})", row, column), "F"
        return self._place(node), "f" if kind == "f[]" else "F"

    def _place(self, node: ast.Subscript) -> str:
        code, kind = self._value(node.value)
        if kind == "Rows":
            row, column = (self._index(part) for part in self._pair(node.slice))
            return f"({code})->at[({row}) * ({code})->columns + ({column})]"
        at = self._index(node.slice)
        if kind == "f[]":
            return f"{code}.at[{at}]"
        if not kind.startswith("F["):
            raise self._no(node, f"indexes a {kind}")
        return f"({code})[{at}]"

    def _pair(self, node: ast.expr) -> list[ast.expr]:
        if not isinstance(node, ast.Tuple) or len(node.elts) != 2:
            raise self._no(node, "indexes a table other than by row and column")
        return node.elts

    def _index(self, node: ast.expr) -> str:
        at, kind = self._value(node)
        if kind not in ("i", "b"):
            raise self._no(node, "uses an index that differs from lane to lane")
        return at

    def _of_unaryop(self, node: ast.UnaryOp) -> _Coded:
        if isinstance(node.op, ast.Not):
            code, kind = self._truth(node.operand)
            return (f"(!({code}))", "b") if kind == "b" else (f"not_({code})", "B")
        code, kind = self._value(node.operand)
        if not isinstance(node.op, ast.USub):
            raise self._no(node, "has an operator that is not supported")
        return f"(-({_as(code, kind, 'f' if kind == 'b' else kind)}))", kind

    def _of_binop(self, node: ast.BinOp) -> _Coded:
        (a, ka), (b, kb) = self._value(node.left), self._value(node.right)
        if isinstance(node.op, ast.BitAnd) and ka == "Active" and kb == "i":
            return f"having({a}, {b})", "B"
        if isinstance(node.op, (ast.BitAnd, ast.BitOr, ast.LShift)) and ka == kb == "i":
            bits = {ast.BitAnd: "&", ast.BitOr: "|", ast.LShift: "<<"}[type(node.op)]
            return f"({a} {bits} {b})", "i"
        for kind in (ka, kb):
            if kind not in ("f", "i", "b", "F", "B"):
                raise self._no(node, f"does arithmetic with a {kind}")
        varying = "F" in (ka, kb) or "B" in (ka, kb)
        if isinstance(node.op, ast.Pow):
            if varying:
                return f"v_pow({_as(a, ka, 'F')}, {_as(b, kb, 'F')})", "F"
            return f"pow({a}, {b})", "f"
        sign = _ARITHMETIC.get(type(node.op))
        if sign is None:
            raise self._no(node, "has an operator that is not supported")
        if varying:
            return f"({_as(a, ka, 'F')} {sign} {_as(b, kb, 'F')})", "F"
        if sign == "/":
            return f"((double)({a}) / (double)({b}))", "f"
        kind = "f" if "f" in (ka, kb) else "i"
        return f"({a} {sign} {b})", kind

    def _of_compare(self, node: ast.Compare) -> _Coded:
        parts = [self._value(one) for one in (node.left, *node.comparators)]
        found = []
        for operation, (a, ka), (b, kb) in zip(node.ops, parts, parts[1:], strict=False):
            name = _COMPARISONS.get(type(operation))
            if name is None:
                raise self._no(node, "has a comparison that is not supported")
            if ka in _SAME_IN_ALL and kb in _SAME_IN_ALL:
                found.append((f"({a} {_SIGNS[name]} {b})", "b"))
            else:
                found.append((f"{name}({_as(a, ka, 'F')}, {_as(b, kb, 'F')})", "B"))
        return self._all_of(found, "and_", "&&")

    def _all_of(self, parts: list[_Coded], function: str, sign: str) -> _Coded:
        code, kind = parts[0]
        for other, other_kind in parts[1:]:
            if kind == other_kind == "b":
                code = f"({code} {sign} {other})"
            else:
                code, kind = f"{function}({_as(code, kind, 'B')}, {_as(other, other_kind, 'B')})", "B"
        return code, kind

    def _of_boolop(self, node: ast.BoolOp) -> _Coded:
        parts = [self._truth(one) for one in node.values]
        return self._all_of(parts, *(("and_", "&&") if isinstance(node.op, ast.And) else ("or_", "||")))

    def _truth(self, node: ast.expr) -> _Coded:
        code, kind = self._value(node)
        if kind in ("b", "B"):
            return code, kind
        if kind in ("i", "f"):
            return f"({code} != 0)", "b"
        if kind == "F":
            return f"ne({code}, splat(0.0))", "B"
        if kind == "Active":
            return f"having({code}, ~0L)", "B"
        raise self._no(node, f"tests a {kind} as a condition")

    def _of_ifexp(self, node: ast.IfExp) -> _Coded:
        truth, kind = self._truth(node.test)
        if truth in ("0", "1"):
            return self._value(node.body if truth == "1" else node.orelse)
        return self._chosen(truth, kind, self._value(node.body), self._value(node.orelse))

    def _chosen(self, truth: str, kind: str, yes: _Coded, no: _Coded) -> _Coded:
        (a, ka), (b, kb) = yes, no
        joined = _joined(ka, kb)
        if joined is None:
            raise UntranslatableError(f"{self.name}: a conditional of {ka} and {kb}")
        if kind == "b" and joined in ("F", "B"):
            c = c_type(joined)
            return f"({truth} ? ({c})({_as(a, ka, joined)}) : ({c})({_as(b, kb, joined)}))", joined
        if kind == "b":
            return f"({truth} ? {_as(a, ka, joined)} : {_as(b, kb, joined)})", joined
        if (joined := _varying(joined)) not in _SELECT:
            raise UntranslatableError(f"{self.name}: a conditional of several values that differs from lane to lane")
        return f"{_SELECT[joined]}({_as(truth, kind, 'B')}, {_as(a, ka, joined)}, {_as(b, kb, joined)})", joined

    def _of_call(self, node: ast.Call) -> _Coded:
        if node.keywords:
            raise self._no(node, "passes keyword arguments in a call")
        function = self._object(node.func)
        arguments = [self._value(one) for one in node.args]
        kinds = [kind for _, kind in arguments]
        varying = any(kind in ("F", "B") for kind in kinds)
        plain = [_as(code, kind, "F" if varying else "f") for code, kind in arguments if kind in "fibFB"]
        if function is max or function is min:
            name = "v_max" if function is max else "v_min"
            if not varying and all(kind == "i" for kind in kinds):
                (a, _), (b, _) = arguments
                return f"({a} {'>' if function is max else '<'} {b} ? {a} : {b})", "i"
            code = plain[0]
            for other in plain[1:]:
                code = f"{name if varying else name[2:] + '_f'}({code}, {other})"
            return code, "F" if varying else "f"
        if function is int or function is float:
            if varying:
                return (f"v_trunc({plain[0]})" if function is int else plain[0]), "F"
            return f"(({'long' if function is int else 'double'})({plain[0]}))", "i" if function is int else "f"
        if function is math.isfinite:
            return (f"finite_({plain[0]})", "B") if varying else (f"isfinite({plain[0]})", "b")
        if function is math.radians:
            return (f"({plain[0]} * {_as('0.017453292519943295', 'f', 'F')})", "F") if varying else (
                f"({plain[0]} * 0.017453292519943295)", "f")  # fmt: skip
        if function in (math.ceil, math.floor) and not varying:
            return f"((long){_MATH[function]}({plain[0]}))", "i"
        if function in _MATH:
            name = _MATH[function]
            if function is abs and kinds == ["i"]:
                return f"labs({arguments[0][0]})", "i"
            return f"{'v_' if varying else ''}{name}({', '.join(plain)})", "F" if varying else "f"
        function = getattr(function, "py_func", function)
        if function in self.translator.intrinsics:
            intrinsic = self.translator.intrinsics[function]
            values = [_as(code, kind, _varying(kind)) for code, kind in arguments]
            return intrinsic.code.format(*values, m=self.region.mask), intrinsic.returns
        if not inspect.isfunction(function):
            raise self._no(node, f"calls {ast.unparse(node.func)}, which cannot be vectorised")
        whole = self.region.full
        try:
            callee = self.translator.function(function, tuple(kinds), whole)
        except UntranslatableError as refusal:
            nothing = self.translator.instead(function, refusal)
            if nothing is None:
                raise
            return nothing.code, nothing.returns
        given = [] if whole else [self.region.mask]
        code = f"{callee.name}({', '.join([*given, *(code for code, _ in arguments)])})"
        return code, callee.returns


def _varying(kind: str) -> str:
    return {"f": "F", "i": "F", "b": "B"}.get(kind, kind)


def _joined(a: Kind | None, b: Kind) -> Kind | None:
    """The kind that can hold both; None if there is none."""
    if a is None or a == b:
        return b
    return next((kind for kinds, kind in _HOLDING if {a, b} <= {*kinds}), None)


def _as(code: str, kind: str, wanted: str) -> str:
    if kind == wanted:
        return code
    if wanted == "F":
        if kind in _SAME_IN_ALL:
            return f"splat({code})"
        if kind == "B":
            return f"sel({code}, splat(1.0), splat(0.0))"
    if wanted == "B" and kind == "b":
        return f"lanes_if({code})"
    if wanted in _SAME_IN_ALL and kind in _SAME_IN_ALL:
        return code
    raise UntranslatableError(f"a {kind} where a {wanted} is needed: {code}")


def _nothing(kind: str) -> str:
    return {"F": "splat(0.0)", "B": "no_lanes()", "f[]": "{0, 0}"}.get(kind, "0")
