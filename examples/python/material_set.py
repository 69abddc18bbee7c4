"""Colour, normals and height of one material, modelled together and grown registered.

    python material_set.py COLOUR OUT_FOLDER

Real sets come as files of maps; here height and normals are made of the colours' brightness.
"""

import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import btfield

colour = np.asarray(Image.open(sys.argv[1]).convert("RGB"))
if os.environ.get("BTFIELD_EXAMPLES_SMALL"):
    colour = np.ascontiguousarray(colour[:128, :128])
height = 6 * btfield.unit_of(colour).mean(axis=2, dtype=np.float32, keepdims=True)  # in pixels
normals = btfield.normals_of_slopes(btfield.slopes_of_height(height))

device = btfield.Device()
maps = [("colour", colour), ("normal", normals), ("height", height)]
material = btfield.join_maps(device, maps)
model = btfield.fit_material(device, material, order=3)
synthesiser = btfield.Synthesiser(device, model, (256, 256))
grown = btfield.split_maps(device, model, synthesiser.synthesise(1), tileable=synthesiser.tileable)

lit = btfield.Surface(grown["normal"], btfield.linear_of(grown["colour"]), grown["height"], edges="periodic").relight(
    btfield.direction_of_angles(60, 135)
)
out = Path(sys.argv[2])
out.mkdir(parents=True, exist_ok=True)
Image.fromarray(btfield.bytes_of(grown["colour"])).save(out / "colour.png")
Image.fromarray(btfield.bytes_of(btfield.encode_normals(grown["normal"]))).save(out / "normal.png")
Image.fromarray(btfield.bytes_of(btfield.srgb_of(lit))).save(out / "lit.png")
print(f"wrote {out}: {', '.join(grown)}, and the surface under a low light")
