"""BTFs as folders of pictures, which the caller's own library reads."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._btfield import BtfSet, _angles_of_name
from ._errors import InputError
from ._pictures import linear_of, unit_of

_PICTURES = {".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".hdr", ".pnm", ".ppm", ".pgm", ".webp"}


def _angles(file: Path, root: Path) -> tuple[float, float, float, float] | None:
    """tl, pl, tv, pv of a file's name, or of the folders that it is in."""
    found: list[float | None] = [None] * 4
    for part in (file.stem, *(folder.name for folder in file.parents if folder != root and root in folder.parents)):
        for i, angle in enumerate(_angles_of_name(part)):
            if found[i] is None:
                found[i] = angle
    if any(angle is None for angle in found):
        return None
    return tuple(found)  # type: ignore[return-value]


def _linear(array: NDArray[Any], coding: str, jpeg: bool) -> NDArray[np.float32]:
    if coding == "auto":
        coding = "linear" if array.dtype == np.float32 else "gamma" if jpeg else "srgb"
    if coding == "linear":
        return unit_of(array)
    if coding == "gamma":
        return np.power(np.maximum(unit_of(array), 0), 2.2).astype(np.float32)
    if coding == "srgb":
        return linear_of(array)
    raise InputError(f"find the coding of values '{coding}'", "it is not known", "use auto, srgb, gamma, linear")


def _side_file(folder: Path, asked: str) -> tuple[float, float]:
    """Exposure and white, which btf.json tells beside pictures that btfield wrote."""
    file = folder / "btf.json"
    if not file.is_file():
        return 1.0, 1.0
    try:
        told = json.loads(file.read_text(encoding="utf-8"))
        exposure, white = float(told["exposure"]), float(told.get("white", 1.0))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(asked, f"'{file}' is not what btfield wrote ({error!r})", "write the set again") from None
    if not (0.0 < exposure < math.inf and 0.0 < white < math.inf):
        raise InputError(asked, f"exposure or white in '{file}' is no number above 0", "write the set again")
    return exposure, white


def open_btf(
    path: str | os.PathLike[str],
    *,
    read: Callable[[Path], NDArray[Any]] | None = None,
    coding: str = "auto",
    view_stride: int = 1,
    light_stride: int = 1,
    pixel_stride: int = 1,
    crop: tuple[int, int, int, int] | None = None,
) -> BtfSet:
    """Opens a BTF.

    path: a folder of pictures whose names, or those of the folders that they are in, have tl, pl, tv and pv with degrees
        behind, in any order; or a file .btf of UBO2014, TBIG 2, BIG 3, MIF.
    read: of folders: gives the array of a file's picture, H x W x d, uint8, uint16 or float32: `imageio.v3.imread`, or
        `lambda file: numpy.asarray(PIL.Image.open(file))`. Called from any thread.
    coding: what numbers mean: 'srgb', 'gamma' (2.2) or 'linear'; 'auto': JPEG gamma, other whole numbers sRGB, floats
        linear.
    crop: (x, y, width, height) of all pictures; strides: every n-th pixel, view, light.

    Of a folder that btfield wrote, btf.json tells exposure and white. Its height.exr is not read: give it to fit_btf().

    Raises InputError when nothing such is there, two pictures have the same directions, or sizes differ.
    """
    path = Path(path)
    if not path.is_dir():
        return BtfSet.open_file(
            path, coding=coding, crop=crop, pixel_stride=pixel_stride, view_stride=view_stride, light_stride=light_stride
        )
    asked = f"open the BTF '{path}'"
    if read is None:
        raise InputError(asked, "a folder's pictures are read by a library of yours", "give read, such as imageio.v3.imread")
    files: dict[tuple[tuple[float, float], tuple[float, float]], Path] = {}
    for file in sorted(path.rglob("*")):
        if file.suffix.lower() not in _PICTURES or (angles := _angles(file, path)) is None:
            continue
        tl, pl, tv, pv = (math.radians(angle) for angle in angles)
        pair = ((tv, pv), (tl, pl))
        if pair in files:
            raise InputError(asked, f"'{file}' and '{files[pair]}' have the same directions", "leave one of them out")
        files[pair] = file
    if not files:
        raise InputError(asked, "no picture's name has tl, pl, tv and pv", "name them as docs/btf.md says")
    exposure, white = _side_file(path, asked)
    views = sorted({view for view, _ in files})[::view_stride]
    lights = sorted({light for _, light in files})[::light_stride]
    at = {
        (views.index(view), lights.index(light)): file
        for (view, light), file in files.items()
        if view in views and light in lights
    }

    def picture(view: int, light: int) -> NDArray[np.float32]:
        file = at[view, light]
        array = np.atleast_3d(np.asarray(read(file)))
        if crop is not None:
            x, y, width, height = crop
            array = array[y : y + height, x : x + width]
        array = array[::pixel_stride, ::pixel_stride]
        values = _linear(array, coding, file.suffix.lower() in (".jpg", ".jpeg"))
        return values if exposure == 1.0 else values / np.float32(exposure)

    first = picture(*min(at))
    height, width, planes = first.shape
    size = sum(file.stat().st_size for file in at.values())
    return BtfSet(
        picture, (height, width), planes, views, lights, pairs=sorted(at), white=white, format="pictures", bytes=size
    )
