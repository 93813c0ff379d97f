#!/bin/sh
# Sees to the Fortran run-time library that NGSolve's wheel expects of the system; the benchmark continues without NGSolve.
#   tools/make_ngsolve.sh PYTHON
set -eu
cd "$(dirname "$0")"
exec </dev/null

. ./debian_packages.sh

"$1" -c 'import ngsolve' >/dev/null 2>&1 && exit 0
debian_packages "the Fortran run-time library" libgfortran5 && "$1" -c 'import ngsolve' && exit 0
echo "Continuing without NGSolve: the comparison comes out with one side only."
