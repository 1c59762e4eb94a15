"""What the tests have in common."""

from __future__ import annotations

import os
import pathlib
import subprocess

import numpy as np
import pytest

import somatic_touch as st

ROOT = pathlib.Path(__file__).parents[2]
DATA = pathlib.Path(os.environ.get("SOMATIC_DATA", ROOT.parent / "shared" / "data"))


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "once: on one Python, as another one makes no difference: the library, or a job of minutes")


@pytest.fixture(scope="session")
def command() -> pathlib.Path:
    """The command, built from the same tree."""
    named = os.environ.get("SOMATIC_COMMAND")
    if named is None:
        pytest.skip("SOMATIC_COMMAND names no command to compare with")
    return pathlib.Path(named)


@pytest.fixture(scope="session")
def somatic(command: pathlib.Path):
    """Runs the command and gives what it prints."""

    def run(*arguments: object) -> str:
        words = [str(command), *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode in (0, 3), done.stderr
        return done.stdout

    return run


def without_gpu(error: st.SomaticError) -> None:
    """Skips a test of the GPU where there is none, unless there must be one."""
    if os.environ.get("SOMATIC_REQUIRE_GPU") == "1":
        pytest.fail(f"SOMATIC_REQUIRE_GPU is set: {error}")
    pytest.skip(str(error))


@pytest.fixture(scope="session")
def gpu() -> str:
    """The backend of that name, where it works."""
    try:
        return st.Engine(st.Body.bundled("hand"), backend="gpu").backend
    except st.SomaticError as error:
        without_gpu(error)
        raise


@pytest.fixture
def hand() -> st.Body:
    return st.Body.bundled("hand")


@pytest.fixture(scope="session")
def touch() -> st.Recording:
    return st.read("hand")


def pressed(body: st.Body, frames: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Times and raw values of touches that move over the body."""
    random = np.random.default_rng(seed)
    places = body.taxels["place"]
    centre = places[random.integers(len(places), size=frames)]
    distance = np.linalg.norm(places[None] - centre[:, None], axis=2)
    values = 900 * np.exp(-((distance / 0.03) ** 2)) - 20
    return 0.01 * np.arange(frames), np.maximum(values, 0).round().astype(np.float32)
