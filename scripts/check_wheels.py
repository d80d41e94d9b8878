"""Install the wheels of a folder where their users do, and hold them against the committed bits.

    python scripts/check_wheels.py FOLDER [PYTHON...]

For each Python (this one, where none is named): an empty environment, NumPy from the index, compfilt from the folder and
nowhere else, scripts/check_bits.py. A Python without the lock must still be without it after the import. Exits with 1 at
the first Python that has no wheel in the folder, or a wrong one.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

BITS = Path(__file__).with_name("check_bits.py")
LOCK = """
import importlib.metadata, sys, sysconfig
import compfilt
lock = getattr(sys, "_is_gil_enabled", lambda: True)()
if sysconfig.get_config_var("Py_GIL_DISABLED") and lock:
    sys.exit("importing compfilt switched the lock on")
tags = [line for line in importlib.metadata.distribution("compfilt").read_text("WHEEL").splitlines() if "Tag" in line]
print("Python", sys.version.split()[0], "with the lock," if lock else "without the lock,", *tags)
"""


def check(python: str, folder: Path) -> None:
    """Raise where one of the steps fails."""
    with tempfile.TemporaryDirectory() as environment:
        subprocess.run([python, "-m", "venv", environment], check=True)
        inside = next(path for path in Path(environment).glob("*/python*") if path.stem == "python")
        pip = [inside, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "--only-binary", ":all:", "numpy"], check=True)
        subprocess.run([*pip, "--no-index", "--no-deps", "--find-links", folder, "compfilt"], check=True)
        # Warnings are errors: an extension that does not say that it can do without the lock is one.
        subprocess.run([inside, "-W", "error", "-c", LOCK], check=True, cwd=environment)
        subprocess.run([inside, BITS], check=True, cwd=environment)


def main() -> int:
    """Check with each Python."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="where the wheels are")
    parser.add_argument("python", nargs="*", default=[sys.executable], help="interpreters")
    arguments = parser.parse_args()
    try:
        for python in arguments.python:
            print(f"{python}:", flush=True)
            check(python, arguments.folder.resolve())
    except subprocess.CalledProcessError as error:
        print(f"failed: {' '.join(map(str, error.cmd[:4]))} ...", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
