// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "trimming/bezier_piece.h"
#include "trimming/crossings.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// A part of a span in the direction of its loop.
struct Piece : BezierPiece {
  int loop = 0, link = 0;  // link: number of the span in the chain of its loop
};

std::pair<Piece, Piece> halves(const Piece& piece) {
  const auto [left, right] = split(piece, 0.5);
  return {{left, piece.loop, piece.link}, {right, piece.loop, piece.link}};
}

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

class Finder {
 public:
  Finder(const std::vector<TrimLoop>& loops, const TrimSpans& spans) {
    Vector2d min = Vector2d::Constant(std::numeric_limits<double>::infinity()), max = -min;
    for (const TrimSpan& span : spans.all) {
      for (int i = 0; i <= span.degree; ++i) {
        min = min.cwiseMin(span.point(i));
        max = max.cwiseMax(span.point(i));
      }
    }
    // Both directions scaled by powers of two, which rounds nothing, to sizes between 1 and 2.
    for (int axis = 0; axis < 2; ++axis) {
      const double size = max[axis] - min[axis];
      scale_[axis] = size > 0 ? std::ldexp(1.0, -std::ilogb(size)) : 1;
    }
    margin_ =
        8 * epsilon *
        std::max((scale_.asDiagonal() * min).cwiseAbs().maxCoeff(), (scale_.asDiagonal() * max).cwiseAbs().maxCoeff());
    smallest_ = 8 * margin_;
    for (std::size_t l = 0; l < loops.size(); ++l) add_loop(loops[l], static_cast<int>(l), spans);
  }

  std::vector<LoopContact> run() {
    std::vector<int> order(pieces_.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
    std::sort(order.begin(), order.end(), [this](int a, int b) {
      const double x = piece(a).box.min.x(), y = piece(b).box.min.x();
      return x != y ? x < y : a < b;
    });
    std::vector<int> active;
    for (const int b : order) {
      std::erase_if(active, [&](int a) { return piece(a).box.max.x() + margin_ < piece(b).box.min.x(); });
      for (const int a : active) {
        if (boxes_apart(piece(a).box, piece(b).box) || level_and_curve(piece(a), piece(b))) continue;
        if (next_[static_cast<std::size_t>(a)] == b) {
          joined(piece(a), piece(b));
        } else if (next_[static_cast<std::size_t>(b)] == a) {
          joined(piece(b), piece(a));
        } else {
          apart(piece(a), piece(b));
        }
      }
      active.push_back(b);
    }
    return std::move(contacts_);
  }

 private:
  const Piece& piece(int k) const { return pieces_[static_cast<std::size_t>(k)]; }

  void add_loop(const TrimLoop& loop, int l, const TrimSpans& spans) {
    std::vector<TrimSpan>& chain = chains_.emplace_back();
    for (std::size_t c = 0; c < loop.curves.size(); ++c) {
      const auto of = spans.of(l, static_cast<int>(c));
      for (std::size_t k = 0; k < of.size(); ++k) {
        TrimSpan span = of[loop.curves[c].reversed ? of.size() - 1 - k : k];
        if (span.degenerate()) continue;
        if (loop.curves[c].reversed) turn(span);
        for (std::size_t i = 0; i <= static_cast<std::size_t>(span.degree); ++i) {
          span.u[i] *= scale_.x();
          span.v[i] *= scale_.y();
        }
        if (!BezierPiece(span).is_point()) chain.push_back(span);
      }
    }
    std::vector<Piece> list;
    for (std::size_t k = 0; k < chain.size(); ++k) {
      split_forward(BezierPiece(chain[k]), [&](const BezierPiece& piece) {
        list.push_back({piece, l, static_cast<int>(k)});
      });
    }
    while (!list.empty() && list.size() < 3) {
      std::vector<Piece> finer;
      for (const Piece& piece : list) {
        const auto [a, b] = halves(piece);
        finer.push_back(a);
        finer.push_back(b);
      }
      list = std::move(finer);
    }
    const std::size_t first = pieces_.size();
    for (std::size_t k = 0; k < list.size(); ++k) {
      pieces_.push_back(list[k]);
      next_.push_back(static_cast<int>(first + (k + 1) % list.size()));
    }
  }

  bool boxes_apart(const Box& a, const Box& b) const {
    return a.max.x() + margin_ < b.min.x() || b.max.x() + margin_ < a.min.x() || a.max.y() + margin_ < b.min.y() ||
           b.max.y() + margin_ < a.min.y();
  }

  bool near_known_contact(const Piece& a, const Piece& b) const {
    const auto near = [](const Piece& piece, const Vector2d& x) {
      return (piece.box.min - x).cwiseAbs().maxCoeff() <= cluster_ &&
             (piece.box.max - x).cwiseAbs().maxCoeff() <= cluster_;
    };
    return std::any_of(places_.begin(), places_.end(), [&](const Vector2d& x) { return near(a, x) || near(b, x); });
  }

  // Pieces that share no joint.
  void apart(const Piece& a, const Piece& b) {
    if (boxes_apart(a.box, b.box) || overlapped_) return;
    if (a.straight() && b.straight()) {
      segments(a, b);
      return;
    }
    if (chord_parts(a, b, margin_) || chord_parts(b, a, margin_) || near_known_contact(a, b)) return;
    if (a.size() <= smallest_ && b.size() <= smallest_) {
      add_contact(a, b, 0.5 * (a.first() + b.first()));
      return;
    }
    if (b.size() > a.size()) {
      const auto [b1, b2] = halves(b);
      apart(a, b1);
      apart(a, b2);
    } else {
      const auto [a1, a2] = halves(a);
      apart(a1, b);
      apart(a2, b);
    }
  }

  void segments(const Piece& a, const Piece& b) {
    const int b0 = orientation(a.first(), a.last(), b.first()), b1 = orientation(a.first(), a.last(), b.last());
    const int a0 = orientation(b.first(), b.last(), a.first()), a1 = orientation(b.first(), b.last(), a.last());
    if (a0 * a1 > 0 || b0 * b1 > 0) return;
    const Vector2d da = a.last() - a.first(), db = b.last() - b.first();
    if (a0 == 0 && a1 == 0) {
      // On one line: ordered by the direction in which it extends most.
      const int axis = std::abs(da.x()) >= std::abs(da.y()) ? 0 : 1;
      const auto [a_min, a_max] = std::minmax({a.first()[axis], a.last()[axis]});
      const auto [b_min, b_max] = std::minmax({b.first()[axis], b.last()[axis]});
      const double low = std::max(a_min, b_min), high = std::min(a_max, b_max);
      if (low > high) return;
      const Vector2d x = a.first()[axis] == low   ? a.first()
                         : a.last()[axis] == low  ? a.last()
                         : b.first()[axis] == low ? b.first()
                                                  : b.last();
      if (low < high) {
        add(ContactKind::overlap, a, b, x);
      } else {
        add_contact(a, b, x);
      }
      return;
    }
    if (a0 * a1 < 0 && b0 * b1 < 0) {
      add(ContactKind::crossing, a, b, a.first() + da * (cross(b.first() - a.first(), db) / cross(da, db)));
      return;
    }
    add_contact(a, b, a0 == 0 ? a.first() : a1 == 0 ? a.last() : b0 == 0 ? b.first() : b.last());
  }

  // A straight span along a line of constant u or v against a curved one, decided exactly: by the signs of the curve's
  // coordinates at its roots on that line, and of what precedes and follows it where it ends there. False: no such
  // pair, or one that meets at an end of the straight span, where this says too little.
  bool level_and_curve(const Piece& a, const Piece& b) {
    if (a.straight() == b.straight()) return false;
    const Piece &line = a.straight() ? a : b, &curve = a.straight() ? b : a;
    const auto [known, added] = level_pairs_.try_emplace({line.loop, line.link, curve.loop, curve.link}, false);
    if (added) known->second = decide_level(line, curve);
    return known->second;
  }

  bool decide_level(const Piece& line, const Piece& curve) {
    const TrimSpan& l = chain(line)[static_cast<std::size_t>(line.link)];
    const std::vector<TrimSpan>& links = chain(curve);
    const std::size_t n = links.size(), k = static_cast<std::size_t>(curve.link);
    const TrimSpan& c = links[k];
    const bool upright = l.u[0] == l.u[1];
    if (!upright && l.v[0] != l.v[1]) return false;
    const Axis across = upright ? Axis::u : Axis::v, along = upright ? Axis::v : Axis::u;
    const double at = upright ? l.u[0] : l.v[0];
    const auto [low, high] = upright ? std::minmax(l.v[0], l.v[1]) : std::minmax(l.u[0], l.u[1]);
    const LineForm form(c, across, at);
    if (form.zero()) return false;
    std::vector<std::pair<ContactKind, Vector2d>> found;
    for (LineRoot& root : roots(form, counts_)) {
      const int above = sign_at_root(LineForm(c, along, low), form, root, counts_);
      const int below = sign_at_root(LineForm(c, along, high), form, root, counts_);
      if (above == 0 || below == 0) return false;
      if (above > 0 && below < 0)
        found.emplace_back(root.crosses ? ContactKind::crossing : ContactKind::touch, c.at(root.s()));
    }
    for (const bool end : {false, true}) {
      if (form.coefficient_sign(end ? c.degree : 0) != 0) continue;
      const Vector2d x = end ? c.last() : c.first();
      const double place = upright ? x.y() : x.x();
      if (place < low || place > high) continue;
      if (place == low || place == high) {
        // The joint of neighbours is no contact.
        const std::size_t beside = static_cast<std::size_t>(line.link);
        if (line.loop == curve.loop && beside == (k + (end ? 1 : n - 1)) % n) continue;
        return false;
      }
      const LineForm beyond(links[(k + (end ? 1 : n - 1)) % n], across, at);
      const int here = end ? form.sign_before_end() : form.sign_after_start();
      const int there = end ? beyond.sign_after_start() : beyond.sign_before_end();
      found.emplace_back(here * there < 0   ? ContactKind::crossing
                         : here * there > 0 ? ContactKind::touch
                                            : ContactKind::overlap,
                         x);
    }
    for (const auto& [kind, x] : found) {
      if (cusp(line, curve, x) || cusp(curve, line, x)) continue;
      const bool listed = std::ranges::any_of(
          places_, [&, &y = x](const Vector2d& known) { return (known - y).cwiseAbs().maxCoeff() <= cluster_; });
      if (kind != ContactKind::touch || !listed) add(kind, line, curve, x);
    }
    return true;
  }

  // a ends where b starts.
  void joined(const Piece& a, const Piece& b) {
    if (overlapped_) return;
    const Vector2d joint = a.last();
    if (a.straight() && b.straight()) {
      if (orientation(a.first(), joint, b.last()) == 0 && (a.first() - joint).dot(b.last() - joint) > 0)
        add(ContactKind::overlap, a, b, joint);
      return;
    }
    if (parted_at(a, b, joint)) return;
    if (a.size() <= cluster_ && b.size() <= cluster_) return;  // a cusp
    const auto [a1, a2] = halves(a);
    const auto [b1, b2] = halves(b);
    apart(a1, b);
    apart(a2, b2);
    joined(a2, b1);
  }

  // A line through the joint has a on one side and b on the other.
  static bool parted_at(const Piece& a, const Piece& b, const Vector2d& joint) {
    const Vector2d normal = (b.last() - joint).normalized() - (a.first() - joint).normalized();
    for (int i = 0; i < a.degree(); ++i) {
      const Vector2d x = a.span.point(i) - joint;
      if (x != Vector2d::Zero() && !(x.dot(normal) < 0)) return false;
    }
    for (int i = 1; i <= b.degree(); ++i) {
      const Vector2d x = b.span.point(i) - joint;
      if (x != Vector2d::Zero() && !(x.dot(normal) > 0)) return false;
    }
    return true;
  }

  void add(ContactKind kind, const Piece& a, const Piece& b, const Vector2d& uv) {
    places_.push_back(uv);
    contacts_.push_back({kind, a.loop, a.span.curve, b.loop, b.span.curve, uv.cwiseQuotient(scale_)});
    if (kind != ContactKind::touch) overlapped_ = true;
  }

  // Next to the joint where the span of b follows that of a: two spans that leave it in one direction, up to rounding,
  // may meet again this near to it.
  bool cusp(const Piece& a, const Piece& b, const Vector2d& uv) const {
    const std::size_t n = chain(a).size(), link = static_cast<std::size_t>(a.link);
    return a.loop == b.loop && n > 2 && (link + 1) % n == static_cast<std::size_t>(b.link) &&
           (uv - chain(a)[link].last()).cwiseAbs().maxCoeff() <= cluster_;
  }

  // Crossing, touch or overlap: by the order in which the four branches leave the contact.
  void add_contact(const Piece& a, const Piece& b, const Vector2d& uv) {
    for (const Vector2d& known : places_) {
      if ((known - uv).cwiseAbs().maxCoeff() <= cluster_) return;
    }
    if (cusp(a, b, uv) || cusp(b, a, uv)) return;
    const TrimSpan& span_a = chain(a)[static_cast<std::size_t>(a.link)];
    const TrimSpan& span_b = chain(b)[static_cast<std::size_t>(b.link)];
    const double size = std::min((span_a.last() - span_a.first()).norm(), (span_b.last() - span_b.first()).norm());
    const double radius = std::max(1e-4 * size, 1e3 * smallest_);
    const double s_a = parameter(a, uv), s_b = parameter(b, uv);
    const double a_in = branch(a, s_a, uv, radius, false), a_out = branch(a, s_a, uv, radius, true);
    const double b_in = branch(b, s_b, uv, radius, false), b_out = branch(b, s_b, uv, radius, true);
    const auto turn = [](double from, double to) {
      const double x = std::fmod(to - from, 2 * std::numbers::pi);
      return x < 0 ? x + 2 * std::numbers::pi : x;
    };
    for (const double x : {a_in, a_out}) {
      for (const double y : {b_in, b_out}) {
        if (std::min(turn(x, y), turn(y, x)) < 1e-9) return add(ContactKind::overlap, a, b, uv);
      }
    }
    const bool between_in = turn(a_in, b_in) < turn(a_in, a_out), between_out = turn(a_in, b_out) < turn(a_in, a_out);
    add(between_in != between_out ? ContactKind::crossing : ContactKind::touch, a, b, uv);
  }

  const std::vector<TrimSpan>& chain(const Piece& p) const { return chains_[static_cast<std::size_t>(p.loop)]; }

  // Where the contact x lies on the span of a piece: a straight one may be long, any other is as small as the contact.
  static double parameter(const Piece& p, const Vector2d& x) {
    if (!p.straight()) return 0.5 * (p.s0 + p.s1);
    if (x == p.first()) return p.s0;
    if (x == p.last()) return p.s1;
    const Vector2d d = p.last() - p.first();
    const double share = std::clamp((x - p.first()).dot(d) / d.squaredNorm(), 0.0, 1.0);
    // The weights of the ends move the parameter of a point at that share of the length.
    const double from = (1 - share) * p.span.w[1], to = share * p.span.w[0];
    return p.s0 + (p.s1 - p.s0) * to / (from + to);
  }

  // Direction [rad] from x to where the loop is `radius` away from it, after or before parameter s of the piece's span.
  double branch(const Piece& p, double s, const Vector2d& x, double radius, bool after) const {
    const std::vector<TrimSpan>& links = chain(p);
    std::size_t link = static_cast<std::size_t>(p.link);
    for (std::size_t step = 0; step <= links.size(); ++step) {
      // Steps that double find the first way out, also where the span comes back to x.
      const double end = after ? 1 : 0;
      double inner = s, outer = s;
      for (double stride = 1e-12; outer != end; stride *= 2) {
        inner = outer;
        outer = after ? std::min(1.0, s + stride) : std::max(0.0, s - stride);
        if ((links[link].at(outer) - x).norm() >= radius) break;
      }
      if ((links[link].at(outer) - x).norm() >= radius) {
        for (int k = 0; k < 60; ++k) {
          const double mid = 0.5 * (inner + outer);
          ((links[link].at(mid) - x).norm() < radius ? inner : outer) = mid;
        }
        const Vector2d d = links[link].at(outer) - x;
        return std::atan2(d.y(), d.x());
      }
      link = (link + (after ? 1 : links.size() - 1)) % links.size();
      s = after ? 0 : 1;
    }
    return 0;
  }

  std::vector<std::vector<TrimSpan>> chains_;  // spans of each loop in its direction
  std::vector<Piece> pieces_;
  std::vector<int> next_;
  std::map<std::array<int, 4>, bool> level_pairs_;  // loop and link of the straight span, of the curved: decided
  PredicateCounts counts_;
  std::vector<LoopContact> contacts_;
  std::vector<Vector2d> places_;  // of the contacts, scaled
  Vector2d scale_{1, 1};
  double margin_ = 0, smallest_ = 0;
  static constexpr double cluster_ = 1e-7;
  bool overlapped_ = false;  // something invalid is found: nothing more to look for
};

}  // namespace

std::vector<LoopContact> find_contacts(const std::vector<TrimLoop>& loops, const TrimSpans& spans) {
  return Finder(loops, spans).run();
}

}  // namespace toile
