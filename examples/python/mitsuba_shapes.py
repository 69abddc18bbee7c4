"""A material on a sphere and on a cloth under a sky, by Mitsuba 3: `pip install mitsuba`.

    python mitsuba_shapes.py MATERIAL OUT.png

MATERIAL: a model of `btfield btf fit`, .btfm or .json, or a picture, of which a BTF is made and learned.
"""

import os
import sys

import mitsuba as mi
import numpy as np
from PIL import Image

mi.set_variant("llvm_ad_rgb" if "llvm_ad_rgb" in mi.variants() else "scalar_rgb")

import btfield  # noqa: E402
import btfield.mitsuba  # noqa: E402

small = bool(os.environ.get("BTFIELD_EXAMPLES_SMALL"))
side, samples, tile, directions = (48, 4, 64, 7) if small else (400, 128, 384, 21)
SUN = 4.0, 0.7  # longitude, height: radians
device = btfield.Device()


def model_of(file):
    if file.endswith((".btfm", ".json")):
        return btfield.read_model(file)
    pixels = 32 if small else 128
    colour = np.asarray(Image.open(file).convert("RGB"))[:pixels, :pixels]
    height = 5 * btfield.unit_of(colour).mean(axis=2, dtype=np.float32)
    normals = btfield.normals_of_slopes(btfield.slopes_of_height(height, "periodic"))
    directions = btfield.btf_directions_81()[:: 5 if small else 1]
    pictures = btfield.make_btf(device, btfield.linear_of(colour), normals, height, views=directions, lights=directions)
    return btfield.fit_btf(device, pictures, planes=4 if small else 16, periodic=True, surface="roll").model


def sky():
    """Linear light over longitude and latitude: a sun, a sky brighter at the horizon, dark ground."""
    up = np.cos(np.linspace(0, np.pi, 256))[:, None, None]
    around = np.linspace(0, 2 * np.pi, 512, endpoint=False)[None, :, None]
    above = [0.2, 0.35, 0.6] + np.exp(-5 * np.abs(up)) * [0.7, 0.6, 0.4]
    light = np.where(up > 0, above, [0.1, 0.09, 0.08] + np.exp(30 * np.minimum(up, 0)) * [0.5, 0.45, 0.4])
    to_sun = np.sqrt(1 - up**2) * np.cos(around - SUN[0]) * np.cos(SUN[1]) + up * np.sin(SUN[1])
    light = light + np.exp((to_sun - 1) / 0.003) * [260, 230, 190]
    return {"type": "envmap", "bitmap": mi.Bitmap(light.astype(np.float32))}


def cloth(bsdf, n=200):
    """A mesh that falls in folds: (x, y) of the material stay as they are, z is given."""
    v, u = np.mgrid[0 : 1 : n * 1j, 0 : 1 : n * 1j]
    x, y = 2 * u - 1, 2 * v - 1
    z = 0.16 * np.sin(5 * x + 2 * np.sin(2 * y)) * (1.2 - v) + 0.08 * np.cos(4 * y + 3 * x)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.stack([corner, corner + 1, corner + n + 1, corner, corner + n + 1, corner + n], axis=1).reshape(-1, 3)
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    mesh = mi.Mesh("cloth", n * n, len(faces), has_vertex_normals=True, has_vertex_texcoords=True, props=properties)
    values = mi.traverse(mesh)
    values["vertex_positions"] = np.stack([x, y, z], axis=-1).ravel()
    values["vertex_texcoords"] = np.stack([u, v], axis=-1).ravel()
    values["faces"] = faces.ravel()
    values.update()
    return mesh


def picture(shape, eye):
    transform = mi.ScalarTransform4f().look_at(origin=eye, target=[0, 0, 0], up=[0, 0, 1])
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4, "hide_emitters": False},
        "sky": sky() | {"to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90)},
        "camera": {
            "type": "perspective", "fov": 25, "to_world": transform,
            "film": {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "gaussian"}},
        },
        "shape": shape,
    })
    return np.array(mi.render(scene, spp=samples))[..., :3]


model = model_of(sys.argv[1])
# Twice as many grown pieces around as from pole to pole keep the material's pixels square on a sphere.
material = btfield.mitsuba.Material(model, device=device, tile=tile, seed=1, directions=directions)
ball = material.bsdf(repeat_u=3, repeat_v=1.5)
sheet = mi.load_dict({"type": "twosided", "bsdf": material.bsdf(repeat_u=1.5)})
pictures = [
    picture({"type": "sphere", "bsdf": ball}, [0, -4.9, 0.6]),
    picture(cloth(sheet), [0, -4.5, 2.2]),
]
both = btfield.bytes_of(btfield.srgb_of(np.concatenate(pictures, axis=1)))
Image.fromarray(both).save(sys.argv[2], quality=88)
print(f"{model}: wrote {sys.argv[2]}: on a sphere and on a cloth")
