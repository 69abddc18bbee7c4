"""The programs of examples/python run, on small pictures, and write what they promise."""

import os
import subprocess
import sys

import pytest
from conftest import DATA, ROOT


@pytest.mark.parametrize(
    ("program", "pictures", "out"),
    [
        ("ten_models", ["cork.png"], "ten.png"),
        ("p4_table", ["cork.png", "bark.png"], "p4.csv"),
        ("material_set", ["cork.png"], "set"),
        ("btf_directions", ["bark.png"], "btf.png"),
        ("mitsuba_shapes", ["bark.png"], "shapes.png"),
    ],
)
def test_example(program, pictures, out, tmp_path):
    words = [sys.executable, ROOT / "examples" / "python" / f"{program}.py", *(DATA / name for name in pictures)]
    done = subprocess.run([*words, tmp_path / out], capture_output=True, text=True, check=False,
                          env={**os.environ, "BTFIELD_EXAMPLES_SMALL": "1", "MPLCONFIGDIR": str(tmp_path)})
    assert done.returncode == 0, done.stderr
    assert done.stdout
    made = tmp_path / out
    assert made.stat().st_size > 1000 if made.is_file() else len(list(made.iterdir())) == 3
