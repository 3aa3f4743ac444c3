// SPDX-License-Identifier: GPL-3.0-or-later
// occt_areas [--fine] FILE: the area of every face that OpenCASCADE reads from an IGES file, one a line [m2]; --fine
// takes ten digits instead of four, and its time.
#include <BRepGProp.hxx>
#include <GProp_GProps.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <ShapeUpgrade_ShapeDivideArea.hxx>
#include <ShapeUpgrade_ShapeDivideContinuity.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace {

double plain_area(const TopoDS_Shape& shape) {
  double sum = 0;
  for (TopExp_Explorer face(shape, TopAbs_FACE); face.More(); face.Next()) {
    GProp_GProps properties;
    BRepGProp::SurfaceProperties(face.Current(), properties);
    sum += std::abs(properties.Mass());
  }
  return sum;
}

// OpenCASCADE's quadrature takes a fixed rule for each face, and is off by up to a hundredth on a spline whose knots it
// doesn't know, whatever tolerance it is given. Faces cut at their knots, then into some sixteen parts, give ten
// digits.
double fine_area(const TopoDS_Shape& face) {
  const double whole = plain_area(face);
  double sum = 0;
  try {
    ShapeUpgrade_ShapeDivideContinuity smooth(face);
    smooth.SetSurfaceCriterion(GeomAbs_CN);
    smooth.SetBoundaryCriterion(GeomAbs_CN);
    smooth.SetPCurveCriterion(GeomAbs_CN);
    smooth.Perform();
    const TopoDS_Shape parts = smooth.Result().IsNull() ? face : smooth.Result();
    for (TopExp_Explorer part(parts, TopAbs_FACE); part.More(); part.Next()) {
      ShapeUpgrade_ShapeDivideArea fine(part.Current());
      fine.MaxArea() = plain_area(part.Current()) / 16;
      fine.Perform();
      sum += plain_area(fine.Result().IsNull() ? part.Current() : fine.Result());
    }
  } catch (const Standard_Failure&) {
    return whole;
  }
  return std::abs(sum - whole) <= 0.05 * whole ? sum : whole;  // cutting fails on some faces
}

}  // namespace

int main(int count, char** arguments) {
  const bool fine = count == 3 && std::strcmp(arguments[1], "--fine") == 0;
  if (count != 2 && !fine) {
    std::fprintf(stderr, "usage: occt_areas [--fine] FILE\n");
    return 2;
  }
  Message::DefaultMessenger()->ChangePrinters().Clear();
  IGESControl_Reader reader;
  if (reader.ReadFile(arguments[count - 1]) != IFSelect_RetDone) return 1;
  // OpenCASCADE converts to millimetres, and doesn't apply the model space scale (field 13).
  const double scale = reader.IGESModel()->GlobalSection().Scale();
  const double metres = 1e-3 / (scale > 0 ? scale : 1);
  reader.TransferRoots();
  for (int k = 1; k <= reader.NbShapes(); ++k)
    for (TopExp_Explorer face(reader.Shape(k), TopAbs_FACE); face.More(); face.Next())
      std::printf("%.12g\n", (fine ? fine_area(face.Current()) : plain_area(face.Current())) * metres * metres);
  return 0;
}
