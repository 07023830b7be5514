#!/usr/bin/env bash
# Sees to it that the slow tests of volumes can ask OpenVDB itself: installs Debian's module, for the system's Python, where there is none.
# Without one those tests are skipped: so only under CI is a missing one an error.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh

found() { /usr/bin/python3 -c 'import pyopenvdb' >/dev/null 2>&1 || /usr/bin/python3 -c 'import openvdb' >/dev/null 2>&1; }

if found; then exit 0; fi
if apt_install python3-openvdb && found; then exit 0; fi
[ "${CI:-}" != true ] || die "no OpenVDB for Python, and none could be installed"
say "no OpenVDB for Python: run 'apt-get install python3-openvdb' as root; going on without the tests that compare volumes with it"
