"""The tables of the laboratory leave nothing out: every family and stress test that a module defines is listed."""

import importlib
import pkgutil

import pytest

from verification import cases, stress
from verification.cases.family import Family
from verification.stress.verdict import Stress


@pytest.mark.parametrize(
    ("package", "kind", "table"),
    [(cases, Family, cases.FAMILIES), (stress, Stress, [stress.STRESS.load(id) for id in stress.STRESS.named])],
    ids=["families", "stress"],
)
def test_every_declaration_is_listed_once(package, kind, table):
    modules = [importlib.import_module(f"{package.__name__}.{m.name}") for m in pkgutil.iter_modules(package.__path__)]
    defined = {id(value) for module in modules for value in vars(module).values() if isinstance(value, kind)}
    assert {id(item) for item in table} == defined
    assert len(table) == len(defined)
