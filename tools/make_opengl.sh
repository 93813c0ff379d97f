#!/bin/sh
# Sees to off-screen OpenGL for the 3-D pictures; without it everything else still works, so this never fails.
#   tools/make_opengl.sh PYTHON
set -eu
cd "$(dirname "$0")"
exec </dev/null

. ./debian_packages.sh

missing=$("$1" check_opengl.py) && exit 0
# shellcheck disable=SC2086
debian_packages "off-screen OpenGL" $missing && "$1" check_opengl.py >/dev/null && exit 0
echo "Continuing without off-screen OpenGL: the report comes out without its 3-D pictures, and says so."
