"""The table of P4 for pictures of one's own, as a pandas frame: MEMD* of ten models, and kappa.

    python p4_table.py PICTURE... OUT.csv
"""

import os
import sys
from pathlib import Path

import numpy as np
import pandas
from PIL import Image

import btfield

device = btfield.Device()
rows = []
for file in sys.argv[1:-1]:
    picture = np.asarray(Image.open(file).convert("RGB"))
    if os.environ.get("BTFIELD_EXAMPLES_SMALL"):
        picture = np.ascontiguousarray(picture[:96, :96])
    reference = btfield.MemdReference(device, picture)
    analysis = btfield.Analysis(device, picture)
    kappa = btfield.kappa(picture).kappa
    for kind in btfield.model_kinds():
        model = analysis.fit(model=kind, order=3, marginals="none")
        found = float("nan")
        if model.valid:
            found = reference(btfield.synthesise(device, model, picture.shape[:2], seed=1)).memd_star
        rows.append({"picture": Path(file).stem, "kappa": kappa, "model": kind, "MEMD*": found})

frame = pandas.DataFrame(rows)
table = frame.pivot(index=["picture", "kappa"], columns="model", values="MEMD*")[btfield.model_kinds()]
print(table.round(3).to_string())
frame.to_csv(sys.argv[-1], index=False)
