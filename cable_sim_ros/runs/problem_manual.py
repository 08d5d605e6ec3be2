"""The page of what a scene or a plan is refused for or warned of: the parts of every Problem, as the code has them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import fill

from ..terminal import markdown_table

TITLE = """# Problems

Made by `cable-sim manual problems --out docs/problems.md` from the code; do not edit. What a scene,
a plan or a scenario is refused for, or warned of, with the way out; `…` stands for a name or number
of yours, a slash between what one of several cases says. A message has these parts in this order,
behind file and line, and says what was not done.
"""
HEAD = "key", "what is wrong", "remedy"
PACKAGE = Path(__file__).resolve().parents[1]
ROOMS = "io", "runs", "sim"
Names = Mapping[str, ast.expr]


def text() -> str:
    """The page in Markdown."""
    parts = [TITLE]
    for path in sorted(path for room in ROOMS for path in (PACKAGE / room).rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        if rows := list(dict.fromkeys(problems(tree))):
            about = (ast.get_docstring(tree) or "").split("\n\n")[0]
            title = path.stem.replace("_", " ").capitalize()
            parts += [f"## {title}\n", fill(about, 100) + "\n", markdown_table([HEAD, *rows]) + "\n"]
    return "\n".join(parts)


def problems(tree: ast.Module) -> Iterator[tuple[str, str, str]]:
    """Key, text and remedy of every Problem that a module makes, as cells of a table."""
    own = {name: value for _, name, value in _assigned(tree.body)}
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        inside = list(ast.walk(function))
        given = list(_assigned(inside))
        for call in inside:
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Problem":
                before = {name: value for line, name, value in given if line <= call.lineno}
                key, what, remedy = (_cell(_shown(part, own | before)) for part in call.args)
                if what != "…":
                    yield f"`{key}`", what, remedy


def _assigned(nodes: list[ast.AST] | list[ast.stmt]) -> Iterator[tuple[int, str, ast.expr]]:
    """Line, name and value of what is given one name, or several at once."""
    for node in nodes:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            target, value = node.targets[0], node.value
            pairs = [(target, value)]
            if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                pairs = list(zip(target.elts, value.elts))
            yield from ((node.lineno, name.id, given) for name, given in pairs if isinstance(name, ast.Name))


def _shown(node: ast.expr, names: Names) -> str:
    """Text that an expression makes, … where it depends on what is given."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (str, int, float)):
        return node.value if isinstance(node.value, str) else f"{node.value:g}"
    if isinstance(node, ast.JoinedStr):
        return "".join(_shown(part, names) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        return _shown(node.value, names)
    if isinstance(node, ast.IfExp):
        return " / ".join(filter(None, (_shown(node.body, names), _shown(node.orelse, names))))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _shown(node.left, names) + _shown(node.right, names)
    if isinstance(node, ast.Name) and node.id in names:
        return _shown(names[node.id], {name: value for name, value in names.items() if name != node.id})
    return "…"


def _cell(shown: str) -> str:
    return re.sub(r"…+", "…", shown).replace("|", "\\|").replace("<", "&lt;").strip() or "…"
