#!/bin/sh
# Makes a virtual environment from a lock file, from nothing more than a python3 with or without venv.
#   tools/make_env.sh VENV LOCK     e.g. tools/make_env.sh .venv requirements/lock.txt
# Says and does nothing when the environment is up to date. Never reads standard input.
set -eu
cd "$(dirname "$0")/.."
venv=$1
lock=$2
bootstrap=requirements/bootstrap.txt
exec </dev/null

. tools/debian_packages.sh

in_range() {
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null
}

has_venv() {
    "$1" -c 'import ensurepip, venv' 2>/dev/null
}

# Prints the first Python that will do; with PYTHON=... on the make command line it is that one or none.
find_python() {
    for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
        if in_range "$candidate" && has_venv "$candidate"; then
            printf '%s\n' "$candidate"
            return
        fi
    done
    return 1
}

refuse() {
    echo "ringbalance needs Python 3.11, 3.12 or 3.13 with venv; $1 is: $("$1" -V 2>&1)." >&2
    echo "Name one that this machine has, for example: make env PYTHON=/opt/python3.12/bin/python3" >&2
    exit 1
}

# A bare Debian's python3 has neither pip nor venv. What off-screen OpenGL lacks goes into the same one line.
require_python() {
    find_python && return
    [ -z "${PYTHON:-}" ] || refuse "$PYTHON"
    opengl=$(python3 tools/check_opengl.py 2>/dev/null) || true
    # shellcheck disable=SC2086
    debian_packages "a Python with venv" python3 python3-venv $opengl >&2 || exit 1
    find_python || refuse python3
}

# Is there an environment that runs, with the Python that was asked for?
venv_runs() {
    found=$("$venv/bin/python" -V 2>/dev/null) && [ "$found" = "$("${PYTHON:-$venv/bin/python}" -V 2>&1)" ]
}

fingerprint() {
    pwd
    cat tools/make_env.sh "$bootstrap" "$lock" | cksum
}

install_locked() {
    # pip is asked when uv cannot: a mirror is often made known to pip alone.
    "$venv/bin/uv" pip install --quiet --python "$venv/bin/python" --require-hashes -r "$lock" ||
        {
            echo "uv could not install the packages; trying pip with the same hashes ..."
            "$venv/bin/python" -m pip install --quiet --no-compile --require-hashes -r "$lock"
        }
    # The packages' own tests, a quarter of their lines, are never imported.
    "$venv/bin/python" -W ignore -m compileall -q -j 0 -x '/tests?/' \
        "$venv"/lib/python3*/site-packages >/dev/null || true
}

make_venv() {
    python=$(require_python)
    echo "making $venv with $("$python" -V) from $lock ..."
    rm -f "$venv/.lock-stamp" "$venv/.project-stamp"
    "$python" -m venv --clear "$venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes -r "$bootstrap"
    install_locked
    fingerprint >"$venv/.lock-stamp"
}

install_project() {
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
    cksum <pyproject.toml >"$venv/.project-stamp"
}

if ! venv_runs || [ "$(fingerprint)" != "$(cat "$venv/.lock-stamp" 2>/dev/null)" ]; then
    make_venv
fi
if [ "$(cksum <pyproject.toml)" != "$(cat "$venv/.project-stamp" 2>/dev/null)" ]; then
    install_project
fi
