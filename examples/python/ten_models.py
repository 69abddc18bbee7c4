"""Ten models of one picture: a texture of each, and how far their statistics are from the picture's.

    python ten_models.py PICTURE OUT.png
"""

import os
import sys

import matplotlib
import numpy as np
from PIL import Image

import btfield

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

picture = np.asarray(Image.open(sys.argv[1]).convert("RGB"))
if os.environ.get("BTFIELD_EXAMPLES_SMALL"):
    picture = np.ascontiguousarray(picture[:128, :128])
size = picture.shape[:2]

device = btfield.Device()
analysis = btfield.Analysis(device, picture)  # shared by all fits
options = [btfield.FitOptions(model=kind, order=3) for kind in btfield.model_kinds()]
models = analysis.fit_all(options)

reference = btfield.MemdReference(device, picture)
figure, axes = plt.subplots(3, 4, figsize=(16, 13), layout="constrained")
axes = axes.ravel()
axes[0].imshow(picture)
axes[0].set_title("picture")
for axis, model in zip(axes[1:], models):
    axis.set_title(f"{model.kind}: not valid")
    if not model.valid:  # its certificate says why
        continue
    texture = btfield.synthesise(device, model, size, seed=1)
    error = btfield.compare(picture, texture).lag_covariance_error
    axis.imshow(btfield.bytes_of(texture))
    axis.set_title(f"{model.kind}: MEMD {reference(texture).memd:.2f}, lag covariances {error:.3f}")
curves = btfield.statistic_curves(picture, btfield.synthesise(device, models[1], size, seed=1))
for plane, colour in zip(curves.planes, "rgb"):
    axes[11].loglog(curves.frequencies, plane.spectrum[:, 0], colour, label=f"picture, {colour}")
    axes[11].loglog(curves.frequencies, plane.spectrum[:, 1], colour + "--")
axes[11].set(title=f"spectrum, and that of {models[1].kind} (dashed)", xlabel="cycles per pixel")
axes[11].legend()
for axis in axes[:11]:
    axis.set_axis_off()
figure.savefig(sys.argv[2], dpi=60)
print(f"wrote {sys.argv[2]}: {sum(model.valid for model in models)} of {len(models)} models are valid")
