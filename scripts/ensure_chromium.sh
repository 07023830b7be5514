#!/usr/bin/env bash
# Sees to it that the tests of the browser view find a Chromium: installs Debian's where there is none.
# Without one those tests are skipped: so only under CI is a missing one an error.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh

found() { command -v chromium >/dev/null 2>&1 || command -v chromium-browser >/dev/null 2>&1 || command -v google-chrome >/dev/null 2>&1; }

if found; then exit 0; fi
if apt_install chromium && found; then exit 0; fi
[ "${CI:-}" != true ] || die "no Chromium, and none could be installed"
say "no Chromium: run 'apt-get install chromium' as root; going on without the tests of the browser view in a browser"
