#!/bin/sh
# check_no_panic.sh   links what runs per sample into a library without std, and looks for ways to panic or to allocate
set -eu
cd "$(dirname "$0")/../crates/no-panic-probe"
target=${CARGO_TARGET_DIR:-../../target}/no-panic-probe
CARGO_TARGET_DIR=$target cargo build --release --quiet --locked
library=$target/release/libno_panic_probe.a
symbols=$(nm "$library" 2>/dev/null)
found=$(printf '%s\n' "$symbols" | grep -c ' T probe_' || true)
[ "$found" -ge 25 ] || { echo "only $found of the probe's functions are in $library" >&2; exit 1; }
if printf '%s\n' "$symbols" | grep -E 'panicking|panic_fmt|panic_bounds|__rust_alloc|__rg_alloc'; then
    echo "something that runs per sample can panic or allocate" >&2
    exit 1
fi
echo "no way to panic or to allocate in $found functions"
