#!/bin/sh
# make_venv.sh FOLDER   a virtual environment with pip, also where the system's Python comes without its venv package
set -eu
folder=$1
python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' || {
    echo "compfilt needs Python 3.10 or newer, found $("$python" --version)" >&2
    exit 1
}
rm -rf "$folder"
if ! "$python" -m venv "$folder" >/dev/null 2>&1; then
    # Debian keeps ensurepip in a package of its own: the system's pip, if there is one, fills the environment instead.
    rm -rf "$folder"
    if "$python" -m pip --version >/dev/null 2>&1; then
        "$python" -m venv --without-pip "$folder"
        "$python" -m pip --python "$folder/bin/python" install --quiet pip
    elif [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get install -y --no-install-recommends python3-venv >/dev/null
        "$python" -m venv "$folder"
    else
        echo "this Python has neither venv nor pip: install python3-venv or python3-pip" >&2
        exit 1
    fi
fi
