// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of Bezier spans: halving, boxes, nearest places and crossings, all by construction.
#pragma once

#include <functional>
#include <utility>

#include "trimming/spans.h"

namespace toile {

struct Box {
  Eigen::Vector2d min, max;
};

// A part of a span with control points of its own.
struct BezierPiece {
  TrimSpan span;
  double s0 = 0, s1 = 1;  // on the span that it is a part of
  Box box;                // of the control points

  BezierPiece() = default;
  explicit BezierPiece(const TrimSpan& of);

  int degree() const { return span.degree; }
  Eigen::Vector2d first() const { return span.first(); }
  Eigen::Vector2d last() const { return span.last(); }
  Eigen::Vector2d at(double x) const { return span.at(x); }  // x in [0, 1] on the piece
  double size() const { return (box.max - box.min).maxCoeff(); }
  bool straight() const { return span.degree == 1; }
  bool is_point() const { return box.min == box.max; }
  void set_box();
};

// The span run backwards; its range stays.
void turn(TrimSpan& span);
// The two parts of a piece below and above x. Their common end is bitwise the same; parameters are linear.
std::pair<BezierPiece, BezierPiece> split(const BezierPiece& piece, double x);

// No leg of the control polygon goes back along the chord: every line across it meets the piece at most once, so the
// piece can't meet itself.
bool forward(const BezierPiece& piece);
// Calls `each` for the parts, in order, that halving needs to make all of them forward (cusps and points
// excepted).
void split_forward(const BezierPiece& piece, const std::function<void(const BezierPiece&)>& each, int depth = 0);

// The hulls lie apart by more than `margin` along the normal of a's chord.
bool chord_parts(const BezierPiece& a, const BezierPiece& b, double margin);

// Where on the piece the nearest place to a point lies, and how far it is.
std::pair<double, double> nearest(const BezierPiece& piece, const Eigen::Vector2d& x);

// Calls `each` with the parameters of the places where two pieces cross or touch, where each is cut so fine that it
// lies within `flat` of its chord. A touch may be missed or found twice, and so may places that lie nearer than `flat`.
void crossings(const BezierPiece& a, const BezierPiece& b, double flat,
               const std::function<void(double s, double t)>& each);

}  // namespace toile
