"""The pages of what a scene or a plan is refused for or warned of, the parts of every Problem as the code has them, and
of the causes for which a message of motion or a command is refused, made from what the log says of each."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from textwrap import fill

from ..io.messages.fault_hypotheses import DOUBTS, UNUSED
from ..io.messages.messages import CAUSES
from ..sim.problem import Limit, without_effect
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
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    own = {name: value for _, name, value in _assigned(tree.body)}
    for made in functions:
        if isinstance(last := made.body[-1], ast.Return) and last.value:
            own[f"{made.name}()"] = last.value
    for function in functions:
        inside = list(ast.walk(function))
        given = sorted(_assigned(inside), key=lambda row: row[0])
        for call in (node for node in inside if isinstance(node, ast.Call)):
            before = {name: value for line, name, value in given if line <= call.lineno}
            if parts := _parts(call, own | before):
                key, what, remedy = map(_cell, parts)
                if what != "…":
                    yield f"`{key}`", what, remedy


def _parts(call: ast.Call, names: Names) -> tuple[str, ...]:
    """Key, text and remedy of a call that makes a Problem, is `idle` or is of a Limit; none of another."""
    shown = [_shown(part, names) for part in call.args]
    match call.func:
        case ast.Name("Problem") if len(shown) == 3:
            return tuple(shown)
        case ast.Name("idle"):
            keys = _made(call.args[2], names)
            which = ", ".join(_shown(key, names) for key in getattr(keys, "elts", ())) or "…"
            return f"{shown[0]}.{which}", *without_effect("= …", *shown[3:])
        case ast.Attribute(value=value, attr="problems"):
            made = _made(value, names)
            if not isinstance(made, ast.Call) or getattr(made.func, "id", "") != "Limit":
                return ()
            args = zip(Limit._fields, made.args), ((word.arg or "", word.value) for word in made.keywords)
            limit = Limit(**{name: _shown(part, names) for name, part in chain(*args)})  # type: ignore[arg-type]
            limit = limit._replace(bounds="" if limit.bounds == "…" else limit.bounds)
            return limit.key, limit.text("…", str(limit.bound), shown[0]), shown[1]
    return ()


def _made(node: ast.expr, names: Names) -> ast.expr:
    """What a name, or a function of the module, stands for."""
    name = getattr(node, "id", "")
    if isinstance(node, ast.Call):
        name = f"{getattr(node.func, 'id', getattr(node.func, 'attr', ''))}()"
    return _made(names[name], names) if name in names else node


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
    return re.sub(r"…+", "…", shown).replace("<", "&lt;").strip() or "…"


CAUSES_TITLE = """# Causes

Made by `cable-sim manual causes --out docs/causes.md` from the code; do not edit. Why messages of
ship motion, winch, flaps and vehicle are refused, and what to do ([motion](motion.md#causes)).
"""
MISFITS = """## Wrong units and axes

A message is refused while the parts of its stream contradict each other. Where the attitudes of
`odom` and `imu/data` do, that is the odometry.
"""
COUNTED = """## Counted, nothing is refused
"""
EVENTS = {
    "imu_gap": "no message of the IMU for `heave.max_gap`: its heave filter begins anew",
    "gap": "no sample of motion for `ship.max_gap`: it is bridged by a blend",
    "source_change": "from odometry to the IMU or back, by a blend over `ship.source_blend`",
    "position_jump": "odometry jumped by more than `motion.max_jump`: its origin is shifted, the ship stays",
    "heave_diverged": "the displacement of the heave filter went beyond `heave.max_displacement`: it begins anew",
}


def causes_text() -> str:
    """The page of the causes in Markdown."""
    messages = [cause for cause, said in CAUSES.items() if said and cause not in DOUBTS]
    events = [(f"`{cause}`", said) for cause, said in EVENTS.items()]
    parts = [CAUSES_TITLE, "## Messages\n", _causes_table(messages), MISFITS, _causes_table(DOUBTS), COUNTED]
    return "\n".join([*parts, markdown_table([("event", "what happened"), *events]) + "\n"])


def _causes_table(causes: Iterable[str]) -> str:
    rows = [(f"`{cause}`", *_parts_of_cause(CAUSES[cause])) for cause in causes]
    return markdown_table([("cause", "what is wrong", "what to do"), *rows]) + "\n"


def _parts_of_cause(said: str) -> list[str]:
    """What is wrong, and the remedy, without what stands between: that the message is not used."""
    return re.split(rf":? (?:dropped|(?:odometry is )?{UNUSED})(?:; |$)", said, maxsplit=1)
