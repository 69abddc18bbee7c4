"""Random-field models of material textures: fitted to pictures, grown to any size, on any OpenCL device.

    import btfield

    device = btfield.Device()
    model = btfield.fit(device, picture)                    # H x W x d of uint8, uint16 or float32
    synthesiser = btfield.Synthesiser(device, model, (1024, 2048))
    texture = synthesiser.synthesise(seed=1)                # H x W x d of float32

Pictures are NumPy arrays H x W x d, or H x W for one plane, read and written by any library. Values of whole numbers are
fractions of white; textures are float32 in the picture's units, not clamped. Every lattice is a torus. Any function may
be called from any number of threads; work lets the interpreter go on, and Ctrl-C ends it. Sections "theory N" are those of
docs/theory.md. Names are those of the C++ library, whose headers say more.
"""

from . import _drivers as _drivers
from ._errors import DeviceError, Error, InputError, Stopped

_drivers.find()

from ._btfield import *  # noqa: E402, F403
from ._btfield import __version__ as __version__  # noqa: E402
from ._pictures import bytes_of, linear_of, srgb_of, unit_of  # noqa: E402
from ._sets import open_btf  # noqa: E402

for _name, _value in list(globals().items()):
    if getattr(_value, "__module__", None) == "btfield._btfield" and isinstance(_value, type):
        _value.__module__ = "btfield"
del _name, _value
