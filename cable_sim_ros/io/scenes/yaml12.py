"""Reading YAML with the line of every value, by the rules of YAML 1.2 (core schema).

PyYAML follows YAML 1.1: 1e-3 would be text, ``on`` a boolean, 1:30 the number 90, a second key of the same name
would silently win.
"""

from __future__ import annotations

import re
from typing import Any

import yaml

Path = tuple  # of str and int: the way to a value

_NULL = re.compile(r"~|null|Null|NULL|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


DEEPEST = 50  # levels of a file; a scene has five
MAX_VALUES = 3000  # of a file, aliases followed; a scene has a few hundred
LONGEST = 1_000_000  # characters of a file
MAX_DIGITS = 300  # of an integer


class YamlError(ValueError):
    """Text that is no YAML a scene can be read from; ``line`` counts from 1, 0 = unknown."""

    def __init__(self, problems: list[tuple[int, str]]):
        self.problems = problems
        super().__init__("; ".join(text for _, text in problems))


def resolve(text: str) -> Any:
    """Value of a plain scalar: None, bool, int, float, or the text itself."""
    if _NULL.fullmatch(text):
        return None
    if _BOOL.fullmatch(text):
        return text.lower() == "true"
    if _INT.fullmatch(text) and len(text) <= MAX_DIGITS:
        return int(text, 0) if text[:2] in ("0x", "0o") else int(text)
    if _FLOAT.fullmatch(text):
        return float(re.sub(r"\.(?=[iInN])", "", text))  # .inf and .nan as Python writes them
    return text


class _Loader(yaml.SafeLoader):
    """Composes nodes to a bounded depth: the composer calls itself for each level."""

    depth = 0

    def compose_node(self, parent, index):
        """As the base class."""
        if self.depth == DEEPEST:
            line = self.peek_event().start_mark.line + 1
            raise YamlError([(line, f"brackets or indentation are nested deeper than {DEEPEST} levels")])
        self.depth += 1
        try:
            return super().compose_node(parent, index)
        finally:
            self.depth -= 1


def parse(text: str) -> tuple[Any, dict[Path, int]]:
    """Plain Python data of one YAML document, and the line (from 1) of every value by its path.

    Raises YamlError with every duplicate key, or with the first mistake of syntax.
    """
    if len(text) > LONGEST:
        raise YamlError([(0, f"has {len(text)} characters, more than {LONGEST}")])
    try:
        node = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise YamlError([(mark.line + 1 if mark else 0, error.problem or error.context or "no YAML")]) from None
    except yaml.YAMLError as error:  # a character that YAML does not allow
        raise YamlError([(0, str(error).splitlines()[0])]) from None
    lines: dict[Path, int] = {}
    problems: list[tuple[int, str]] = []
    data = _build(node, (), lines, problems, ()) if node is not None else None
    if problems:
        raise YamlError(problems)
    return data, lines


def _build(node, path: Path, lines, problems, above) -> Any:
    lines.setdefault(path, node.start_mark.line + 1)
    if len(path) > DEEPEST:  # aliases within aliases
        raise YamlError([(node.start_mark.line + 1, f"is nested deeper than {DEEPEST} levels through aliases")])
    if len(lines) > MAX_VALUES:  # a path each, so aliases within aliases count as often as they stand
        raise YamlError([(node.start_mark.line + 1, f"has more than {MAX_VALUES} values, counting aliases")])
    if id(node) in above:
        problems.append((node.start_mark.line + 1, f"{dotted(path)} contains itself through an alias"))
        return None
    above = (*above, id(node))
    if isinstance(node, yaml.ScalarNode):
        return node.value if node.style else resolve(node.value)  # quoted is always text
    if isinstance(node, yaml.SequenceNode):
        return [_build(item, (*path, i), lines, problems, above) for i, item in enumerate(node.value)]
    out: dict[str, Any] = {}
    for key_node, value_node in node.value:
        line = key_node.start_mark.line + 1
        if not isinstance(key_node, yaml.ScalarNode):
            problems.append((line, f"{dotted(path) or 'the file'} has a key that is not a plain word"))
            continue
        here = (*path, key_node.value)
        if key_node.value in out:
            problems.append((line, f"{dotted(here)} is given twice, first on line {lines[here]}"))
            continue
        lines[here] = line
        out[key_node.value] = _build(value_node, here, lines, problems, above)
    return out


def dotted(path: Path) -> str:
    """Path as a dotted key: ``sheave.position[1]``."""
    out = ""
    for part in path:
        out += f"[{part}]" if isinstance(part, int) else f".{part}" if out else str(part)
    return out


class Dumper(yaml.SafeDumper):
    """Writes text that both YAML 1.1 and 1.2 read back as text, and short vectors in one line."""


def _represent_str(dumper, value):
    plain = re.fullmatch(r"[A-Za-z_][A-Za-z0-9_ ./-]*", value) and isinstance(yaml.safe_load(value), str)
    return dumper.represent_scalar(
        "tag:yaml.org,2002:str", value, style=None if plain and isinstance(resolve(value), str) else '"'
    )


def _represent_list(dumper, value):
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=True)


Dumper.add_representer(str, _represent_str)
Dumper.add_representer(list, _represent_list)
