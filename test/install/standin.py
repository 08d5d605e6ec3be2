"""A stand-in for Ubuntu 24.04 with ROS from apt, in one folder, made without apt and without root.

What it stands for: a system Python that pip may not write to (PEP 668), whose packages have the versions that Ubuntu
holds; colcon beside them; ``/opt/ros/<distribution>`` with a ``setup.bash`` that sets what the real one sets. What it
does not: the C libraries, compilers and numpy builds of Ubuntu, apt and dpkg themselves, any `ros2` command but `run`.
The ROS in it is that of the wheels in the environment of the tests, without the hook that makes wheels start.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from importlib import metadata
from pathlib import Path

from cable_sim_ros.io.bags.typestore import ROS_DISTRO

ROOT = Path(__file__).resolve().parents[2]
UBUNTU = {  # of 24.04, by installation logs and package lists in public repositories; numba's: by docs/install.md
    "numpy": "1.26.4",
    "scipy": "1.11.4",
    "numba": "0.58.1",
    "pydantic": "1.10.14",
    "ruamel.yaml": "0.17.21",
    "click": "8.1.6",
    "rich": "13.7.1",
    "setuptools": "68.1.2",
}
PARTS = "package.xml setup.py setup.cfg pyproject.toml README.md MANIFEST.in LICENSE requirements.txt"
PARTS += " resource cable_sim_ros config bags launch"
MARKER = """[externally-managed]
Error=To install Python packages system-wide, try apt install
 python3-xyz, where xyz is the package you are trying to
 install.
"""
SETUP = """export AMENT_PREFIX_PATH="{prefix}${{AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}}"
export PYTHONPATH="{site}${{PYTHONPATH:+:$PYTHONPATH}}"
export LD_LIBRARY_PATH="{libraries}${{LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}}"
export PATH="{prefix}/bin:$PATH"
export ROS_DISTRO={distro} ROS_VERSION=2 ROS_PYTHON_VERSION=3
"""
ROS2 = """#!{python}
# `ros2 run PACKAGE EXECUTABLE ...` as ros2run does it: the file in lib/PACKAGE of the prefix the index names
import os, sys
from ament_index_python.packages import PackageNotFoundError, get_package_prefix
_, verb, package, executable, *arguments = sys.argv
assert verb == "run"
try:
    path = os.path.join(get_package_prefix(package), "lib", package, executable)
except PackageNotFoundError:
    sys.exit(f"Package '{{package}}' not found")
if not os.access(path, os.X_OK):
    sys.exit("No executable found")
os.execv(path, [path, *arguments])
"""


def copied(folder: Path) -> Path:
    """The sources, as a checkout has them."""
    folder.mkdir(parents=True)
    for part in PARTS.split():
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.nb[ic]"))
        else:
            shutil.copy(ROOT / part, folder / part)
    with (folder / "setup.cfg").open("a") as file:
        file.write("[install_lib]\ncompile = 0\n")  # of what colcon installs a test imports a tenth
    return folder


UV = importlib.util.find_spec("uv") is not None  # takes a tenth of pip's time


def environment(folder: Path, *packages: str, python: str = sys.executable) -> Path:
    """The folder of the commands of a new environment that has these packages."""
    inside = str(folder / "bin" / "python")
    subprocess.run([python, "-m", "venv", *["--without-pip"] * UV, str(folder)], check=True, timeout=600)
    pip = [sys.executable, "-m", "uv", "pip", "install", "--python", inside] if UV else [inside, "-m", "pip", "install"]
    subprocess.run([*pip, "-q", *packages], check=True, timeout=600)
    return folder / "bin"


def linked(names: set[str], prefix: Path, site: Path | None = None) -> None:
    """Links the files of installed distributions into another prefix, at the same places; modules into `site`."""
    modules = Path(sysconfig.get_path("purelib")).relative_to(sys.prefix)
    for name in names:
        for file in metadata.distribution(name).files or ():
            source = Path(os.path.normpath(file.locate()))
            if not source.is_relative_to(sys.prefix) or not source.exists():
                continue
            place = source.relative_to(sys.prefix)
            if source.suffix in (".pyc", ".pth") or place.parts[0] == "bin":
                continue
            target = prefix / place
            if site is not None and place.is_relative_to(modules):
                target = site / place.relative_to(modules)
            target.parent.mkdir(parents=True, exist_ok=True)
            if not target.exists():
                target.symlink_to(source)


def with_dependencies(name: str, found: set[str], without: set[str]) -> set[str]:
    """Names of a distribution and of all it needs, those in `without` left out."""
    if name in found or name in without:
        return found
    try:
        requires = metadata.requires(name) or []
    except metadata.PackageNotFoundError:  # for another system
        return found
    found.add(name)
    for requirement in requires:
        if "extra ==" not in requirement:
            with_dependencies(re.match(r"[\w.-]+", requirement)[0].lower(), found, without)
    return found


class World:
    """The folder, and a shell in it."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.home, self.usr, self.ros = root / "home", root / "usr", root / "opt" / "ros" / ROS_DISTRO
        self.python = self.usr / "bin" / "python3"
        self.transcript: list[str] = []
        self.home.mkdir(parents=True)
        self._system()
        self._distribution()

    def _system(self) -> None:
        stdlib = Path(sysconfig.get_path("stdlib"))
        here = self.usr / "lib" / stdlib.name
        # Debian's own Python, as Ubuntu's, looks there
        debian = "deb_system" in sysconfig.get_scheme_names()
        here.mkdir(parents=True)
        self.site = self.usr / "lib" / "python3" / "dist-packages" if debian else here / "site-packages"
        self.site.mkdir(parents=True)
        for entry in stdlib.iterdir():
            if entry.name not in ("site-packages", "dist-packages", "EXTERNALLY-MANAGED", "__pycache__"):
                (here / entry.name).symlink_to(entry)
        for library in Path(sys.base_prefix, "lib").glob("libpython*"):
            (self.usr / "lib" / library.name).symlink_to(library)
        self.python.parent.mkdir()
        shutil.copy(os.path.realpath(sys.executable), self.python)  # no link: Python would follow it home
        for name in (f"python3.{sys.version_info.minor}", "python"):
            (self.python.parent / name).symlink_to("python3")
        wanted, stubs = dict(UBUNTU), {}
        if sys.version_info >= (3, 12):  # the first wheel of numba for 3.12 is 0.59; Ubuntu has patched its own
            stubs = {"numba": wanted.pop("numba")}
        pip = [sys.executable, "-m", *["uv"] * UV, "pip", "install", "-q", "--only-binary=:all:", "--target"]
        packages = ["pip", *(f"{name}=={version}" for name, version in wanted.items())]
        subprocess.run([*pip, str(self.site), *packages], check=True, timeout=600)
        for name, version in stubs.items():
            info = self.site / f"{name}-{version}.dist-info"
            info.mkdir()
            (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
            (self.site / f"{name}.py").write_text("raise ImportError('stands for a numba that is too old')\n")
        linked(with_dependencies("colcon-common-extensions", set(), {n.lower() for n in UBUNTU}), self.usr, self.site)
        colcon = self.python.with_name("colcon")
        colcon.write_text(f"#!{self.python}\nimport sys\nfrom colcon_core.command import main\nsys.exit(main())\n")
        colcon.chmod(0o755)
        (here / "EXTERNALLY-MANAGED").write_text(MARKER)

    def _distribution(self) -> None:
        wheels = {dist.name for dist in metadata.distributions() if (dist.name or "").startswith("ros-")}
        linked(wheels - {"ros-wheels-bootstrapper"}, self.ros)
        site = self.ros / "lib" / f"python3.{sys.version_info.minor}" / "site-packages"
        libraries = ":".join(map(str, [self.ros / "lib", *sorted(site.glob("ros_*.libs"))]))
        setup = SETUP.format(prefix=self.ros, site=site, libraries=libraries, distro=ROS_DISTRO)
        for name in ("setup.bash", "setup.sh", "local_setup.bash"):
            (self.ros / name).write_text(setup)
        command = self.ros / "bin" / "ros2"
        command.parent.mkdir(exist_ok=True)
        command.write_text(ROS2.format(python=self.python))
        command.chmod(0o755)

    def shell(self, script: str, *, timeout: float = 600, said: bool = True, check: bool = False, **environment: str):
        """Run a script in a new shell that stops at the first failure; only ``/opt/ros/jazzy`` is put elsewhere."""
        there = script.replace("/opt/ros/jazzy", str(self.ros))
        clean = {name: value for name, value in os.environ.items() if name.startswith("PIP_") or name == "LANG"}
        clean |= {"HOME": str(self.home), "PATH": f"{self.python.parent}:/usr/bin:/bin"} | environment
        done = subprocess.run(
            ["bash", "-ec", there],
            cwd=self.home,
            env=clean,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            timeout=timeout,
        )
        if said:
            text = done.stdout.replace(str(self.ros), "/opt/ros/jazzy").replace(str(self.home), "~")
            lines = [
                line for line in text.replace(str(self.usr), "/usr").splitlines() if "WARNING: Location" not in line
            ]
            self.transcript += [*(f"$ {line}" for line in script.strip().splitlines()), *lines]
            self.transcript.append(f"[exit code {done.returncode}]")
        assert not check or done.returncode == 0, f"{script}\n{done.stdout}"
        return done


def commands(page: str, heading: str) -> list[str]:
    """The shell blocks of a page under a heading, without what only root may do (``sudo``)."""
    text = page.split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]
    blocks = re.findall(r"^```bash\n(.*?)^```$", text, re.M | re.S)
    return ["".join(line for line in block.splitlines(True) if not line.startswith("sudo ")) for block in blocks]
