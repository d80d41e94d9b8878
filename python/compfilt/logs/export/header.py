"""What an exported C source needs beside it: the header that it includes, and the library behind that."""

import contextlib
from pathlib import Path

from compfilt.logs.errors import UsageError
from compfilt.logs.writers import check_target, complete_file

__all__ = ["BUILD", "HEADER", "check_header", "put_header"]

HEADER = Path(__file__).resolve().parents[2] / "include" / "compfilt.h"
"""Where the package has it; the tests of the crate compfilt-capi make it and hold it up to date."""

BUILD = (
    "cargo rustc --locked -p compfilt-capi --profile firmware --crate-type staticlib "
    "--features panic-handler --target thumbv7em-none-eabihf"
)
"""What builds the library for a Cortex-M4F, in the source distribution or a clone."""


def check_header(source: Path, *, beside: bool, force: bool) -> None:
    """Refuse a source that would be its own header, and a header that would replace another one."""
    if source.name == HEADER.name:
        raise UsageError(f"{source}: {HEADER.name} is the header that the source includes; take another name")
    place = source.with_name(HEADER.name)
    if beside and not _is_there(place):
        check_target(place, force=force)


def put_header(source: Path) -> Path:
    """Copy the header to the folder of a source, unless it is there already."""
    place = source.with_name(HEADER.name)
    if not _is_there(place):
        with complete_file(place) as file:
            file.write(HEADER.read_bytes())
    return place


def _is_there(place: Path) -> bool:
    """Say whether the same header is there: several exported filters share one."""
    with contextlib.suppress(OSError):
        return place.read_bytes() == HEADER.read_bytes()
    return False
