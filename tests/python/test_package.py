"""The package as it is installed: its version, and what importing it costs."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
import tomllib

import pytest
from conftest import ROOT

import somatic_touch as st


def test_its_version_is_the_crates(somatic) -> None:
    crate = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    assert st.__version__ == importlib.metadata.version("somatic-touch") == crate
    assert somatic("--version").split()[1].rstrip(",") == crate


IMPORTED = """
import os, time, numpy
def threads(): return set(os.listdir("/proc/self/task"))
before, began = threads(), time.process_time()
import somatic_touch
took = time.process_time() - began
libraries = open("/proc/self/maps").read()
print(took, threads() == before, [name for name in ("vulkan", "lvp", "libGL") if name in libraries])
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads are counted in /proc")
def test_importing_it_is_quick_and_starts_nothing() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORTED], capture_output=True, text=True, check=True)
    took, rest = done.stdout.split(maxsplit=1)
    assert float(took) < 0.15 and rest.strip() == "True []", done.stdout
