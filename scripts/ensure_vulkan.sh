#!/usr/bin/env bash
# Sees to it that WebGPU finds an adapter: installs Mesa's software Vulkan where there is none.
# Without one Airlight still works, on NumPy: so only under CI is a missing adapter an error.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh

if .venv/bin/python scripts/probe_adapter.py; then exit 0; fi
if apt_install mesa-vulkan-drivers libvulkan1 && .venv/bin/python scripts/probe_adapter.py; then exit 0; fi
[ "${CI:-}" != true ] || die "no Vulkan adapter, and none could be installed"
say "no Vulkan adapter: run 'apt-get install mesa-vulkan-drivers libvulkan1' as root; going on with the slower NumPy path"
