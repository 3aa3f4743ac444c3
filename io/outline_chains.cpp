// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/outline_chains.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/measure.h"
#include "geometry/text.h"

namespace toile::drawing {

namespace {

using Eigen::Vector3d;

// Do the curves, whose ends meet, run along each other?
bool same_line(const Curve3& a, const Curve3& b, double tolerance) {
  constexpr int places = 8;
  for (int k = 1; k < places; ++k) {
    const Vector3d p = a(a.domain().min + a.domain().length() * k / places);
    if (closest_point<3>(b, p).distance > tolerance) return false;
  }
  return true;
}

}  // namespace

std::string place_text(const Vector3d& x) {
  return std::string("(") + text(x.x()) + ", " + text(x.y()) + ", " + text(x.z()) + ")";
}

// The pieces of one entity as a closed chain in their own order, where they are one: whatever else meets its corners.
std::optional<Chain> closed_in_order(const std::vector<Piece>& pieces, std::size_t first, std::size_t count) {
  if (count == 0) return std::nullopt;
  for (const bool turned : {false, true}) {
    Chain chain{{static_cast<int>(first), turned}};
    const int start = turned ? pieces[first].to : pieces[first].from;
    int end = turned ? pieces[first].from : pieces[first].to;
    for (std::size_t k = first + 1; k < first + count && chain.size() == k - first; ++k) {
      if (pieces[k].from == end) {
        chain.push_back({static_cast<int>(k), false});
        end = pieces[k].to;
      } else if (pieces[k].to == end) {
        chain.push_back({static_cast<int>(k), true});
        end = pieces[k].from;
      }
    }
    if (chain.size() == count && end == start) return chain;
  }
  return std::nullopt;
}

Chains::Chains(const std::vector<Piece>& pieces, std::vector<bool> used, int places, std::vector<OutlineNote>& notes)
    : pieces_(pieces),
      used_(std::move(used)),
      at_(static_cast<std::size_t>(places)),
      degree_(static_cast<std::size_t>(places), 0),
      notes_(notes) {
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    if (used_[k]) continue;
    for (const int place : {pieces[k].from, pieces[k].to}) {
      at_[static_cast<std::size_t>(place)].push_back(static_cast<int>(k));
      ++degree_[static_cast<std::size_t>(place)];
    }
  }
}

void Chains::find(const Places& places) {
  drop_doubles(places.tolerance());
  for (std::size_t place = 0; place < at_.size(); ++place) {
    if (degree_[place] != 1) continue;
    for (const int k : at_[place])
      if (!used_[static_cast<std::size_t>(k)]) loose.emplace_back(static_cast<int>(place), k);
  }
  drop_loose_ends();
  for (std::size_t k = 0; k < pieces_.size(); ++k)
    if (!used_[k]) follow(static_cast<int>(k), places);
}

// Two curves along each other between the same places: where others meet at both, in pairs, the way goes on without
// them and they are a slit; else one of them is the other drawn again.
void Chains::drop_doubles(double tolerance) {
  std::map<std::pair<int, int>, std::vector<int>> between;
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    if (!used_[k] && pieces_[k].from != pieces_[k].to)
      between[std::minmax(pieces_[k].from, pieces_[k].to)].push_back(static_cast<int>(k));
  }
  for (auto& [ends, pieces] : between) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      for (std::size_t j = i + 1; j < pieces.size(); ++j) {
        const int a = pieces[i], b = pieces[j];
        if (used_[static_cast<std::size_t>(a)] || used_[static_cast<std::size_t>(b)]) continue;
        if (!same_line(pieces_[static_cast<std::size_t>(a)].curve, pieces_[static_cast<std::size_t>(b)].curve,
                       tolerance))
          continue;
        const auto even = [&](int place) { return degree_[static_cast<std::size_t>(place)] % 2 == 0; };
        const bool slit = even(ends.first) && even(ends.second);
        remove(b);
        if (slit) {
          remove(a);
          slits.push_back(a);
        }
        notes_.push_back({pieces_[static_cast<std::size_t>(b)].id,
                          std::string("the line from ") +
                              place_text(pieces_[static_cast<std::size_t>(b)].curve.start()) + " to " +
                              place_text(pieces_[static_cast<std::size_t>(b)].curve.end()) +
                              (slit ? " is drawn out and back: a slit, kept as a mark" : " is drawn twice")});
      }
    }
  }
}

void Chains::remove(int piece) {
  used_[static_cast<std::size_t>(piece)] = true;
  for (const int place : {pieces_[static_cast<std::size_t>(piece)].from, pieces_[static_cast<std::size_t>(piece)].to})
    --degree_[static_cast<std::size_t>(place)];
}

void Chains::drop_loose_ends() {
  std::vector<int> ends(at_.size());
  std::iota(ends.begin(), ends.end(), 0);
  while (!ends.empty()) {
    const int end = ends.back();
    ends.pop_back();
    if (degree_[static_cast<std::size_t>(end)] != 1) continue;
    for (const int k : at_[static_cast<std::size_t>(end)]) {
      const auto i = static_cast<std::size_t>(k);
      if (used_[i]) continue;
      used_[i] = true;
      open.push_back(k);
      for (const int place : {pieces_[i].from, pieces_[i].to}) --degree_[static_cast<std::size_t>(place)];
      ends.push_back(pieces_[i].from == end ? pieces_[i].to : pieces_[i].from);
    }
  }
}

// What is left has no loose ends. Where more than two ends meet, nobody knows which of the curves is the outline.
void Chains::follow(int first, const Places& places) {
  Chain chain{{first, false}};
  used_[static_cast<std::size_t>(first)] = true;
  const int start = pieces_[static_cast<std::size_t>(first)].from;
  int end = pieces_[static_cast<std::size_t>(first)].to;
  while (end != start && degree_[static_cast<std::size_t>(end)] == 2) {
    int next = -1;
    for (const int k : at_[static_cast<std::size_t>(end)])
      if (!used_[static_cast<std::size_t>(k)]) next = k;
    if (next < 0) break;  // the other part of this chain has been followed, to a fork that was noted
    const Piece& piece = pieces_[static_cast<std::size_t>(next)];
    used_[static_cast<std::size_t>(next)] = true;
    chain.push_back({next, piece.from != end});
    end = piece.from == end ? piece.to : piece.from;
  }
  if (end != start && degree_[static_cast<std::size_t>(end)] == 2) {
    for (const Step& step : chain) open.push_back(step.piece);
    return;
  }
  const int fork = degree_[static_cast<std::size_t>(start)] == 2 ? end : start;
  if (end == start && degree_[static_cast<std::size_t>(start)] == 2) {
    closed.push_back(std::move(chain));
    return;
  }
  notes_.push_back(
      {pieces_[static_cast<std::size_t>(first)].id,
       "several curves go on from " + place_text(places.point(fork)) + "; those that meet there make no panel"});
  for (const Step& step : chain) open.push_back(step.piece);
}

}  // namespace toile::drawing
