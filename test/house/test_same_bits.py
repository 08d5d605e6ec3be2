"""Nothing that a run is made of depends on which code numpy or a BLAS chooses for the processor.

The bits themselves are compared in processes of their own by stress N28; this finds a name before it costs a bit.
"""

import ast
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.check

PACKAGE = Path(__file__).resolve().parents[2] / "cable_sim_ros"
# numpy computes them by other code with AVX-512 than with AVX2, or gives them to the BLAS (numpy 2.4)
CHOSEN = {
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "tan", "arcsin", "arccos", "arctan", "arctan2"),
    *("sinh", "cosh", "tanh", "arcsinh", "arccosh", "arctanh", "power", "float_power", "cbrt", "geomspace", "logspace"),
    *("dot", "vdot", "inner", "matmul", "tensordot", "convolve", "correlate", "cov", "corrcoef", "polyfit", "linalg"),
}
SCIPY = {"make_smoothing_spline", "make_interp_spline", "savgol_filter", "solve_ivp", "linalg"}  # by LAPACK and BLAS
BESIDE = {  # no number of a run comes from them: what they are for
    "sim/checks/viv_checks.py": "texts of cautions",
    "sim/checks/added_mass_checks.py": "texts of refusals",
    "sim/checks/scene_warnings.py": "texts of cautions",
    "sim/rig/rig.py": "a line of one's own, not a run",
    "io/plausibility/cross_check.py": "sources of motion against bounds: convicted or not",
    "io/messages/fault_hypotheses.py": "matrices of 0 and 1, to be compared with bounds",
    "io/messages/markers.py": "what RViz draws",
    "io/geodesy.py": "latitude and longitude of a layback",
    "runs/mean_track.py": "is pitch positive bow down: a correlation against bounds",
    "runs/verdict.py": "a step of 1, 2 or 5 times a power of ten",
    "tools/logs/inspection/inspect_log.py": "the same",
    "tools/logs/mapping/apply.py": "an import: a run has the numbers of the bag that it made",
    "tools/logs/mapping/lever_arm.py": "the same",
    "tools/logs/imports/import_logs.py": "the same",
    "tools/logs/imports/regular.py": "the same",
    "tools/logs/imports/track.py": "the same",
    "io/sources/coarse_bag.py": "rounded motion, smoothed: bounded, docs/replay.md",
    "io/sources/rounding.py": "the same: which columns are rounded, and to what",
    "io/sources/smoothing.py": "the same: the spline",
}


def is_numpy(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id == "np"


def along_an_axis(node: ast.AST) -> bool:
    """np.linalg.norm(..., axis=...): numpy sums it itself, without the BLAS."""
    return (
        isinstance(node, ast.Call)
        and ast.unparse(node.func) == "np.linalg.norm"
        and any(keyword.arg == "axis" for keyword in node.keywords)
    )


def found(source: str) -> set[str]:
    """Names of `CHOSEN` used as np.<name>, of `SCIPY` imported, and @ between arrays."""
    if not re.search(rf"np\.(?:{'|'.join(CHOSEN)})\b|scipy| @ ", source):
        return set()
    tree, names = ast.parse(source), set()
    good = {node.func.value for node in ast.walk(tree) if along_an_axis(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            names.add("@")
        elif isinstance(node, ast.Attribute) and is_numpy(node.value) and node not in good:
            names |= {node.attr} & CHOSEN
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("scipy"):
            names |= {alias.name for alias in node.names} & SCIPY
            names |= {str(node.module).rpartition(".")[2]} & SCIPY
    return names


def test_a_run_takes_nothing_that_is_chosen_by_the_processor():
    used = {}
    for path in (
        path
        for floor in ("compiler", "physics", "sim", "io", "runs", "tools/logs")
        for path in sorted((PACKAGE / floor).rglob("*.py"))
    ):
        if names := found(path.read_text("utf-8")):
            used[path.relative_to(PACKAGE).as_posix()] = names
    wrong = {name: names for name, names in used.items() if name not in BESIDE}
    assert not wrong, f"the last bit depends on the processor: {wrong}; take those of sim/tables/elementary.py"
    assert set(used) == set(BESIDE), "a file that is let pass has none of them"


@pytest.mark.parametrize(
    "source, names",
    [
        ("y = np.exp(x)", {"exp"}),
        ("y = a @ b", {"@"}),
        ("y = np.linalg.norm(v)", {"linalg"}),
        ("y = np.linalg.norm(v, axis=1)", set()),
        ("y = np.sqrt(np.sin(x)) + math.exp(2.0)", set()),
        ("from scipy.interpolate import CubicSpline, make_smoothing_spline", {"make_smoothing_spline"}),
        ("from scipy.linalg import solve_banded", {"linalg"}),
    ],
)
def test_it_is_found(source, names):
    assert found(source) == names
