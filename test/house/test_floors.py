"""Floors import only downward; rclpy stays on the top one; nothing leaves its shape."""

import ast
import graphlib
from pathlib import Path

import pytest

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
    "ros": {"physics", "sim", "io"},
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
    "compare": {"logs"},
    "ensemble": {"layback", "sweeps"},
    "layback": {"logs"},
    "logs": {"telegrams"},
    "sweeps": {"logs", "report"},
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
BESIDE_A_NODE = {"ensemble/ear.py", "ensemble/voice.py", "layback/node_part.py"}
LONGEST = 600


def room_of(path):
    """Room of the core, "tools/NAME", or "verification"."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    if parts[0] != "cable_sim_ros":
        return parts[0]
    return "/".join(parts[1:3]) if parts[1] == "tools" and len(parts) > 3 else parts[1]


def imports(path):
    """(first part of what is imported from outside, floor of ours or None) for every import anywhere in the file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield name.name.split(".")
        elif isinstance(node, ast.ImportFrom):
            module = (node.module or "").split(".") if node.module else []
            if node.level:
                module = [*parts[: -node.level], *module]
            if module == ["cable_sim_ros"]:
                for name in node.names:
                    yield [*module, name.name]
            else:
                yield module


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_downward(path):
    room = room_of(path)
    if room in ("__init__", "tools"):
        return
    tool = room.removeprefix("tools/") if room.startswith("tools/") else ""
    for module in imports(path):
        if module[0] in ("cable_sim_ros", "verification"):
            target = module[1] if module[0] == "cable_sim_ros" and len(module) > 1 else "__init__"
            if module[0] == "verification":
                assert room == "verification", f"{room} imports {'.'.join(module)}: it stands beside the product"
            elif tool and target == "tools":
                assert module[2] in TOOLS.get(tool, set()) | {tool}, f"{room} imports {'.'.join(module)}"
            elif room in CORE:
                own = CORE[room] | {room, "__init__"} | (set() if room in {"compiler", "physics"} else LEAVES)
                assert target in own, f"{room} imports {'.'.join(module)}"
        elif room == "physics":
            assert module[0] in PHYSICS_MAY | PHYSICS_ALSO.get(path.name, set()), f"physics imports {module[0]}"
        if module[0] in ROS and room not in ("ros", "testing", "verification"):
            word = "/".join(path.parts[-2:])
            assert word in BESIDE_A_NODE, f"{word} imports {module[0]}: only ros/, testing/ and parts of a node may"


def test_the_walk_sees_an_upward_import(tmp_path, monkeypatch):
    package = tmp_path / "cable_sim_ros"
    (package / "physics").mkdir(parents=True)
    bad = package / "physics" / "bad.py"
    bad.write_text("def f():\n    from ..io import bag\n")
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    monkeypatch.setitem(globals(), "PACKAGE", package)
    with pytest.raises(AssertionError, match="physics imports cable_sim_ros.io"):
        test_imports_go_downward(bad)
    core, tool = package / "runs" / "bad.py", package / "tools" / "layback" / "bad.py"
    for path, text in ((core, "from ..tools.layback import ways"), (tool, "from ..view import page")):
        path.parent.mkdir(parents=True)
        path.write_text(text)
        with pytest.raises(AssertionError, match="imports cable_sim_ros.tools"):
            test_imports_go_downward(path)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_module_is_longer_than_600_lines(path):
    assert len(path.read_text("utf-8").splitlines()) <= LONGEST


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_modules_and_public_functions_say_what_they_do(path):
    tree = ast.parse(path.read_text("utf-8"))
    assert ast.get_docstring(tree), "no module docstring"
    missing = []
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and not node.name.startswith("_"):
            says_itself = len(node.body) == 1 and isinstance(node.body[0], ast.Return)
            if not ast.get_docstring(node) and not says_itself:
                missing.append(node.name)
    assert not missing, f"no docstring: {', '.join(missing)}"


def module_graph():
    """Module -> the modules of ours that it imports, also for types alone."""
    names = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in MODULES}
    needs = {name: set() for name in names}
    for name, path in names.items():
        package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
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
