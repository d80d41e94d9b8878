"""Draw the figures of docs/pictures.md anew: run the page's blocks, and keep the pictures that it shows.

python scripts/draw_pictures.py
"""

import re
import shutil
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

import pages  # noqa: E402 - found in the folder of the tests, which run the same blocks

DRAWN = {"result.png": "drive.png"}
"""Pictures that the page's commands give another name."""


def main() -> None:
    """Run the page in a folder of its own, and copy what it shows."""
    mpl.use("agg")
    page = ROOT / "docs/pictures.md"
    with tempfile.TemporaryDirectory() as folder:
        pages.run(page, Path(folder))
        for name in re.findall(r"\]\(images/([\w.]+)\)", page.read_text()):
            shutil.copyfile(Path(folder, DRAWN.get(name, name)), ROOT / "docs/images" / name)


if __name__ == "__main__":
    main()
