"""Prints the adapter that WebGPU offers; exit code 1 where there is none.

OpenGL does not count: wgpu falls back to it silently where no Vulkan driver is installed.
"""

import os
import sys
import tempfile

BACKENDS = ("Vulkan", "Metal", "D3D12")


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault("XDG_RUNTIME_DIR", folder)  # or the graphics libraries complain on stderr
        try:
            import wgpu

            found = [a.summary for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] in BACKENDS]
        except Exception as error:  # a broken driver raises any of several
            print(f"WebGPU adapter: none ({type(error).__name__}: {error})")
            return 1
    print(f"WebGPU adapter: {found[0] if found else 'none'}")
    return 0 if found else 1


if __name__ == "__main__":
    sys.exit(main())
