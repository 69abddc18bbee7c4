"""btfield.mitsuba: BTF models as materials of Mitsuba 3, in its scalar and its LLVM variant."""

import math
import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from mitsuba.chi2 import ChiSquareTest, SphericalDomain

mi.set_variant("scalar_rgb")

import btfield  # noqa: E402
import btfield.mitsuba  # noqa: E402

TILE = 32
VIEWS = [(0, 0), (30, 45), (60, 300), (45, 180), (70, 100)]
LIGHTS = [(45, 90), (60, 200), (20, 10), (10, 250), (55, 330)]


def radians(direction):
    return math.radians(direction[0]), math.radians(direction[1])


def vector(direction):
    theta, phi = radians(direction)
    return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])


@pytest.fixture(scope="module")
def model(device, cork):
    height = 12 * btfield.unit_of(cork[:TILE, :TILE, :1])
    normals = btfield.normals_of_slopes(btfield.slopes_of_height(height, "periodic"))
    directions = btfield.btf_directions_81()[::3]
    pictures = btfield.make_btf(device, btfield.linear_of(cork[:TILE, :TILE]), normals, height, views=directions,
                                lights=directions)
    field = btfield.FitOptions(model="3d-car", order=1)
    return btfield.fit_btf(device, pictures, planes=4, periodic=True, field=field).model


@pytest.fixture(scope="module")
def material(device, model):
    return btfield.mitsuba.Material(model, device=device, tile=TILE, seed=3)


@pytest.fixture
def llvm():
    mi.set_variant("llvm_ad_rgb")
    yield
    mi.set_variant("scalar_rgb")


def interaction(wi, uv=(0.3, 0.2), n=1, dp_dv=(0, 1, 0)):
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi, si.uv, si.dp_dv, si.sh_frame = wi, uv, dp_dv, mi.Frame3f([0, 0, 1])
    return si


def value(bsdf, view, light, uv=(0.3, 0.2), mode=None, dp_dv=(0, 1, 0)):
    """eval() of one pair in the variant in use."""
    context = mi.BSDFContext(mi.TransportMode.Radiance if mode is None else mode)
    si = interaction(mi.Vector3f(*map(float, view)), mi.Point2f(*uv), dp_dv=mi.Vector3f(*dp_dv))
    return np.array(bsdf.eval(context, si, mi.Vector3f(*map(float, light)))).ravel()


def plane_scene(bsdf, view, light, repeat, texels, pixels):
    """A plane of repeat x repeat pieces, each of side 1, seen as `btfield btf render` does; white under the light is 1."""
    to = vector(view)
    up = np.array([0, 1, 0]) - to[1] * (np.array([0, 0, 1]) + to) / (1 + to[2])
    transform = mi.ScalarTransform4f()
    camera = transform.look_at(origin=list(50 * to), target=[0, 0, 0], up=list(up))
    half = 0.5 * pixels / texels / TILE
    return mi.load_dict({
        "type": "scene", "integrator": {"type": "direct"},
        "camera": {
            "type": "orthographic", "to_world": camera @ transform.scale([half, half, 1]),
            "film": {"type": "hdrfilm", "width": pixels, "height": pixels, "rfilter": {"type": "box"},
                     "component_format": "float32"},
            "sampler": {"type": "stratified", "sample_count": 16},
        },
        "light": {"type": "directional", "direction": list(-vector(light)),
                  "irradiance": {"type": "rgb", "value": [math.pi] * 3}},
        "plane": {"type": "rectangle", "to_world": transform.scale([repeat / 2, repeat / 2, 1]), "bsdf": bsdf},
    })


def test_without_mitsuba():
    program = """
import sys
sys.modules["mitsuba"] = None
import btfield
try:
    import btfield.mitsuba
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "pip install mitsuba" in done.stdout
    program = "import sys, btfield; assert 'mitsuba' not in sys.modules and 'drjit' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_weights_make_the_library_s_pictures(device, model):
    grown = btfield.BtfSynthesiser(device, model, TILE, 3)
    views, lights = ([radians(each) for each in directions] for directions in (VIEWS, LIGHTS))
    means, offsets, weights = btfield.btf_weights(model, grown, views, lights)
    assert means.shape == offsets.shape == (5, 3) and weights.shape == (5, 3, 4)
    planes = grown.surface[..., 1:]
    # From above the relief moves nothing. Contrasts are those of all views on a lattice, not of this picture.
    light = means[0] * np.maximum(offsets[0] + planes @ weights[0].T, 0) ** 2
    assert np.abs(light - grown.picture(views[0], lights[0])).mean() < 0.01 * light.mean()
    # A pair that was measured has its own mean.
    means = btfield.btf_weights(model, grown, [model.views[4]], [model.lights[7]])[0]
    assert np.allclose(means[0], grown.picture(model.views[4], model.lights[7]).mean((0, 1)), rtol=1e-3)
    for views, lights in (([(2.0, 0.0)], [(0.1, 0.0)]), ([(0.1, 0.0)], []), ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3])):
        with pytest.raises(btfield.InputError):
            btfield.btf_weights(model, grown, views, lights)


def test_table_has_the_library_s_weights(device, model, material):
    """At points of the fine square that the coarse one has, weights are the library's."""
    grown = btfield.BtfSynthesiser(device, model, surface=material.surface)
    table = material.table
    assert table.rows.shape == (21**2, 21**2, 3 + 3 + 12)
    views, lights = table.views.directions(), table.lights.directions()
    # Every second ring of 10 is one of 5 of the coarse views; of lights, every fifth of 10 is a third of 6.
    middle, edge = 10 * 21 + 10, 10 * 21 + 20
    for view in (middle, 10 * 21 + 14, edge):
        for light in (middle, 10 * 21 + 15, edge):
            mean, offset, weights = btfield.btf_weights(model, grown, [views[view]], [lights[light]])
            row = table.rows[view, light]
            lit = mean[0] / math.cos(lights[light, 0]) / model.white
            assert np.allclose(np.exp(row[:3]), lit, rtol=1e-3)
            assert np.allclose(row[3:], np.concatenate([offset[0], weights[0].ravel()]), atol=1e-3)


def test_plane_is_that_of_render(device, model, material, llvm):
    renderer = btfield.BtfRenderer(device, model, TILE, 3)
    bsdf = material.bsdf(repeat_u=25)
    errors = []
    for view, light in zip(VIEWS, LIGHTS, strict=True):
        # Four pixels for a texel: what lies between pixels is the same then, however a pixel is sampled.
        shown = np.array(mi.render(plane_scene(bsdf, view, light, 25, 4, 96)))[..., :3]
        wanted = renderer.picture(radians(view), radians(light), shape="plane", size=96, scale=4)
        errors.append(np.abs(shown - wanted).mean() / wanted.mean())
    # What linear interpolation between directions leaves; more where light and view are both low.
    assert max(errors) < 0.02
    assert np.mean(errors) < 0.01


def test_variants_agree(material):
    rng = np.random.default_rng(1)
    n = 60
    view, light = rng.normal(size=(2, n, 3))
    view[:, 2], light[:, 2] = np.abs(view[:, 2]), np.abs(light[:, 2])
    view[:5, 2] *= -1
    light[3:8, 2] *= -1
    view, light = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (view, light))
    uv = rng.uniform(-1, 2, (n, 2))
    bsdf = material.bsdf(repeat_u=3, repeat_v=2)
    one = np.array([value(bsdf, *each) for each in zip(view, light, uv, strict=True)])
    mi.set_variant("llvm_ad_rgb")
    bsdf = material.bsdf(repeat_u=3, repeat_v=2)
    si = interaction(mi.Vector3f(view.T.astype(np.float32)), mi.Point2f(uv.T.astype(np.float32)), n)
    other = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(light.T.astype(np.float32)))).T
    mi.set_variant("scalar_rgb")
    # Rounding moves a place by 1e-5 of a texel.
    assert np.allclose(one, other, rtol=1e-3, atol=1e-5)
    assert (one[:8] == 0).all() and (other[:8] == 0).all()
    assert (one >= 0).all() and (one[8:].max(axis=1) > 0).all()


@pytest.mark.parametrize("view", [(0, 0), (50, 30), (85, 200)])
def test_density_is_that_of_samples(material, llvm, view):
    bsdf = material.bsdf()
    wi = mi.ScalarVector3f(*map(float, vector(view)))

    def sample(numbers):
        bs, weight = bsdf.sample(mi.BSDFContext(), interaction(wi, n=dr.width(numbers)), numbers[0],
                                 mi.Point2f(numbers[1], numbers[2]))
        return bs.wo, dr.select(dr.any(weight > 0), 1.0, 0.0)

    def density(wo):
        return bsdf.pdf(mi.BSDFContext(), interaction(wi, n=dr.width(wo)), wo)

    test = ChiSquareTest(SphericalDomain(), sample, density, sample_dim=3, sample_count=200_000)
    assert test.run(test_count=3, quiet=True), test.messages


def test_samples_weigh_what_eval_says(material, llvm):
    bsdf = material.bsdf()
    rng = np.random.default_rng(5)
    n = 1000
    numbers = mi.Point2f(rng.uniform(size=(2, n)).astype(np.float32))
    for view in VIEWS:
        si = interaction(mi.Vector3f(*map(float, vector(view))), n=n)
        bs, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(0.5), numbers)
        both, density = bsdf.eval_pdf(mi.BSDFContext(), si, bs.wo)
        assert np.allclose(np.array(bs.pdf), np.array(density), rtol=1e-5)
        assert np.allclose(np.array(weight) * np.array(density), np.array(both), rtol=1e-4, atol=1e-7)
        assert np.array_equal(np.array(both), np.array(bsdf.eval(mi.BSDFContext(), si, bs.wo)))
    behind = interaction(mi.Vector3f(0, 0, -1), n=n)
    bs, weight = bsdf.sample(mi.BSDFContext(), behind, mi.Float(0.5), numbers)
    assert dr.all(bs.pdf == 0) and dr.all(weight == 0, axis=None)


def test_paths_from_lights_see_the_same(material):
    bsdf = material.bsdf()
    view, light = vector((50, 40)), vector((20, 250))
    to_eye = value(bsdf, view, light) / light[2]
    to_light = value(bsdf, light, view, mode=mi.TransportMode.Importance) / view[2]
    assert np.allclose(to_eye, to_light, rtol=1e-5) and to_eye.min() > 0


def test_mirrored_coordinates_mirror_the_material(material):
    bsdf = material.bsdf()
    view, light = vector((50, 40)), vector((20, 250))
    mirror = np.array([1, -1, 1])
    plain = value(bsdf, view, light)
    assert np.allclose(value(bsdf, view * mirror, light * mirror, dp_dv=(0, -1, 0)), plain, rtol=1e-5)
    assert not np.allclose(value(bsdf, view * mirror, light * mirror), plain, rtol=1e-3)


def test_views_lower_than_measured_are_those_of_the_ring(material):
    bsdf = material.bsdf()
    light = (30, 10)
    ring, low = (value(bsdf, vector((theta, 77)), vector(light)) for theta in (75.001, 88))
    assert np.allclose(ring, low, rtol=1e-4)
    # Beyond the outermost ring light falls with its cosine.
    ring, low = (value(bsdf, vector((30, 10)), vector((theta, 77))) for theta in (75.001, 88))
    assert np.allclose(ring / math.cos(math.radians(75)), low / math.cos(math.radians(88)), rtol=1e-3)


def test_scenes_name_files(material, model, tmp_path, llvm):
    file = tmp_path / "cork.btfm"
    btfield.write_model(file, model)
    scene = mi.load_string(f"""<scene version="3.0.0"><shape type="sphere"><bsdf type="twosided"><bsdf type="btf">
        <string name="filename" value="{file}"/><integer name="tile" value="{TILE}"/><integer name="seed" value="3"/>
        <float name="repeat_u" value="4"/><float name="repeat_v" value="2"/><integer name="directions" value="7"/>
        </bsdf></bsdf></shape></scene>""")
    bsdf = scene.shapes()[0].bsdf()
    assert "repeat_v = 2" in str(bsdf)
    above = bsdf.eval(mi.BSDFContext(), interaction(mi.Vector3f(0, 0, 1)), mi.Vector3f(0, 0.6, 0.8))
    below = bsdf.eval(mi.BSDFContext(), interaction(mi.Vector3f(0, 0, -1)), mi.Vector3f(0, 0.6, -0.8))
    assert np.array_equal(np.array(above), np.array(below)) and np.array(above).min() > 0
    with pytest.raises(RuntimeError, match="no-such.btfm"):
        mi.load_dict({"type": "btf", "filename": str(tmp_path / "no-such.btfm")})


def test_what_cannot_be(device, model, material, cork):
    with pytest.raises(btfield.InputError, match="odd number"):
        btfield.mitsuba.Material(model, device=device, directions=4)
    with pytest.raises(btfield.InputError, match="joint"):
        btfield.mitsuba.Material(btfield.fit(device, cork[:32, :32], model="2d-car", order=1), device=device)
    with pytest.raises(btfield.InputError, match="factors"):
        btfield.mitsuba.Material(model, device=device, tile=34)
    mi.set_variant("scalar_spectral")
    try:
        with pytest.raises(btfield.InputError, match="scalar_spectral.*scalar_rgb"):
            material.bsdf()
    finally:
        mi.set_variant("scalar_rgb")


def test_grey_is_grey(device, material):
    grey = material.__class__.__new__(material.__class__)
    grey.__dict__.update(material.__dict__)
    rows = material.table.rows
    # The middle colour alone.
    keep = np.concatenate([[1, 4], np.arange(10, 14)])
    table = material.table
    grey.table = type(table)(table.views, table.lights, np.ascontiguousarray(rows[..., keep]))
    grey.colours = 1
    got, whole = (value(each.bsdf(), vector((30, 20)), vector((40, 200))) for each in (grey, material))
    assert np.allclose(got, whole[1], rtol=1e-6)
