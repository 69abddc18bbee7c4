"""What the tests share: a device, pictures of tests/data, the command."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import btfield

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"


@pytest.fixture(scope="session")
def device() -> btfield.Device:
    return btfield.Device()


@pytest.fixture(scope="session")
def cork() -> np.ndarray:
    return np.asarray(Image.open(DATA / "cork.png").convert("RGB"))


@pytest.fixture(scope="session")
def bark() -> np.ndarray:
    return np.asarray(Image.open(DATA / "bark.png").convert("RGB"))


@pytest.fixture(scope="session")
def small(cork: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(cork[:64, :64])


@pytest.fixture(scope="session")
def command():
    """Runs the command of the same build; gives what it says as JSON."""
    program = os.environ.get("BTFIELD_COMMAND", str(ROOT / "build" / "release" / "btfield"))

    def run(*words: object) -> dict:
        done = subprocess.run([program, *map(str, words), "--json"], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run
