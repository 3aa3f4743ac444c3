// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>
#include <span>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges/cards.h"
#include "io/iges/file.h"
#include "io/iges/parameters.h"
#include "io/iges/topology.h"
#include "io/iges_corpus.h"
#include "support/near.h"

namespace toile {
namespace {

using test::message_of;
using test::read_corpus;

TrimmedSurface bent(const TrimmedSurface& panel) {
  Eigen::Matrix3Xd points = panel.surface.points();
  const double size = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i) / size;
    points.col(i) += size * Eigen::Vector3d(0.05 * std::sin(9 * p.y()), 0.04 * std::sin(7 * p.x()),
                                            0.1 * std::sin(8 * p.x() + 3) * std::cos(6 * p.y()));
  }
  TrimmedSurface out = panel;
  out.surface = panel.surface.with_points(points);
  return out;
}

IgesHeader header_of(const PanelFile& file) {
  IgesHeader header;
  header.unit = file.unit;
  return header;
}

// What is written is head to tail in its own order, whatever the source's was.
void expect_same_trims(const TrimmedSurface& back, const TrimmedSurface& source) {
  ASSERT_EQ(back.loops.size(), source.loops.size());
  for (std::size_t l = 0; l < back.loops.size(); ++l) {
    EXPECT_EQ(back.loops[l].kind, source.loops[l].kind);
    EXPECT_EQ(back.loops[l].index, source.loops[l].index);
    ASSERT_EQ(back.loops[l].curves.size(), source.loops[l].curves.size());
    for (std::size_t k = 0; k < back.loops[l].curves.size(); ++k) {
      EXPECT_EQ(back.loops[l].curves[k].index, static_cast<int>(k));
      EXPECT_EQ(back.loops[l].curves[k].curve, source.loops[l].curves[k].curve);
    }
  }
}

TEST(IgesWriting, ReplayGivesTheSameBytes) {
  for (const std::string& name : test::corpus_names())
    EXPECT_EQ(format_iges(read_corpus(name), IgesMode::replay), test::corpus_text(name)) << name;
}

TEST(IgesWriting, BothModesRoundTripTheCorpus) {
  for (const std::string& name : test::corpus_names()) {
    for (IgesMode mode : {IgesMode::replay, IgesMode::rewrite}) {
      const PanelFile file = read_corpus(name);
      const RoundtripReport report = roundtrip(file, mode);
      EXPECT_TRUE(report.exact()) << name << ": " << (report.differences.empty() ? "" : report.differences[0]);
      EXPECT_EQ(report.faces, static_cast<int>(file.panels.size()));
      EXPECT_EQ(report.entities, static_cast<int>(file.ledger.size()));
    }
  }
}

TEST(IgesWriting, RoundTripSeesADifference) {
  PanelFile file = read_corpus("hole_and_composite");
  file.panels[0] = bent(file.panels[0]);
  const RoundtripReport report = roundtrip(file, IgesMode::rewrite);
  EXPECT_FALSE(report.exact());
  EXPECT_FALSE(report.points_equal);
  EXPECT_TRUE(report.knots_equal);
}

TEST(IgesWriting, RewritingMakesRecordsAnew) {
  const std::string text = format_iges(read_corpus("d_exponents_and_defaults"), IgesMode::rewrite);
  EXPECT_EQ(text.find("D+00"), std::string::npos);
  EXPECT_NE(format_iges(read_corpus("denied_outer"), IgesMode::rewrite).find("144,1,1,0,13;"), std::string::npos);
}

TEST(IgesWriting, RewritingStatesOneUnit) {
  for (const std::string& name : test::corpus_names()) {
    SCOPED_TRACE(name);
    const PanelFile source = read_corpus(name);
    const PanelFile back = parse_iges(format_iges(source, IgesMode::rewrite), "back.igs");
    EXPECT_EQ(back.metres_per_unit, source.metres_per_unit);
    EXPECT_FALSE(test::has_warning(back, "unit")) << back.warnings[0];
  }
  // By name only (flag 3), or two that contradict each other: the flag says it all afterwards.
  EXPECT_NE(format_iges(read_corpus("unit_by_name"), IgesMode::rewrite).find(",10,2HCM,"), std::string::npos);
  std::string text = test::corpus_text("unit_by_name");
  text.replace(text.find("1.,3,2Hcm,"), 10, "1.,2,2Hcm,");
  EXPECT_NE(format_iges(parse_iges(text, "two.igs"), IgesMode::rewrite).find(",2,2HMM,"), std::string::npos);
}

TEST(IgesWriting, UnknownRecordsSurviveRewriting) {
  const std::string text = format_iges(read_corpus("unknown_entities"), IgesMode::rewrite);
  EXPECT_NE(text.find("5Ha;b,c;"), std::string::npos);
  EXPECT_EQ(parse_iges(text, "again.igs").entities, read_corpus("unknown_entities").entities);
}

TEST(IgesWriting, ADrapedFaceComesBackBitForBit) {
  for (const std::string& name : test::corpus_names()) {
    SCOPED_TRACE(name);
    const PanelFile source = read_corpus(name);
    if (source.metres_per_unit != 0.001) continue;
    std::vector<OutputFace> faces;
    for (const TrimmedSurface& panel : source.panels) {
      // A curve that alone runs against its loop is turned on writing (ALoneReversedCurveIsTurnedHeadToTail).
      if (std::any_of(panel.loops.begin(), panel.loops.end(), [](const TrimLoop& loop) {
            return std::any_of(loop.curves.begin(), loop.curves.end(), [](const TrimCurve& c) { return c.reversed; });
          }))
        continue;
      faces.push_back({bent(panel), "draped " + panel.name, 2, {{0.8, 0.2, 0.1}}});
    }
    if (faces.empty()) continue;
    const PanelFile back = parse_iges(format_iges(faces, header_of(source)).text, "back.igs");
    EXPECT_TRUE(back.warnings.empty()) << back.warnings[0];
    ASSERT_EQ(back.panels.size(), faces.size());
    for (std::size_t i = 0; i < faces.size(); ++i) {
      EXPECT_EQ(back.panels[i].surface, faces[i].face.surface);
      EXPECT_EQ(back.panels[i].name, faces[i].name);
      EXPECT_EQ(back.panels[i].natural_bounds, faces[i].face.natural_bounds);
      EXPECT_EQ(back.panels[i].metres_per_unit, 0.001);
      expect_same_trims(back.panels[i], faces[i].face);
    }
  }
}

TEST(IgesWriting, ModelCurvesFollowTheDeformedSurface) {
  for (const char* name : {"hole_and_composite", "rational", "polyline_loop", "unclamped"}) {
    SCOPED_TRACE(name);
    const PanelFile source = read_corpus(name);
    const std::vector<OutputFace> faces{{bent(source.panels[0]), "bent", 0, {}}};
    const IgesOutput output = format_iges(faces, header_of(source));
    const TrimmedSurface back = parse_iges(output.text, "back.igs").panels[0];
    const double size = 500;
    EXPECT_LE(output.largest_curve_fit, 5e-8 * size);
    if (back.natural_bounds) continue;
    double largest = 0;
    for (const TrimLoop& loop : back.loops)
      for (const TrimCurve& c : loop.curves) {
        ASSERT_TRUE(c.model);
        EXPECT_EQ(c.model->domain().min, c.curve.domain().min);
        EXPECT_EQ(c.model->domain().max, c.curve.domain().max);
        for (int i = 0; i <= 1000; ++i) {
          const double t = c.curve.domain().min + c.curve.domain().length() * i / 1000;
          const Eigen::Vector2d p = c.curve(t);
          largest = std::max(largest, ((*c.model)(t)-back.surface(p.x(), p.y())).norm());
        }
      }
    EXPECT_LE(largest, 1.1 * output.largest_curve_fit + 1e-12 * size);
    EXPECT_GE(back.resolution, output.largest_curve_fit);
  }
}

TEST(IgesWriting, CurvesFarFromTheOriginAreFittedAsFinelyAsPlacesAre) {
  // 1e9 m away in mm a double is 1e-4 mm fine: a fit that asked for more would halve to the end and write megabytes.
  const PanelFile source = read_corpus("hole_and_composite");
  const TrimmedSurface near = bent(source.panels[0]);
  TrimmedSurface far = near;
  far.surface = near.surface.with_points(near.surface.points().array() + 1e12);
  const auto written = [&](const TrimmedSurface& face) {
    const std::vector<OutputFace> faces{{face, "bent", 0, {}}};
    return format_iges(faces, header_of(source));
  };
  const IgesOutput output = written(far);
  EXPECT_LE(output.largest_curve_fit, 2 * 64 * std::numeric_limits<double>::epsilon() * 1e12);
  EXPECT_LT(output.text.size(), 2 * written(near).text.size());
  EXPECT_EQ(parse_iges(output.text, "far.igs").panels[0].surface, far.surface);
}

TEST(IgesWriting, OnAFlatPanelModelCurvesAreExact) {
  const PanelFile source = read_corpus("polyline_loop");
  const std::vector<OutputFace> faces{{source.panels[0], "flat", 0, {}}};
  const IgesOutput output = format_iges(faces, header_of(source));
  EXPECT_LE(output.largest_curve_fit, 1e-13 * 100);
  const Curve3 model = *parse_iges(output.text, "back.igs").panels[0].loops[0].curves[0].model;
  EXPECT_EQ(model.degree(), 1);
  EXPECT_EQ(model.knots(), source.panels[0].loops[0].curves[0].curve.knots());
}

TEST(IgesWriting, AddressesSurviveALoopTurnedRound) {
  const PanelFile source = read_corpus("hole_and_composite");
  TrimmedSurface turned = source.panels[0];
  for (TrimLoop& loop : turned.loops) {
    std::reverse(loop.curves.begin(), loop.curves.end());
    for (TrimCurve& c : loop.curves) c.reversed = true;
  }
  // Traversal may start anywhere.
  std::rotate(turned.loops[0].curves.begin(), turned.loops[0].curves.begin() + 2, turned.loops[0].curves.end());
  const std::vector<OutputFace> faces{{turned, "turned", 0, {}}};
  const TrimmedSurface back = parse_iges(format_iges(faces, header_of(source)).text, "back.igs").panels[0];
  expect_same_trims(back, source.panels[0]);
}

TEST(IgesWriting, ALoneReversedCurveIsTurnedHeadToTail) {
  const PanelFile source = read_corpus("denied_outer");
  TrimmedSurface panel = source.panels[0];
  TrimCurve& odd = panel.loops[0].curves[2];
  odd.curve = reversed(odd.curve);
  odd.reversed = true;
  const std::vector<OutputFace> faces{{panel, "odd", 0, {}}};
  const TrimmedSurface back = parse_iges(format_iges(faces, header_of(source)).text, "back.igs").panels[0];
  EXPECT_LE(back.loops[0].gap, 1e-15);
}

TEST(IgesWriting, LinesAreEightyColumnsAndCountersRight) {
  const PanelFile source = read_corpus("hole_and_composite");
  const std::vector<OutputFace> faces{{bent(source.panels[0]), std::string(200, 'n') + ",;", 0, {{1, 0, 0}}}};
  const std::string text = format_iges(faces, header_of(source)).text;
  std::map<char, int> counts;
  for (std::size_t at = 0; at < text.size(); at += 81) {
    ASSERT_EQ(text[at + 80], '\n');
    const char section = text[at + 72];
    EXPECT_EQ(std::stoi(text.substr(at + 73, 7)), ++counts[section]);
    if (section == 'D' && counts['D'] % 2 == 1) {
      // Status: independent faces, dependents, parameter curves, definitions.
      const int type = std::stoi(text.substr(at, 8));
      const std::string status = text.substr(at + 64, 8);
      if (type == 144) {
        EXPECT_EQ(status, "00000000");
      } else if (type == 128 || type == 142) {
        EXPECT_EQ(status, "00010000");
      } else if (type == 314) {
        EXPECT_EQ(status, "00000200");
      } else if (type == 126 || type == 102) {
        EXPECT_TRUE(status == "00010000" || status == "00010500");
      }
    }
  }
  const auto file = iges::parse_file(text, "lines.igs");
  EXPECT_TRUE(file->notes.list().empty());
  EXPECT_EQ(file->global.fields.size(), 23u);  // 25 with the two delimiters
  EXPECT_EQ(file->global.fields[20], "11");
  EXPECT_EQ(file->global.scale, 1);
}

TEST(IgesWriting, TheDateComesFromTheHeaderOrTheEnvironment) {
  const PanelFile source = read_corpus("natural_144");
  const std::vector<OutputFace> faces{{source.panels[0], "flat", 0, {}}};
  IgesHeader header = header_of(source);
  const char* old = std::getenv("SOURCE_DATE_EPOCH");
  const std::string kept = old ? old : "";
  ::unsetenv("SOURCE_DATE_EPOCH");
  EXPECT_NE(format_iges(faces, header).text.find("15H19700101.000000"), std::string::npos);
  ::setenv("SOURCE_DATE_EPOCH", "1795334399", 1);
  EXPECT_NE(format_iges(faces, header).text.find("15H20261122.075959"), std::string::npos);
  old ? ::setenv("SOURCE_DATE_EPOCH", kept.c_str(), 1) : ::unsetenv("SOURCE_DATE_EPOCH");
  header.date = "20300102.030405";
  EXPECT_NE(format_iges(faces, header).text.find("15H20300102.030405"), std::string::npos);
}

TEST(IgesWriting, AModelScaleIsSaidAgain) {
  const PanelFile source = read_corpus("inch_and_scale");
  const std::vector<OutputFace> faces{{source.panels[0], "half", 0, {}}};
  const PanelFile back = parse_iges(format_iges(faces, header_of(source)).text, "back.igs");
  expect_near_rel(back.metres_per_unit, source.metres_per_unit, 1e-15);
  EXPECT_EQ(back.panels[0].surface, source.panels[0].surface);
}

TEST(IgesWriting, FacesOfDifferentUnitsAreRefused) {
  const TrimmedSurface mm = read_corpus("natural_144").panels[0], m = read_corpus("two_panels_units_m").panels[0];
  const std::vector<OutputFace> faces{{mm, "a", 0, {}}, {m, "b", 0, {}}};
  EXPECT_FALSE(message_of<GeometryError>([&] { format_iges(faces, IgesHeader{}); }).empty());
}

// Directory numbers that no group names, of entities that stand for shapes.
std::vector<int> free_shapes(const iges::File& file) {
  std::set<int> held;
  for (const iges::Entry& e : file.entries) {
    if (e.type != 402) continue;
    iges::Parameters in(file, e);
    for (const int member : iges::read_group(in)) held.insert(member);
  }
  std::vector<int> out;
  for (const iges::Entry& e : file.entries) {
    const bool shape = e.type == 402 || e.type == 144 || (e.type == 128 && e.subordinate == 0);
    if (shape && held.count(e.sequence) == 0) out.push_back(e.sequence);
  }
  return out;
}

TEST(IgesWriting, AFileHasOneFreeShape) {
  const TrimmedSurface trimmed = read_corpus("hole_and_composite").panels[0],
                       whole = read_corpus("natural_144").panels[0];
  TrimmedSurface marked = trimmed;
  marked.marks.push_back({MarkKind::drill, {0.5, 0.5}, std::nullopt, ""});
  const std::vector<OutputFace> faces{{trimmed, "a flat", 1, {}},
                                      {marked, "a draped", 2, {}},
                                      {whole, "b flat", 1, {}},
                                      {bent(whole), "b draped", 2, {}}};
  IgesHeader header = header_of(read_corpus("hole_and_composite"));
  header.product = "coat";
  const std::string text = format_iges(faces, header).text;
  const auto file = iges::parse_file(text, "coat.igs");
  const std::vector<int> roots = free_shapes(*file);
  ASSERT_EQ(roots.size(), 1u);
  const iges::Entry& group = *file->find(roots[0]);
  EXPECT_EQ(group.type, 402);
  EXPECT_EQ(group.form, 7);
  iges::Parameters in(*file, group);
  EXPECT_EQ(iges::read_group(in).size(), 4u);
  // Ours are the same four panels, the mark on its own.
  const PanelFile back = parse_iges(text, "coat.igs");
  ASSERT_EQ(back.panels.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(back.panels[k].name, faces[k].name);
    EXPECT_EQ(back.panels[k].surface, faces[k].face.surface);
    EXPECT_EQ(back.panels[k].marks.size(), k == 1 ? 1u : 0u);
  }
  EXPECT_TRUE(roundtrip(back, IgesMode::rewrite).exact());
  // One face needs no group.
  EXPECT_EQ(format_iges(std::span(faces).first(1), header).text.find("     402"), std::string::npos);
}

TEST(IgesWriting, APanelMovedAsideIsReadWhereItIs) {
  TrimmedSurface face = read_corpus("hole_and_composite").panels[0];
  face.marks.push_back({MarkKind::drill, {0.5, 0.5}, std::nullopt, ""});
  const TrimmedSurface whole = read_corpus("natural_144").panels[0];
  const std::vector<OutputFace> faces{
      {face, "a flat", 1, {}, {-700, 0, 0}}, {bent(face), "a draped", 2, {}}, {whole, "b flat", 1, {}, {-700, 0, 0}}};
  const std::string text = format_iges(faces, header_of(read_corpus("hole_and_composite"))).text;
  // Others find one translation, under the face, its mark and the whole surface.
  const auto file = iges::parse_file(text, "aside.igs");
  std::map<int, int> moved;
  int matrices = 0;
  for (const iges::Entry& e : file->entries) {
    if (e.transform != 0) ++moved[e.type];
    if (e.type != 124) continue;
    ++matrices;
    iges::Parameters in(*file, e);
    const std::vector<double> wanted{1, 0, 0, -700, 0, 1, 0, 0, 0, 0, 1, 0};
    for (const double value : wanted) EXPECT_EQ(in.real("R"), value);
  }
  EXPECT_EQ(matrices, 1);
  EXPECT_EQ(moved, (std::map<int, int>{{116, 1}, {128, 1}, {144, 1}}));
  // We find the panels as they were, and say why.
  const PanelFile back = parse_iges(text, "aside.igs");
  ASSERT_EQ(back.panels.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(back.panels[k].surface, faces[k].face.surface);
  EXPECT_LE((back.panels[0].marks.at(0).at - face.marks[0].at).norm(), 1e-9);
  const auto said = std::ranges::find_if(back.ledger, [](const LedgerEntry& row) { return row.type == 124; });
  EXPECT_EQ(said->disposition, Disposition::converted);
  EXPECT_NE(said->why.find("aside"), std::string::npos);
  for (const IgesMode mode : {IgesMode::replay, IgesMode::rewrite}) EXPECT_TRUE(roundtrip(back, mode).exact());
}

TEST(IgesWriting, LevelsSayWhatTheyHold) {
  const TrimmedSurface face = read_corpus("hole_and_composite").panels[0];
  const std::vector<OutputFace> faces{{face, "a flat", 1, {}}, {bent(face), "a draped", 2, {}}};
  IgesHeader header = header_of(read_corpus("hole_and_composite"));
  header.levels = {{1, "flat"}, {2, "draped"}};
  const auto file = iges::parse_file(format_iges(faces, header).text, "levels.igs");
  std::map<int, std::string> levels;
  std::map<int, int> on_level;
  for (const iges::Entry& e : file->entries) {
    if (e.type == 144) ++on_level[e.level];
    if (e.type != 406 || e.form != 3) continue;
    iges::Parameters in(*file, e);
    EXPECT_EQ(in.integer("NP"), 2);
    in.integer("FC");
    levels[e.level] = in.text("FD");
  }
  EXPECT_EQ(levels, header.levels);
  EXPECT_EQ(on_level, (std::map<int, int>{{1, 1}, {2, 1}}));
}

TEST(IgesWriting, SameInputGivesSameBytes) {
  const PanelFile source = read_corpus("hole_and_composite");
  const std::vector<OutputFace> faces{{bent(source.panels[0]), "a", 0, {{0.1, 0.2, 0.3}}}};
  EXPECT_EQ(format_iges(faces, header_of(source)).text, format_iges(faces, header_of(source)).text);
}

}  // namespace
}  // namespace toile
