# SPDX-License-Identifier: GPL-3.0-or-later
"""blender_meshes.py -- WORK STEM: Blender imports WORK/STEM.glb and .obj.

Objects by the panels' names, areas those of the file, upright, texture coordinates in the unit square and the flat and
the draped mesh of a panel as shape keys of each other. Renders WORK/blender.png."""
import json
import math
import os
import sys

import bpy
import numpy
from mathutils import Vector

# Debian's importer of glTF asks for a name that Debian's numpy has dropped.
if not hasattr(numpy, "bool"):
    numpy.bool = bool

work, stem = sys.argv[sys.argv.index("--") + 1:][:2]
panels = {p["name"]: p for p in json.load(open(os.path.join(work, stem + ".json")))["panels"]}
nets = {}
for line in open(os.path.join(work, stem + ".csv")).read().splitlines()[1:]:
    name, _, _, *x = line.split(",")[:6]
    nets.setdefault(name, []).append(tuple(map(float, x)))
wrong = []


def expect(what, good, seen):
    if not good:
        wrong.append(f"{what}: {seen}")


def imported(load):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    load()
    return {o.name: o for o in bpy.data.objects if o.type == "MESH"}


def area(mesh):
    return sum(p.area for p in mesh.polygons)


def box(points):
    return [min(p[c] for p in points) for c in range(3)] + [max(p[c] for p in points) for c in range(3)]


def check(what, objects, name_of, places):
    expect(f"{what}: names", set(objects) == {name_of(n) for n in panels}, sorted(objects))
    for name, panel in panels.items():
        o = objects.get(name_of(name))
        if o is None:
            continue
        a = area(o.data)
        expect(f"{what}: area of {name}", abs(a - panel["area"]) < 5e-3 * panel["area"], (a, panel["area"]))
        seen, net = box(places(o)), box(nets[name])
        inside = all(net[c] - 1e-6 <= seen[c] and seen[c + 3] <= net[c + 3] + 1e-6 for c in range(3))
        expect(f"{what}: box of {name}", inside, (seen, net))
        uv = [t.uv for t in o.data.uv_layers[0].data]
        expect(f"{what}: texture of {name}", all(-1e-6 <= t[c] <= 1 + 1e-6 for t in uv for c in (0, 1)), box([(*t, 0) for t in uv]))
        # What is square on the texture is square on the cloth; v runs upwards in Blender.
        if name.endswith("flat"):
            mesh = o.data
            polygon = max(mesh.polygons, key=lambda p: p.area)
            loops = list(polygon.loop_indices)
            t = [mesh.uv_layers[0].data[k].uv for k in loops]
            x = [mesh.vertices[mesh.loops[k].vertex_index].co for k in loops]
            turn = (t[1] - t[0]).cross(t[2] - t[0])
            ratios = [(t[k] - t[0]).length / (x[k] - x[0]).length for k in (1, 2)]
            expect(f"{what}: texture's sense", turn > 0, turn)
            expect(f"{what}: texture's shape", abs(ratios[0] / ratios[1] - 1) < 1e-3, ratios)


# glTF is Y up and Blender Z up: its importer turns what stands upright in the file upright here, which brings the
# scene's own axes back.
glb = imported(lambda: bpy.ops.import_scene.gltf(filepath=os.path.join(work, stem + ".glb")))
check("glb", glb, lambda n: n, lambda o: [o.matrix_world @ v.co for v in o.data.vertices])

flat = [n for n in panels if n.endswith(" flat")]
for name in flat:
    a, b = glb[name].data, glb[name[:-5] + " draped"].data
    expect(f"vertices of {name} and its drape", len(a.vertices) == len(b.vertices), (len(a.vertices), len(b.vertices)))
    expect(f"triangles of {name} and its drape",
           all(list(p.vertices) == list(q.vertices) for p, q in zip(a.polygons, b.polygons)), "differ")
    same = all((s.uv - t.uv).length < 1e-6 for s, t in zip(a.uv_layers[0].data, b.uv_layers[0].data))
    expect(f"texture of {name} and its drape", same, "differ")

# A picture of the drape as it stands.
for name in flat:
    glb[name].hide_render = True
points = [o.matrix_world @ v.co for n, o in glb.items() if n not in flat for v in o.data.vertices]
low, high = Vector(box(points)[:3]), Vector(box(points)[3:])
middle, size = (low + high) / 2, (high - low).length
scene = bpy.context.scene
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = middle + Vector((0.5, -1.6, 0.35)) * size
camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN"))
lamp.rotation_euler = (math.radians(50), 0, math.radians(-30))
for o in (camera, lamp):
    scene.collection.objects.link(o)
scene.camera = camera
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 16, False
scene.render.resolution_x, scene.render.resolution_y = 480, 400
scene.render.filepath = os.path.join(work, "blender.png")
bpy.ops.render.render(write_still=True)

# OBJ keeps the scene's axes: imported with Z up.
obj = imported(lambda: bpy.ops.wm.obj_import(filepath=os.path.join(work, stem + ".obj"), forward_axis="Y", up_axis="Z"))
check("obj", obj, lambda n: n.replace(" ", "_"), lambda o: [o.matrix_world @ v.co for v in o.data.vertices])
expect("material of the obj", {m.name for m in bpy.data.materials} == {"cloth"}, [m.name for m in bpy.data.materials])
smooth = all(p.use_smooth for o in obj.values() for p in o.data.polygons)
expect("smooth normals of the obj", smooth, "flat shaded")

for problem in wrong:
    print("WRONG", problem)
if not wrong:
    print(f"\nall right: {len(glb)} objects, upright, textures in the unit square")
sys.exit(1 if wrong else 0)
