"""Builds the firmware and the steps with Debian's compiler, and looks into what was linked."""

import os
import re
import subprocess
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPTS = Path(__file__).parent
FIRMWARE = ROOT / "examples" / "firmware"
STEPS = ROOT / "crates" / "no-panic-probe"
RUSTC = "/usr/bin/rustc"
BINUTILS = "arm-none-eabi-"

# The shell scripts read the same list.
PANIC_OR_ALLOCATION = re.compile(
    "|".join(map(re.escape, (SCRIPTS.parent / "forbidden_symbols.txt").read_text(encoding="ascii").split()))
)
SOFT_DOUBLE = re.compile(r"__aeabi_(d|[a-z0-9]+2d|cd)|__(add|sub|mul|div)df3")
# A step that waits for an event, an interrupt or a debugger would block.
WAITING = re.compile(r"\t(wfi|wfe|svc|bkpt|cpsid|cpsie)\b")


class FirmwareError(Exception):
    """What went wrong, in a sentence."""


def folder() -> Path:
    """Where everything is built."""
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "firmware"


def run(*command: str | Path, cwd: Path = ROOT, env: dict[str, str] | None = None) -> str:
    """The output of a command; its errors are shown as they are."""
    done = subprocess.run(command, cwd=cwd, env=env, check=False, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise FirmwareError(f"{Path(command[0]).name} failed with status {done.returncode}")
    return done.stdout


def has_sources() -> bool:
    """Whether the compiler comes with the sources of its core library, which are built for the targets."""
    library = Path(run(RUSTC, "--print", "sysroot").strip()) / "lib/rustlib/src/rust/library"
    return (library / "core").is_dir()


@dataclass(frozen=True)
class Image:
    """Something linked."""

    path: Path

    def symbols(self) -> list[str]:
        """The names in it."""
        return [line.split()[-1] for line in run(f"{BINUTILS}nm", self.path).splitlines()]

    def size(self) -> int:
        """Bytes of code and constants."""
        lines = run(f"{BINUTILS}size", "-A", self.path).splitlines()
        return sum(int(line.split()[1]) for line in lines if line.startswith((".text", ".rodata", ".data")))

    def waits(self) -> list[str]:
        """Instructions that wait for something."""
        code = run(f"{BINUTILS}objdump", "-d", self.path)
        return [line for line in code.splitlines() if WAITING.search(line)]


class Toolchain:
    """Debian's compiler, with a core library of our own for one target."""

    def __init__(self, target: str) -> None:
        self.target = target
        sysroot = folder() / "sysroot"
        run("sh", SCRIPTS / "sysroot.sh", sysroot, target)
        # Flags of the caller's machine must not decide what is measured.
        kept = {name: value for name, value in os.environ.items() if not name.endswith("RUSTFLAGS")}
        prefix = f"CARGO_TARGET_{target.upper().replace('-', '_')}"
        self.environment = {
            **kept,
            "RUSTC": RUSTC,
            "CARGO_TARGET_DIR": str(folder()),
            f"{prefix}_LINKER": f"{BINUTILS}ld",
            f"{prefix}_RUSTFLAGS": f"--sysroot {sysroot}",
        }
        self.built = folder() / target / "release"

    def _cargo(self, crate: Path, command: str, *options: str) -> None:
        both = ("--release", "--quiet", "--locked", "--target", self.target)
        run("cargo", command, *both, *options, cwd=crate, env=self.environment)

    def firmware(self) -> Image:
        """The whole program."""
        self._cargo(FIRMWARE, "build")
        return Image(self.built / "firmware")

    def steps(self) -> Path:
        """A library with one function for every step."""
        self._cargo(STEPS, "rustc", "--crate-type", "staticlib")
        return self.built / "libno_panic_probe.a"

    def link(self, library: Path, entries: Iterable[str], out: Path) -> Image:
        """An image of these functions and of what they call: nothing else, and nothing may be missing."""
        wanted = [option for entry in entries for option in ("-u", entry)]
        run(f"{BINUTILS}ld", "--gc-sections", "-e", wanted[1], *wanted, "-o", out, library)
        return Image(out)


def names_of_steps() -> list[str]:
    """The functions of the library."""
    source = (STEPS / "src" / "lib.rs").read_text(encoding="utf-8")
    return re.findall(r"^    (probe_\w+)\(", source, re.MULTILINE)


def check_steps(toolchain: Toolchain, library: Path) -> int:
    """Links every step into one image that may not panic, allocate or wait; how many there are."""
    names = names_of_steps()
    with tempfile.TemporaryDirectory() as place:
        image = toolchain.link(library, names, Path(place) / "steps")
        symbols = image.symbols()
        missing = set(names) - set(symbols)
        if missing:
            raise FirmwareError(f"not in the linked image: {', '.join(sorted(missing))}")
        wrong = [name for name in symbols if PANIC_OR_ALLOCATION.search(name)]
        if wrong:
            raise FirmwareError(f"a step for {toolchain.target} can panic or allocate: {', '.join(wrong)}")
        waits = image.waits()
        if waits:
            raise FirmwareError(f"a step for {toolchain.target} can wait: {waits[0].strip()}")
    return len(names)


@dataclass(frozen=True)
class Code:
    """What one filter's step is linked to."""

    size: int
    soft_double: list[str]


def code_of(toolchain: Toolchain, library: Path, entry: str) -> Code:
    """The size of a filter alone, and which double-precision routines it brings along."""
    with tempfile.TemporaryDirectory() as place:
        image = toolchain.link(library, [entry], Path(place) / "step")
        return Code(image.size(), [name for name in image.symbols() if SOFT_DOUBLE.search(name)])
