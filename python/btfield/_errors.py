"""The exceptions of btfield, as btfield/error.hpp has them."""


class Error(Exception):
    """Base of every error of btfield. `str()` is one line, "ASKED: FOUND; REMEDY"."""

    def __init__(self, asked: str, found: str = "", remedy: str = "", text: str = "", log: str = "") -> None:
        super().__init__(asked, found, remedy, text, log)
        self.asked = asked
        self.found = found
        self.remedy = remedy
        self._text = text or f"{asked}: {found}; {remedy}"

    def __str__(self) -> str:
        return self._text


class InputError(Error, ValueError):
    """The request cannot be met: a bad picture, an invalid model, an impossible size, an unwritable file."""


class Stopped(Error):
    """The caller ended the work: nothing is wrong."""


class DeviceError(Error, RuntimeError):
    """An OpenCL call, a kernel's build or an allocation failed, or there is no such device.

    `log` is the whole build log of a kernel that did not compile; empty otherwise.
    """

    def __init__(self, asked: str, found: str = "", remedy: str = "", text: str = "", log: str = "") -> None:
        super().__init__(asked, found, remedy, text, log)
        self.log = log
