"""A BTF made of maps, learned as one small model, grown, and seen from many directions.

    python btf_directions.py COLOUR OUT.png
"""

import math
import os
import sys

import numpy as np
from PIL import Image

import btfield

small = bool(os.environ.get("BTFIELD_EXAMPLES_SMALL"))
side = 48 if small else 128
colour = np.asarray(Image.open(sys.argv[1]).convert("RGB"))[:side, :side]
height = 5 * btfield.unit_of(colour).mean(axis=2, dtype=np.float32)
normals = btfield.normals_of_slopes(btfield.slopes_of_height(height, "periodic"))

device = btfield.Device()
directions = btfield.btf_directions_81()[:: 3 if small else 1]
pictures = btfield.make_btf(device, btfield.linear_of(colour), normals, height, views=directions, lights=directions)
# Height of the material instead of one that stereo would find.
fit = btfield.fit_btf(device, pictures, planes=6, periodic=True, leave_out=9)
print(f"{fit.model}: {len(fit.model.to_bytes())} bytes; error of pictures that the fit was not shown: "
      f"{fit.score.model.median:.2f} of their deviation, of the nearest picture: {fit.score.nearest.median:.2f}")

grown = btfield.BtfSynthesiser(device, fit.model, (128, 128), seed=1)
rows = []
for theta in (0, 30, 60):
    row = [grown.picture((math.radians(theta), 0), (math.radians(50), math.radians(phi))) for phi in range(0, 360, 60)]
    rows.append(np.concatenate(row, axis=1))
sheet = btfield.srgb_of(np.concatenate(rows))
Image.fromarray(btfield.bytes_of(sheet)).save(sys.argv[2])
print(f"wrote {sys.argv[2]}: views from above down, lights around")
