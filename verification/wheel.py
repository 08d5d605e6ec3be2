"""`make wheel`: a wheel that brings the kernels of the shipped scenes, compiled for every processor with x86-64-v3.

The sources are copied, the kernels compiled from the copy for that level of processors, which a folder under build/
keeps for the next time, and put into the copy (compiler/packaged.py), of which pip makes the wheel. Beside the kernels
it is the wheel that `pip wheel .` makes.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "build" / "kernels"
LEVEL = "x86-64-v3"
BUILD = "1x86_64_v3"  # in the name of the wheel: pip knows no tag for a level of processors
PARTS = ("package.xml", "setup.py", "setup.cfg", "pyproject.toml", "README.md", "LICENSE")
FOLDERS = ("resource", "cable_sim_ros", "config", "bags", "launch")
NONE = shutil.ignore_patterns("__pycache__", "*.nb[ic]", "kernels")
COMPILE = """
import sys
from pathlib import Path
from numba.core.registry import cpu_target
from cable_sim_ros.compiler import packaged
from cable_sim_ros.compiler.kernel_cache import files
from cable_sim_ros.runs import offline
for scene in sys.argv[2:]:
    for step in ("fixed", "chosen"):
        offline.run(scene, heave=(0.5, 6.0), duration=0.2, step=step)
    print(f"{Path(scene).stem}: {packaged.packaged.told()} so far", flush=True)
target = cpu_target.target_context.codegen().magic_tuple()
packaged.pack(files.folders[0], packaged.origins, Path(sys.argv[1]), target)
"""


def scenes(folder: Path) -> list[Path]:
    """The shipped scenes, full_scale the first."""
    sys.path.insert(0, str(ROOT))
    from cable_sim_ros.io.scenes.document import shipped_scenes

    names = sorted(shipped_scenes(), key=lambda name: (name != "full_scale", name))
    return [folder / "config" / f"{name}.yaml" for name in names]


def build(out: Path, these: list[str] | None = None) -> Path:
    """The wheel in ``out``; these: names of the scenes whose kernels it brings, all that are shipped by default.

    Raises subprocess.CalledProcessError where a scene does not compile or pip makes no wheel.
    """
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(scratch) / "source"
        source.mkdir()
        for part in PARTS:
            shutil.copy(ROOT / part, source)
        for part in FOLDERS:
            shutil.copytree(ROOT / part, source / part, ignore=NONE)
        paths = [str(path) for path in scenes(source) if these is None or path.stem in these]
        kernels = source / "cable_sim_ros" / "compiler" / "kernels"
        own = {"NUMBA_CPU_NAME": LEVEL, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(KEPT)}
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA_", "CABLE_SIM_"))} | own
        command = [sys.executable, "-W", "ignore", "-c", COMPILE, str(kernels), *paths]
        subprocess.run(command, env=environment | {"PYTHONPATH": str(source)}, cwd=scratch, check=True)
        for made in source.rglob("__pycache__"):
            shutil.rmtree(made)
        made = Path(scratch) / "made"
        pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--disable-pip-version-check", "-w", str(made)]
        subprocess.run([*pip, str(source)], check=True)
        (wheel,) = made.glob("*.whl")
        out.mkdir(parents=True, exist_ok=True)
        sizes = [path.stat().st_size / 1e6 for path in (*kernels.iterdir(), wheel)]
        print(f"{len(sizes) - 2} kernels for {LEVEL}, {sum(sizes[:-1]):.1f} MB; wheel {sizes[-1]:.1f} MB")
        name, version, tags = wheel.name.split("-", 2)
        # not by setuptools, which would name the folder of its data after the build too: uv leaves that where it is
        return Path(shutil.copy(wheel, out / f"{name}-{version}-{BUILD}-{tags}"))


def main() -> int:
    """Arguments: the folder for the wheel, then names of scenes, if not all."""
    if platform.machine() != "x86_64" or sys.platform != "linux":
        print(
            f"error: the kernels of the wheel are for {LEVEL} under Linux, this is {platform.machine()}",
            file=sys.stderr,
        )
        return 2
    print(build(Path(sys.argv[1]), sys.argv[2:] or None))
    return 0


if __name__ == "__main__":
    sys.exit(main())
