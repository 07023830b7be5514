#!/usr/bin/env bash
# Makes .venv with the locked packages and Airlight itself (editable). Run by make; harmless to run again.
# PYTHON=... chooses the interpreter. Plain pip: it alone reads the index settings that a machine has for pip.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore PIP_USER=0

usable() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; }
makes_venvs() { "$1" -c 'import ensurepip, venv' >/dev/null 2>&1; }

# A Python that can make environments, else one that at least is new enough.
find_python() {
    local candidate fallback=""
    for candidate in ${PYTHON:-python3 /usr/bin/python3 python3.11 python3.12 python3.13 python3.14}; do
        usable "$candidate" || continue
        if makes_venvs "$candidate"; then
            echo "$candidate"
            return
        fi
        fallback=${fallback:-$candidate}
    done
    echo "$fallback"
}

if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    python=$(find_python)
    [ -n "$python" ] || die "Python 3.11 or later is needed: install it (Debian: apt-get install python3), or name it: make PYTHON=/path/to/python3"
    if ! makes_venvs "$python"; then
        apt_install python3-venv || true
        python=$(find_python)
    fi
    say "making .venv with $("$python" --version)"
    if makes_venvs "$python"; then
        "$python" -m venv --clear .venv
    elif "$python" -m pip --version >/dev/null 2>&1 && "$python" -m venv --clear --without-pip .venv; then
        "$python" -m pip --python .venv/bin/python install --quiet pip
    else
        die "$python cannot make environments: run 'apt-get install python3-venv' as root, then make again"
    fi
fi

say "installing the locked packages (a minute or two the first time)"
.venv/bin/python -m pip install --quiet --only-binary :all: -r requirements.lock -r requirements-dev.lock
.venv/bin/python -m pip install --quiet --no-deps --no-build-isolation --editable .
