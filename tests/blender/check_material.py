# Run in Blender after a program of `btfield synth --export blender`: is what it built what material.json says?
#     blender -b --factory-startup --python-exit-code 1 -P out/s.py -P check_material.py
import json
import os
import tempfile

import bpy
import numpy

material = next(m for m in bpy.data.materials if m.users and m.use_nodes and m.node_tree.nodes.get("colour"))
nodes = material.node_tree.nodes
plane = bpy.data.objects[material.name]
folder = os.path.dirname(bpy.path.abspath(nodes["colour"].image.filepath))
side = json.load(open(os.path.join(folder, "material.json")))
pixel = side.get("pixel_size_mm", 1000.0 / side["size"][0]) / 1000.0
maps = {each["role"]: each for each in side["maps"]}


def expect(what, found, wanted, most=0.0):
    same = abs(found - wanted) <= most if most else found == wanted
    print("%s %s: %s" % ("      " if same else "WRONG:", what, found))
    if not same:
        raise SystemExit("%s is %s, not %s" % (what, found, wanted))


def source(socket):
    expect(socket.name + " is linked", len(socket.links), 1)
    return socket.links[0].from_node


output = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
surface = source(output.inputs["Surface"])
expect("surface", surface.type, "BSDF_PRINCIPLED")
lift = source(output.inputs["Displacement"])
expect("displacement", lift.type, "DISPLACEMENT")
expect("midlevel", lift.inputs["Midlevel"].default_value, 0.5, 1e-7)
expect("scale", lift.inputs["Scale"].default_value, maps["height"]["scale"] * pixel, 1e-6 * maps["height"]["scale"] * pixel)
expect("space", lift.space, "OBJECT")
expect("method", material.cycles.displacement_method, "BOTH")
bend = source(surface.inputs["Normal"])
expect("bend", bend.type, "NORMAL_MAP")
expect("bend's space", bend.space, "TANGENT")
turned = source(bend.inputs["Color"])
expect("green is turned", turned.type == "CURVE_RGB", maps["normal"]["convention"] == "directx")
pictures = {"colour": source(surface.inputs["Base Color"]), "height": source(lift.inputs["Height"]),
            "normal": source(turned.inputs["Color"]) if turned.type == "CURVE_RGB" else turned}
for role, socket in (("roughness", "Roughness"), ("metalness", "Metallic"), ("opacity", "Alpha")):
    if role in maps:
        pictures[role] = source(surface.inputs[socket])
for role, node in pictures.items():
    expect(role, node.type, "TEX_IMAGE")
    expect(role + " file", os.path.basename(bpy.path.abspath(node.image.filepath)), maps[role]["file"])
    expect(role + " size", list(node.image.size), side["size"])
    expect(role + " colours", node.image.colorspace_settings.name, "sRGB" if role == "colour" else "Non-Color")
    expect(role + " goes on", node.extension, "REPEAT" if side["tileable"] else "EXTEND")
    expect(role + " is mapped", source(node.inputs["Vector"]).type, "MAPPING")
expect("width", plane.dimensions.x, side["size"][0] * pixel, 1e-6 * side["size"][0] * pixel)
expect("height", plane.dimensions.y, side["size"][1] * pixel, 1e-6 * side["size"][1] * pixel)
expect("scaled", tuple(plane.scale), (1.0, 1.0, 1.0))

# Distances from a camera right above, as the renderer sees the displaced plane.
columns, rows = side["size"]
fine = 16  # of the depth's pixels along a pixel of the map
scene = bpy.data.scenes.new("depth")
scene.render.engine = "CYCLES"
scene.cycles.samples = 1
scene.cycles.use_denoising = False
scene.render.resolution_x, scene.render.resolution_y = fine * columns, fine * rows
scene.view_layers[0].use_pass_z = True
scene.view_layers[0].pass_alpha_threshold = 0.0
camera = bpy.data.objects.new("above", bpy.data.cameras.new("above"))
camera.data.type = "ORTHO"
camera.data.ortho_scale = max(side["size"]) * pixel
far = 10.0 * camera.data.ortho_scale
camera.location = (0.0, 0.0, far)
camera.data.clip_end = 2.0 * far
for thing in (plane, camera):
    scene.collection.objects.link(thing)
scene.camera = camera
scene.use_nodes = True
scene.node_tree.nodes.clear()
layers = scene.node_tree.nodes.new("CompositorNodeRLayers")
layers.scene = scene
files = scene.node_tree.nodes.new("CompositorNodeOutputFile")
files.format.file_format = "OPEN_EXR"
files.format.color_depth = "32"
files.base_path = tempfile.mkdtemp()
scene.node_tree.links.new(layers.outputs["Depth"], files.inputs[0])
bpy.ops.render.render(scene=scene.name)
made = os.path.join(files.base_path, os.listdir(files.base_path)[0])
depth = numpy.array(bpy.data.images.load(made).pixels[:], dtype=numpy.float32).reshape(fine * rows, fine * columns, 4)[:, :, 0]
os.remove(made)
os.rmdir(files.base_path)
lifted = far - depth
values = numpy.array(pictures["height"].image.pixels[:]).reshape(rows, columns, 4)[:, :, 0]
heights = (values - 32768.0 / 65535.0) * maps["height"]["scale"] * pixel
# Corners of faces lie between four pixels of the map, and have their mean.
wanted = (heights[:-1, :-1] + heights[1:, :-1] + heights[:-1, 1:] + heights[1:, 1:]) / 4
seen = sum(lifted[fine - 1 + r:fine * (rows - 1) + 1:fine, fine - 1 + c:fine * (columns - 1) + 1:fine] for r in (0, 1) for c in (0, 1)) / 4
reach = float(wanted.max() - wanted.min())
expect("range, parts of the true one", float(seen.max() - seen.min()) / reach, 1.0, 0.03)
expect("highest, parts of the range", float(seen.max()) / reach, float(wanted.max()) / reach, 0.02)
expect("mean difference, parts of the range", float(abs(seen - wanted).mean()) / reach, 0.0, 0.01)
print("ALL RIGHT")
