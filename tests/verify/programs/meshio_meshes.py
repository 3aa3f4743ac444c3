# SPDX-License-Identifier: GPL-3.0-or-later
"""meshio_meshes.py WORK STEM: meshio reads WORK/STEM.ply, .stl, .obj and .vtu; all hold the same triangles."""
import json
import os
import sys

import meshio
import numpy as np

work, stem = sys.argv[1:3]
area = sum(p["area"] for p in json.load(open(os.path.join(work, stem + ".json")))["panels"])
wrong = []


def expect(what, good, seen):
    if not good:
        wrong.append(f"{what}: {seen}")


counts, boxes = {}, {}
for ending in ("ply", "stl", "obj", "vtu"):
    mesh = meshio.read(os.path.join(work, f"{stem}.{ending}"))
    triangles = np.vstack([block.data for block in mesh.cells if block.type == "triangle"])
    expect(f"{ending}: cells", {block.type for block in mesh.cells} == {"triangle"}, [b.type for b in mesh.cells])
    p = mesh.points[triangles]
    sum_of_areas = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum()
    expect(f"{ending}: area", abs(sum_of_areas - area) < 5e-3 * area, (sum_of_areas, area))
    counts[ending] = len(triangles)
    boxes[ending] = np.concatenate([mesh.points[triangles].min(axis=(0, 1)), mesh.points[triangles].max(axis=(0, 1))])
    if ending == "ply":
        names = set(mesh.point_data)
        expect("ply: vertex data", names == {"s", "t", "panel"}, names)
        for name in ("s", "t"):
            values = np.asarray(mesh.point_data[name])
            expect(f"ply: {name}", 0 <= values.min() and values.max() <= 1, (values.min(), values.max()))
expect("counts", len(set(counts.values())) == 1, counts)
for ending, box in boxes.items():
    expect(f"{ending}: box", np.allclose(box, boxes["ply"], atol=1e-6), (box, boxes["ply"]))

for problem in wrong:
    print("WRONG", problem)
if not wrong:
    print(f"\nall right: {counts['ply']} triangles in PLY, STL, OBJ and VTU")
sys.exit(1 if wrong else 0)
