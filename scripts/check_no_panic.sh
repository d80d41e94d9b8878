#!/bin/sh
# check_no_panic.sh   links what runs per sample without std, and looks for ways to panic or to allocate
set -eu
# Cargo would take them instead of what is set here for a target.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS
cd "$(dirname "$0")/../crates/no-panic-probe"
target=${CARGO_TARGET_DIR:-../../target}/no-panic-probe
host=$(rustc --version --verbose | sed -n 's/^host: //p')

# With the core library alone at hand a dependency that uses std or allocates does not compile: no_std alone does not say that.
libraries=lib/rustlib/$host/lib
mkdir -p "$target/core"
target=$(cd "$target" && pwd)
rm -rf "$target/core"
mkdir -p "$target/core/$libraries"
for crate in core compiler_builtins; do
    ln -s "$(rustc --print sysroot)/$libraries/lib$crate"-* "$target/core/$libraries"
done
CARGO_TARGET_DIR=$target RUSTFLAGS="--sysroot $target/core" \
    cargo rustc --release --quiet --locked --target "$host" --crate-type staticlib

library=$target/$host/release/libno_panic_probe.a
symbols=$(nm "$library" 2>/dev/null)
found=$(printf '%s\n' "$symbols" | grep -c ' T probe_' || true)
wanted=$(grep -c '^    probe_' src/lib.rs)
[ "$found" = "$wanted" ] || { echo "$found of the probe's $wanted functions are in $library" >&2; exit 1; }
if printf '%s\n' "$symbols" | grep -F -f ../../scripts/forbidden_symbols.txt; then
    echo "something that runs per sample can panic or allocate" >&2
    exit 1
fi
echo "no way to panic or to allocate in $found functions, and none needs more than the core library"
