"""A message package made of its definitions with the generators beside rclpy: simulation_interfaces of those in
standard_2_1_0, or another.

Classes alone need no compiler; to send them, one extension module is compiled against the headers and libraries of the
same environment. Run as a program (python standard_package.py FOLDER DEFINITIONS PACKAGE), as the generators print and
read sys.argv.
"""

from __future__ import annotations

import functools
import json
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

HERE = Path(__file__).parent / "standard_2_1_0"
PREFIX = Path(sys.prefix)
PACKAGE, SUPPORT = "simulation_interfaces", "rosidl_typesupport_fastrtps_c"
INTROSPECTION = "rosidl_typesupport_introspection_c"  # the middleware describes the type of a topic by it
NEEDED = {PACKAGE: ("builtin_interfaces", "service_msgs"), "control_msgs": ("builtin_interfaces", "std_msgs")}
LIBRARIES = ("rosidl_runtime_c", "rosidl_typesupport_c", SUPPORT, f"{SUPPORT}pp", "rmw", "fastcdr", "rcutils")
LIBRARIES += (INTROSPECTION,)


def why_not() -> str:
    """ "" or what is missing to compile it here."""
    missing = [tool for tool in ("gcc", "g++") if shutil.which(tool) is None]
    missing += [str(p) for p in (PREFIX / "include" / "rosidl_runtime_c", PREFIX / "share" / SUPPORT) if not p.exists()]
    return f"missing: {', '.join(missing)}" if missing else ""


def make(folder: Path, definitions: Path = HERE, package: str = PACKAGE) -> Path:
    """Make the package in a folder, in a process of its own; returns what to put on the path."""
    environment = os.environ | {"AMENT_PREFIX_PATH": str(PREFIX)}
    command = [sys.executable, __file__, str(folder), str(definitions), package]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "py"


def generate(folder: Path, definitions: Path, package: str) -> None:
    """C and Python sources."""
    import rosidl_typesupport_c
    import rosidl_typesupport_fastrtps_c
    import rosidl_typesupport_introspection_c
    from rosidl_adapter.msg import convert_msg_to_idl
    from rosidl_adapter.srv import convert_srv_to_idl
    from rosidl_generator_c import generate_c
    from rosidl_generator_py.generate_py_impl import generate_py
    from rosidl_generator_type_description import generate_type_hash
    from rosidl_parser import parser

    parser.get_ast_from_idl_string = functools.cache(parser.get_ast_from_idl_string)  # each generator parses anew
    fraction, idls = PREFIX / "share", []
    for path in sorted((*definitions.glob("msg/*.msg"), *definitions.glob("srv/*.srv"))):
        relative = path.relative_to(definitions)
        convert = convert_msg_to_idl if path.suffix == ".msg" else convert_srv_to_idl
        convert(definitions, package, relative, folder / "idl" / relative.parent)
        idls.append(str(relative.with_suffix(".idl")))

    def report(out: str, template: str, **more) -> str:
        place = folder / out / package
        place.mkdir(parents=True, exist_ok=True)
        file = folder / f"{template}.json"
        given = {
            "package_name": package,
            "output_dir": str(place),
            "template_dir": str(fraction / template / "resource"),
            "idl_tuples": [f"{folder / 'idl'}:{idl}" for idl in idls],
            "ros_interface_dependencies": [f"{n}:{p}" for n in NEEDED[package] for p in (fraction / n).rglob("*.idl")],
            "target_dependencies": [],
        }
        file.write_text(json.dumps(given | more))
        return str(file)

    generate_type_hash(
        report(
            "td", "rosidl_generator_type_description", include_paths=[f"{n}:{fraction / n}" for n in NEEDED[package]]
        )
    )
    described = [f"{idl}:{folder / 'td' / package / Path(idl).with_suffix('.json')}" for idl in idls]
    generate_c(report("c", "rosidl_generator_c", type_description_tuples=described))
    rosidl_typesupport_fastrtps_c.generate_typesupport_fastrtps_c(report("c", SUPPORT))
    supports = [SUPPORT] if package == PACKAGE else [SUPPORT, INTROSPECTION]
    if INTROSPECTION in supports:
        rosidl_typesupport_introspection_c.generate_c(report("c", INTROSPECTION))
    rosidl_typesupport_c.generate_c(report("c", "rosidl_typesupport_c"), supports)
    generate_py(report("py", "rosidl_generator_py"), ["rosidl_typesupport_c"])
    for kind in ("rosidl_generator_c", *supports):
        name = f"{kind}__visibility_control.h"
        text = (fraction / kind / "resource" / f"{name}.in").read_text()
        text = text.replace("@PROJECT_NAME@", package).replace("@PROJECT_NAME_UPPER@", package.upper())
        (folder / "c" / package / "msg" / name).write_text(text)
    (folder / "py" / package / "__init__.py").touch()


def compile_all(folder: Path, package: str) -> None:
    """The extension module beside the Python sources."""
    import numpy

    headers = [folder / "c", PREFIX / "include", *(p for p in (PREFIX / "include").iterdir() if p.is_dir())]
    headers += [Path(sysconfig.get_path("include")), Path(numpy.get_include())]
    flags = ["-O0", "-fPIC", "-w", *(f"-I{path}" for path in headers)]
    sources = sorted((*(folder / "c").rglob("*.c"), *(folder / "py").rglob("*.c")))
    described = [path for path in sources if path.name.endswith("__description.c")]  # their names collide
    whole = {"whole.c": [p for p in sources if p not in described], "whole.cpp": (folder / "c").rglob("*.cpp")}
    for name, parts in whole.items():
        (folder / name).write_text("".join(f'#include "{path}"\n' for path in parts))
    objects = []
    for path in (*described, *(folder / name for name in whole)):
        objects.append(str(folder / f"{path.name}.o"))
        compiler = ["g++", "-std=c++17"] if path.suffix == ".cpp" else ["gcc"]
        subprocess.run([*compiler, *flags, "-c", str(path), "-o", objects[-1]], check=True)
    library = PREFIX / "lib"
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    target = folder / "py" / package / f"{package}_s__rosidl_typesupport_c{suffix}"
    kinds = ("rosidl_typesupport_c", SUPPORT, INTROSPECTION, "rosidl_generator_c", "rosidl_generator_py")
    linked = [str(library / f"lib{name}__{kind}.so") for name in NEEDED[package] for kind in kinds]
    paths = [f"-L{library}", f"-Wl,-rpath,{library}", *(f"-l{name}" for name in LIBRARIES)]
    subprocess.run(["g++", "-shared", "-o", str(target), *objects, *paths, *linked], check=True)
    if package == PACKAGE:
        return
    # where there are two supports, each is looked for as a library of its own, among those that are loaded too
    for kind in (SUPPORT, INTROSPECTION):
        made = folder / "py" / f"lib{package}__{kind}.so"
        named = [f"-Wl,-soname,{made.name}", "-Wl,--no-as-needed", str(target)]
        subprocess.run(["g++", "-shared", "-o", str(made), *named], check=True)
    (folder / "py" / package / "__init__.py").write_text(
        "import ctypes, pathlib\n[ctypes.CDLL(made) for made in pathlib.Path(__file__).parents[1].glob('lib*.so')]\n"
    )


if __name__ == "__main__":
    place, package = Path(sys.argv[1]), sys.argv[3]
    generate(place, Path(sys.argv[2]), package)
    compile_all(place, package)
