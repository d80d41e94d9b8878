"""The type stub, the annotations and the docstrings say what the module does."""

import doctest
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import compfilt as cf
from compfilt import _core

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = Path(cf.__file__).resolve().parent
STUB = PACKAGE / "_core.pyi"

needs_stub = pytest.mark.skipif(not STUB.exists(), reason=f"{STUB.name} does not exist yet")
PUBLIC = [name for name in cf.__all__ if not name.startswith("__")]
CLASSES = [name for name in PUBLIC if inspect.isclass(getattr(cf, name))]
EXTENSION = [name for name in PUBLIC if getattr(cf, name).__module__ == _core.__name__]


def run(*arguments):
    result = subprocess.run(
        [sys.executable, "-m", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr


@needs_stub
def test_stub_agrees_with_the_module():
    run("mypy.stubtest", "compfilt._core", "--mypy-config-file", str(ROOT / "pyproject.toml"))


@needs_stub
def test_package_is_typed():
    assert (PACKAGE / "py.typed").exists()
    run("mypy", "--strict", str(PACKAGE))


@needs_stub
def test_types_of_ordinary_use(tmp_path):
    """What a caller writes passes a strict check, and what cannot work does not."""
    good = tmp_path / "good.py"
    good.write_text(
        "import compfilt as cf\n"
        "import numpy as np\n"
        "design: cf.LinearFilter = cf.Butterworth(omega0=1.0, order=2, split=1)\n"
        "angle = design.filter(np.zeros(3), [0.0, 0.0, 0.0], fs=100.0)\n"
        "print(angle.shape, design.estimate(angle, angle, t=[0, 1, 2]).levels[0])\n"
        "stream = design.stream(fs=100.0, dtype=np.float32)\n"
        "stream.state = stream.state\n",
        encoding="utf-8",
    )
    run("mypy", "--strict", str(good))
    bad = tmp_path / "bad.py"
    bad.write_text(
        "import compfilt as cf\n"
        "cf.FirstOrder('1')\n"
        "cf.FirstOrder(1.0).filter([1.0], [1.0], fs=1.0, rule='euler')\n"
        "cf.FirstOrder(1.0).tau = 2.0\n",
        encoding="utf-8",
    )
    with pytest.raises(AssertionError, match="Found 3 errors"):
        run("mypy", "--strict", str(bad))


# ---------------------------------------------------------------------------------------------------------- docstrings


@pytest.mark.parametrize("name", PUBLIC)
def test_public_name_has_a_docstring_with_examples(name):
    doc = inspect.getdoc(getattr(cf, name)) or ""
    assert doc.strip(), "no docstring"
    assert "Examples\n--------\n" in doc


@pytest.mark.parametrize("name", CLASSES)
def test_public_members_are_documented(name):
    """In their own docstring, or under Attributes in the class's."""
    listed = inspect.getdoc(getattr(cf, name)) or ""
    for member, value in vars(getattr(cf, name)).items():
        if member.startswith("_") or name == "Flags":
            continue
        own = getattr(value, "__doc__", None)
        assert own or f"{member} :" in listed or f"{member}," in listed or f", {member} :" in listed, member


# A state is made by the library only.
@pytest.mark.parametrize("name", [name for name in EXTENSION if name != "State"])
def test_docstring_names_every_parameter(name):
    """The signature that a caller sees is the documented one."""
    thing = getattr(cf, name)
    try:
        parameters = inspect.signature(thing).parameters
    except ValueError:
        assert inspect.isclass(thing)
        with pytest.raises(TypeError):
            thing()
        return
    doc = inspect.getdoc(thing)
    assert [parameter for parameter in parameters if parameter not in doc] == []


def members(name):
    """The name itself, and a class's own methods and properties."""
    thing = getattr(cf, name)
    yield name, thing
    if inspect.isclass(thing):
        for member, value in vars(thing).items():
            if not member.startswith("_"):
                yield f"{name}.{member}", value


def documented_examples():
    parser = doctest.DocTestParser()
    yield "compfilt", cf.__doc__ or ""
    for name in PUBLIC:
        for label, thing in members(name):
            doc = getattr(thing, "__doc__", None)
            if isinstance(doc, str) and parser.get_examples(doc):
                yield label, doc


EXAMPLES = dict(documented_examples())


@pytest.mark.parametrize("label", EXAMPLES)
def test_examples(label):
    test = doctest.DocTestParser().get_doctest(inspect.cleandoc(EXAMPLES[label]), {}, label, None, 0)
    output = []
    failed, _ = doctest.DocTestRunner(verbose=False).run(test, out=output.append)
    assert not failed, "".join(output)


def test_examples_were_found():
    """Of every class with a constructor and of the methods, not of a few."""
    assert len(EXAMPLES) > 12
    for label in (
        "FirstOrder",
        "LinearFilter.filter",
        "LinearFilter.stream",
        "Stream",
        "State",
        "alpha_to_tau",
    ):
        assert label in EXAMPLES
