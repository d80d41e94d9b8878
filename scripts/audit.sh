#!/bin/sh
# audit.sh PYTHON   licences, sources and known vulnerabilities of the crates in Cargo.lock and of the packages in
# requirements/. A database that cannot be reached is said, and with CI=true an error. Needs cargo-deny, and PYTHON pip-audit.
set -eu
cd "$(dirname "$0")/.."
python=$1
missing=""

not_checked() { # not_checked WHAT
    echo "not checked, since its database cannot be reached: $1"
    missing=yes
}

cargo deny --version >/dev/null 2>&1 || {
    echo "make audit needs cargo-deny: cargo install cargo-deny --locked" >&2
    exit 1
}
cargo deny check licenses bans sources
if cargo deny fetch db >/dev/null 2>&1; then
    cargo deny check --disable-fetch advisories
else
    not_checked "known vulnerabilities of crates"
fi

# Where the service cannot be reached, it calls every package unknown and goes on: --strict makes that an error.
for requirements in dev docs bench fuzz; do
    found=$("$python" -m pip_audit --strict --no-deps --disable-pip --progress-spinner off \
        --requirement "requirements/$requirements.txt" 2>&1) && continue
    case $found in
    *"not found on PyPI"* | *ConnectionError*) not_checked "known vulnerabilities of requirements/$requirements.txt" ;;
    *)
        echo "$found" >&2
        exit 1
        ;;
    esac
done
[ -z "$missing" ] || [ "${CI:-}" != true ]
