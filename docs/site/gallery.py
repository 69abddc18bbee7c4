"""Writes the gallery of the documentation site: gallery.md and its pictures.

gallery.py BTFIELD PICTURES FOLDER

BTFIELD is the command, PICTURES the folder of the samples, FOLDER where the page goes. Everything on the page is
computed here, with the commands that the page shows.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image, ImageFilter

FIELDS = [f"{dimension}-{kind}" for kind in ("car", "ma", "msar", "mmrf", "pmrf") for dimension in ("2d", "3d")]
MATERIALS = ["cork", "bark", "rock", "sand", "grass"]
# Whose brightness is taken for its height, so that a BTF can be made of it; black to white as a share of the width.
RELIEFS = {"cork": 0.03, "bark": 0.04}
SIDE = 256


class Gallery:
    def __init__(self, btfield, pictures, folder, work):
        self.btfield, self.pictures, self.folder, self.work = btfield, pictures, folder, work
        self.lines = []

    def run(self, *words):
        """The command's JSON."""
        done = subprocess.run([self.btfield, *map(str, words), "--json"], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"btfield {' '.join(map(str, words))}\n{done.stderr}")
        return json.loads(done.stdout)

    def publish(self, picture, name):
        """Shows a piece of a picture, as large as all others; the piece itself."""
        piece = self.work / "piece.png"
        with Image.open(picture) as image:
            part = image.crop((0, 0, SIDE, SIDE))
            part.save(piece)
            part.convert("RGB").save(self.folder / name, quality=88)
        return piece

    def row(self, title, note, sample, model, grown):
        """Shows a texture, and holds it against its sample."""
        name = f"{sample.stem}-{title}.jpg"
        piece = self.publish(grown, name)
        told = self.run("compare", sample, grown)
        colours = self.run("memd", sample, piece)
        ratios = [plane["std_ratio"] for plane in told["planes"] if plane["std_ratio"] is not None]
        size = f"{model.stat().st_size / 1e3:.1f} kB" if model else "the sample"
        figures = [
            f"{colours['memd_star']:.2f} %",
            f"{min(ratios):.3f}–{max(ratios):.3f}",
            f"{told['lag_covariance_error']:.3f}",
            "–" if told["structure_distance"] is None else f"{told['structure_distance']:.3f}",
            size,
        ]
        return (f"![{sample.stem}: {title}]({name})", f"{title}{note}", figures)

    def fields(self, material, sample):
        """Every model's texture."""
        models = self.work / material
        self.run("fit", sample, "--all", models, "--levels", 3)
        rows = []
        for name in FIELDS:
            model = models / f"{material}-{name}.json"
            if not model.exists():
                rows.append(("", f"{name}: has no model here", ["–"] * 5))
                continue
            grown = self.work / f"{material}-{name}.png"
            told = self.run("info", model)
            valid = all(level["certificate"]["valid"] for level in told["levels"])
            note = "" if valid else " (its certificate fails)"
            self.run("synth", model, "-o", grown, "--size", 2 * SIDE, "--allow-invalid")
            rows.append(self.row(name, note, sample, model, grown))
        return rows

    def structures(self, material, sample):
        model, grown = self.work / f"{material}.btfm", self.work / f"{material}-compound.png"
        self.run("compound", "fit", sample, "-o", model)
        self.run("synth", model, "-o", grown, "--size", 2 * SIDE)
        rows = [self.row("compound", "", sample, model, grown)]
        grown = self.work / f"{material}-roll.png"
        self.run("roll", sample, "-o", grown, "--size", 2 * SIDE)
        return [*rows, self.row("roll", "", sample, None, grown)]

    def material(self, name):
        sample = self.work / f"{name}.png"
        with Image.open(self.pictures / f"{name}.png") as image:
            flat = image.convert("L" if image.mode == "L" else "RGB")
            flat.crop((0, 0, SIDE, SIDE)).save(sample)
        self.publish(sample, f"{name}.jpg")
        rows = [*self.fields(name, sample), *self.structures(name, sample)]
        self.lines += [f"## {name.capitalize()}", "", '<div class="gallery" markdown>', ""]
        self.lines += [f"<figure markdown>![{name}: the sample]({name}.jpg)<figcaption>the sample</figcaption></figure>"]
        self.lines += [
            f"<figure markdown>{picture}<figcaption>{title}</figcaption></figure>" for picture, title, _ in rows if picture
        ]
        self.lines += ["", "</div>", "", "| texture | MEMD* | std ratio | covariance error | structure | model |"]
        self.lines += ["|---|---|---|---|---|---|"]
        self.lines += [f"| {title} | {' | '.join(figures)} |" for _, title, figures in rows]
        self.lines += [""]

    def surface(self, name, relief):
        """A material seen under light, its relief guessed from brightness."""
        with Image.open(self.work / f"{name}.png") as image:
            colour = image.convert("RGB").resize((SIDE // 2, SIDE // 2), Image.Resampling.BOX)
        colour.save(self.work / "colour.png")
        colour.convert("L").filter(ImageFilter.BoxBlur(1)).save(self.work / "height.png")
        whole, model = self.work / f"{name}.tbig", self.work / f"{name}-btf.btfm"
        self.run("btf", "make", self.work / "colour.png", self.work / "height.png", "-o", whole, "--relief", relief)
        told = self.run("btf", "fit", whole, "-o", model, "--model", "roll")
        self.lines += [""]
        for shape, light in (("sphere", "60,120"), ("plane", "70,30")):
            shown = self.work / f"{name}-{shape}.png"
            self.run("btf", "render", model, "-o", shown, "--shape", shape, "--light", light, "--size", 2 * SIDE, "--tile", 512)
            with Image.open(shown) as image:
                image.convert("RGB").save(self.folder / f"{name}-{shape}.jpg", quality=88)
            self.lines += [f"![{name} on a {shape}]({name}-{shape}.jpg){{ width=48% }}"]
        self.lines += ["", f"{name.capitalize()}: a model of {model.stat().st_size / 1e3:.0f} kB, 1 : {told['compression_ratio']:.0f}."]

    def write(self):
        self.lines = [
            "# Gallery",
            "",
            f"Samples of {SIDE} × {SIDE} pixels and what was grown of them: {2 * SIDE} × {2 * SIDE} pixels each, of which the",
            "left upper quarter is shown. The figures hold the texture against the sample: [MEMD*](colour-criteria.md) that",
            "quarter, the others the whole: smallest and largest ratio of deviations among planes, error of covariances by",
            "lag, and [structure distance](theory.md#155-structure); the last column is the model file's size.",
            "",
            "    btfield fit cork.png --all models/ --levels 3",
            "    btfield synth models/cork-3d-car.json -o grown.png --size 512      and so on for the other nine",
            "    btfield compound fit cork.png -o cork.btfm && btfield synth cork.btfm -o grown.png --size 512",
            "    btfield roll cork.png -o grown.png --size 512",
            "    btfield compare cork.png grown.png --json; btfield memd cork.png quarter.png --json",
            "",
        ]
        for name in MATERIALS:
            self.material(name)
        self.lines += [
            "## Under light",
            "",
            "BTFs of 81 views under 81 lights, computed of the samples above with their brightness taken for height, and",
            "the models of them, grown and lit ([BTFs](btf.md)).",
            "",
            "    btfield btf make colour.png height.png -o set.tbig --relief 0.03",
            "    btfield btf fit set.tbig -o model.btfm --model roll",
            "    btfield btf render model.btfm -o ball.png --shape sphere --light 60,120 --size 512 --tile 512",
        ]
        for name, relief in RELIEFS.items():
            self.surface(name, relief)
        (self.folder / "gallery.md").write_text("\n".join(self.lines) + "\n", encoding="utf-8")


def main():
    btfield, pictures, folder = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        Gallery(btfield, pictures, folder, pathlib.Path(work)).write()


if __name__ == "__main__":
    main()
