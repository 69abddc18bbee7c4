"""What NumPy does for pictures: to linear light and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError


def unit_of(picture: NDArray[Any]) -> NDArray[np.float32]:
    """Values of uint8 and uint16 as fractions of white, float32; float32 as they are."""
    picture = np.asarray(picture)
    if picture.dtype == np.float32:
        return picture
    if picture.dtype in (np.uint8, np.uint16):
        return picture.astype(np.float32) / np.float32(np.iinfo(picture.dtype).max)
    raise InputError("take a picture", f"its values are {picture.dtype}", "give uint8, uint16 or float32")


def linear_of(picture: NDArray[Any]) -> NDArray[np.float32]:
    """sRGB-encoded values, uint8, uint16 or float32, as linear light."""
    values = unit_of(picture).astype(np.float64)
    dark = values / 12.92
    light = ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(values <= 0.04045, dark, light).astype(np.float32)


def srgb_of(picture: NDArray[Any]) -> NDArray[np.float32]:
    """Linear light, sRGB-encoded."""
    values = unit_of(picture).astype(np.float64)
    dark = values * 12.92
    light = 1.055 * np.maximum(values, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(values <= 0.0031308, dark, light).astype(np.float32)


def bytes_of(picture: NDArray[Any]) -> NDArray[np.uint8]:
    """Values in [0, 1], others clamped, as the nearest of uint8: what libraries of pictures store.

    H x W where there is one plane.
    """
    values = np.clip(unit_of(picture), np.float32(0), np.float32(1)) * np.float32(255)
    result = np.ascontiguousarray(np.rint(values).astype(np.uint8))
    return result[..., 0] if result.ndim == 3 and result.shape[2] == 1 else result
