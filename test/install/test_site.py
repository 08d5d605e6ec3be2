"""`make docs`: the pages become a site with the versions of the extra `docs`, and what is broken on a page fails it."""

import ast
import os
import re
import shutil
import subprocess
import sysconfig

import pytest
from standin import PARTS, ROOT, environment

pytestmark = pytest.mark.install
COMMAND = re.search(r"^\t\$\(BIN\)/(sphinx-build .+)$", (ROOT / "Makefile").read_text("utf-8"), re.M)[1].split()
BROKEN = "[a](nowhere.md), [b](topics.md#nowhere), [c](#nowhere), ![d](nowhere.png), $\\nonsense{x}$, <lost>\n"


def wanted():
    """Requirements of the extra `docs` in setup.py."""
    for node in ast.parse((ROOT / "setup.py").read_text("utf-8")).body:
        if isinstance(node, ast.Assign) and node.targets[0].id == "DOCS":
            return ast.literal_eval(node.value)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """The sources with a copy of the pages."""
    folder = tmp_path_factory.mktemp("site")
    for name in ("docs", "bags", "test/examples"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for path in ROOT.iterdir():
        if path.suffix in (".md", ".rst"):
            shutil.copy(path, folder)
        elif path.name in PARTS and not (folder / path.name).exists():
            (folder / path.name).symlink_to(path)  # modules are compiled there
    return folder


@pytest.fixture(scope="module")
def build(source, tmp_path_factory):
    """Runs the Makefile's command in the copy, by an environment with the extra beside the packages of this one."""
    bin_ = environment(tmp_path_factory.mktemp("sphinx") / "env", *wanted())
    (site,) = (bin_.parent / "lib").glob("python*/site-packages")
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")  # its own .pth files do not count
    variables = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    command = [str(bin_ / COMMAND[0]), *COMMAND[1:]]
    return lambda: subprocess.run(command, cwd=source, env=variables, text=True, capture_output=True, timeout=600)


def test_the_site_is_made_without_a_warning(build, source):
    done = build()
    assert done.returncode == 0 and not done.stderr, done.stderr
    html = source / "build" / "docs"
    assert {page.stem for page in (html / "docs").glob("*.html")} == {page.stem for page in source.glob("docs/*.md")}
    first = (html / "README.html").read_text("utf-8")
    for door in re.findall(r"^## (.+)$", (source / "docs/index.md").read_text("utf-8"), re.M):
        assert f">{door}<" in first or f">{door}: " in first, door  # captions of the navigation
    assert "docs/rig.html" in first and "README.html" in (html / "index.html").read_text("utf-8")
    reference = (html / "docs/python.html").read_text("utf-8")
    assert 'id="cable_sim_ros.Simulator.tick"' in reference and 'id="cable_sim_ros.testing.Tow.step"' in reference
    theory = (html / "docs/theory.html").read_text("utf-8")
    assert theory.count("<math") > 300 and "$$" not in theory and 'id="t3"' in theory


@pytest.mark.nightly
def test_what_is_broken_on_a_page_fails_it(build, source):
    page = source / "docs" / "rig.md"
    kept = page.read_text("utf-8")
    page.write_text(f"{kept}\n{BROKEN}")
    done = build()
    page.write_text(kept)
    shutil.rmtree(source / "build")
    assert done.returncode == 1
    for part in (
        "nowhere.md",
        "local id not found",
        "'nowhere'",
        "nowhere.png",
        "formula not understood",
        "raw HTML: <lost>",
    ):
        assert part in done.stderr, (part, done.stderr)
