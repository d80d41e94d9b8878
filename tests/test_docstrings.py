"""The examples in the docstrings of every module run; those of the compiled one are in test_stub."""

import doctest
import importlib
import pkgutil

import pytest

import compfilt

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(compfilt.__path__, "compfilt.")
    if not module.name.endswith(("._core", ".__main__"))
)


@pytest.mark.parametrize("name", ["compfilt", *MODULES])
def test_the_examples_run(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert doctest.testmod(importlib.import_module(name)).failed == 0
    assert list(tmp_path.iterdir()) == []


def test_there_are_examples():
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = [test for name in MODULES for test in finder.find(importlib.import_module(name)) if test.examples]
    assert len(found) > 30
