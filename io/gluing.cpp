// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/gluing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>

namespace toile {

namespace {

constexpr double same = 1e-6;   // of an edge's length: cuts nearer than this are one
constexpr int max_rounds = 32;  // of carrying cuts over seams; seams in a row, not a limit of their number

// Disjoint sets; each element has a sign against its root, for orientations.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count), sign_(count, 1) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::pair<int, int> root(int k) {
    int sign = 1;
    while (parent_[at(k)] != k) {
      sign *= sign_[at(k)];
      k = parent_[at(k)];
    }
    return {k, sign};
  }
  // False where the two are in one set already with the other sign.
  bool join(int a, int b, int sign = 1) {
    const auto [ra, sa] = root(a);
    const auto [rb, sb] = root(b);
    if (ra == rb) return sa * sb == sign;
    parent_[at(std::max(ra, rb))] = std::min(ra, rb);
    sign_[at(std::max(ra, rb))] = sa * sb * sign;
    return true;
  }

 private:
  static std::size_t at(int k) { return static_cast<std::size_t>(k); }
  std::vector<int> parent_, sign_;
};

// A piece of an edge between neighbouring cuts.
struct Bit {
  int panel = 0, loop = 0, edge = 0;
  int start = 0, end = 0;    // corners
  int next = 0, before = 0;  // bits along the loop
  std::vector<int> seams;    // that take it
  double from = 0, to = 1;   // of its edge
};

class Gluer {
 public:
  Gluer(const std::vector<GluePanel>& panels, const std::vector<GlueSeam>& seams) : panels_(panels), seams_(seams) {
    for (std::size_t p = 0; p < panels.size(); ++p) {
      for (std::size_t l = 0; l < panels[p].loops.size(); ++l) {
        for (std::size_t e = 0; e < panels[p].loops[l].lengths.size(); ++e)
          cuts_[{static_cast<int>(p), static_cast<int>(l), static_cast<int>(e)}] = {0, 1};
      }
    }
  }
  Gluing run() {
    divide();
    make_bits();
    join();
    count();
    return std::move(out_);
  }

 private:
  using Edge = std::tuple<int, int, int>;
  static Edge edge(const GluePart& p) { return {p.panel, p.loop, p.edge}; }
  double length(const GluePart& p) const {
    const GlueLoop& loop = panels_[static_cast<std::size_t>(p.panel)].loops[static_cast<std::size_t>(p.loop)];
    return loop.lengths[static_cast<std::size_t>(p.edge)] * std::abs(p.to - p.from);
  }
  double length(const std::vector<GluePart>& side) const {
    return std::accumulate(side.begin(), side.end(), 0.0, [&](double sum, const auto& p) { return sum + length(p); });
  }

  bool cut(const Edge& e, double at) {
    std::vector<double>& cuts = cuts_[e];
    const auto above = std::ranges::lower_bound(cuts, at);
    if (above != cuts.end() && *above - at <= same) return false;
    if (above != cuts.begin() && at - *std::prev(above) <= same) return false;
    cuts.insert(above, at);
    return true;
  }
  // At a share of a side's length.
  bool cut(const std::vector<GluePart>& side, double share) {
    double rest = share * length(side);
    for (const GluePart& part : side) {
      const double here = length(part);
      if (rest <= here || &part == &side.back())
        return cut(edge(part), part.from + std::clamp(rest / here, 0.0, 1.0) * (part.to - part.from));
      rest -= here;
    }
    return false;
  }
  // Shares of the side's length at its cuts and at the ends of its parts.
  std::vector<double> shares(const std::vector<GluePart>& side) const {
    std::vector<double> out;
    const double whole = length(side);
    double before = 0;
    for (const GluePart& part : side) {
      const double low = std::min(part.from, part.to), high = std::max(part.from, part.to);
      for (const double c : cuts_.at(edge(part))) {
        if (c < low - same || c > high + same) continue;
        out.push_back((before + length(part) * std::clamp((c - part.from) / (part.to - part.from), 0.0, 1.0)) / whole);
      }
      before += length(part);
    }
    return out;
  }

  void divide() {
    for (const GlueSeam& seam : seams_) {
      for (const std::vector<GluePart>* side : {&seam.a, &seam.b}) {
        for (const GluePart& part : *side) {
          cut(edge(part), part.from);
          cut(edge(part), part.to);
        }
      }
    }
    bool fresh = true;
    for (int round = 0; fresh && round < max_rounds; ++round) {
      fresh = false;
      for (const GlueSeam& seam : seams_) {
        for (const double s : shares(seam.a)) fresh = cut(seam.b, seam.reverse ? 1 - s : s) || fresh;
        for (const double s : shares(seam.b)) fresh = cut(seam.a, seam.reverse ? 1 - s : s) || fresh;
      }
    }
  }

  void make_bits() {
    for (std::size_t p = 0; p < panels_.size(); ++p) {
      for (std::size_t l = 0; l < panels_[p].loops.size(); ++l) {
        const int first = static_cast<int>(bits_.size());
        for (std::size_t e = 0; e < panels_[p].loops[l].lengths.size(); ++e) {
          const Edge key{static_cast<int>(p), static_cast<int>(l), static_cast<int>(e)};
          first_bit_[key] = static_cast<int>(bits_.size());
          for (std::size_t k = 0; k + 1 < cuts_[key].size(); ++k) {
            const int n = static_cast<int>(bits_.size());
            bits_.push_back({static_cast<int>(p),
                             static_cast<int>(l),
                             static_cast<int>(e),
                             n,
                             n + 1,
                             n + 1,
                             n - 1,
                             {},
                             cuts_[key][k],
                             cuts_[key][k + 1]});
          }
        }
        const int last = static_cast<int>(bits_.size()) - 1;
        if (last < first) continue;
        bits_[static_cast<std::size_t>(last)].end = first;
        bits_[static_cast<std::size_t>(last)].next = first;
        bits_[static_cast<std::size_t>(first)].before = last;
      }
    }
  }

  // Bits of a side in its order; negative (-1 - bit) where they are run backwards.
  std::vector<int> run_of(const std::vector<GluePart>& side) const {
    std::vector<int> out;
    for (const GluePart& part : side) {
      const std::vector<double>& cuts = cuts_.at(edge(part));
      const int first = first_bit_.at(edge(part));
      std::vector<int> bits;
      for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
        const double middle = (cuts[k] + cuts[k + 1]) / 2;
        if (middle > std::min(part.from, part.to) && middle < std::max(part.from, part.to))
          bits.push_back(first + static_cast<int>(k));
      }
      if (part.from > part.to) {
        std::ranges::reverse(bits);
        for (int& bit : bits) bit = -1 - bit;
      }
      out.insert(out.end(), bits.begin(), bits.end());
    }
    return out;
  }

  void join() {
    corners_.emplace(bits_.size());
    edges_.emplace(bits_.size());
    sides_.emplace(panels_.size());
    mates_.assign(bits_.size(), -1);
    mate_turned_.assign(bits_.size(), false);
    for (std::size_t s = 0; s < seams_.size(); ++s) {
      const std::vector<int> a = run_of(seams_[s].a);
      std::vector<int> b = run_of(seams_[s].b);
      if (seams_[s].reverse) {
        std::ranges::reverse(b);
        for (int& bit : b) bit = -1 - bit;
      }
      if (a.size() != b.size()) out_.unmatched.push_back(static_cast<int>(s));
      bool twists = false;
      for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
        // Both in a's direction.
        const bool against = (a[k] < 0) != (b[k] < 0);
        if (!sew(a[k] < 0 ? -1 - a[k] : a[k], b[k] < 0 ? -1 - b[k] : b[k], against, static_cast<int>(s))) twists = true;
      }
      if (twists) out_.twisted.push_back(static_cast<int>(s));
    }
  }

  // False where the two panels, or one with itself, would have to lie face to back.
  bool sew(int x, int y, bool against, int seam) {
    Bit &a = bits_[static_cast<std::size_t>(x)], &b = bits_[static_cast<std::size_t>(y)];
    a.seams.push_back(seam);
    b.seams.push_back(seam);
    corners_->join(a.start, against ? b.end : b.start);
    corners_->join(a.end, against ? b.start : b.end);
    edges_->join(x, y);
    mates_[static_cast<std::size_t>(x)] = y;
    mates_[static_cast<std::size_t>(y)] = x;
    mate_turned_[static_cast<std::size_t>(x)] = mate_turned_[static_cast<std::size_t>(y)] = against;
    const bool same_side = left(a) == left(b);
    const bool fits = sides_->join(a.panel, b.panel, same_side == against ? 1 : -1);
    if (!fits) one_sided_.push_back(a.panel);
    return fits;
  }
  bool left(const Bit& bit) const {
    return panels_[static_cast<std::size_t>(bit.panel)].loops[static_cast<std::size_t>(bit.loop)].material_left;
  }

  void count() {
    std::map<int, std::size_t> piece_of;  // root -> piece
    const auto piece = [&](int panel) -> GluedPiece& {
      const auto [it, fresh] = piece_of.try_emplace(sides_->root(panel).first, out_.pieces.size());
      if (fresh) out_.pieces.emplace_back();
      return out_.pieces[it->second];
    };
    for (std::size_t p = 0; p < panels_.size(); ++p) {
      GluedPiece& of = piece(static_cast<int>(p));
      of.panels.push_back(static_cast<int>(p));
      of.euler += 2 - static_cast<int>(panels_[p].loops.size());  // the open panel: a disc less its holes
    }
    for (const int panel : one_sided_) piece(panel).orientable = false;
    std::map<Edge, std::vector<int>> oversewn;
    for (std::size_t k = 0; k < bits_.size(); ++k) {
      const Bit& bit = bits_[k];
      GluedPiece& of = piece(bit.panel);
      // Bit k starts at corner k.
      if (corners_->root(static_cast<int>(k)).first == static_cast<int>(k)) ++of.euler;
      if (edges_->root(static_cast<int>(k)).first == static_cast<int>(k)) --of.euler;
      if (bit.seams.size() < 2) continue;
      of.manifold = false;
      std::vector<int>& seams = oversewn[{bit.panel, bit.loop, bit.edge}];
      seams.insert(seams.end(), bit.seams.begin(), bit.seams.end());
    }
    for (auto& [e, seams] : oversewn) {
      std::ranges::sort(seams);
      seams.erase(std::unique(seams.begin(), seams.end()), seams.end());
      out_.oversewn.push_back({{std::get<0>(e), std::get<1>(e), std::get<2>(e)}, std::move(seams)});
    }
    count_borders(piece);
  }

  // Along free bits; at a corner, around it over the sewn ones to the next that is free.
  template <class Piece>
  void count_borders(const Piece& piece) {
    std::vector<bool> seen(bits_.size(), false);
    for (std::size_t k = 0; k < bits_.size(); ++k) {
      if (seen[k] || mates_[k] >= 0) continue;
      GluedPiece& of = piece(bits_[k].panel);
      ++of.borders;
      of.border_lines.emplace_back();
      int bit = static_cast<int>(k);
      bool at_end = true;  // which end of it the walk leaves by
      for (std::size_t steps = 0; steps <= 4 * bits_.size(); ++steps) {
        const Bit& here = bits_[static_cast<std::size_t>(bit)];
        const int neighbour = at_end ? here.next : here.before;
        const int mate = mates_[static_cast<std::size_t>(neighbour)];
        if (mate < 0) {
          if (seen[static_cast<std::size_t>(neighbour)]) break;
          seen[static_cast<std::size_t>(neighbour)] = true;
          bit = neighbour;  // entered by one end, left by the other
          const Bit& b = bits_[static_cast<std::size_t>(bit)];
          of.border_lines.back().push_back({b.panel, b.loop, b.edge, at_end ? b.from : b.to, at_end ? b.to : b.from});
          continue;
        }
        // The corner is the neighbour's start where we came over the end of `here`; on the mate the same point.
        const bool turned = mate_turned_[static_cast<std::size_t>(neighbour)];
        bit = mate;
        at_end = at_end == turned;
      }
    }
  }

  const std::vector<GluePanel>& panels_;
  const std::vector<GlueSeam>& seams_;
  std::map<Edge, std::vector<double>> cuts_;
  std::map<Edge, int> first_bit_;
  std::vector<Bit> bits_;
  std::optional<Sets> corners_, edges_, sides_;
  std::vector<int> mates_;
  std::vector<bool> mate_turned_;
  std::vector<int> one_sided_;
  Gluing out_;
};

}  // namespace

Gluing glue(const std::vector<GluePanel>& panels, const std::vector<GlueSeam>& seams) {
  return Gluer(panels, seams).run();
}

}  // namespace toile
