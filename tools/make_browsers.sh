#!/bin/sh
# Sees to Node, Chromium and Firefox, which `make test-panel` alone needs.
set -eu
cd "$(dirname "$0")"
exec </dev/null

. ./debian_packages.sh

missing=
command -v node >/dev/null || missing="$missing nodejs"
command -v chromium >/dev/null || missing="$missing chromium"
command -v firefox-esr >/dev/null || missing="$missing firefox-esr"
[ -z "$missing" ] && exit 0
# shellcheck disable=SC2086
debian_packages "a browser or Node" $missing
