"""How hypothesis runs: no deadlines, and the same examples every time where CI is set. And how examples are imported."""

import importlib.util
import os
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

COMMON = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}

settings.register_profile("dev", **COMMON)
settings.register_profile("ci", derandomize=True, **COMMON)
settings.load_profile("ci" if os.environ.get("CI") else "dev")

# The modules of the examples are imported by their names, which are unique over all examples.
EXAMPLES = {path.parent.name: path for path in Path(__file__).parents[1].glob("examples/*/reproduce.py")}
sys.path.extend(str(path.parent) for path in EXAMPLES.values())


@pytest.fixture(scope="session")
def load_example():
    """Return what imports the reproduce.py of a folder, under a name of its own."""

    def load(folder):
        spec = importlib.util.spec_from_file_location(f"reproduce_{folder}", EXAMPLES[folder])
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return load
