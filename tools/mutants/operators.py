"""Small faults that a source file could have had, each a change of its syntax tree.

A mutant changes one place: an operator, a sign, a comparison or its limit, a constant, a condition,
an argument or its default, an axis, a slice's bound, a function for its counterpart, a returned
value, or a statement that is left out. Texts, annotations and docstrings are left alone: what a
message says is no test's business.
"""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

Edit = tuple[str, ast.AST]
"""What an operator is called, and what it puts in a node's place."""

_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Div,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}
_COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_PAIRS = (
    ("min", "max"),
    ("minimum", "maximum"),
    ("argmin", "argmax"),
    ("any", "all"),
    ("sin", "cos"),
    ("floor", "ceil"),
    ("zeros", "ones"),
    ("zeros_like", "ones_like"),
    ("logical_and", "logical_or"),
)
_COUNTERPART = {a: b for one, other in _PAIRS for a, b in ((one, other), (other, one))}
_LEFT_OUT = ("abs", "fabs", "sqrt", "cumsum", "sorted", "reversed", "radians", "unwrap", "clip")
"""Functions of one main argument, for which that argument itself may stand."""


@dataclass(frozen=True, eq=False)
class Mutant:
    """One changed place: a node of a statement, and what stands there instead.

    ``scope`` is the function or class around it, with dots, and empty for the module itself;
    ``number`` counts the mutants of its file.
    """

    file: str
    number: int
    scope: str
    in_function: bool
    operator: str
    tree: ast.Module
    statement: ast.stmt
    node: ast.AST
    new: ast.AST

    @property
    def line(self) -> int:
        """Where the changed place is."""
        return int(getattr(self.node, "lineno", self.statement.lineno))

    @property
    def lines(self) -> set[int]:
        """Lines of the statement, or of its head if others stand in it."""
        body = getattr(self.statement, "body", None)
        first, end = self.statement.lineno, self.statement.end_lineno or self.statement.lineno
        if isinstance(body, list) and body:
            end = max(first, body[0].lineno - 1)
        return set(range(first, end + 1))

    @property
    def before(self) -> str:
        """The statement as it stands, in one line."""
        return _told(self.statement)

    @property
    def after(self) -> str:
        """The statement as the mutant has it."""
        statement, node = copy.deepcopy([self.statement, self.node])
        return _told(self.new if node is statement else _Place(node, self.new).visit(statement))

    def placed(self) -> ast.Module:
        """Put the mutant into the tree: what stood there is lost, so only a child may."""
        _Place(self.node, ast.copy_location(self.new, self.node)).visit(self.tree)
        return ast.fix_missing_locations(self.tree)

    @property
    def name(self) -> str:
        """What stays the same while lines move."""
        return f"{self.file} {self.scope or '-'}: {self.before} -> {self.after}"


def _number(value: float) -> Iterator[ast.AST]:
    yield ast.Constant(value + 1)
    if isinstance(value, int):
        yield ast.Constant(value - 1)


def _constant(node: ast.Constant) -> Iterator[Edit]:
    if isinstance(node.value, bool):
        yield "boolean", ast.Constant(not node.value)
    elif isinstance(node.value, int | float):
        yield from (("constant", changed) for changed in _number(node.value))
    elif node.value in ("left", "right"):
        yield "side", ast.Constant("right" if node.value == "left" else "left")


def _operators(node: ast.AST) -> Iterator[Edit]:
    match node:
        case ast.BinOp(left, ast.MatMult(), right):
            yield "operands swapped", ast.BinOp(right, ast.MatMult(), left)
        case ast.BinOp(left, op, right) if type(op) in _ARITHMETIC:
            yield "arithmetic", ast.BinOp(left, _ARITHMETIC[type(op)](), right)
        case ast.AugAssign(target, op, value) if type(op) in _ARITHMETIC:
            yield "arithmetic", ast.AugAssign(target, _ARITHMETIC[type(op)](), value)
            yield "plain assignment", ast.Assign([target], value)
        case ast.UnaryOp(ast.USub() | ast.Not() | ast.Invert(), operand):
            yield "sign or not", operand
        case ast.Compare(left, [op], [right]):
            for other in _COMPARISONS[type(op)]:
                yield "comparison", ast.Compare(left, [other()], [right])
        case ast.Compare(left, ops, right):
            for n, op in enumerate(ops):
                for other in _COMPARISONS[type(op)]:
                    yield "comparison", ast.Compare(left, [*ops[:n], other(), *ops[n + 1 :]], right)
        case ast.BoolOp(op, values):
            yield "and or", ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.IfExp(test, body, orelse):
            yield "branches swapped", ast.IfExp(test, orelse, body)


def _call(node: ast.Call) -> Iterator[Edit]:
    func, args, keywords = node.func, node.args, node.keywords
    called = func.attr if isinstance(func, ast.Attribute) else getattr(func, "id", "")
    if called in _COUNTERPART:
        other = copy.deepcopy(func)
        setattr(other, "attr" if isinstance(func, ast.Attribute) else "id", _COUNTERPART[called])
        yield "counterpart", ast.Call(other, args, keywords)
    if called in _LEFT_OUT and args:
        yield "function left out", args[0]
    if len(args) > 1 and not isinstance(args[-1], ast.Starred):
        yield "argument left out", ast.Call(func, args[:-1], keywords)
    for n, keyword in enumerate(keywords):
        yield "argument left out", ast.Call(func, args, [*keywords[:n], *keywords[n + 1 :]])
        if keyword.arg == "axis" and isinstance(keyword.value, ast.Constant | ast.UnaryOp):
            axis = ast.literal_eval(keyword.value)
            other_axis = ast.Constant(0 if axis in (-1, 1) else 1)
            changed = [*keywords[:n], ast.keyword("axis", other_axis), *keywords[n + 1 :]]
            yield "axis", ast.Call(func, args, changed)


def _slice(node: ast.Slice) -> Iterator[Edit]:
    one = ast.Constant(1)
    if node.lower is not None:
        yield "slice", ast.Slice(None, node.upper, node.step)
        later = ast.BinOp(node.lower, ast.Add(), one)
        yield "slice", ast.Slice(later, node.upper, node.step)
    if node.upper is not None:
        yield "slice", ast.Slice(node.lower, None, node.step)
        earlier = ast.BinOp(node.upper, ast.Sub(), one)
        yield "slice", ast.Slice(node.lower, earlier, node.step)
    if node.step is not None:
        yield "slice", ast.Slice(node.lower, node.upper, None)


def _statement(node: ast.stmt) -> Iterator[Edit]:
    match node:
        case ast.If(test, body, orelse):
            if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
                return
            yield "condition", ast.If(ast.UnaryOp(ast.Not(), test), body, orelse)
        case ast.Return(value) if value is not None and not _is_none(value):
            yield "returned value", ast.Return(ast.Constant(None))
        case ast.Expr(value) if not isinstance(value, ast.Constant):
            yield "statement left out", ast.Pass()
        case ast.Raise() | ast.AugAssign() | ast.Continue() | ast.Break():
            yield "statement left out", ast.Pass()
        case ast.Assign([ast.Subscript() | ast.Attribute()]):
            yield "statement left out", ast.Pass()


def _is_none(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def edits(node: ast.AST) -> Iterator[Edit]:
    """What may stand in a node's place, always in the same order."""
    match node:
        case ast.Constant():
            yield from _constant(node)
        case ast.Call():
            yield from _call(node)
        case ast.Slice():
            yield from _slice(node)
        case _:
            yield from _operators(node)
            if isinstance(node, ast.stmt):
                yield from _statement(node)


def _children(node: ast.AST) -> Iterator[ast.AST]:
    """What of a node may be changed: no annotations, texts or docstrings."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "type_comment", "type_params"):
            continue
        if isinstance(node, ast.Raise | ast.JoinedStr):
            continue
        if isinstance(node, ast.Assign) and name == "targets":
            value = [target for target in value if not isinstance(target, ast.Name)]
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield child


def _typing_only(node: ast.AST) -> bool:
    """Tell what a type checker reads and no program runs."""
    match node:
        case ast.If(ast.Name("TYPE_CHECKING")) | ast.Import() | ast.ImportFrom():
            return True
        case ast.Assign([ast.Name("__all__")]):
            return True
    return False


def _told(node: ast.AST) -> str:
    """A statement in one line, without what stands in it."""
    if isinstance(getattr(node, "body", None), list):
        node = copy.copy(node)
        for name in ("body", "orelse", "handlers", "finalbody"):
            if getattr(node, name, None):
                setattr(node, name, [ast.Expr(ast.Constant(...))] if name == "body" else [])
    return " ".join(ast.unparse(ast.fix_missing_locations(node)).split())


class _Place(ast.NodeTransformer):
    """Put one node in the place of another, by identity."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else super().generic_visit(node)


def _walk(tree: ast.Module) -> Iterator[tuple[ast.AST, ast.stmt, tuple[str, ...], bool]]:
    """Every node that may be changed, with its statement, its scope, and if a function runs it."""
    todo: list[tuple[ast.AST, ast.stmt | None, tuple[str, ...], bool]] = [(tree, None, (), False)]
    while todo:
        node, statement, scope, inside = todo.pop()
        if _typing_only(node):
            continue
        if isinstance(node, ast.stmt):
            statement = node
        if statement is not None:
            yield node, statement, scope, inside
        below = inside
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            scope = (*scope, node.name)
        for child in reversed(list(_children(node))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                below = isinstance(child, ast.stmt)
            todo.append((child, statement, scope, below))


def mutants(file: str, text: str) -> list[Mutant]:
    """List all mutants of a source file, in the order of its text."""
    tree = ast.parse(text)
    found: list[Mutant] = []
    for node, statement, scope, inside in _walk(tree):
        for operator, new in edits(node):
            within = ".".join(scope)
            found.append(
                Mutant(file, len(found), within, inside, operator, tree, statement, node, new)
            )
    return found
