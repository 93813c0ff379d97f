# shellcheck shell=sh
# Sourced by the set-up scripts.
# debian_packages WHAT PACKAGE...: installs Debian packages as root, else prints the one line to run and fails.
debian_packages() {
    what=$1
    shift
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "installing $what: $* ..."
        if DEBIAN_FRONTEND=noninteractive apt-get update -qq &&
            DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null; then
            return
        fi
        echo "apt-get could not install them."
    fi
    # A bare Debian has no sudo.
    if command -v sudo >/dev/null; then sudo="sudo " how=with; else sudo="" how="as root with"; fi
    echo "$what is missing; install it $how:"
    echo "    ${sudo}apt-get update && ${sudo}apt-get install -y --no-install-recommends $*"
    return 1
}
