#!/bin/sh
# Sees to OpenFOAM, which `make bench-cfd` alone needs.
set -eu
cd "$(dirname "$0")"
exec </dev/null

. ./debian_packages.sh

command -v SRFSimpleFoam >/dev/null && command -v pimpleFoam >/dev/null && exit 0
debian_packages "OpenFOAM" openfoam
