"""What the package defines and nothing of it uses: run from the repository's folder.

python tools/unreached.py                  functions, classes, methods and names, and where they are

A function, class or name of a module is used where it is named, is imported and named, or is an
attribute of its imported module; a module that is given to something as a whole is used as a whole.
A method is used where an attribute of its name is. What others call stands in `CALLED_BY_OTHERS`,
or overrides something of a class that is not ours.
"""

import ast
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1] / "dmpcli"

CALLED_BY_OTHERS = {
    "dmpcli.bench.world.World.compliance": "docs/bench.md: what no robot tells",
    "dmpcli.cli.options": "typer, by its decorator",
    "dmpcli.instruments.drivers.Pacing": "drivers written for version 0.1.0",
    "dmpcli.records.skill.SkillFile._consistent": "pydantic, by its decorator",
    "dmpcli.simulation.netft_server.state.BoxState.restart": "who simulates a power cycle",
    "dmpcli.simulation.netft_server.state.BoxState.set_scale": "who simulates another scale",
}

_DEFINITIONS = (ast.FunctionDef, ast.ClassDef)


class Package:
    """The modules of a package by name, and what is used of them."""

    def __init__(self, root: Path) -> None:
        self.name = root.name
        self.trees = {
            self._module(path, root): ast.parse(path.read_text(encoding="utf-8"))
            for path in sorted(root.rglob("*.py"))
        }
        # Each tree is walked once; what is looked for in it is looked for several times.
        self._nodes = {module: list(ast.walk(tree)) for module, tree in self.trees.items()}
        self.imported = {module: self._imported(module) for module in self.trees}
        self.used: set[tuple[str, str]] = set()
        self.attributes: dict[str, list[tuple[str, int]]] = {}
        for module, tree in self.trees.items():
            self._look_through(module, tree)

    def unreached(self) -> Iterator[tuple[str, int]]:
        """Yield name and line of each definition that nothing uses."""
        for module, tree in self.trees.items():
            for name, node in _defined(tree):
                if (module, name) not in self.used and not name.startswith("__"):
                    yield f"{module}.{name}", node.lineno
            for kind in (one for one in self._nodes[module] if isinstance(one, ast.ClassDef)):
                if all(self._is_ours(module, base) for base in kind.bases):
                    yield from self._methods(module, kind)

    def _methods(self, module: str, kind: ast.ClassDef) -> Iterator[tuple[str, int]]:
        for node in kind.body:
            if not isinstance(node, ast.FunctionDef) or node.name.startswith("__"):
                continue
            own = range(node.lineno, (node.end_lineno or node.lineno) + 1)
            places = self.attributes.get(node.name, [])
            if all(at == module and line in own for at, line in places):
                yield f"{module}.{kind.name}.{node.name}", node.lineno

    def _is_ours(self, module: str, base: ast.expr) -> bool:
        """Tell whether a base class is of the package, and what it demands is asked for by us."""
        name = ast.unparse(base).partition("[")[0]
        ours = name in dict(_defined(self.trees[module])) or name in self.imported[module]
        return ours or name in ("Protocol", "Enum", "IntEnum", "NamedTuple", "Generic")

    def _imported(self, module: str) -> dict[str, tuple[str, str]]:
        """Names that a module has from another of the package, and what they are there."""
        return {
            alias.asname or alias.name: (str(node.module), alias.name)
            for node in self._nodes[module]
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith(self.name)
            for alias in node.names
        }

    def _look_through(self, module: str, tree: ast.Module) -> None:
        own, imported = dict(_defined(tree)), self.imported[module]
        nodes = self._nodes[module]
        owners = {id(n.value) for n in nodes if isinstance(n, ast.Attribute)}
        for node in nodes:
            match node:
                case ast.Name(id=name, ctx=ast.Load()):
                    defined = own.get(name)
                    if not isinstance(defined, _DEFINITIONS) or not _within(node, defined):
                        self.used.add((module, name))
                    if name in imported:
                        self._use(*imported[name], whole=id(node) not in owners)
                case ast.Attribute(attr=name, value=owner):
                    self.attributes.setdefault(name, []).append((module, node.lineno))
                    if isinstance(owner, ast.Name) and owner.id in imported:
                        self._use(".".join(imported[owner.id]), name)
                case ast.Constant(value=str() as name) if name.isidentifier():
                    # Of a table of names, as __init__.py has one: "fit": "workflows.library".
                    self.attributes.setdefault(name, []).append((module, node.lineno))
                case ast.Dict(keys=keys, values=values):
                    for key, value in zip(keys, values, strict=True):
                        if isinstance(key, ast.Constant) and isinstance(value, ast.Constant):
                            self.used.add((f"{self.name}.{value.value!s}", str(key.value)))

    def _use(self, module: str, name: str, whole: bool = False) -> None:
        """Take a name of a module as used, where it is defined and where it is handed on."""
        self.used.add((module, name))
        if whole and (given := self.trees.get(f"{module}.{name}")) is not None:
            self.used |= {(f"{module}.{name}", one) for one, _ in _defined(given)}
        if name in (handed := self.imported.get(module, {})) and handed[name] not in self.used:
            self._use(*handed[name])

    @staticmethod
    def _module(path: Path, root: Path) -> str:
        parts = path.relative_to(root.parent).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _defined(tree: ast.Module) -> Iterator[tuple[str, ast.stmt]]:
    """Names that a module defines, and where."""
    for node in tree.body:
        if isinstance(node, _DEFINITIONS):
            yield node.name, node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                yield from ((n.id, node) for n in ast.walk(target) if isinstance(n, ast.Name))


def _within(node: ast.expr, definition: ast.stmt) -> bool:
    return definition.lineno <= node.lineno <= (definition.end_lineno or definition.lineno)


def known() -> set[str]:
    """Names that others call: by pyproject.toml, by the command line's table, and those listed."""
    project = tomllib.loads((ROOT.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    tables = [project["scripts"], *project["entry-points"].values()]
    found = {place.replace(":", ".") for table in tables for place in table.values()}
    found |= {f"dmpcli.commands.{path.stem}.command" for path in (ROOT / "commands").glob("*.py")}
    return found | set(CALLED_BY_OTHERS)


def main() -> None:
    """Print what nothing reaches."""
    named = known()
    found = [place for place in Package(ROOT).unreached() if place[0] not in named]
    for name, line in found:
        print(f"{name}, line {line}")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
