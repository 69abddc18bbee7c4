"""OpenCL drivers that came from PyPI: found without the system's help, before the first device is asked for.

The loader reads the names of drivers from the files of one folder, /etc/OpenCL/vendors, or another that
OCL_ICD_VENDORS names. Where a driver of `pip install btfield[cpu]` is there and the user has not chosen folders, a
folder is made that has both: the system's drivers and this one. It goes with the process.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from pathlib import Path

_SYSTEM = Path("/etc/OpenCL/vendors")
_CHOICES = ("OCL_ICD_VENDORS", "OCL_ICD_FILENAMES", "OPENCL_VENDOR_PATH")


def packaged_driver() -> Path | None:
    """The CPU driver of the package intel-opencl-rt, which pip puts into the lib folder of the environment."""
    import sysconfig

    places = {Path(sysconfig.get_path("data")) / "lib", Path(sys.prefix) / "lib"}
    if sys.version_info >= (3, 10):
        user = sysconfig.get_path("data", sysconfig.get_preferred_scheme("user"))
        places.add(Path(user) / "lib")
    for place in sorted(places):
        driver = place / "libintelocl.so"
        if driver.is_file():
            return driver
    return None


def find() -> Path | None:
    """Makes the driver known to the loader, and gives its file; None where there is none or the user has chosen."""
    if sys.platform != "linux" or any(os.environ.get(name) for name in _CHOICES):
        return None
    driver = packaged_driver()
    if driver is None:
        return None
    folder = Path(tempfile.mkdtemp(prefix="btfield-opencl-"))
    owner = os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # not in a process that was forked
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    if _SYSTEM.is_dir():
        for file in _SYSTEM.glob("*.icd"):
            shutil.copy(file, folder)
    (folder / "zz-btfield-cpu.icd").write_text(f"{driver}\n")
    os.environ["OCL_ICD_VENDORS"] = str(folder)
    return driver
