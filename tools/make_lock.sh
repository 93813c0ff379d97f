#!/bin/sh
# Rewrites the lock files: exact versions and hashes, no host. uv.lock names hosts and stays out of git.
#   tools/make_lock.sh UV
set -eu
uv=$1
export_lock() {
    "$uv" export --quiet --no-emit-project --no-annotate --no-header "$@" >/dev/null
}
export_lock --all-groups --extra pictures -o requirements/lock.txt
export_lock --all-groups --all-extras -o requirements/lock-all.txt
"$uv" pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-annotate --no-header \
    requirements/bootstrap.in -o requirements/bootstrap.txt
rm -f uv.lock
