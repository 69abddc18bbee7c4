"""A BTF as a material of Mitsuba 3: the plug-in 'btf'.

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    import btfield.mitsuba

    ball = mi.load_dict({"type": "sphere", "bsdf": {"type": "btf", "filename": "bark.btfm", "repeat_u": 8, "repeat_v": 4}})

Variants scalar_rgb, llvm_ad_rgb, cuda_ad_rgb. docs/mitsuba.md tells what it does, and what it does not.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import BtfModel, BtfSynthesiser, Device, InputError, read_model
from ._directions import LitTable, Square, lit_table

try:
    import drjit as dr
    import mitsuba as mi
except ImportError as error:
    raise ImportError(f"btfield.mitsuba needs Mitsuba 3.8 or newer ({error}): pip install mitsuba") from error

__all__ = ["PLUGIN", "Material"]

PLUGIN = "btf"
"""Its name in scenes."""

_VARIANTS = ("scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb")
_STEP = 0.5
"""Pixels from one look along a ray to the next (theory 21.1)."""
_HALVINGS = 6
_PACKET = 16
"""Numbers that are read at a time."""


class _Numbers:
    """Rows of numbers in memory, of which weighted sums are taken."""

    def __init__(self, rows: NDArray[np.float32]) -> None:
        self._width = rows.shape[-1]
        padded = -(-self._width // _PACKET) * _PACKET
        self._packets = padded // _PACKET
        self._scalar = mi.variant().startswith("scalar")
        if self._scalar:
            self._rows: Any = rows.reshape(-1, self._width)
        else:
            flat = np.zeros((rows.size // self._width, padded), np.float32)
            flat[:, : self._width] = rows.reshape(-1, self._width)
            self._rows = mi.Float(flat.ravel())
            self._array = dr.auto.ad.Array44f

    def blend(self, corner: Callable[[Any], tuple[Any, Any]], corners: int, active: Any) -> Any:
        """A sum of so many rows, corner() telling index and share of each: a sequence of numbers."""
        if self._scalar:
            return sum(share * self._rows[index] for index, share in map(corner, range(corners))).tolist()

        def add(number: Any, sums: list[Any]) -> Any:
            index, share = corner(number)
            index = index * self._packets
            read = [dr.gather(self._array, self._rows, index + k, active) for k in range(self._packets)]
            return number + 1, [dr.fma(values, share, own) for values, own in zip(read, sums, strict=True)]

        zero = [dr.zeros(self._array, dr.width(active)) for _ in range(self._packets)]
        # A loop, for the sake of what compiles it.
        _, sums = dr.while_loop((mi.Int32(0), zero), lambda number, sums: number < corners, add, ("number", "sums"))
        return [row[i] for packet in sums for row in packet for i in range(4)][: self._width]


class _Plane:
    """One number for each pixel of a torus."""

    def __init__(self, values: NDArray[np.float32]) -> None:
        self._scalar = mi.variant().startswith("scalar")
        self._values = values.ravel() if self._scalar else mi.Float(values.ravel())

    def __getitem__(self, asked: tuple[Any, Any]) -> Any:
        index, active = asked
        return float(self._values[int(index)]) if self._scalar else dr.gather(mi.Float, self._values, index, active)


def _whole(value: Any) -> Any:
    return int(value) if mi.variant().startswith("scalar") else mi.Int32(value)


def _wrapped(place: Any, side: int) -> Any:
    """On the torus: from 0 to below side."""
    inside = place - side * dr.floor(place / side)
    return dr.select(inside >= side, 0.0, dr.maximum(inside, 0.0))


class _Surface:
    """Height and planes of a grown surface, a torus."""

    def __init__(self, surface: NDArray[np.float32]) -> None:
        self.height, self.width = surface.shape[:2]
        heights = np.ascontiguousarray(surface[..., 0])
        self._lowest, self._highest = float(heights.min()), float(heights.max())
        self._heights = _Plane(heights)
        self._planes = _Numbers(np.ascontiguousarray(surface[..., 1:]))

    def _corner(self, x: Any, y: Any) -> Callable[[Any], tuple[Any, Any]]:
        """The four pixels around a place."""
        x, y = _wrapped(x, self.width), _wrapped(y, self.height)
        left, top = dr.minimum(_whole(x), self.width - 1), dr.minimum(_whole(y), self.height - 1)
        across, down = x - left, y - top

        def corner(number: Any) -> tuple[Any, Any]:
            right, below = number & 1, number >> 1
            column, row = left + right, top + below
            column, row = dr.select(column == self.width, 0, column), dr.select(row == self.height, 0, row)
            share = dr.select(right == 1, across, 1 - across) * dr.select(below == 1, down, 1 - down)
            return row * self.width + column, share

        return corner

    def _height_at(self, x: Any, y: Any, active: Any) -> Any:
        return sum(share * self._heights[index, active] for index, share in map(self._corner(x, y), range(4)))

    def planes_at(self, x: Any, y: Any, ray: Any, active: Any) -> Any:
        """T where the ray to the viewer from a place of the mean plane meets the relief (theory 21.1)."""
        t = self._met(x, y, ray, active)
        return self._planes.blend(self._corner(x + t * ray.x, y - t * ray.y), 4, active)

    def _met(self, x: Any, y: Any, ray: Any, active: Any) -> Any:
        last = self._lowest / ray.z
        if self._lowest == self._highest:
            return last
        first = self._highest / ray.z

        def above(at: Any, active: Any) -> Any:
            return ray.z * at > self._height_at(x + at * ray.x, y - at * ray.y, active)

        def looking(step: Any, going: Any) -> Any:
            return going

        def look(step: Any, going: Any) -> Any:
            step = step + 1.0
            at = first - _STEP * step
            return step, going & (at > last) & above(at, going)

        step, _ = dr.while_loop((0.0 * first, active & (first > last)), looking, look, ("step", "going"))
        low = first - _STEP * step
        high = low + _STEP
        missed = above(low, active)

        def halve(number: Any, low: Any, high: Any) -> Any:
            middle = 0.5 * (low + high)
            over = above(middle, active)
            return number + 1, dr.select(over, low, middle), dr.select(over, middle, high)

        state = _whole(0), low, high
        _, low, high = dr.while_loop(state, lambda number, low, high: number < _HALVINGS, halve, ("number", "low", "high"))
        return dr.select(missed, last, 0.5 * (low + high))


def _place(square: Square, direction: Any) -> tuple[Any, Any]:
    """Column and row of a direction on a square, from 0 to side - 1; steeper ones are at the edge."""
    half = 0.5 * (square.side - 1)
    if half == 0:
        return 0.0 * direction.z, 0.0 * direction.z
    theta = dr.minimum(dr.atan2(dr.hypot(direction.x, direction.y), direction.z), square.steepest)
    out = theta * (half / square.steepest)
    if square.tangents:
        out = 0.5 * out + dr.tan(theta) * (0.5 * half / math.tan(square.steepest))
    turn = dr.atan2(direction.y, direction.x) / (2 * math.pi) + 0.125
    eighths = 8 * (turn - dr.floor(turn))
    # Quarters of a turn: right, up, left, down.
    sector = dr.minimum(dr.floor(0.5 * eighths), 3.0)
    along = (eighths - 2 * sector - 1) * out
    x = dr.select(sector < 1, out, dr.select(sector < 2, -along, dr.select(sector < 3, -out, along)))
    y = dr.select(sector < 1, along, dr.select(sector < 2, out, dr.select(sector < 3, -along, -out)))
    return half + x, half + y


class _Axis:
    """The two points beside a place, and their shares."""

    def __init__(self, place: Any, side: int) -> None:
        self._single = side == 1
        self._point = _whole(dr.clip(dr.floor(place), 0.0, max(side - 2, 0)))
        self._share = place - self._point

    def __getitem__(self, upper: Any) -> tuple[Any, Any]:
        """Of the lower point, or the upper where `upper` is 1: index and share."""
        if self._single:
            return self._point, dr.select(upper == 1, 0.0, 1.0)
        return self._point + upper, dr.select(upper == 1, self._share, 1 - self._share)


class _Directions:
    """What the table has between its directions."""

    def __init__(self, table: LitTable) -> None:
        self._views, self._lights = table.views, table.lights
        self._numbers = _Numbers(table.rows)

    def at(self, view: Any, light: Any, active: Any) -> Any:
        column, row = (_Axis(place, self._views.side) for place in _place(self._views, view))
        light_column, light_row = (_Axis(place, self._lights.side) for place in _place(self._lights, light))
        n, m = self._views.side, self._lights.side

        def corner(number: Any) -> tuple[Any, Any]:
            i, si = column[number & 1]
            j, sj = row[(number >> 1) & 1]
            k, sk = light_column[(number >> 2) & 1]
            l, sl = light_row[number >> 3]
            return ((j * n + i) * m + l) * m + k, si * sj * sk * sl

        return self._numbers.blend(corner, 16, active)


class _Light:
    """What a material gives back, in the memory of the variant in use."""

    def __init__(self, of: Material) -> None:
        self._colours, self._planes, self._xyz = of.colours, of.surface.shape[2] - 1, of.xyz
        self._directions = _Directions(of.table)
        self._surface = _Surface(of.surface)
        self._lowest = math.cos(of.table.views.steepest), math.sin(of.table.views.steepest)
        self.size = of.size

    def lit(self, u: Any, v: Any, view: Any, light: Any, active: Any) -> Any:
        """Light by the cosine of its angle: 1 is white. u, v: pieces of the material."""
        row = self._directions.at(view, light, active)
        # No lower than any view that was measured.
        low = view.z < self._lowest[0]
        level = dr.maximum(dr.hypot(view.x, view.y), 1e-6)
        scale = dr.select(low, self._lowest[1] / level, 1.0)
        ray = mi.Vector3f(scale * view.x, scale * view.y, dr.select(low, self._lowest[0], view.z))
        height, width = self.size
        planes = self._surface.planes_at(u * width - 0.5, (1 - v) * height - 0.5, ray, active)
        values = []
        for c in range(self._colours):
            z = row[self._colours + c]
            for k in range(self._planes):
                z = dr.fma(row[2 * self._colours + c * self._planes + k], planes[k], z)
            values.append(dr.exp(row[c]) * dr.square(dr.maximum(z, 0.0)))
        if self._colours == 1:
            values *= 3
        colour = mi.Color3f(*values)
        return dr.maximum(mi.xyz_to_srgb(colour), 0.0) if self._xyz else colour


class Material:
    """A grown piece of a BTF model, ready to lie on shapes: bsdf() of any variant.

    model: of method joint, or its file.
    tile: (height, width) in pixels of the piece, or one number; None: the pictures' size.
    surface: instead of a grown piece BtfFit.surface, that the model was fitted to.
    directions: views and lights are kept on squares of so many by so many, an odd number; memory goes with the
        fourth power of it.

    Raises InputError when the model is of another kind or has other than one or three colours, the tile does not
    continue at its edges, or an option does not fit.
    """

    def __init__(
        self,
        model: BtfModel | str | os.PathLike[str],
        *,
        device: Device | None = None,
        tile: int | tuple[int, int] | None = None,
        seed: int = 0,
        surface: NDArray[Any] | None = None,
        directions: int = 21,
    ) -> None:
        asked = "make a material of Mitsuba"
        if isinstance(model, (str, os.PathLike)):
            asked = f"make a material of Mitsuba of '{os.fspath(model)}'"
            model = read_model(model)
        if not isinstance(model, BtfModel):
            raise InputError(asked, f"it is a {type(model).__name__}", "give a model of `btfield btf fit`, method joint")
        if model.colours not in (1, 3):
            raise InputError(asked, f"the model has {model.colours} colours", "give one of one or three")
        if directions < 3 or directions % 2 == 0:
            raise InputError(asked, f"directions is {directions}", "give an odd number above 1, such as 21")
        device = device or Device()
        if surface is None:
            grown = BtfSynthesiser(device, model, tile or model.size, seed)
        else:
            grown = BtfSynthesiser(device, model, surface=surface)
        if not grown.tileable:
            found = f"a tile of {' x '.join(map(str, grown.size))} pixels does not continue at its edges"
            raise InputError(asked, found, "take sides without factors above 13")
        self.table: LitTable = lit_table(model, grown, directions)
        self.surface: NDArray[np.float32] = np.ascontiguousarray(grown.surface)
        """H x W x (1 + planes): height in pixels, then the planes."""
        self.colours: int = model.colours
        self.xyz: bool = model.space == "xyz"

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the piece."""
        return self.surface.shape[0], self.surface.shape[1]

    def bsdf(self, *, repeat_u: float = 1.0, repeat_v: float | None = None) -> Any:
        """The material in Mitsuba's variant in use, for a scene's dict.

        repeat_u, repeat_v: pieces side by side where u and v go from 0 to 1; repeat_v None: as many as along u.

        Raises InputError when the variant has no such material, or Dr.Jit's LLVM is too old for it.
        """
        if _class is None:
            found = f"the variant is {mi.variant()}"
            raise InputError("make a material of Mitsuba", found, f"set_variant() to one of {', '.join(_VARIANTS)}")
        _check_llvm()
        properties = mi.Properties(PLUGIN)
        properties["repeat_u"] = repeat_u
        properties["repeat_v"] = repeat_u if repeat_v is None else repeat_v
        return _class(properties, self)


def _check_llvm() -> None:
    """Dr.Jit 1.5 asks for what LLVM has for x86 from 17 on; older ones end the process."""
    if not mi.variant().startswith("llvm"):
        return
    llvm, drjit = dr.detail.llvm_version()[0], tuple(map(int, dr.__version__.split(".")[:2]))
    if llvm < 17 and drjit >= (1, 5):
        raise InputError(
            "render with LLVM",
            f"Dr.Jit {dr.__version__} found LLVM {llvm}, with which it ends the process",
            "install LLVM 17 or newer (Debian: libllvm19) and name it in DRJIT_LIBLLVM_PATH, or pip install mitsuba==3.8.0",
        )


def _make_class() -> type:
    class Btf(mi.BSDF):  # type: ignore[misc, name-defined]
        """The plug-in in the variant in use."""

        def __init__(self, props: Any, material: Material | None = None) -> None:
            mi.BSDF.__init__(self, props)
            if material is None:
                material = _of_file(props)
            self._light = _Light(material)
            self._repeat_u = float(props.get("repeat_u", 1.0))
            self._repeat_v = float(props.get("repeat_v", self._repeat_u))
            flags = mi.BSDFFlags
            self._lobe = flags.DiffuseReflection | flags.FrontSide | flags.SpatiallyVarying | flags.Anisotropic
            self.m_components = [self._lobe | flags.NonSymmetric]
            self.m_flags = self.m_components[0]

        def _lit(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            view, light = (si.wi, wo) if ctx.mode == mi.TransportMode.Radiance else (wo, si.wi)
            # Where coordinates of the surface are mirrored, so is the material.
            mirrored = dr.dot(si.dp_dv, si.sh_frame.t) < 0.0
            turned = dr.select(mirrored, -1.0, 1.0)
            lit = self._light.lit(
                si.uv.x * self._repeat_u,
                si.uv.y * self._repeat_v,
                mi.Vector3f(view.x, turned * view.y, view.z),
                mi.Vector3f(light.x, turned * light.y, light.z),
                active,
            )
            return dr.select(active, mi.UnpolarizedSpectrum(lit), 0.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            cosine = mi.Frame3f.cos_theta(si.wi)
            active = active & (cosine > 0.0) & ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 0)
            bs = mi.BSDFSample3f()
            bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
            bs.pdf = dr.select(active, mi.warp.square_to_cosine_hemisphere_pdf(bs.wo), 0.0)
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+self._lobe)
            bs.sampled_component = 0
            active = active & (bs.pdf > 0.0)
            return bs, self._lit(ctx, si, bs.wo, active)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            cosine, outward = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            active = active & (cosine > 0.0) & (outward > 0.0) & ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 0)
            return dr.select(active, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            density = self.pdf(ctx, si, wo, active)
            return self._lit(ctx, si, wo, density > 0.0) * density, density

        def to_string(self) -> str:
            height, width = self._light.size
            return f"Btf[tile = {width} x {height}, repeat_u = {self._repeat_u}, repeat_v = {self._repeat_v}]"

    return Btf


def _of_file(props: Any) -> Material:
    _check_llvm()
    return Material(
        str(mi.file_resolver().resolve(props.get("filename"))),
        device=Device(props.get("device", "auto")),
        tile=props.get("tile", 0) or None,
        seed=props.get("seed", 0),
        directions=props.get("directions", 21),
    )


_class: type | None = None


def _register() -> None:
    """Makes the plug-in anew for the variant in use: classes of Mitsuba belong to one."""
    global _class
    _class = None
    if mi.variant() in _VARIANTS:
        _class = _make_class()
        mi.register_bsdf(PLUGIN, _class)


_register()
mi.detail.add_variant_callback(lambda old, new: _register())
