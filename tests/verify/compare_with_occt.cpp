// SPDX-License-Identifier: GPL-3.0-or-later
// compare_with_occt FILE INSPECTION.json: the same file through OpenCASCADE's reader and through ours.
//   faces, loops per face: equal; area per face: within 1e-6; largest |C3(t) - S(c(t))| over all edges: not above the
//   resolution that the file states (IGES global field 19).
// Prints one line per face; exit 1 with every difference on stderr.
#include <BRepGProp.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom_Curve.hxx>
#include <Geom_Surface.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

namespace {

constexpr double area_tolerance = 1e-6;   // relative
constexpr double metres_per_unit = 1e-3;  // OpenCASCADE converts every file to millimetres

struct Face {
  int loops = 0;
  double area = 0;       // m2
  double deviation = 0;  // m
};

Face measure(const TopoDS_Face& face) {
  Face out;
  for (TopExp_Explorer wire(face, TopAbs_WIRE); wire.More(); wire.Next()) ++out.loops;
  GProp_GProps properties;
  BRepGProp::SurfaceProperties(face, properties, 1e-9);
  out.area = std::abs(properties.Mass()) * metres_per_unit * metres_per_unit;
  TopLoc_Location location;
  const Handle(Geom_Surface) surface = BRep_Tool::Surface(face);
  for (TopExp_Explorer explorer(face, TopAbs_EDGE); explorer.More(); explorer.Next()) {
    const TopoDS_Edge edge = TopoDS::Edge(explorer.Current());
    if (BRep_Tool::Degenerated(edge)) continue;
    double first = 0, last = 0, first2 = 0, last2 = 0;
    const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, first, last);
    const Handle(Geom2d_Curve) parameter = BRep_Tool::CurveOnSurface(edge, face, first2, last2);
    if (curve.IsNull() || parameter.IsNull()) {
      out.deviation = INFINITY;
      continue;
    }
    constexpr int samples = 200;
    for (int k = 0; k <= samples; ++k) {
      const double s = double(k) / samples;
      const gp_Pnt2d uv = parameter->Value(first2 + s * (last2 - first2));
      const double distance = curve->Value(first + s * (last - first)).Distance(surface->Value(uv.X(), uv.Y()));
      out.deviation = std::max(out.deviation, distance * metres_per_unit);
    }
  }
  return out;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::fprintf(stderr, "usage: compare_with_occt FILE INSPECTION.json\n");
    return 2;
  }
  Message::DefaultMessenger()->ChangePrinters().Clear();
  IGESControl_Reader reader;
  if (reader.ReadFile(arguments[1]) != IFSelect_RetDone) {
    std::fprintf(stderr, "%s: OpenCASCADE can't read it\n", arguments[1]);
    return 1;
  }
  const IGESData_GlobalSection& global = reader.IGESModel()->GlobalSection();
  // OpenCASCADE reads the model space scale (field 13) and doesn't apply it.
  const double scale = global.Scale() > 0 ? global.Scale() : 1;
  // Where the file states no resolution, a nanometre.
  const double stated = global.Resolution() * global.UnitValue() * metres_per_unit / scale;
  const double resolution = stated > 0 ? stated : 1e-9;
  reader.TransferRoots();
  std::vector<Face> faces;
  for (int k = 1; k <= reader.NbShapes(); ++k) {
    for (TopExp_Explorer explorer(reader.Shape(k), TopAbs_FACE); explorer.More(); explorer.Next()) {
      faces.push_back(measure(TopoDS::Face(explorer.Current())));
    }
  }

  nlohmann::json ours;
  try {
    ours = nlohmann::json::parse(std::ifstream(arguments[2]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", arguments[2], error.what());
    return 1;
  }
  const auto& panels = ours.at("panels");
  int differences = 0;
  const auto differs = [&](const std::string& what) {
    std::fprintf(stderr, "%s: MISMATCH: %s\n", arguments[1], what.c_str());
    ++differences;
  };
  if (faces.empty()) differs("OpenCASCADE finds no face");
  if (faces.size() != panels.size()) {
    differs(std::to_string(faces.size()) + " faces for OpenCASCADE, " + std::to_string(panels.size()) + " for us");
  }
  for (std::size_t k = 0; k < std::min(faces.size(), panels.size()); ++k) {
    Face theirs = faces[k];
    theirs.area /= scale * scale;
    theirs.deviation /= scale;
    const std::string name = panels[k].at("name");
    const int loops = static_cast<int>(panels[k].at("loops").size());
    const double area = panels[k].at("area");
    const double relative = std::abs(theirs.area - area) / area;
    std::printf("  %-24s loops %d %d, area %.9g %.9g m2 (%.1e), curve on surface %.1e m (allowed %.1e)\n", name.c_str(),
                theirs.loops, loops, theirs.area, area, relative, theirs.deviation, resolution);
    if (theirs.loops != loops)
      differs(name + ": " + std::to_string(theirs.loops) + " loops, ours " + std::to_string(loops));
    if (!(relative <= area_tolerance)) differs(name + ": areas differ by " + std::to_string(relative));
    if (!(theirs.deviation <= resolution)) {
      differs(name + ": a trim leaves the surface by " + std::to_string(theirs.deviation) + " m");
    }
  }
  return differences == 0 ? 0 : 1;
}
