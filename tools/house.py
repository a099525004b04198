"""What the code costs to read: run from the repository's folder, see CONTRIBUTING.md.

python tools/house.py                      lines, names and docstrings, of the package
python tools/house.py --execute FILE       modules and calls of `execute`, at run time
python tools/house.py --follow FILE:FUNCTION:PARAMETER    where one parameter goes
"""

import argparse
import ast
import collections
import io
import statistics
import sys
import tempfile
import tokenize
import tomllib
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).parents[1] / "dmpcli"
_NO_CODE = (
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
)
_DEFINITIONS = (ast.FunctionDef, ast.ClassDef)


def code_lines(text: str) -> int:
    """Count the lines that are no docstring, comment, blank or import."""
    told: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import | ast.ImportFrom) or (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            told |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE:
            lines |= set(range(token.start[0], token.end[0] + 1))
    return len(lines - told)


def counted(root: Path) -> dict[str, Any]:
    """Count a package's lines, names and docstrings."""
    texts = [path.read_text(encoding="utf-8") for path in sorted(root.rglob("*.py"))]
    nodes = [node for text in texts for node in ast.walk(ast.parse(text))]
    names = collections.Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    docs = [ast.get_docstring(node) or "" for node in nodes if isinstance(node, _DEFINITIONS)]
    told = sum(len(text.splitlines()) for text in docs)
    sizes = [len(text.splitlines()) for text in texts]
    return {
        "files": len(texts),
        "lines": sum(sizes),
        "lines a file, median": statistics.median(sizes),
        "lines a file, largest": max(sizes),
        "code lines": sum(map(code_lines, texts)),
        "classes": sum(names.values()),
        "class names defined twice": sorted(name for name, n in names.items() if n > 1),
        "docstring lines a definition": round(told / len(docs), 2),
    }


def executed(trajectory: str) -> dict[str, int]:
    """Run `execute` on the mock; count modules entered, and calls on the stack at a set-point.

    Loading a module counts where that runs a function or the body of a class of it.
    """
    from dmpcli.cli import app

    package, mock = str(ROOT), str(ROOT / "simulation" / "mock")
    entered: set[str] = set()
    depth: list[int] = []

    def seen(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(package):
            return
        if code.co_name != "<module>":
            entered.add(code.co_filename)
        if code.co_name == "send" and code.co_filename.startswith(mock):
            count, at = 0, frame.f_back
            while at is not None:
                count += at.f_code.co_filename.startswith(package)
                at = at.f_back
            depth.append(count)

    with tempfile.TemporaryDirectory() as folder:
        words = ["execute", trajectory, "-o", f"{folder}/run.parquet", "-q"]
        sys.setprofile(seen)
        try:
            app(words, standalone_mode=False)
        finally:
            sys.setprofile(None)
    return {"modules entered": len(entered), "calls on the stack at a set-point": max(depth)}


class Walk:
    """Follows one parameter through the calls that it is passed on with, by name.

    A call is followed where its name is a function of the same file or an imported one; what it
    returns counts as the parameter too. Put down in a field of an object, it is followed where that
    field is read. A climb is a return from a lower room to a higher one, as pyproject.toml has the
    layers.
    """

    def __init__(self) -> None:
        setup = tomllib.loads((ROOT.parent / "pyproject.toml").read_text(encoding="utf-8"))
        layers = setup["tool"]["importlinter"]["contracts"][0]["layers"]
        self._height = {
            name.strip(): -row for row, line in enumerate(layers) for name in line.split("|")
        }
        self._trees: dict[Path, ast.Module] = {}
        self._seen: set[tuple[Path, str, str]] = set()
        self.files: list[Path] = []
        self.climbs = 0

    def follow(self, path: Path, function: str, parameter: str, field: str = "") -> None:
        """Follow one parameter of one function, or a field of it."""
        body = self._definition(path, function)
        if (path, function, parameter) in self._seen or not isinstance(body, ast.FunctionDef):
            return
        self._seen.add((path, function, parameter))
        if path not in self.files:
            self.files.append(path)
        names = {parameter: field}
        steps = [n for n in ast.walk(body) if isinstance(n, ast.Assign | ast.Call)]
        for node in sorted(steps, key=lambda n: (n.lineno, n.col_offset)):
            if isinstance(node, ast.Call):
                self._call(path, body, node, names)
            elif (held := self._held(path, body, node.value, names)) is not None:
                for target in node.targets:
                    names |= {n.id: held for n in ast.walk(target) if isinstance(n, ast.Name)}

    def _call(
        self, path: Path, body: ast.FunctionDef, call: ast.Call, names: dict[str, str]
    ) -> None:
        place = self._resolved(path, body, call.func)
        target = None if place is None else self._definition(*place)
        if place is None or not isinstance(target, ast.FunctionDef):
            return
        taken = [one.arg for one in (*target.args.posonlyargs, *target.args.args)]
        taken += [one.arg for one in target.args.kwonlyargs]
        given = [*zip(taken, call.args, strict=False)]
        given += [(one.arg, one.value) for one in call.keywords if one.arg]
        passed = [(n, self._held(path, body, value, names)) for n, value in given]
        for name, held in passed:
            if held is not None:
                self.follow(*place, name, held)
        below = self._layer(place[0]) < self._layer(path)
        self.climbs += below and any(held is not None for _, held in passed)

    def _held(
        self, path: Path, body: ast.FunctionDef, value: ast.AST, names: dict[str, str]
    ) -> str | None:
        """Return in which field an expression holds the parameter, "" as itself; else None."""
        if isinstance(value, ast.Name):
            return names.get(value.id)
        if isinstance(value, ast.Call) and (place := self._resolved(path, body, value.func)):
            made = self._definition(*place)
            if isinstance(made, ast.ClassDef):
                fields = [
                    one.target.id
                    for one in made.body
                    if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name)
                ]
                given = [*zip(fields, value.args, strict=False)]
                given += [(one.arg or "", one.value) for one in value.keywords]
                for name, part in given:
                    if self._held(path, body, part, names) is not None:
                        return name
                return None
        if isinstance(value, ast.Attribute) and isinstance(value.value, ast.Name):
            field = names.get(value.value.id)
            return None if field is None or field not in ("", value.attr) else ""
        parts = [self._held(path, body, part, names) for part in ast.iter_child_nodes(value)]
        return "" if any(part == "" for part in parts) else None

    def _layer(self, path: Path) -> int:
        room = path.relative_to(ROOT).parts[0].removesuffix(".py")
        return self._height.get(f"dmpcli.{room}", 0)

    def _tree(self, path: Path) -> ast.Module:
        if path not in self._trees:
            self._trees[path] = ast.parse(path.read_text(encoding="utf-8"))
        return self._trees[path]

    def _definition(self, path: Path, name: str) -> ast.FunctionDef | ast.ClassDef | None:
        known = (n for n in self._tree(path).body if isinstance(n, ast.FunctionDef | ast.ClassDef))
        return next((node for node in known if node.name == name), None)

    def _resolved(self, path: Path, body: ast.AST, called: ast.expr) -> tuple[Path, str] | None:
        """Return file and name of what is called: `name(...)` or `module.name(...)`."""
        tops = {n.name for n in self._tree(path).body if isinstance(n, _DEFINITIONS)}
        if isinstance(called, ast.Name) and called.id in tops:
            return path, called.id
        for node in (*ast.walk(body), *self._tree(path).body):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("dmpcli"):
                continue
            folder = ROOT.parent.joinpath(*str(node.module).split("."))
            for alias in node.names:
                said = alias.asname or alias.name
                if isinstance(called, ast.Name) and called.id == said:
                    return self._file(folder), alias.name
                if (
                    isinstance(called, ast.Attribute)
                    and isinstance(called.value, ast.Name)
                    and called.value.id == said
                    and (folder / f"{alias.name}.py").exists()
                ):
                    return folder / f"{alias.name}.py", called.attr
        return None

    @staticmethod
    def _file(module: Path) -> Path:
        file = module.with_suffix(".py")
        return file if file.exists() else module / "__init__.py"


def main() -> None:
    """Print what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--execute", metavar="TRAJECTORY")
    parser.add_argument("--follow", metavar="FILE:FUNCTION:PARAMETER")
    said = parser.parse_args()
    found: dict[str, Any]
    if said.execute:
        found = executed(said.execute)
    elif said.follow:
        file, function, parameter = said.follow.split(":")
        walk = Walk()
        walk.follow(ROOT / file, function, parameter)
        found = {"files": [str(f.relative_to(ROOT)) for f in walk.files], "climbs": walk.climbs}
        found["files entered"] = len(walk.files)
    else:
        found = counted(ROOT)
    for name, value in found.items():
        print(f"{name}: {', '.join(value) if isinstance(value, list) else value}")


if __name__ == "__main__":
    main()
