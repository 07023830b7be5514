# Sourced by the scripts beside it.

say() { printf 'airlight set-up: %s\n' "$*"; }
die() {
    printf 'airlight set-up: %s\n' "$*" >&2
    exit 1
}

# Installs Debian packages as root or by a sudo that asks nothing; fails where neither can.
apt_install() {
    command -v apt-get >/dev/null 2>&1 || return 1
    local as=()
    if [ "$(id -u)" != 0 ]; then
        sudo -n true >/dev/null 2>&1 || return 1
        as=(sudo -n)
    fi
    local wait=(-o Acquire::Retries=3 -o Acquire::http::Timeout=30 -o Acquire::https::Timeout=30 -o DPkg::Lock::Timeout=120)
    say "installing $* (apt-get)"
    local log
    log=$(mktemp)
    # an update that fails in part may still let the packages install
    ${as[@]+"${as[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get "${wait[@]}" -q update >"$log" 2>&1 || true
    if ! ${as[@]+"${as[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get "${wait[@]}" -q install -y --no-install-recommends "$@" >>"$log" 2>&1; then
        tail -n 20 "$log" >&2
        rm -f "$log"
        return 1
    fi
    rm -f "$log"
}
