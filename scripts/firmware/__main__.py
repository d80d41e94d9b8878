"""The firmware on emulated boards against Python, bit for bit, and what every filter costs there.

    cd scripts && python -m firmware [--update] [--if-installed]

Installs what it needs, where it may. Builds examples/firmware for a Cortex-M4F and for a Cortex-M0, runs both in QEMU, and compares
every output with the batch functions of the installed compfilt. Links all that runs per sample, and looks for a way to panic, to
allocate or to wait. Exits with 1 where something differs, or costs more than docs/firmware-costs.md has.
"""

import argparse
import hashlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from firmware import build, costs, expected, report
from firmware.build import FirmwareError, Toolchain
from firmware.report import Measured


@dataclass(frozen=True)
class Board:
    """A processor, the target it is compiled for, and QEMU's board."""

    name: str
    target: str
    machine: str


BOARDS = (
    Board("Cortex-M4F", "thumbv7em-none-eabihf", "mps2-an386"),
    # QEMU's M0 has too little memory: an M3 runs the same instructions.
    Board("Cortex-M0", "thumbv6m-none-eabi", "mps2-an385"),
)
# Whoever builds for these finds that it can be done; they are not run.
BUILT_ONLY = ("riscv32imac-unknown-none-elf",)
# Sine and cosine in float32 are computed in double precision: no processor without a unit for it should meet that unawares.
WITH_SINES = {"tilt", "cube_first_order"}
# A minute on an idle machine.
SECONDS = 1200


def install(*, only_look: bool) -> bool:
    """Whether all is there that is needed."""
    if only_look:
        tools = (build.RUSTC, "qemu-system-arm", f"{build.BINUTILS}ld")
        return all(map(shutil.which, tools)) and build.has_sources()
    return subprocess.run(["sh", build.SCRIPTS / "install.sh"], check=False).returncode == 0


def emulate(board: Board, image: build.Image) -> dict[str, Measured]:
    """Runs the program, an instruction every 1024 ns, and reads what it wrote down."""
    with tempfile.TemporaryDirectory() as place:
        emulator = [
            "qemu-system-arm",
            "-M",
            board.machine,
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
        ]
        semihosting = ["-semihosting-config", "enable=on,target=native"]
        clock = ["-icount", "shift=10,sleep=off,align=off"]
        command = [*emulator, *semihosting, *clock, "-kernel", str(image.path)]
        try:
            done = subprocess.run(command, cwd=place, check=False, stdin=subprocess.DEVNULL, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            raise FirmwareError(f"the {board.name} has not finished within {SECONDS} s") from None
        if done.returncode:
            raise FirmwareError(f"the program on the {board.name} ended with status {done.returncode}")
        return report.read(Path(place) / "report", expected.SAMPLES)


def compare(board: Board, measured: dict[str, Measured], wanted: dict[str, expected.Array]) -> list[str]:
    """Prints a line for every filter; what differs."""
    if list(measured) != list(wanted):
        raise FirmwareError(f"the {board.name} ran {', '.join(measured)}, Python {', '.join(wanted)}")
    differences = []
    for name, outputs in wanted.items():
        difference = report.first_difference(name, measured[name].outputs, outputs)
        digest = hashlib.sha256(measured[name].outputs.tobytes()).hexdigest()[:16]
        print(f"{board.name}  {name:18} {digest}  {difference or 'the same bits as in Python'}")
        differences += [f"{board.name}: {difference}"] if difference else []
    return differences


def on_board(board: Board, wanted: dict[str, expected.Array]) -> tuple[list[str], dict[str, costs.Row]]:
    """What differs on a board, and what the filters cost there: state, instructions, the most, stack, code."""
    toolchain = Toolchain(board.target)
    measured = emulate(board, toolchain.firmware())
    differences = compare(board, measured, wanted)
    library = toolchain.steps()
    count = build.check_steps(toolchain, library)
    print(f"{board.name}  no way to panic, to allocate or to wait in {count} linked functions")
    rows: dict[str, costs.Row] = {}
    doubles = []
    for name, of in measured.items():
        code = build.code_of(toolchain, library, f"probe_{name}")
        rows[name] = (of.state, round(of.mean), of.most, of.stack, code.size)
        doubles += [name] if code.soft_double else []
    print(f"{board.name}  double precision in software: {', '.join(doubles) or 'nowhere'}")
    unexpected = [name for name in doubles if name not in WITH_SINES]
    differences += [f"{board.name}: {name} computes in double precision" for name in unexpected]
    return differences, rows


def judge(rows: dict[str, costs.Row], *, update: bool) -> list[str]:
    """Shows the costs, and compares them with the page or writes them there."""
    print(costs.table(rows))
    if update:
        compiler = build.run(build.RUSTC, "--version").split(" (")[0]
        costs.write(rows, f'{compiler}, `opt-level = 3`, `lto = "fat"`.')
        return []
    return costs.complaints(costs.read(), rows)


def check(*, update: bool) -> list[str]:
    """All that is wrong."""
    wanted = expected.Expected().outputs()
    differences, rows = [], []
    for board in BOARDS:
        differing, costing = on_board(board, wanted)
        differences += differing
        rows.append(costing)
    for target in BUILT_ONLY:
        Toolchain(target).steps()
        print(f"{target}  builds")
    m4f, m0 = rows
    both = {name: (*m4f[name], *m0[name][1:]) for name in m4f}
    return differences + judge(both, update=update)


def main(arguments: Sequence[str] | None = None) -> int:
    """Checks, and says what is wrong."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--update", action="store_true", help="write the costs into docs/firmware-costs.md")
    parser.add_argument("--if-installed", action="store_true", help="leave it out where a tool is missing")
    options = parser.parse_args(arguments)
    if not install(only_look=options.if_installed):
        if not options.if_installed:
            return 1
        print("LEFT OUT: the firmware, whose tools are not installed; `make firmware` installs them")
        return 0
    try:
        wrong = check(update=options.update)
    except FirmwareError as failure:
        wrong = [str(failure)]
    for sentence in wrong:
        print(sentence, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
