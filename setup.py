"""One package for both worlds: pip wheels, and colcon with ROS from its distribution."""

import os
import re
import sys
from pathlib import Path

from setuptools import find_packages, setup

HERE = Path(__file__).resolve().parent  # colcon --symlink-install runs a link to this file
NAME = "cable_sim_ros"
VERSION = re.search(r'__version__ = "([^"]+)"', (HERE / NAME / "version.py").read_text()).group(1)

REQUIRES = [
    line.partition("#")[0].strip()
    for line in (HERE / NAME / "requirements.txt").read_text("utf-8").splitlines()
    if line.partition("#")[0].strip()
]


def ros(rclpy, common, rcl):
    """Wheels of one ROS distribution, by the versions of three of its repositories: rclpy and its messages must come
    from the same one."""
    return (
        [f"ros-rclpy[fastrtps]~={rclpy}"]
        + [f"ros-{name}-msgs~={common}" for name in ("diagnostic", "geometry", "nav", "sensor", "std", "visualization")]
        + [f"ros-std-srvs~={common}"]
        + [f"ros-{name}~={rcl}" for name in ("rcl-interfaces", "lifecycle-msgs", "rosgraph-msgs")]
    )


JAZZY = ros("7.1.6", "5.3.6", "2.0.3")  # supported until May 2029
KILTED = ros("9.1.2", "5.5.1", "2.3.0")  # until December 2026

PEERS = ["moordyn>=2.7", "mujoco>=3.3", "exudyn>=1.13", "cabledyn>=0.3"]  # other codes, for cable-sim bench --peers
SWEEP = [  # cable-sim sweep, table, envelope, sensitivity
    "pyarrow>=18",  # rows, as they come
    "xarray>=2024.10",
    "pandas>=2.2",
    "h5netcdf>=1.4",
    "h5py>=3.12",
    "dask>=2024.10",  # --cluster
    "distributed>=2024.10",
    "cryptography>=42",  # the certificate of a cluster
]
DOCS = ["sphinx>=9,<10", "myst-parser>=5,<6", "furo>=2025.12.19"]  # make docs; what docs/conf.py is written against
IMPORT = [  # logs of others; each is imported when such a log is read
    "pynmeagps>=1.1",  # fields of the sentences of NMEA 0183
    "nmea2000>=2026.10",  # PGN database of canboat; from there on with its backend in Rust
    "pyulog>=1.2",  # ULog
    "pyxtf>=1.4",  # layouts of the packets of XTF
    "pyarrow>=18",  # Parquet; from there on for Python 3.13
    "xarray>=2024.10",  # NetCDF, with h5netcdf and h5py
    "h5netcdf>=1.4",
    "h5py>=3.12",
    "vqf>=2.1",  # attitude of an IMU that tells none
]
CALIBRATE = ["iminuit>=2.30"]  # profile likelihood of cable-sim calibrate
EXPORT = ["xarray>=2024.10", "h5netcdf>=1.4", "h5py>=3.12", "pyarrow>=18"]  # cable-sim export to NetCDF and Parquet
FMU = ["pythonfmu>=0.7", "pythonfmu3>=0.3.4"]  # cable-sim fmu; the FMU holds the binary of its exporter
PLOTS = ["matplotlib>=3.8", "pillow>=9.1"]  # pillow: fewer colours; it comes with matplotlib
REPORT = ["jinja2>=3.1", "markupsafe>=2.1", *PLOTS]  # --report: a run as one HTML file
VIEW = [  # cable-sim view and film
    "viser>=1.1.1,<2",  # the page is in its wheel; from there on panels are docked and lines have a thickness
    "websockets>=13.1",  # that of viser, asked who may open one
    "imageio-ffmpeg>=0.5",  # brings ffmpeg
    *PLOTS,
]
TEST = [
    "fmpy>=0.3.22",  # flies the FMU
    "pytest>=8",
    "junitparser>=3.1",  # reads the JUnit file of cable-sim compare
    "pytest-xdist>=3.7",  # make install-check: two installs side by side
    "click>=8.2",  # its test runner keeps the two outputs apart
    "hypothesis>=6",
    "pynmea2>=1.19",  # reads our sentences of NMEA 0183
    "ruff>=0.17,<0.18",  # the set of rules changes with the minor version
    "mypy>=2.4,<2.5",  # likewise what it finds
    "pyyaml>=6",  # as a reader of YAML 1.1
    "coverage>=7.10,<8",  # counts child processes from 7.10 on
    "colcon-common-extensions>=0.3",
    "setuptools<80",  # colcon-core: `setup.py develop` and `install` as they were before 80
]

KERNELS = "compiler/kernels"  # there in what `make wheel` builds from: verification/wheel.py
OF_LEVEL = {  # which Python and processors the wheel is for; with others it works too, and compiles
    "python_tag": f"cp{sys.version_info[0]}{sys.version_info[1]}",
    "plat_name": "manylinux_2_28_x86_64",  # that of numba's wheels
}

IN_PLACE = bool({"editable_wheel", "develop"} & set(sys.argv))
COMMANDS = {  # what extensions.py finds; a package of its own adds to the same groups
    "ahc": "ahc.command",
    "calibrate": "calibrate.command",
    "clear": "clear.command",
    "compare": "compare.command",
    "ensemble": "ensemble.command",
    "envelope": "sweeps.analyses",
    "export": "export.command",
    "film": "view.command",
    "fmu": "fmu.command",
    "gradients": "sweeps.gradients",
    "import": "logs.command:import_command",
    "inspect": "logs.command",
    "layback": "layback.command",
    "plan": "plan.command",
    "report": "report.command",
    "sensitivity": "sweeps.analyses",
    "span": "spans.command",
    "sweep": "sweeps.command",
    "table": "sweeps.table",
    "telegrams": "telegrams.command",
    "towbody": "towbody.command",
    "tows": "tows.command",
    "view": "view.command",
    "viv": "spans.command",
}
OF_A_CHECKOUT = {  # extensions.py offers them where verification/ is there: in no wheel
    **dict.fromkeys(("bench", "case", "stress", "validate"), "verification.commands"),
    "soak": "verification.soak.command",
}
EXTENSIONS = {
    "cable_sim.commands": [
        *(f"{name} = {NAME}.tools.{where if ':' in where else f'{where}:{name}'}" for name, where in COMMANDS.items()),
        *(f"{name} = {where}:{name}" for name, where in OF_A_CHECKOUT.items()),
    ],
    "cable_sim.node_parts": [
        f"fix = {NAME}.tools.layback.node_part:TowbodyFix",
        f"telegrams = {NAME}.tools.telegrams.sender:Sender",
    ],
    "cable_sim.pages": [f"mapping_keys = {NAME}.tools.logs.imports.mapping_manual:text"],
    "cable_sim.run_parts": [f"report = {NAME}.tools.report.write", f"scores = {NAME}.tools.compare.command"],
}


def shared(*folders):
    """Data files of the top-level folders, for share/<package>/<folder> in both worlds."""
    for folder in folders:
        for path, _, files in os.walk(folder):
            kept = sorted(os.path.join(path, name) for name in files if not name.startswith("."))
            if kept and os.path.basename(path) != "__pycache__":
                yield os.path.join("share", NAME, path), kept


setup(
    name=NAME,
    version=VERSION,
    description="Simulates a shipboard cable tow in real time",
    long_description=(HERE / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="cable_sim_ros maintainers",
    maintainer="cable_sim_ros maintainers",
    maintainer_email="maintainers@cable-sim.org",
    license="MIT",
    packages=find_packages(include=[NAME, NAME + ".*", *(["verification", "verification.*"] if IN_PLACE else [])]),
    package_data={NAME: ["py.typed", "requirements.txt", "**/*.html", "**/*.c", "**/*.js", "**/*.css", f"{KERNELS}/*"]},
    options={"bdist_wheel": OF_LEVEL} if (HERE / NAME / KERNELS).is_dir() else {},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
        *shared("bags", "config", "launch"),
    ],
    python_requires=">=3.11",
    install_requires=REQUIRES,
    extras_require={
        "ros": JAZZY,
        "ros-jazzy": JAZZY,
        "ros-kilted": KILTED,
        "viz": PLOTS,
        "import": IMPORT,
        "calibrate": CALIBRATE,
        "export": EXPORT,
        "fmu": FMU,
        "view": VIEW,
        "report": REPORT,
        "all": sorted({*IMPORT, *CALIBRATE, *EXPORT, *FMU, *VIEW, *REPORT, *SWEEP}),
        "test": TEST,
        "peers": PEERS,
        "docs": DOCS,
        "sweep": SWEEP,
    },
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "cable-sim = cable_sim_ros.start:cable_sim",
            "node = cable_sim_ros.start:node",  # ros2 run cable_sim_ros node
        ],
        **EXTENSIONS,
        # named as its module, so that `pytest -p cable_sim_ros.testing.plugin` without an install is the same plugin
        "pytest11": ["cable_sim_ros.testing.plugin = cable_sim_ros.testing.plugin"],
    },
)
