#!/bin/sh
# Sees to off-screen OpenGL for the 3-D pictures; without it everything else still works, so this never fails.
#   tools/make_opengl.sh PYTHON
set -eu
cd "$(dirname "$0")"
exec </dev/null

. ./debian_packages.sh

"$1" check_opengl.py && exit 0
debian_packages "off-screen OpenGL" libegl1 libgl1 libgl1-mesa-dri || true
"$1" check_opengl.py || echo "Going on; the report comes out without its 3-D pictures, and says so."
