"""Floors import only downward; rclpy stays on the top one; nothing leaves its shape."""

import ast
import functools
import graphlib
from pathlib import Path

import pytest

pytestmark = pytest.mark.check

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "cable_sim_ros"
MODULES = sorted([*PACKAGE.rglob("*.py"), *(ROOT / "verification").rglob("*.py")])
CORE = {  # room of the core: what it may import of the others; none knows a tool
    "compiler": set(),
    "physics": {"compiler"},
    "sim": {"compiler", "physics"},
    "io": {"physics", "sim"},
    "runs": {"physics", "sim", "io"},
    "plots": {"physics", "sim", "io", "runs"},  # every picture of a run, in one style
    "ros": {"compiler", "physics", "sim", "io"},
    "testing": {"physics", "sim", "io", "runs", "ros"},  # for users' tests
    "api": {"physics", "sim", "io"},
    "cli": {"physics", "sim", "io", "runs", "plots", "ros", "start"},
    "start": {"cli", "ros"},
    "viv": {"tools"},  # published names of the frequency domain
    "extensions": set(),
    "limits": set(),
    "processes": set(),
    "errors": set(),
    "files": set(),
    "terminal": set(),
    "version": set(),
}
TOOLS = {  # a tool -> the other tools that it builds on
    "ahc": {"report"},
    "calibrate": {"compare", "logs"},
    "clear": {"ensemble"},
    "compare": {"logs"},
    "ensemble": {"sweeps"},
    "layback": {"ensemble", "logs"},  # copies of the tow where it manoeuvres
    "logs": {"telegrams"},
    "sweeps": {"logs", "report"},
    "tows": {"calibrate", "logs", "sweeps"},
}
# they import nothing of ours but each other, all above the kernels may import them
LEAVES = {"errors", "extensions", "files", "limits", "processes", "terminal", "version"}
PHYSICS_MAY = {"numpy", "scipy", "numba", "math", "cmath", "enum", "typing", "collections", "functools", "__future__"}
PHYSICS_ALSO = {"parameter.py": {"pydantic", "pydantic_core"}}
ROS = {
    "rclpy",
    "sensor_msgs",
    "geometry_msgs",
    "nav_msgs",
    "std_msgs",
    "std_srvs",
    "diagnostic_msgs",
    "rosgraph_msgs",
    "lifecycle_msgs",
    "rcl_interfaces",
    "builtin_interfaces",
    "tf2_msgs",
    "ament_index_python",
}
BESIDE_A_NODE = {"clear/beside.py", "ensemble/beside.py", "layback/fixes.py"}
LONGEST = 600


def room_of(path):
    """Room of the core, "tools/NAME", or "verification"."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    if parts[0] != "cable_sim_ros":
        return parts[0]
    return "/".join(parts[1:3]) if parts[1] == "tools" and len(parts) > 3 else parts[1]


@functools.cache
def read(path):
    """What of the module says nothing of itself, and its statements that import, anywhere. The trees are not kept:
    with all of them in memory most of the time would go to collecting garbage."""
    tree = ast.parse(path.read_text("utf-8"))
    silent = [] if ast.get_docstring(tree) else [""]
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.name.startswith("_"):
            says_itself = len(node.body) == 1 and isinstance(node.body[0], ast.Return)
            silent += [] if ast.get_docstring(node) or says_itself else [f": {node.name}"]
    found, left = [], [tree]
    while left:
        node = left.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        for part in ("body", "orelse", "handlers", "finalbody", "cases"):
            left += getattr(node, part, ())
    return silent, found


def imports(path):
    """(first part of what is imported from outside, floor of ours or None) for every import anywhere in the file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    for node in read(path)[1]:
        if isinstance(node, ast.Import):
            for name in node.names:
                yield name.name.split(".")
        else:
            module = (node.module or "").split(".") if node.module else []
            if node.level:
                module = [*parts[: -node.level], *module]
            if module == ["cable_sim_ros"]:
                for name in node.names:
                    yield [*module, name.name]
            else:
                yield module


def upward(paths):
    """Imports that no room may have: of a room above, of a tool, of ROS, of more than numbers in physics."""
    return [
        f"{path.relative_to(ROOT)}: {'.'.join(module)}"
        for path in paths
        for module in imports(path)
        if wrong(path, module)
    ]


def wrong(path, module):
    """May this file not import this?"""
    room = room_of(path)
    if room in ("__init__", "tools"):
        return False
    if module[0] in ROS and room not in ("ros", "testing", "verification"):
        return "/".join(path.parts[-2:]) not in BESIDE_A_NODE
    if module[0] == "verification":
        return room != "verification"
    if module[0] != "cable_sim_ros":
        return room == "physics" and module[0] not in PHYSICS_MAY | PHYSICS_ALSO.get(path.name, set())
    target = module[1] if len(module) > 1 else "__init__"
    if room in CORE:
        return target not in CORE[room] | {room, "__init__"} | (set() if room in {"compiler", "physics"} else LEAVES)
    tool = room.removeprefix("tools/")
    return room != "verification" and target == "tools" and module[2] not in TOOLS.get(tool, set()) | {tool}


def test_imports_go_downward():
    assert upward(MODULES) == []


def test_the_walk_sees_an_upward_import(tmp_path, monkeypatch):
    package = tmp_path / "cable_sim_ros"
    (package / "physics").mkdir(parents=True)
    bad = package / "physics" / "bad.py"
    bad.write_text("def f():\n    from ..io import bag\n")
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    monkeypatch.setitem(globals(), "PACKAGE", package)
    assert upward([bad]) == ["cable_sim_ros/physics/bad.py: cable_sim_ros.io"]
    core, tool = package / "runs" / "bad.py", package / "tools" / "layback" / "bad.py"
    for path, text in ((core, "from ..tools.layback import ways"), (tool, "from ..view import page")):
        path.parent.mkdir(parents=True)
        path.write_text(text)
        assert len(upward([path])) == 1


def test_no_module_is_longer_than_600_lines():
    assert [path.name for path in MODULES if len(path.read_text("utf-8").splitlines()) > LONGEST] == []


def test_modules_and_public_functions_say_what_they_do():
    assert [f"{path.relative_to(ROOT)}{what}" for path in MODULES for what in read(path)[0]] == []


@functools.cache
def module_graph():
    """Module -> the modules of ours that it imports, also for types alone."""
    names = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in MODULES}
    needs = {name: set() for name in names}
    for name, path in names.items():
        package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
        for node in read(path)[1]:
            if isinstance(node, ast.ImportFrom):
                begin = package[: len(package) - node.level + 1] if node.level else []
                module = ".".join([*begin, *(node.module or "").split(".")]).strip(".")
                needs[name] |= {
                    f"{module}.{one.name}" if f"{module}.{one.name}" in names else module for one in node.names
                }
    graph = {name: {other for other in wanted if other in names and other != name} for name, wanted in needs.items()}
    assert sum(map(len, graph.values())) > 500, "the imports were not read"
    return graph


def folder_of(name):
    """A folder inside a room counts as one; a module that stands in its room is itself."""
    parts = name.split(".")
    return ".".join(parts[:3]) if len(parts) > 3 else name


def rooms_graph(graph):
    """The same with the folders as nodes."""
    rooms = {}
    for name, wanted in graph.items():
        rooms.setdefault(folder_of(name), set()).update(folder_of(other) for other in wanted)
    return {room: wanted - {room} for room, wanted in rooms.items()}


def ring_in(graph):
    """Names of a ring, or none."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def test_no_modules_import_each_other_in_a_ring():
    """Also not for types alone: what two modules share stands in a third."""
    assert not ring_in(module_graph())


def test_no_folders_import_each_other_in_a_ring():
    """What two folders share stands in a third, or on their floor."""
    assert not ring_in(rooms_graph(module_graph()))
    assert ring_in(rooms_graph({"p.io.bags.a": {"p.io.messages.b"}, "p.io.messages.c": {"p.io.bags.d"}}))


def test_a_folder_is_read_at_a_glance():
    """A floor or a folder of more than 30 files is a drawer; physics is one subject and stays flat."""
    count = {}
    for path in MODULES:
        count[path.parent] = count.get(path.parent, 0) + 1
    crowded = {str(folder.relative_to(ROOT)): n for folder, n in count.items() if n > 30}
    assert set(crowded) <= {"cable_sim_ros/physics"}, crowded
