# SPDX-License-Identifier: GPL-3.0-or-later
"""freecad.py FILE.igs INSPECTION.json NET.csv NAME: FreeCAD imports the file without a window.

One object called NAME with every face of ours: areas within 2e-5 (as FreeCAD integrates), boxes within those of the nets. Flat panels of a
drape stand beside it."""
import csv
import json
import sys

sys.path.append("/usr/lib/freecad-python3/lib")
import FreeCAD  # noqa: E402
import Import  # noqa: E402
import Part  # noqa: E402

path, inspection, net, name = sys.argv[1:5]
panels = json.load(open(inspection))["panels"]
wrong = []


def expect(what, good, seen):
    if not good:
        wrong.append(f"{what}: {seen}")


def same_areas(what, faces):
    # FreeCAD works in millimetres.
    ours = sorted(p["area"] for p in panels)
    theirs = sorted(f.Area * 1e-6 for f in faces)
    expect(f"{what}: faces", len(ours) == len(theirs), f"{len(theirs)} of {len(ours)}")
    for a, b in zip(ours, theirs):
        expect(f"{what}: area", abs(a - b) <= 2e-5 * a, f"{b} m2, ours {a}")


def box_of(points):
    return [min(p[c] for p in points) for c in range(3)] + [max(p[c] for p in points) for c in range(3)]


def boxes(what, faces):
    """Each face lies in the box of one panel's net; with a drape, flat faces are moved aside, clear of the draped."""
    nets = {}
    for row in csv.DictReader(open(net)):
        nets.setdefault(row["panel"], []).append([1000 * float(row[c]) for c in "xyz"])
    ours = {panel: box_of(points) for panel, points in nets.items()}
    theirs = [[b.XMin, b.YMin, b.ZMin, b.XMax, b.YMax, b.ZMax] for b in (f.BoundBox for f in faces)]
    slack = 1e-3  # mm

    def within(box, outer):
        return all(outer[c] - slack <= box[c] and box[c + 3] <= outer[c + 3] + slack for c in range(3))

    drape = any(panel.endswith(" draped") for panel in ours)
    if drape:
        still = [b for b in theirs if any(within(b, o) for p, o in ours.items() if p.endswith(" draped"))]
        expect(f"{what}: faces of the drape", len(still) == len(ours) // 2, len(still))
        moved = [b for b in theirs if b not in still]
        right, left = max(b[3] for b in moved), min(b[0] for b in still)
        expect(f"{what}: the flat panels beside the drape", right < left, (right, left))
    for panel, outer in ours.items():
        if not panel.endswith(" flat"):
            expect(f"{what}: box of {panel}", any(within(b, outer) for b in theirs), outer)


shape = Part.Shape()
shape.read(path)
same_areas("Part", shape.Faces)
boxes("Part", shape.Faces)

# The importer of documents, which fell over files with several free shapes.
Import.open(path)
objects = [o for d in FreeCAD.listDocuments().values() for o in d.Objects if o.isDerivedFrom("Part::Feature")]
same_areas("Import", [f for o in objects for f in o.Shape.Faces])
boxes("Import", [f for o in objects for f in o.Shape.Faces])
labels = [o.Label for o in objects]
expect("objects", labels == [name], labels)
for problem in wrong:
    print("WRONG", problem)
if not wrong:
    print(f"\nall right: {len(shape.Faces)} faces, one object called {name}")
sys.stdout.flush()
# The interpreter's own end is not what is looked at here.
import os  # noqa: E402

os._exit(1 if wrong else 0)
