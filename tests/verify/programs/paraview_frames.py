# SPDX-License-Identifier: GPL-3.0-or-later
"""paraview_frames.py FRAMES NAME WORK: ParaView opens the two indices of a run.

NAME.pvd shows triangles alone, coloured by strain as it opens; NAME_parts.pvd has five blocks, Bezier cells among them.
The triangles are those of the OBJ of the same frame."""
import csv
import glob
import os
import sys

from paraview import servermanager
from paraview.simple import (GetActiveViewOrCreate, OpenDataFile, Render, ResetCamera, SaveScreenshot, Show,
                             UpdatePipeline)

frames, name, work = sys.argv[1:4]
wrong = []


def expect(what, good, seen):
    if not good:
        wrong.append(f"{what}: {seen}")


history = list(csv.DictReader(open(os.path.join(frames, "..", "history.csv"))))
times = [float(row["t"]) for row in history]
cloth = OpenDataFile(os.path.join(frames, name + ".pvd"))
expect("times", list(cloth.TimestepValues) == times, list(cloth.TimestepValues))
UpdatePipeline(time=times[-1], proxy=cloth)
data = servermanager.Fetch(cloth)
while data.IsA("vtkMultiBlockDataSet"):
    data = data.GetBlock(0)
types = {data.GetCellType(k) for k in range(data.GetNumberOfCells())}
expect("cell types of the cloth", types == {5}, types)
arrays = {data.GetPointData().GetArrayName(k) for k in range(data.GetPointData().GetNumberOfArrays())}
expect("fields", {"strain", "strain_weft", "strain_warp", "normal", "uv", "velocity"} <= arrays, arrays)
strain = data.GetPointData().GetArray("strain").GetRange()
expect("strain", -0.5 < strain[0] <= strain[1] < 0.5, strain)

view = GetActiveViewOrCreate("RenderView")
view.ViewSize, view.ViewTime = [900, 700], times[-1]
shown = Show(cloth, view)
expect("colour as it opens", shown.ColorArrayName[1] == "strain", list(shown.ColorArrayName))
shown.RescaleTransferFunctionToDataRange(False, True)
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [1, 3, 0.5], [0, 0, 0], [0, 0, 1]
ResetCamera(view)
Render(view)
SaveScreenshot(os.path.join(work, "paraview.png"), view)

# The same triangles as the OBJ of that frame.
obj = sorted(glob.glob(os.path.join(frames, "frame_*.obj")))[-1]
points = [tuple(map(float, line.split()[1:4])) for line in open(obj) if line.startswith("v ")]
expect("points", data.GetNumberOfPoints() == len(points), data.GetNumberOfPoints())
worst = max(max(abs(a - b) for a, b in zip(data.GetPoint(k), p)) for k, p in enumerate(points))
expect("places", worst < 1e-12, worst)

parts = OpenDataFile(os.path.join(frames, name + "_parts.pvd"))
expect("times of the parts", list(parts.TimestepValues) == times, list(parts.TimestepValues))
UpdatePipeline(time=times[-1], proxy=parts)
whole = servermanager.Fetch(parts)
while whole.GetNumberOfBlocks() == 1:
    whole = whole.GetBlock(0)
blocks = {}
for k in range(whole.GetNumberOfBlocks()):
    block = whole.GetBlock(k)
    while block.IsA("vtkMultiBlockDataSet"):
        block = block.GetBlock(0)
    blocks[whole.GetMetaData(k).Get(whole.NAME())] = block
wanted = {"triangles": 5, "surface": 77, "net": 3, "trims": 4, "points": 1}
expect("blocks", set(blocks) == set(wanted), set(blocks))
for part, cell in wanted.items():
    kinds = {blocks[part].GetCellType(k) for k in range(blocks[part].GetNumberOfCells())}
    expect(f"cell types of {part}", kinds == {cell}, kinds)
# The material lies on the surface, which lies within its net.
box = blocks["triangles"].GetBounds()
net = blocks["net"].GetBounds()
inside = all(net[2 * c] - 1e-9 <= box[2 * c] and box[2 * c + 1] <= net[2 * c + 1] + 1e-9 for c in range(3))
expect("the cloth's box within the net's", inside, (box, net))

for problem in wrong:
    print("WRONG", problem)
if not wrong:
    print(f"\nall right: {len(times)} frames, {data.GetNumberOfCells()} triangles, {blocks['surface'].GetNumberOfCells()} "
          "Bezier cells")
sys.stdout.flush()
os._exit(1 if wrong else 0)  # without taking the window down, which Xvfb minds
