"""What pip and colcon read about the package is the same, and true."""

import ast
import os
import re
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml
from test_floors import read

import cable_sim_ros
from cable_sim_ros.io.scenes import document
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.tools.spans.load import load_span

pytestmark = pytest.mark.trust

ROOT = Path(__file__).resolve().parents[2]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
PACKAGE_XML = ElementTree.parse(ROOT / "package.xml").getroot()
# key -> what it installs on Ubuntu 24.04; source: ros/rosdistro, rosdep/python.yaml at 8468e88 (2026-08-22)
ROSDEP = {
    "python3-click": "apt python3-click",
    "python3-numba": "apt python3-numba",
    "python3-numpy": "apt python3-numpy",
    "python3-pydantic": "apt python3-pydantic",
    "python3-pytest": "apt python3-pytest",
    "python3-rich": "apt python3-rich",
    "python3-rosbags-pip": "pip rosbags",
    "python3-ruamel.yaml": "apt python3-ruamel.yaml",
    "python3-scipy": "apt python3-scipy",
    "mcap-ros2-support": "pip mcap-ros2-support",  # needs mcap, which has no key of its own
}
LAUNCH = {"ament_index_python", "launch", "launch_ros"}  # only with a ROS from its distribution, as ros2 launch is
KEY_OF = {"rosbags": "python3-rosbags-pip", "mcap": "mcap-ros2-support"}


def setup_arguments():
    """Arguments of setup(), without building anything."""
    import setuptools

    seen = {}
    real, setuptools.setup = setuptools.setup, lambda **arguments: seen.update(arguments)
    before = os.getcwd()
    try:
        os.chdir(ROOT)
        exec(
            compile((ROOT / "setup.py").read_text("utf-8"), str(ROOT / "setup.py"), "exec"),
            {"__file__": str(ROOT / "setup.py"), "__name__": "__main__"},
        )
    finally:
        setuptools.setup = real
        os.chdir(before)
    return seen


def name_of(requirement):
    return re.match(r"[A-Za-z0-9_.-]+", requirement).group().lower()


@pytest.fixture(scope="module")
def arguments():
    pytest.importorskip("setuptools")
    return setup_arguments()


def depends(kind):
    return {element.text for element in PACKAGE_XML.findall(kind)}


def test_package_xml_is_one_that_colcon_takes():
    assert PACKAGE_XML.get("format") == "3"
    assert PACKAGE_XML.findtext("export/build_type") == "ament_python"
    mail = PACKAGE_XML.find("maintainer").get("email")  # an invalid one makes colcon treat it as plain Python
    assert re.fullmatch(r"[\w.+-]+@[\w-]+(\.[\w-]+)+", mail)


def test_version_is_the_same_everywhere(arguments):
    assert PACKAGE_XML.findtext("version") == arguments["version"] == cable_sim_ros.__version__ == CITATION["version"]


def test_name_and_licence_are_the_same_everywhere(arguments):
    assert PACKAGE_XML.findtext("name") == arguments["name"] == document.PACKAGE
    assert PACKAGE_XML.findtext("license") == arguments["license"] == "MIT"
    assert (ROOT / "LICENSE").read_text().startswith("MIT License")
    assert CITATION["title"] == arguments["name"] and CITATION["license"] == "MIT"


def test_authors_are_the_same_everywhere(arguments):
    (author,) = CITATION["authors"]
    (named,) = PACKAGE_XML.findall("author")
    assert author["name"] == named.text == arguments["author"] == PACKAGE_XML.findtext("maintainer")
    assert author["email"] == named.get("email") == arguments["maintainer_email"]


def test_the_thesis_that_is_cited_stands_in_the_references():
    (thesis,) = CITATION["references"]
    page = " ".join((ROOT / "docs" / "references.md").read_text("utf-8").split())
    assert f"C. {thesis['authors'][0]['family-names']}, *{thesis['title']}*" in page and str(thesis["year"]) in page


def test_rosdoc2_finds_its_file_the_pages_and_the_package():
    """Its two YAML documents: kind of the file, and settings with paths from the folder of package.xml."""
    file = ROOT / PACKAGE_XML.findtext("export/rosdoc2")
    kind, config = yaml.safe_load_all(file.read_text("utf-8"))
    assert kind == {"type": "rosdoc2 config", "version": 1}
    (builder,) = config["builders"]
    assert (ROOT / builder["sphinx"]["user_doc_dir"] / "conf.py").exists()
    assert (ROOT / config["settings"]["python_source"] / "__init__.py").exists()


@pytest.mark.parametrize("distribution", ["jazzy", "lyrical"])
def test_pixi_takes_what_package_xml_names(distribution):
    feature = tomllib.loads((ROOT / "pixi.toml").read_text("utf-8"))["feature"][distribution]
    taken = {name.removeprefix(f"ros-{distribution}-").replace("-", "_") for name in feature["dependencies"]}
    wanted = depends("exec_depend") - set(ROSDEP) - {"ament_index_python", "launch"}  # these come with launch_ros
    assert taken == wanted | {"rmw_fastrtps_cpp"}


def test_python_dependencies_are_the_same_in_both_worlds(arguments):
    pip = {name_of(r) for r in arguments["install_requires"]} - {"setuptools"}
    assert {KEY_OF.get(name, f"python3-{name}") for name in pip} == depends("exec_depend") & set(ROSDEP)


def test_every_rosdep_key_exists():
    """rosdep stops at a key that it does not know. ROS packages: in the lists of Jazzy and Kilted, as wheels too."""
    for name in depends("exec_depend") | depends("test_depend"):
        ours = name in {*ROSDEP, *LAUNCH, "rclpy"}
        assert ours or re.fullmatch(r"[a-z]+_(msgs|srvs|interfaces)", name), name


@pytest.mark.parametrize("extra", ["ros", "ros-jazzy", "ros-kilted"])
def test_ros_dependencies_are_the_same_in_both_worlds(arguments, extra):
    wheels = {name_of(r).removeprefix("ros-").replace("-", "_") for r in arguments["extras_require"][extra]}
    assert wheels == depends("exec_depend") - set(ROSDEP) - LAUNCH


def test_wheels_of_ros_are_of_one_distribution(arguments):
    """Each pin stays within one: rclpy 7 and 9 have different middleware, and share no message library."""
    extras = arguments["extras_require"]
    assert extras["ros"] == extras["ros-jazzy"]
    for extra, versions in {
        "ros-jazzy": {"7.1.6", "5.3.6", "2.0.3"},
        "ros-kilted": {"9.1.2", "5.5.1", "2.3.0"},
    }.items():
        assert {requirement.partition("~=")[2] for requirement in extras[extra]} == versions


def test_every_import_is_a_dependency(arguments):
    declared = {name_of(r).partition(".")[0] for r in arguments["install_requires"]}
    ros = depends("exec_depend") - set(ROSDEP)
    optional = {"matplotlib", "tf2_msgs", "llvmlite", "pydantic_core"}  # viz; a full ROS; of numba; of pydantic
    optional |= {"lz4", "zstandard"}  # of mcap
    optional |= {"pytest"}  # testing/plugin.py, which pytest loads
    optional |= {"dask_jobqueue"}  # --cluster slurm, on machines that have it
    for extra in set(arguments["extras_require"]) - {"test", "docs"}:
        optional |= {name_of(r).partition(".")[0] for r in arguments["extras_require"][extra]}
    optional |= {"PIL"} if "pillow" in optional else set()
    for path in sorted((ROOT / "cable_sim_ros").rglob("*.py")):
        for node in read(path)[1]:
            names = (
                [a.name for a in node.names]
                if isinstance(node, ast.Import)
                else ([node.module] if isinstance(node, ast.ImportFrom) and not node.level else [])
            )
            for name in names:
                top = name.split(".")[0]
                assert top in sys.stdlib_module_names | declared | ros | optional | {"cable_sim_ros"}, f"{path}: {name}"


def test_no_pyproject_states_a_python_version():
    path = ROOT / "pyproject.toml"
    assert "requires-python =" not in path.read_text("utf-8"), "it breaks colcon builds"


def test_every_pip_builds_a_wheel():
    """An old pip without pyproject.toml runs setup.py develop: by setup.cfg the commands then miss the path."""
    build = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["build-system"]
    assert build["build-backend"] == "setuptools.build_meta" and "setuptools" in {name_of(r) for r in build["requires"]}


def test_executables_lead_somewhere(arguments):
    for line in arguments["entry_points"]["console_scripts"]:
        module, function = line.split("=")[1].split("#")[0].strip().split(":")
        path = ROOT / (module.replace(".", "/") + ".py")
        names = {node.name for node in ast.parse(path.read_text("utf-8")).body if isinstance(node, ast.FunctionDef)}
        assert function in names, line


def test_every_scene_and_bag_is_installed(arguments):
    installed = {Path(file) for _, files in arguments["data_files"] for file in files}
    for folder in ("bags", "config", "launch"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and not path.name.startswith("."):
                assert path.relative_to(ROOT) in installed, path


@pytest.mark.parametrize("name", document.shipped_scenes())
def test_every_shipped_scene_loads_and_is_called_like_its_file(name):
    assert load_scene(name).name == name


@pytest.mark.parametrize("name", document.shipped_spans())
def test_every_shipped_span_loads_and_is_called_like_its_file(name):
    assert load_span(name).name == name


def test_every_file_in_config_is_of_one_kind():
    kinds = [
        document.shipped_scenes(),
        document.shipped_spans(),
        document.shipped_viv(),
        document.shipped_mappings(),
        document.shipped_tows(),
    ]
    ours = [path for path in (ROOT / "config").rglob("*.yaml") if path.parent.name != "ros2_control"]  # not read here
    assert sorted(sum(kinds, [])) == sorted(path.stem for path in ours)


def test_changelog_has_the_version_or_says_forthcoming():
    """In the form that bloom reads: a title of the package, sections of a version and a date."""
    text = (ROOT / "CHANGELOG.rst").read_text("utf-8")
    sections = re.findall(r"^(.+)\n-{5,}$", text, re.M)
    assert sections and all(re.fullmatch(r"Forthcoming|\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)", name) for name in sections)
    assert max(map(len, text.splitlines())) <= 100
    assert any(name == "Forthcoming" or name.startswith(f"{cable_sim_ros.__version__} (") for name in sections)


def test_test_files_have_names_of_their_own():
    """Two files of one name in two folders cannot be collected together."""
    names = [path.name for path in (ROOT / "test").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))
