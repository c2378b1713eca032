#!/bin/sh
# Creates .venv with the locked, hashed packages and this project's own three, editable.
set -eu
cd "$(dirname "$0")/.."

suits() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

# An interrupted `python -m venv` leaves an environment without pip.
if ! suits .venv/bin/python || ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    for python in "${PYTHON:-python3}" python3.14 python3.13 python3.12 python3.11 none; do
        suits "$python" && break
    done
    if [ "$python" = none ]; then
        echo "error: Python 3.11 or newer is needed; name it: make PYTHON=/path/to/python3" >&2
        exit 1
    fi
    echo "Creating .venv with $("$python" --version)"
    "$python" -m venv --clear .venv
fi

log=build/pip.txt
mkdir -p build
pip() {
    .venv/bin/python -m pip --disable-pip-version-check install --quiet --no-compile "$@" >"$log" 2>&1 || {
        cat "$log" >&2
        echo "error: pip could not install the Python packages; is PyPI or a mirror of it reachable?" >&2
        exit 1
    }
}
echo "Installing Python packages from host/requirements.lock"
pip --require-hashes --no-deps --requirement host/requirements.lock
pip --no-deps --no-build-isolation --editable host/lacuna --editable host --editable host/virtual_robot

# Where PYTHONDONTWRITEBYTECODE is set, as in many containers, each start would else compile these large ones anew, which
# takes longer than importing them.
site=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
cd "$site"
"$OLDPWD/.venv/bin/python" -m compileall -qq -j 0 -x '/tests?/' llvmlite matplotlib numba numpy scipy || true
