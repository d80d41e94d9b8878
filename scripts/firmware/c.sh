#!/bin/sh
# c.sh [host]   the C interface: the header in C99 and C++17; the example on the host, on i686 and on a Cortex-M under QEMU, against Python
#
# PYTHON is one in which compfilt is installed. With "host" the chip is left out.
set -eu
# Cargo would take them instead of what is set here for a target.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS
cd "$(dirname "$0")/../.."
PYTHON=${PYTHON:-python3}
CC=${CC:-gcc}
CXX=${CXX:-g++}
target=thumbv7em-none-eabihf
folder=${CARGO_TARGET_DIR:-$PWD/target}/firmware
include=python/compfilt/include
example=examples/c
warnings="-Wall -Wextra -Werror -pedantic"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

library() { # library FOLDER OPTION...: builds it; nothing in it may panic or allocate
    built=$1/libcompfilt_capi.a
    shift
    CARGO_TARGET_DIR=$folder cargo rustc --quiet --locked --package compfilt-capi --profile firmware \
        --crate-type staticlib --features panic-handler "$@"
    symbols=$(nm "$built" 2>/dev/null)
    if printf '%s\n' "$symbols" | grep -F -f scripts/forbidden_symbols.txt; then
        echo "something in $built can panic or allocate" >&2
        exit 1
    fi
}

declared=$(sed -n 's/.*\(compfilt_[a-z0-9_]*\)(.*/\1/p' "$include/compfilt.h")
echo '#include "compfilt.h"' >"$work/header.c"
cp "$work/header.c" "$work/header.cc"
"$CC" -std=c99 $warnings -I "$include" -c "$work/header.c" -o "$work/header.o"
"$CXX" -std=c++17 $warnings -I "$include" -c "$work/header.cc" -o "$work/header.o"

$PYTHON "$example/expected.py" >"$work/expected"
compare() { # compare PLACE: what the example printed there against Python
    diff "$work/expected" "$work/printed" || { echo "the bits differ: $1 (>) and Python (<)" >&2; exit 1; }
    echo "the C example gives Python's bits: $1"
}

library "$folder/firmware"
for name in $declared; do
    printf '%s\n' "$symbols" | grep -q " T $name\$" || { echo "$name is in the header only" >&2; exit 1; }
done
# No fused multiply-add in the example's own signal.
compile="-std=c99 -O2 -ffp-contract=off $warnings -I $include -I $example"
"$CC" $compile "$example/filters.c" "$example/host.c" "$built" -o "$work/host"
"$work/host" >"$work/printed"
compare "host"
[ "${1:-}" != host ] || exit 0

sh scripts/firmware/install.sh gcc-arm-none-eabi
sh scripts/firmware/sysroot.sh "$folder/sysroot" "$target"
if [ "$(uname -sm)" = "Linux x86_64" ]; then
    # A processor with half the word, which such a machine runs as well; its floats are SSE's.
    small=i686-unknown-linux-gnu
    sh scripts/firmware/sysroot.sh "$folder/sysroot" "$small"
    RUSTC=/usr/bin/rustc CARGO_TARGET_I686_UNKNOWN_LINUX_GNU_RUSTFLAGS="--sysroot $folder/sysroot" \
        library "$folder/$small/firmware" --target "$small"
    "$CC" $compile -m32 -msse2 -mfpmath=sse -ffreestanding -fno-pie -fno-stack-protector -nostdlib -static \
        "$example/filters.c" "$example/linux_i686.c" "$built" -o "$work/small"
    "$work/small" >"$work/printed"
    compare "i686"
fi
RUSTC=/usr/bin/rustc CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS="--sysroot $folder/sysroot" \
    library "$folder/$target/firmware" --target "$target"
arm-none-eabi-gcc $compile -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -ffreestanding -nostdlib \
    -Wl,--gc-sections,-z,noexecstack -T "$example/cortex_m.ld" "$example/filters.c" "$example/cortex_m.c" "$built" -lgcc -o "$work/chip.elf"
timeout 60 qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none \
    -chardev stdio,id=text -semihosting-config enable=on,target=native,chardev=text -kernel "$work/chip.elf" >"$work/printed"
compare "Cortex-M4F, $(arm-none-eabi-size "$work/chip.elf" | awk 'NR == 2 { print $1 }') bytes of code with all filters"
