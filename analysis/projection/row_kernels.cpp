// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/row_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "analysis/parallel/lanes.h"

namespace toile {
namespace {

// A vector of three and nothing.
using Vector4 = double __attribute__((vector_size(4 * sizeof(double))));

class GeneralKernel final : public RowKernel {
 public:
  GeneralKernel(const KernelInput& in, std::vector<int> which, std::vector<int> nodes)
      : which_(std::move(which)), slot_of_node_(static_cast<std::size_t>(in.mass->size()), -1) {
    int slots = 0;
    for (const int k : nodes) slot_of_node_[static_cast<std::size_t>(k)] = slots++;
    free_ = slots;
    slots += in.fixed;
    x_.assign(static_cast<std::size_t>(slots), Vector4{});
    v_ = a_ = x_;
    const auto count = which_.size();
    stiffness_.assign(count, 0);
    before_.assign(count, 0);
    force_.assign(count, Vector4{});
    CompressedRows of_free;  // on slots
    for (const int r : which_) {
      const CompressedRows &d = in.rows->free, &g = in.rows->fixed;
      for (int e = d.start[r]; e < d.start[r + 1]; ++e) {
        of_free.column.push_back(slot_of_node_[static_cast<std::size_t>(d.column[e])]);
        of_free.value.push_back(d.value[e]);
      }
      of_free.start.push_back(static_cast<int>(of_free.column.size()));
      for (int e = d.start[r]; e < d.start[r + 1]; ++e) {
        rows_.column.push_back(slot_of_node_[static_cast<std::size_t>(d.column[e])]);
        rows_.value.push_back(d.value[e]);
      }
      for (int e = g.start[r]; e < g.start[r + 1]; ++e) {
        rows_.column.push_back(free_ + g.column[e]);
        rows_.value.push_back(g.value[e]);
      }
      rows_.start.push_back(static_cast<int>(rows_.column.size()));
      slack_.push_back(in.slack[static_cast<std::size_t>(r)]);
    }
    Eigen::VectorXd mass(free_);
    for (std::size_t s = 0; s < nodes.size(); ++s) mass[static_cast<Eigen::Index>(s)] = (*in.mass)[nodes[s]];
    at_node_ = transposed_by_mass(of_free, mass);
  }

  KernelPoint node(int k) override { return at(slot_of_node_[static_cast<std::size_t>(k)]); }
  KernelPoint fixed(int k) override { return at(free_ + k); }
  void set_stiffness(const Eigen::VectorXd& per_row) override {
    for (std::size_t r = 0; r < which_.size(); ++r) stiffness_[r] = per_row[which_[r]];
  }

  void advance(double kick, double drift, double damping, Workers* workers) override {
    share_out(workers, static_cast<int>(which_.size()), [&](int begin, int end) { rows(begin, end, damping); });
    share_out(workers, free_, [&](int begin, int end) { nodes(begin, end, kick, drift); });
  }

 private:
  KernelPoint at(int slot) {
    if (slot < 0) return {};
    return {reinterpret_cast<double*>(&x_[static_cast<std::size_t>(slot)]),
            reinterpret_cast<double*>(&v_[static_cast<std::size_t>(slot)]),
            reinterpret_cast<double*>(&a_[static_cast<std::size_t>(slot)]), 1};
  }
  [[gnu::noinline]] void rows(int begin, int end, double damping) {
    const int* const column = rows_.column.data();
    const double* const value = rows_.value.data();
    for (int r = begin; r < end; ++r) {
      Vector4 y{};
      for (int e = rows_.start[r]; e < rows_.start[r + 1]; ++e) y += value[e] * x_[column[e]];
      const double strain = 0.5 * (y[0] * y[0] + y[1] * y[1] + y[2] * y[2] - 1), excess = slack_[r].excess(strain);
      force_[r] = stiffness_[r] * (excess + damping * (excess - before_[r])) * y;
      before_[r] = excess;
    }
  }
  [[gnu::noinline]] void nodes(int begin, int end, double kick, double drift) {
    const int* const column = at_node_.column.data();
    const double* const value = at_node_.value.data();
    for (int k = begin; k < end; ++k) {
      Vector4 pull{};
      for (int e = at_node_.start[k]; e < at_node_.start[k + 1]; ++e) pull += value[e] * force_[column[e]];
      v_[k] += kick * (a_[k] - pull);
      x_[k] += drift * v_[k];
    }
  }

  std::vector<int> which_, slot_of_node_;
  int free_ = 0;
  CompressedRows rows_, at_node_;  // on slots; M^-1 D^T
  std::vector<Slack> slack_;
  std::vector<double> stiffness_, before_;
  std::vector<Vector4> x_, v_, a_, force_;
};

constexpr int widest = 6, farthest = 2;  // of a LineTable: width, shift

// Both directions' 1-D functions at lines of points: at line a of the `width` control points from a + shift on.
struct LineTable {
  int lines = 0, shift = 0, width = 0;
  std::array<std::vector<double>, 2> value;  // [direction][a width + s]
  double& at(int d, int a, int i) { return value[d][static_cast<std::size_t>(a * width + i - a - shift)]; }
  double of(int d, int a, int s) const { return value[d][static_cast<std::size_t>(a * width + s)]; }
};

// Lines of points along one parameter, and which control points each reaches.
class Reach {
 public:
  void set_lines(const std::vector<NetRows::Row>& rows, int parameter) {
    for (const NetRows::Row& r : rows) at_.push_back(r.uv[parameter]);
    std::ranges::sort(at_);
    at_.erase(std::unique(at_.begin(), at_.end()), at_.end());
  }
  int lines() const { return static_cast<int>(at_.size()); }
  int line(double t) const { return static_cast<int>(std::ranges::lower_bound(at_, t) - at_.begin()); }
  void add(int a, int i) {
    low_ = std::min(low_, i - a);
    high_ = std::max(high_, i - a);
  }
  LineTable table() const {
    LineTable table{lines(), low_, high_ - low_ + 1, {}};
    for (auto& numbers : table.value) numbers.assign(static_cast<std::size_t>(table.lines * table.width), 0);
    return table;
  }

 private:
  std::vector<double> at_;
  int low_ = 1 << 20, high_ = -(1 << 20);
};

struct Entry {
  int i, j;
  double value;
};

bool is_product(const std::vector<Entry>& entries, const LineTable& u, int a, const LineTable& v, int b,
                int direction) {
  constexpr double rounding = 1e-12;
  std::vector<double> left(static_cast<std::size_t>(u.width * v.width), 0);
  double size = 0, largest = 0;
  for (const Entry& e : entries) {
    left[static_cast<std::size_t>(e.i - a - u.shift + u.width * (e.j - b - v.shift))] += e.value;
    size = std::max(size, std::abs(e.value));
  }
  for (int t = 0; t < v.width; ++t)
    for (int s = 0; s < u.width; ++s)
      largest = std::max(largest, std::abs(left[static_cast<std::size_t>(s + u.width * t)] -
                                           u.of(direction, a, s) * v.of(direction, b, t)));
  return largest <= rounding * size;
}

// Doubles that begin with a line of the cache.
class Numbers {
 public:
  void assign(std::size_t count, double value) {
    Block block;
    block.fill(value);
    blocks_.assign((count + block.size() - 1) / block.size(), block);
  }
  double* data() { return reinterpret_cast<double*>(blocks_.data()); }
  const double* data() const { return reinterpret_cast<const double*>(blocks_.data()); }
  double& operator[](std::size_t k) { return blocks_[k / 8][k % 8]; }

 private:
  struct alignas(64) Block : std::array<double, 8> {};
  std::vector<Block> blocks_;
};

constexpr int padding = 8;  // numbers at both ends of a line, which are 0

int round_up(int n) {
  return (n + padding - 1) / padding * padding;
}

// Lines of control points and of points one after the other. Along u a line is a vector; from each line of control
// points comes its profile D_u x at the points' u, alike for both directions; from W profiles a line of points.
template <int W>
class NetKernel final : public RowKernel {
 public:
  NetKernel(const KernelInput& in, const NetRows& net, const LineTable& u, const LineTable& v,
            const std::vector<std::array<int, 2>>& row_at)
      : net_(net), along_v_(v), row_at_(row_at), points_(u.lines), length_(round_up(std::max(u.lines, net.count_u))) {
    stride_ = length_ + 2 * padding;
    const auto lines = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(net.count_v);
    for (auto* part : {&x_, &v_, &a_}) part->assign(3 * lines, 0);
    inverse_mass_.assign(lines, 0);
    for (int i = 0; i < net.count_u * net.count_v; ++i)
      if (const int k = net.node[static_cast<std::size_t>(i)]; k >= 0)
        inverse_mass_[static_cast<std::size_t>(offset(i))] = 1 / (*in.mass)[k];
    for (std::size_t i = 0; i < net.node.size(); ++i) {
      if (net.node[i] >= 0) of_node_[net.node[i]] = offset(static_cast<int>(i));
      if (net.fixed[i] >= 0) of_fixed_[net.fixed[i]] = offset(static_cast<int>(i));
    }
    shift_u_ = u.shift;
    for (int d = 0; d < 2; ++d) {
      slack_[d] = {};
      for (int s = 0; s < W; ++s) {
        to_points_[d][s].assign(static_cast<std::size_t>(stride_), 0);
        to_nodes_[d][s] = to_points_[d][s];
        if (s >= u.width) continue;
        for (int a = 0; a < u.lines; ++a) {
          const double value = u.of(d, a, s);
          to_points_[d][s][static_cast<std::size_t>(padding + a)] = value;
          const int i = a + u.shift + s;
          if (i >= 0 && i < net.count_u) to_nodes_[d][s][static_cast<std::size_t>(padding + i)] = value;
        }
      }
      const auto points = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(v.lines);
      stiffness_[d].assign(points, 0);
      before_[d].assign(points, 0);
    }
    for (const NetRows::Row& r : net.rows) slack_[r.second] = in.slack[static_cast<std::size_t>(r.row)];
    nothing_.assign(6 * static_cast<std::size_t>(stride_), 0);
    make_room(W + 1);
  }

  KernelPoint node(int k) override { return at(of_node_, k); }
  KernelPoint fixed(int k) override { return at(of_fixed_, k); }
  void set_stiffness(const Eigen::VectorXd& per_row) override {
    for (int b = 0; b < along_v_.lines; ++b)
      for (int a = 0; a < points_; ++a)
        for (int d = 0; d < 2; ++d)
          if (const int k = row_at_[static_cast<std::size_t>(a + points_ * b)][d]; k >= 0)
            stiffness_[d][static_cast<std::size_t>(b * stride_ + padding + a)] =
                per_row[net_.rows[static_cast<std::size_t>(k)].row];
  }

  void advance(double kick, double drift, double damping, Workers* workers) override {
    const int lines = net_.count_v, across = along_v_.lines, shift = along_v_.shift;
    if (workers && workers->count() > 1) {
      make_room(std::max(lines, across));
      const auto each = [&](int count, const auto& body) {
        share_out(workers, count, [&](int begin, int end) {
          for (int l = begin; l < end; ++l) body(l);
        });
      };
      each(lines, [&](int l) { make_profile(l); });
      each(across, [&](int b) { make_forces(b, damping); });
      each(lines, [&](int l) { move(l, kick, drift); });
      return;
    }
    // A line of control points moves once all points that see it have been there: what is at work stays in the cache.
    int seen = 0, moved = 0;
    for (int b = 0; b < across; ++b) {
      for (; seen < std::min(lines, b + shift + W); ++seen) make_profile(seen);
      make_forces(b, damping);
      for (; moved < std::min(lines, b + shift + 1); ++moved) move(moved, kick, drift);
    }
    for (; moved < lines; ++moved) move(moved, kick, drift);
  }

 private:
  int offset(int i) const { return (i / net_.count_u) * stride_ + padding + i % net_.count_u; }
  KernelPoint at(const std::map<int, int>& offsets, int k) {
    const auto it = offsets.find(k);
    if (it == offsets.end()) return {};
    return {x_.data() + it->second, v_.data() + it->second, a_.data() + it->second,
            static_cast<std::ptrdiff_t>(stride_) * net_.count_v};
  }
  void make_room(int lines) {
    if (room_ >= lines) return;
    room_ = lines;
    for (auto* part : {&profile_, &force_, &gathered_})
      part->assign(6 * static_cast<std::size_t>(stride_) * static_cast<std::size_t>(room_), 0);
  }
  // Six lines, direction by direction, of what has room for a few.
  double* in(Numbers& part, int l) {
    return part.data() + static_cast<std::ptrdiff_t>(l % room_) * 6 * stride_ + padding;
  }
  double* line(Numbers& part, int l, int c) {
    return part.data() + (static_cast<std::ptrdiff_t>(c) * net_.count_v + l) * stride_ + padding;
  }

  static Lanes load(const double* from) {
    Lanes a;
    std::memcpy(&a, from, sizeof a);
    return a;
  }
  static void store(double* to, const Lanes& a) { std::memcpy(to, &a, sizeof a); }

  using Table = std::array<const double*, W>;
  static Table table(const std::array<Numbers, W>& lines) {
    Table out;
    for (int s = 0; s < W; ++s) out[s] = lines[s].data() + padding;
    return out;
  }
  // In these three nothing is read through `this` within loops: stores might change it for all that the compiler knows.
  [[gnu::noinline]] void make_profile(int l) {
    const int n = length_;
    const std::ptrdiff_t stride = stride_;
    std::array<const double*, 3> x;
    for (int c = 0; c < 3; ++c) x[c] = line(x_, l, c) + shift_u_;
    const std::array<Table, 2> f{table(to_points_[0]), table(to_points_[1])};
    double* const out = in(profile_, l);
    for (int a = 0; a < n; a += lane_count) {
      std::array<std::array<Lanes, 3>, 2> sum{};
      for (int s = 0; s < W; ++s)
        for (int c = 0; c < 3; ++c) {
          const Lanes at = load(x[c] + a + s);
          for (int d = 0; d < 2; ++d) sum[d][c] += load(f[d][s] + a) * at;
        }
      for (int k = 0; k < 6; ++k) store(out + k * stride + a, sum[k / 3][k % 3]);
    }
  }

  [[gnu::noinline]] void make_forces(int b, double damping) {
    const int n = length_;
    const std::ptrdiff_t stride = stride_;
    std::array<const double*, W> from;
    std::array<std::array<double, W>, 2> f{};
    for (int t = 0; t < W; ++t) {
      const int l = b + along_v_.shift + t;
      const bool there = t < along_v_.width && l >= 0 && l < net_.count_v;
      from[t] = there ? in(profile_, l) : nothing_.data();
      for (int d = 0; d < 2; ++d) f[d][t] = there ? along_v_.of(d, b, t) : 0;
    }
    for (int d = 0; d < 2; ++d) {
      double* const out = in(force_, b) + 3 * d * stride;
      double* const before = before_[d].data() + b * stride + padding;
      const double* const k = stiffness_[d].data() + b * stride + padding;
      const Lanes low = broadcast<Lanes>(slack_[d].low), high = broadcast<Lanes>(slack_[d].high);
      for (int a = 0; a < n; a += lane_count) {
        std::array<Lanes, 3> y{};
        for (int t = 0; t < W; ++t)
          for (int c = 0; c < 3; ++c) y[c] += f[d][t] * load(from[t] + (3 * d + c) * stride + a);
        const Lanes strain = 0.5 * (y[0] * y[0] + y[1] * y[1] + y[2] * y[2] - 1);
        const Lanes excess = strain - select(strain < low, low, select(strain > high, high, strain));
        const Lanes force = load(k + a) * (excess + damping * (excess - load(before + a)));
        store(before + a, excess);
        for (int c = 0; c < 3; ++c) store(out + c * stride + a, force * y[c]);
      }
    }
  }

  [[gnu::noinline]] void move(int l, double kick, double drift) {
    const int n = length_;
    const std::ptrdiff_t stride = stride_;
    std::array<const double*, W> from;
    std::array<std::array<double, W>, 2> f{};
    for (int t = 0; t < W; ++t) {
      const int b = l - along_v_.shift - t;
      const bool there = t < along_v_.width && b >= 0 && b < along_v_.lines;
      from[t] = there ? in(force_, b) : nothing_.data();
      for (int d = 0; d < 2; ++d) f[d][t] = there ? along_v_.of(d, b, t) : 0;
    }
    double* const gathered = in(gathered_, l);
    for (int k = 0; k < 6; ++k)
      for (int a = 0; a < n; a += lane_count) {
        Lanes sum{};
        for (int t = 0; t < W; ++t) sum += f[k / 3][t] * load(from[t] + k * stride + a);
        store(gathered + k * stride + a, sum);
      }
    const double* const w = inverse_mass_.data() + l * stride + padding;
    const std::array<Table, 2> back{table(to_nodes_[0]), table(to_nodes_[1])};
    const double* const seen = gathered - shift_u_;
    std::array<double*, 3> x, v;
    std::array<const double*, 3> even;
    for (int c = 0; c < 3; ++c) x[c] = line(x_, l, c), v[c] = line(v_, l, c), even[c] = line(a_, l, c);
    for (int i = 0; i < n; i += lane_count) {
      std::array<Lanes, 3> pull{};
      for (int d = 0; d < 2; ++d)
        for (int s = 0; s < W; ++s) {
          const Lanes value = load(back[d][s] + i);
          for (int c = 0; c < 3; ++c) pull[c] += value * load(seen + (3 * d + c) * stride + i - s);
        }
      const Lanes each = load(w + i);
      for (int c = 0; c < 3; ++c) {
        const Lanes speed = load(v[c] + i) + kick * (load(even[c] + i) - each * pull[c]);
        store(v[c] + i, speed);
        store(x[c] + i, load(x[c] + i) + drift * speed);
      }
    }
  }

  NetRows net_;
  LineTable along_v_;
  std::vector<std::array<int, 2>> row_at_;
  int points_ = 0, length_ = 0, stride_ = 0, shift_u_ = 0, room_ = 0;
  std::map<int, int> of_node_, of_fixed_;
  std::array<std::array<Numbers, W>, 2> to_points_, to_nodes_;
  std::array<Slack, 2> slack_;
  std::array<Numbers, 2> stiffness_, before_;
  Numbers x_, v_, a_, inverse_mass_, profile_, force_, gathered_, nothing_;
};

}  // namespace

std::unique_ptr<RowKernel> general_kernel(const KernelInput& input, std::vector<int> which, std::vector<int> nodes) {
  return std::make_unique<GeneralKernel>(input, std::move(which), std::move(nodes));
}

std::unique_ptr<RowKernel> net_kernel(const KernelInput& input, const NetRows& net) {
  if (net.rows.empty()) return nullptr;
  std::map<int, int> place_of_node, place_of_fixed;
  for (std::size_t i = 0; i < net.node.size(); ++i) {
    if (net.node[i] < 0 && net.fixed[i] < 0) return nullptr;
    (net.node[i] >= 0 ? place_of_node[net.node[i]] : place_of_fixed[net.fixed[i]]) = static_cast<int>(i);
  }
  Reach u, v;
  u.set_lines(net.rows, 0);
  v.set_lines(net.rows, 1);
  const int points_u = u.lines(), points_v = v.lines();
  if (static_cast<std::size_t>(points_u) * static_cast<std::size_t>(points_v) > net.rows.size()) return nullptr;

  // Each row as entries on the net.
  std::vector<std::vector<Entry>> entries(net.rows.size());
  std::vector<std::array<int, 2>> at(static_cast<std::size_t>(points_u * points_v), {-1, -1});  // which of net.rows
  for (std::size_t k = 0; k < net.rows.size(); ++k) {
    const NetRows::Row& r = net.rows[k];
    const int a = u.line(r.uv.x()), b = v.line(r.uv.y());
    int& taken = at[static_cast<std::size_t>(a + points_u * b)][r.second];
    if (taken >= 0) return nullptr;
    taken = static_cast<int>(k);
    const auto add = [&](const CompressedRows& d, const std::map<int, int>& places) {
      for (int e = d.start[r.row]; e < d.start[r.row + 1]; ++e) {
        const auto it = places.find(d.column[e]);
        if (it == places.end()) return false;
        entries[k].push_back({it->second % net.count_u, it->second / net.count_u, d.value[e]});
        u.add(a, entries[k].back().i);
        v.add(b, entries[k].back().j);
      }
      return true;
    };
    if (!add(input.rows->free, place_of_node) || !add(input.rows->fixed, place_of_fixed)) return nullptr;
  }
  LineTable along_u = u.table(), along_v = v.table();
  const int width = std::max(along_u.width, along_v.width);
  if (width > widest || std::abs(along_u.shift) > farthest) return nullptr;

  for (int d = 0; d < 2; ++d) {
    const auto row = [&](int a, int b) { return at[static_cast<std::size_t>(a + points_u * b)][d]; };
    const int a0 = points_u / 2, b0 = points_v / 2;
    if (row(a0, b0) < 0 || entries[static_cast<std::size_t>(row(a0, b0))].empty()) return nullptr;
    const Entry peak = *std::ranges::max_element(entries[static_cast<std::size_t>(row(a0, b0))], {},
                                                 [](const Entry& e) { return std::abs(e.value); });
    for (int a = 0; a < points_u; ++a) {
      if (row(a, b0) < 0) return nullptr;
      for (const Entry& e : entries[static_cast<std::size_t>(row(a, b0))])
        if (e.j == peak.j) along_u.at(d, a, e.i) = e.value;
    }
    for (int b = 0; b < points_v; ++b) {
      if (row(a0, b) < 0) return nullptr;
      for (const Entry& e : entries[static_cast<std::size_t>(row(a0, b))])
        if (e.i == peak.i) along_v.at(d, b, e.j) = e.value / peak.value;
    }
  }
  for (std::size_t k = 0; k < net.rows.size(); ++k) {
    const NetRows::Row& r = net.rows[k];
    if (!is_product(entries[k], along_u, u.line(r.uv.x()), along_v, v.line(r.uv.y()), r.second)) return nullptr;
  }
  if (width <= 2) return std::make_unique<NetKernel<2>>(input, net, along_u, along_v, at);
  if (width <= 4) return std::make_unique<NetKernel<4>>(input, net, along_u, along_v, at);
  return std::make_unique<NetKernel<widest>>(input, net, along_u, along_v, at);
}

}  // namespace toile
