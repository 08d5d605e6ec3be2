"""Without compilation: the kernels as plain Python give the same truths, with plain tracebacks and coverage."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]
SMALL = [
    "test/physics/test_tangent.py::test_each_alone",
    "test/physics/test_winch.py",
    "test/physics/test_invariants.py",
]


def test_small_cases_pass_without_the_compiler():
    result = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *SMALL, "-k", "not mean_track"],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert result.returncode == 0, result.stdout[-3000:] + result.stderr[-2000:]
    assert " passed" in result.stdout and "skipped" not in result.stdout
