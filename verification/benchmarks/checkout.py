"""Another commit of this project beside this tree: checked out for a while, and both run as a user runs them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from cable_sim_ros.errors import CableSimError

ROOT = Path(__file__).resolve().parents[2]
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
# every clock that a version times itself with is that of its CPU: at some commits P7 read the one of the wall
LAUNCH = """
import runpy, sys, time
time.perf_counter = time.process_time
sys.argv = ["cable-sim", *sys.argv[1:]]
runpy.run_module("cable_sim_ros.cli", run_name="__main__", alter_sys=True)
"""
IMPORT = "import cable_sim_ros, cable_sim_ros.cli; print(cable_sim_ros.__file__)"


class CompareError(CableSimError):
    """There is nothing to compare with; the text says what was asked for, why, and the remedy."""


class Tree(NamedTuple):
    """A source tree: what it is called in the table, its folder, and its kernel cache (None: the user's)."""

    name: str
    folder: Path
    cache: Path | None = None

    def python(self, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run code in a process of its own that imports this tree, on one thread."""
        environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(self.folder)}
        if self.cache is not None:
            environment["NUMBA_CACHE_DIR"] = str(self.cache)
        return subprocess.run(
            [sys.executable, "-P", "-c", code, *arguments],
            env=environment,
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )

    def command(self, *arguments: str) -> tuple[Any, str]:
        """What ``cable-sim`` of this tree prints as JSON, or None and its last words."""
        done = self.python(LAUNCH, *arguments, "--json")
        try:
            return json.loads(done.stdout), ""
        except ValueError:
            return None, last_words(done)


def last_words(done: subprocess.CompletedProcess[str]) -> str:
    """The last line of a process that failed."""
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    return lines[-1] if lines else f"it left with code {done.returncode} and said nothing"


def _git(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    clean = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-C", str(folder), *arguments]
    try:
        return subprocess.run(command, env=clean, capture_output=True, text=True, check=False)
    except OSError as error:
        raise CompareError(
            f"git cannot be run ({error.strerror}), and an earlier version is checked out with it; nothing was "
            f"compared. Install git"
        ) from None


def resolved(commit: str, root: Path = ROOT) -> str:
    """The full name of a commit of the repository in ``root``. Raises CompareError."""
    top = _git(root, "rev-parse", "--show-toplevel")
    if top.returncode or Path(top.stdout.strip()).resolve() != root.resolve():
        raise CompareError(
            f"--against {commit}: {root}, from which this version runs, is no git repository, so that no other "
            f"version can be checked out; nothing was compared. Run the command in a clone of the project, installed "
            f"in place (pip install -e .)"
        )
    found = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{commit}^{{commit}}")
    if found.returncode:
        raise CompareError(
            f"--against {commit}: no commit of {root} has this name; nothing was compared. `git log --oneline` and "
            f"`git tag` list the names; a shallow clone first needs `git fetch --unshallow --tags`"
        )
    return found.stdout.strip()


def described(root: Path = ROOT) -> str:
    """What this tree is: its commit, with -dirty where it was edited since."""
    return _git(root, "describe", "--always", "--dirty", "--abbrev=7", "--exclude=*").stdout.strip()


@contextmanager
def checked_out(commit: str, out: Path | None = None, root: Path = ROOT) -> Iterator[Tree]:
    """The commit in a work tree of its own below ``out`` (None: the temporary folder), removed afterwards.

    Its kernels are compiled into a folder beside it, which goes with it. Raises CompareError.
    """
    full = resolved(commit, root)
    place = Path(tempfile.mkdtemp(prefix="against_", dir=out)).resolve()
    tree = Tree(full[:7], place / "tree", place / "kernels")
    try:
        made = _git(root, "worktree", "add", "--detach", "--quiet", str(tree.folder), full)
        if made.returncode:
            raise CompareError(
                f"--against {commit}: git cannot check it out into {tree.folder} ({last_words(made)}); nothing was "
                f"compared. Give --out a folder with room for it, and `git worktree prune` what is left over"
            )
        _importable(commit, tree)
        yield tree
    finally:
        if tree.folder.exists():
            _git(root, "worktree", "remove", "--force", str(tree.folder))
        shutil.rmtree(place, ignore_errors=True)


def _importable(commit: str, tree: Tree) -> None:
    done = tree.python(IMPORT)
    found = Path(done.stdout.strip() or ".").resolve()
    if done.returncode or tree.folder not in found.parents:
        why = last_words(done) if done.returncode else f"Python imports {found} in its place"
        raise CompareError(
            f"--against {commit}: the package of that commit cannot be imported with {sys.executable} ({why}); "
            f"nothing was compared. Give a later commit, or an environment with what its setup.py asks for"
        )


def first_that_runs(tree: Tree, commands: Sequence[Sequence[str]]) -> tuple[Any, str]:
    """JSON of the first command whose options the tree knows, or None and the last words of the last one."""
    report, words = None, ""
    for arguments in commands:
        report, words = tree.command(*arguments)
        if report is not None or "No such option" not in words:
            break
    return report, words
