#!/bin/sh
# sysroot.sh FOLDER TARGET...   the core library for targets that the compiler comes without, built from its own sources
#
# Only this step uses what is not stable in cargo. Everything after it is an ordinary build with `--sysroot FOLDER`.
set -eu
# Cargo would take them instead of what is set here for a target.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS
folder=$1
shift
RUSTC=${RUSTC:-/usr/bin/rustc}
export RUSTC
library=$("$RUSTC" --print sysroot)/lib/rustlib/src/rust/library
[ -d "$library/core" ] || { echo "$RUSTC has no sources in $library: install rust-web-src" >&2; exit 1; }
made_by=$("$RUSTC" --version --verbose | cat - "$0" | cksum)

build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
mkdir "$build/src"
echo '#![no_std]' >"$build/src/lib.rs"
cat >"$build/Cargo.toml" <<END
[package]
name = "empty"
version = "0.0.0"
edition = "2024"
[profile.release]
panic = "abort"
[workspace]
END
cat >"$build/offline.toml" <<END
[source.crates-io]
replace-with = "packaged"
[source.packaged]
directory = "$library/vendor"
END

for target in "$@"; do
    place=$folder/lib/rustlib/$target
    [ "$(cat "$place/made-by" 2>/dev/null)" != "$made_by" ] || continue
    echo "building the core library for $target" >&2
    (
        cd "$build"
        RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR=$build/target RUSTFLAGS=-Cembed-bitcode=yes \
            cargo build --quiet --offline --release --config offline.toml -Zbuild-std=core --target "$target"
    )
    rm -rf "$place"
    mkdir -p "$place/lib"
    for crate in core compiler_builtins; do
        cp "$build/target/$target/release/deps/lib$crate"-*.rlib "$place/lib"
    done
    echo "$made_by" >"$place/made-by"
done
