"""Feeds recipes and CSV logs that nobody would write: whatever they hold, it is either read or refused in one line.

    python scripts/fuzz.py recipe|csv [--seconds 600]

Inputs that reach new code are kept in tests/corpus, which the tests run through again. Needs atheris (`make fuzz`).
"""

import argparse
import contextlib
import sys
import tempfile
from pathlib import Path

import pyarrow as pa

try:
    import atheris
except ImportError:  # the tests do without it
    atheris = None

# What is reached is counted in our own modules only: to rewrite all of Python takes minutes.
with contextlib.nullcontext() if atheris is None else atheris.instrument_imports(include=["compfilt"]):
    from compfilt.logs import LogError, Pipeline, UsageError, parse_recipe
    from compfilt.logs.readers import open_log

CORPUS = Path(__file__).parents[1] / "tests" / "corpus"
LOG_RECIPE = parse_recipe(
    """
    version = 1
    [log]
    time = { column = "t", unit = "s" }
    measurement = { column = "angle", unit = "deg" }
    derivative = { column = "rate", unit = "deg/s" }
    [filter]
    kind = "pi"
    kp = 2.0
    ki = 1.0
    [policy]
    gap = { longer_than = "1 s", do = "reset" }
    backwards = "coast"
    [output]
    columns = ["estimate", "bias", "flags", "faults"]
    keep = ["note"]
    """
)


def check_message(error: Exception) -> None:
    """A message is one line that can be printed."""
    text = str(error)
    assert text, "an error says what is wrong"
    assert text.isprintable(), repr(text)


def try_recipe(data: bytes) -> None:
    """A recipe is read and its filter built, or refused."""
    try:
        recipe = parse_recipe(data.decode("utf-8", "replace"))
        Pipeline(recipe)
    except UsageError as error:
        check_message(error)


def filtered(path: Path, batch_bytes: int) -> tuple[pa.Table | None, str]:
    """What comes of a log, as far as it can be read, and what was said."""
    batches, said, pipeline = [], "", None
    try:
        with open_log(path, LOG_RECIPE.columns, batch_bytes=batch_bytes) as reader:
            pipeline = Pipeline(LOG_RECIPE, reader.schema)
            batches.extend(pipeline.process(batch) for batch in reader.batches())
    except (LogError, UsageError) as error:
        check_message(error)
        said = str(error)
    if not batches:
        return None, said
    return pa.Table.from_batches(batches).combine_chunks(), said


def try_csv(data: bytes) -> None:
    """A log gives the same rows and the same message however it is cut, or is refused."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_bytes(data)
        whole, said = filtered(path, 1 << 20)
        pieces, said_in_pieces = filtered(path, 4096)
        if said == said_in_pieces:
            assert (whole is None) == (pieces is None)
            assert whole is None or pieces is None or whole.num_rows == pieces.num_rows


TRIALS = {"recipe": try_recipe, "csv": try_csv}


def main() -> None:
    """Fuzz one of the paths."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("path", choices=TRIALS)
    parser.add_argument("--seconds", type=int, default=600)
    arguments = parser.parse_args()
    if atheris is None:
        sys.exit("fuzzing needs atheris: make fuzz")
    trial = TRIALS[arguments.path]
    folder = CORPUS / arguments.path
    limits = [f"-max_total_time={arguments.seconds}", "-max_len=4096", "-timeout=20", "-rss_limit_mb=4096"]
    words = [f"-dict={CORPUS / 'words.txt'}"] if (CORPUS / "words.txt").exists() else []
    atheris.Setup([sys.argv[0], *limits, *words, str(folder)], trial)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
