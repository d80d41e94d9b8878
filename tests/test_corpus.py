"""What fuzzing has found is read or refused in one line, as ever."""

import pytest

import fuzz

SEEDS = [
    pytest.param(name, path, id=f"{name} {path.name[:8]}")
    for name in fuzz.TRIALS
    for path in sorted((fuzz.CORPUS / name).iterdir())
]


@pytest.mark.parametrize(("name", "path"), SEEDS)
def test_what_was_found_is_read_or_refused(name, path):
    fuzz.TRIALS[name](path.read_bytes())
