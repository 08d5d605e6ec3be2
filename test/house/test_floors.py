"""Floors import only downward; rclpy stays on the top one; nothing leaves its shape."""

import ast
import functools
import graphlib
from pathlib import Path

import pytest

pytestmark = pytest.mark.check

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "cable_sim_ros"
MODULES = sorted(PACKAGE.rglob("*.py"))
MAY = {  # floor: what it may import of ours; nothing of the product imports verification
    "physics": {"physics"},
    "sim": {"physics", "sim"},
    "io": {"physics", "sim", "io"},
    "runs": {"physics", "sim", "io", "runs"},
    "spans": {"physics", "sim", "io", "spans"},  # beside runs
    "viv": {"spans"},  # published names of the frequency domain
    "plots": {"physics", "sim", "io", "runs", "spans", "plots"},
    "report": {"physics", "sim", "io", "runs", "spans", "plots", "report"},  # one HTML file of what was simulated
    "ros": {"physics", "sim", "io", "ros"},
    "sweeps": {"physics", "sim", "io", "runs", "plots", "report", "cli", "sweeps"},  # many runs, one answer
    "ensemble": {"physics", "sim", "io", "runs", "plots", "ros", "sweeps", "cli", "ensemble"},  # node or recording
    "view": {"physics", "sim", "io", "runs", "plots", "ros", "view"},  # live view and film, in processes of their own
    "fmu": {"physics", "sim", "io", "runs", "fmu"},
    "testing": {"physics", "sim", "io", "runs", "ros", "testing"},  # for users' tests: of ours only ahc imports it
    "api": {"physics", "sim", "io"},
    "cli": {"physics", "sim", "io", "runs", "spans", "plots", "report", "ros", "view", "fmu", "start", "cli"},
    "ahc": {"physics", "sim", "io", "runs", "plots", "report", "testing", "cli", "ahc"},
    "verification": {
        "physics",
        "sim",
        "io",
        "runs",
        "spans",
        "plots",
        "report",
        "ros",
        "sweeps",
        "cli",
        "verification",
    },
    "limits": set(),
    "processes": set(),
    "errors": set(),
    "files": set(),
    "terminal": set(),
    "start": {"cli", "ros"},
}
# they import nothing, all above the kernels may import them
LEAVES = {"errors", "files", "limits", "processes", "terminal", "version"}
PHYSICS_MAY = {"numpy", "scipy", "numba", "math", "cmath", "enum", "typing", "collections", "functools", "__future__"}
PHYSICS_ALSO = {
    "parameter.py": {"pydantic", "pydantic_core"},
    "simd.py": {"llvmlite"},
    "jit.py": {"hashlib", "pathlib", "threading", "llvmlite"},
    "kernel_form.py": {"hashlib", "pickle", "warnings", "llvmlite"},
    "kernel_key.py": {"dis", "hashlib", "pathlib", "platform", "sys", "types", "llvmlite"},
    "kernel_cache.py": {"contextlib", "hashlib", "os", "pathlib", "re", "shutil", "tempfile", "time", "uuid"},
}
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
LONGEST = 400


def floor_of(path):
    part = path.relative_to(PACKAGE).parts[0]
    return part.removesuffix(".py")


@functools.cache
def tree_of(path):
    return ast.parse(path.read_text("utf-8"))


def imports(path):
    """(first part of what is imported from outside, floor of ours or None) for every import anywhere in the file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    for node in ast.walk(tree_of(path)):
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


def upward(paths):
    """Imports that no floor may have: of a floor above, of ROS, of more than numbers in physics."""
    wrong = []
    for path in paths:
        floor = floor_of(path)
        leaves = set() if floor in {"physics", *LEAVES} else LEAVES
        for module in imports(path) if floor != "__init__" else ():
            if module[0] == "cable_sim_ros":
                target = module[1] if len(module) > 1 else "__init__"
                bad = target not in MAY[floor] | {"__init__"} | leaves
            else:
                bad = floor == "physics" and module[0] not in PHYSICS_MAY | PHYSICS_ALSO.get(path.name, set())
                bad |= floor not in ("ros", "testing") and module[0] in ROS and (floor, module[0]) != ("cli", "rclpy")
            wrong += [f"{path.relative_to(PACKAGE)}: {'.'.join(module)}"] * bad
    return wrong


def test_imports_go_downward():
    assert upward(MODULES) == []


def test_the_walk_sees_an_upward_import(tmp_path, monkeypatch):
    package = tmp_path / "cable_sim_ros"
    (package / "physics").mkdir(parents=True)
    bad = package / "physics" / "bad.py"
    bad.write_text("def f():\n    from ..io import bag\n")
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    monkeypatch.setitem(globals(), "PACKAGE", package)
    assert upward([bad]) == ["physics/bad.py: cable_sim_ros.io"]


def test_no_module_is_longer_than_400_lines():
    assert [path.name for path in MODULES if len(path.read_text("utf-8").splitlines()) > LONGEST] == []


def test_modules_and_public_functions_say_what_they_do():
    silent = []
    for path in MODULES:
        module = str(path.relative_to(PACKAGE))
        silent += [] if ast.get_docstring(tree_of(path)) else [module]
        for node in tree_of(path).body:
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and not node.name.startswith("_"):
                says_itself = len(node.body) == 1 and isinstance(node.body[0], ast.Return)
                silent += [] if ast.get_docstring(node) or says_itself else [f"{module}: {node.name}"]
    assert not silent


def module_graph():
    """Module -> the modules of ours that it imports, also for types alone."""
    names = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in MODULES}
    needs = {name: set() for name in names}
    for name, path in names.items():
        package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ImportFrom):
                begin = package[: len(package) - node.level + 1] if node.level else []
                module = ".".join([*begin, *(node.module or "").split(".")]).strip(".")
                needs[name] |= {
                    f"{module}.{one.name}" if f"{module}.{one.name}" in names else module for one in node.names
                }
    graph = {name: {other for other in wanted if other in names and other != name} for name, wanted in needs.items()}
    assert sum(map(len, graph.values())) > 500, "the imports were not read"
    return graph


def room_of(name):
    """A folder inside a floor counts as one; a module that stands on its floor is itself."""
    parts = name.split(".")
    return ".".join(parts[:3]) if len(parts) > 3 else name


def rooms_graph(graph):
    """The same with the folders as nodes."""
    rooms = {}
    for name, wanted in graph.items():
        rooms.setdefault(room_of(name), set()).update(room_of(other) for other in wanted)
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
    crowded = {str(folder.relative_to(PACKAGE)): n for folder, n in count.items() if n > 30}
    assert set(crowded) <= {"physics"}, crowded
