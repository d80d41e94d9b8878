#!/bin/sh
# install.sh [PACKAGE...]   what the firmware needs: a Rust compiler with its sources, the emulator, a linker; Debian's packages, as root only
set -eu
packages="rustc-web rust-web-src qemu-system-arm binutils-arm-none-eabi $*"
missing=""
for package in $packages; do
    status=$(dpkg-query --show --showformat '${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$status" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    # Recommended packages would be thirty times as much.
    log=$(mktemp)
    if { apt-get update && apt-get install --yes --no-install-recommends $missing; } >"$log" 2>&1; then
        rm "$log"
        exit 0
    fi
    tail -n 3 "$log" >&2
    rm "$log"
fi
echo "the firmware needs Debian's packages, not installed here:$missing" >&2
exit 1
