"""Kernels that came with the package: compiled where its wheel was built, for every processor of one level.

A wheel of ``make wheel`` has them in a folder beside this file, named by their content as those on disk are
(kernel_cache.py), and an index: what they were compiled with and for, and the hash of each file. They are used where
the same versions run and the processor has what the level asks for; what the index does not name is not read, and what
is damaged is compiled here, as if it had not come. Nothing is written into the folder.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections import Counter
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path

from .kernel_cache import CHECK

INDEX = "index.json"
LEVELS = {  # the features of each level, as LLVM calls them: x86-64 psABI 1.0, table 3.1
    "x86-64": (),
    "x86-64-v3": (
        *("cx16", "popcnt", "sse3", "sse4.1", "sse4.2", "ssse3"),
        *("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave"),
    ),
}
PACKAGE, DISK, COMPILED = "package", "disk", "compiled"
origins: dict[str, str] = {}  # names of the files of the kernels that this process runs: where they came from


class Packaged:
    """Contents by name in a folder of the package; none where it has none, or of other versions or processors."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.files: dict[str, str] = {}  # name: hash of the content
        self.target = ""  # as it stands in the keys
        self.level = ""  # of the processors
        self.damaged: set[str] = set()  # names whose content is not that of the index, or could not be read
        try:
            index = json.loads((folder / INDEX).read_text("utf-8"))
            files, target = dict(index["files"]), tuple(index["target"])
            self._made, self._needs = dict(index["versions"]), [str(name) for name in index["needs"]]
            self._system, self.level, _ = target
        except FileNotFoundError:
            return
        except (OSError, ValueError, KeyError, TypeError):
            self.damaged.add(INDEX)
            return
        self.files, self.target = files, repr(target)

    @cached_property
    def refused(self) -> str:
        """Why none of them is used; "": they are, as far as there are any."""
        if not self.files:
            return "their index is damaged" if self.damaged else ""
        for variable in ("CABLE_SIM_KERNELS", "CABLE_SIM_COMPILER"):  # start.py
            if os.environ.get(variable):
                return f"{variable} = {os.environ[variable]}"
        from numba.core.registry import cpu_target  # not with CABLE_SIM_COMPILER: inner parts of some numbas

        from . import kernel_key

        for name, here in kernel_key.versions().items():
            if self._made.get(name) != here:
                return f"they are for {name} {self._made.get(name)}, here is {here}"
        target = cpu_target.target_context.codegen().magic_tuple()
        if repr(target) == self.target:
            return ""
        system, processor, features = target
        has = {word[1:] for word in features.split(",") if word.startswith("+")}
        lacking = [name for name in self._needs if name not in has]
        if lacking or system != self._system:
            return f"they are for {self.level}, here is {processor} without {', '.join(lacking) or self._system}"
        return ""

    def any(self) -> bool:
        """Are there some that this process may use?"""
        return bool(self.files) and not self.refused

    def read(self, name: str) -> bytes | None:
        """The content of that name, None: there is none that is whole."""
        if name not in self.files or name in self.damaged:
            return None
        try:
            content = (self.folder / name).read_bytes()
        except OSError:
            content = b""
        if hashlib.sha256(content).hexdigest() != self.files[name]:
            self.damaged.add(name)
            return None
        return content

    def ahead(self) -> str:
        """What a first start is about to do, in a few words."""
        if self.any():
            return f"loading the kernels, those of the package for {self.level}"
        why = f"; those of the package are not used: {self.refused}" if self.refused else ""
        return f"compiling the kernels (half a minute to two the first time, kept on disk{why})"

    def complaint(self) -> str:
        """A sentence where there are some that cannot be used and nobody asked for it, else nothing."""
        if self.refused and not self.refused.startswith("CABLE_SIM_"):
            return f"the kernels of the package are not used, they were compiled here: {self.refused}"
        if self.damaged and not self.refused:
            return f"{len(self.damaged)} kernels of the package are damaged and were compiled here: install it again"
        return ""

    def told(self) -> str:
        """Where the kernels that this process runs came from."""
        text = {PACKAGE: f"from the package ({self.level})", DISK: "from disk", COMPILED: "compiled now"}
        counts = Counter(origins.values())
        parts = [f"{counts[name]} {words}" for name, words in text.items() if counts[name]]
        if self.files and self.damaged:
            parts.append(f"{len(self.damaged)} of the package damaged and not used")
        if self.refused:
            parts.append(f"those of the package not used: {self.refused}")
        return ", ".join(parts) or "none yet"


def pack(kept: Path, names: Iterable[str], folder: Path, target: tuple[str, str, str]) -> list[str]:
    """Make of the kernels in ``kept``, a folder of kernel_cache.py, those of a package; the names of its files.

    names: of the kernels, others are left out; target: what they were compiled for, of the process that did; its second
    is one of LEVELS. Raises OSError where one is not there.
    """
    from . import kernel_key

    folder.mkdir(parents=True)
    files = {}
    for name in sorted(names):
        content = (kept / name).read_bytes()[CHECK:]
        (folder / name).write_bytes(content)
        files[name] = hashlib.sha256(content).hexdigest()
    index = {"versions": kernel_key.versions(), "target": target, "needs": LEVELS[target[1]], "files": files}
    (folder / INDEX).write_text(json.dumps(index, indent=1) + "\n", "utf-8")
    return [*files, INDEX]


packaged = Packaged(Path(__file__).with_name("kernels"))
