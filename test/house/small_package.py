"""A package of a few kernels with a copy of what compiles: what an edit costs and gives, in processes of its own."""

from __future__ import annotations

import functools
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).resolve().parents[2] / "cable_sim_ros"
COMPILERS = ("jit.py", "by_symbol.py", "kernel_form.py", "kernel_key.py", "kernel_cache.py", "compiling.py")
COMPILERS += ("packaged.py", "kernel_reference.py", "shortcuts.py")
FILES = {
    "__init__.py": "",
    "physics/__init__.py": "",
    "compiler/__init__.py": "",
    "sim/__init__.py": "",
    "physics/numbers.py": '''
        """Numbers, a table, an enum and a record."""
        import enum
        from typing import NamedTuple
        import numpy as np

        FACTOR = 2.0
        TABLE = np.array([1.0, 10.0])

        class Law(enum.IntEnum):
            LINEAR = 1
            SQUARE = 2

        class Pair(NamedTuple):
            first: float
            second: float

        ROW = np.dtype([("a", "f8"), ("b", "f8")])
        ''',
    "physics/inlined.py": '''
        """Copied into what calls it."""
        from ..compiler.jit import inline
        from .numbers import FACTOR, TABLE, Law, Pair

        @inline
        def scaled(x):
            """A multiple."""
            return FACTOR * x  # of it

        @inline
        def tabled(i):
            return TABLE[i]

        @inline
        def by_law(x, law):
            return x * x if law == Law.SQUARE else x

        @inline
        def paired(x):
            return Pair(x, 0.0)
        ''',
    "physics/heavy.py": '''
        """Called by symbol."""
        from .inlined import paired, scaled
        from ..compiler.jit import driver, link, opaque

        @driver
        def _heavy(rows) -> float:
            """The first of a row."""
            return scaled(paired(rows[0].a).first)

        heavy = opaque(_heavy)

        @driver
        def _heavier(rows) -> float:
            return heavy(rows) + 1000.0

        heavier = opaque(_heavier)

        def link_heavy(rows):
            link(_heavy, rows)
            link(_heavier, rows)
        ''',
    "sim/top.py": '''
        """The entry."""
        import sys
        import numpy as np
        from ..physics.heavy import heavier, link_heavy
        from ..physics.inlined import by_law, tabled
        from ..compiler.jit import driver
        from ..physics.numbers import ROW
        from ..compiler import compiling

        @driver
        def run(rows, law):
            return heavier(rows) + tabled(1) + by_law(3.0, law)

        def needs():
            rows = np.zeros(1, ROW).view(np.recarray)
            rows[0].a, rows[0].b = 100.0, 200.0
            return link_heavy, (rows,), run, (rows, 2)

        def result():
            compiling.prepare(*needs())
            return run(*needs()[3])
        ''',
}
PROGRAM = """
import json, os, sys
from numba.core import event
import small.compiler.compiling as compiling

class Compiled(event.Listener):
    names = []

    def on_start(self, e):
        function = e.data["dispatcher"].py_func
        if function.__module__.startswith("small"):
            self.names.append(function.__name__)

    def on_end(self, e):
        pass

event.register("numba:compile", Compiled())
{setup}
from small.sim.top import result
value = result()
print(json.dumps({{"value": value, "compiled": sorted(Compiled.names)}}))
"""
FORKS = """
import json, os, signal, sys
import numba
sys.dont_write_bytecode = True
for line in sys.stdin:
    folder, cache, program = json.loads(line)
    if child := os.fork():
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
        continue
    signal.alarm(600)  # s, ends it
    for number, path in enumerate((os.devnull, folder + "/out", folder + "/err")):
        os.dup2(os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC), number)
    os.environ.update(PYTHONPATH=folder, NUMBA_CACHE_DIR=cache, PYTHONDONTWRITEBYTECODE="1")
    os.chdir(folder)
    sys.path.insert(0, folder)
    exec(program)
    sys.exit()
"""
AS_IT_IS = 1000.0 + 200.0 + 10.0 + 9.0


class Ran(NamedTuple):
    """What a process printed: its result, and the kernels that it compiled itself."""

    value: float
    compiled: list[str]


@functools.cache
def forks() -> subprocess.Popen:
    """A process whose forks have numba imported, which is most of a run."""
    return subprocess.Popen([sys.executable, "-c", FORKS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


class Small:
    """The package in a folder, with a cache beside it."""

    def __init__(self, folder: Path):
        self.folder, self.cache = folder, folder / "cache"
        for name, text in FILES.items():
            path = folder / "small" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            lines = text.strip("\n").splitlines()
            path.write_text("\n".join(line.removeprefix(" " * 8) for line in lines) + "\n")
        for name in COMPILERS:
            shutil.copy(PACKAGE / "compiler" / name, folder / "small" / "compiler")

    def edit(self, file: str, old: str, new: str) -> None:
        """Put ``new`` for ``old`` into a file of the package, which has it once."""
        path = self.folder / "small" / file
        text = path.read_text()
        assert text.count(old) == 1, f"{file} has {text.count(old)} of {old}"
        path.write_text(text.replace(old, new))

    def start(self, setup: str = "", how: str = "-c", **environment: str) -> subprocess.Popen:
        """A process that runs the entry; how: -c, or - for the standard input."""
        program = PROGRAM.format(setup=setup)
        own = {"PYTHONPATH": str(self.folder), "NUMBA_CACHE_DIR": str(self.cache), "PYTHONDONTWRITEBYTECODE": "1"}
        pipe = subprocess.PIPE
        process = subprocess.Popen(
            [sys.executable, how, *([program] if how == "-c" else [])],
            cwd=self.folder,
            env={**os.environ, **own, **environment},
            stdin=pipe,
            stdout=pipe,
            stderr=pipe,
            text=True,
        )
        assert process.stdin is not None
        if how == "-":
            process.stdin.write(program)
        process.stdin.close()
        process.stdin = None
        return process

    def run(self, setup: str = "", how: str = "", **environment: str) -> Ran:
        """What a fork printed, or a process of start() where one is asked for or has variables of its own."""
        if how or environment:
            return self.end(self.start(setup, how or "-c", **environment))
        asked = json.dumps([str(self.folder), str(self.cache), PROGRAM.format(setup=setup)])
        print(asked, file=forks().stdin, flush=True)
        code = forks().stdout.readline()
        assert code == "0\n", (self.folder / "err").read_text()[-3000:]
        return Ran(**json.loads((self.folder / "out").read_text()))

    @staticmethod
    def end(process: subprocess.Popen) -> Ran:
        """What the process printed."""
        out, err = process.communicate(timeout=600)
        assert process.returncode == 0, err[-3000:]
        return Ran(**json.loads(out))

    def files(self) -> dict[str, bytes]:
        """What is on disk, by name."""
        folder = self.cache / "cable_sim_ros" / "kernels"
        return {path.name: path.read_bytes() for path in folder.iterdir()} if folder.exists() else {}
