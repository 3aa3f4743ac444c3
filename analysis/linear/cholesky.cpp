// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/linear/cholesky.h"

#include <cholmod.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "analysis/linear/pack.h"
#include "analysis/linear/supernodal_factor.h"
#include "geometry/error.h"

namespace toile {
namespace {

// An envelope whose rows are longer than this in mean square is slower than supernodes (tests/bench/README.md, "Sparse
// factor"): a square of some 1,800 rows, a strip or several panels of any size.
constexpr double longest_rows = 6000;

// Neighbours of each row, without itself.
std::vector<std::vector<int>> adjacency(const SparsePattern& pattern) {
  std::vector<std::vector<int>> near(pattern.size());
  for (int c = 0; c < pattern.size(); ++c)
    for (int e = pattern.column_start[c]; e < pattern.column_start[c + 1]; ++e)
      if (const int r = pattern.row[e]; r != c) near[r].push_back(c), near[c].push_back(r);
  for (auto& list : near) std::sort(list.begin(), list.end());
  return near;
}

// Breadth-first levels from `start` among rows not yet placed; appends to `order`.
void breadth_first(const std::vector<std::vector<int>>& near, int start, std::vector<char>& seen,
                   std::vector<int>& order) {
  std::size_t head = order.size();
  order.push_back(start);
  seen[start] = 1;
  while (head < order.size()) {
    const std::size_t first = order.size();
    for (int r : near[order[head++]])
      if (!seen[r]) seen[r] = 1, order.push_back(r);
    std::stable_sort(order.begin() + first, order.end(), [&](int a, int b) { return near[a].size() < near[b].size(); });
  }
}

// Reverse Cuthill-McKee: order[k] is the row that stands k-th. [Cuthill & McKee 1969; George & Liu 1979]
std::vector<int> reverse_cuthill_mckee(const SparsePattern& pattern) {
  const auto near = adjacency(pattern);
  const int n = pattern.size();
  std::vector<char> seen(n, 0);
  std::vector<int> order;
  for (int i = 0; i < n; ++i) {
    if (seen[i]) continue;
    // Two sweeps to the far end give a start near the rim of the component.
    int start = i;
    for (int sweep = 0; sweep < 2; ++sweep) {
      auto trial = seen;
      std::vector<int> levels;
      breadth_first(near, start, trial, levels);
      start = levels.back();
    }
    breadth_first(near, start, seen, order);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

// Where each row of the lower factor begins, in an order that keeps rows short.
struct EnvelopeShape {
  std::vector<int> order, place, first;  // order[k] is the row that stands k-th, place its inverse

  explicit EnvelopeShape(const SparsePattern& pattern) : order(reverse_cuthill_mckee(pattern)) {
    const int n = pattern.size();
    place.resize(n);
    for (int k = 0; k < n; ++k) place[order[k]] = k;
    first.resize(n);
    for (int k = 0; k < n; ++k) first[k] = k;
    for (int c = 0; c < n; ++c)
      for (int e = pattern.column_start[c]; e < pattern.column_start[c + 1]; ++e) {
        const auto [lo, hi] = std::minmax(place[c], place[pattern.row[e]]);
        first[hi] = std::min(first[hi], lo);
      }
  }
  int length(int k) const { return k - first[k] + 1; }
  double mean_square_length() const {
    double sum = 0;
    for (std::size_t k = 0; k < first.size(); ++k) sum += std::pow(length(static_cast<int>(k)), 2);
    return first.empty() ? 0 : sum / static_cast<double>(first.size());
  }
};

// Rows of the lower factor from their first nonzero to the diagonal, contiguous: short dot products without
// indirection, which is what systems of narrow band want.
class Envelope {
 public:
  Envelope(const SparsePattern& pattern, EnvelopeShape shape)
      : order_(std::move(shape.order)), first_(std::move(shape.first)) {
    const int n = pattern.size();
    start_.resize(n + 1, 0);
    for (int k = 0; k < n; ++k) start_[k + 1] = start_[k] + (k - first_[k] + 1);
    slot_.resize(pattern.row.size());
    for (int c = 0; c < n; ++c)
      for (int e = pattern.column_start[c]; e < pattern.column_start[c + 1]; ++e) {
        const auto [lo, hi] = std::minmax(shape.place[c], shape.place[pattern.row[e]]);
        slot_[e] = start_[hi] + lo - first_[hi];
      }
    factor_.resize(start_[n]);
    inverse_.resize(n);
    work_.resize(n);
    int longest = 0;
    for (int k = 0; k < n; ++k) longest = std::max(longest, k - first_[k] + 1);
    rows_.reserve(static_cast<std::size_t>(longest + lanes));
  }

  // Eight rows at a time, one per lane: the rows above are read once for all of them, and no sum runs across lanes.
  bool factorise(std::span<const double> values) {
    std::fill(factor_.begin(), factor_.end(), 0.0);
    for (std::size_t e = 0; e < slot_.size(); ++e) factor_[slot_[e]] = values[e];
    const int n = static_cast<int>(first_.size());
    for (int row = 0; row < n; row += lanes)
      if (!factorise_rows(row, std::min(lanes, n - row))) return false;
    return true;
  }

  void solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x) {
    const int n = static_cast<int>(first_.size());
    for (int i = 0; i < n; ++i) {
      const double* row = &factor_[start_[i]] - first_[i];
      work_[i] = (rhs[order_[i]] - dot(row + first_[i], &work_[first_[i]], i - first_[i])) * inverse_[i];
    }
    for (int i = n - 1; i >= 0; --i) {
      const double* row = &factor_[start_[i]] - first_[i];
      work_[i] *= inverse_[i];
      for (int j = first_[i]; j < i; ++j) work_[j] -= row[j] * work_[i];
    }
    for (int i = 0; i < n; ++i) x[order_[i]] = work_[i];
  }

  std::size_t nonzeros() const { return factor_.size(); }
  double operations() const {
    double sum = 0;
    for (int i = 0; i < static_cast<int>(first_.size()); ++i) {
      for (int j = first_[i]; j < i; ++j) sum += 2 * (j - std::max(first_[i], first_[j])) + 4;
      sum += 2;
    }
    return sum;
  }

 private:
  static constexpr int lanes = pack_lanes;

  // sum over [0, count) of x_k coefficient(k), in a fixed order of four sums that don't wait for each other.
  template <class Coefficient>
  static Pack combination(const Pack* x, int count, const Coefficient& coefficient) {
    Pack s0{}, s1{}, s2{}, s3{};
    int k = 0;
    for (; k + 4 <= count; k += 4) {
      s0.add_product(x[k], coefficient(k));
      s1.add_product(x[k + 1], coefficient(k + 1));
      s2.add_product(x[k + 2], coefficient(k + 2));
      s3.add_product(x[k + 3], coefficient(k + 3));
    }
    for (; k < count; ++k) s0.add_product(x[k], coefficient(k));
    s0 += s1;
    s2 += s3;
    s0 += s2;
    return s0;
  }

  bool factorise_rows(int begin, int count) {
    const int first = *std::min_element(first_.begin() + begin, first_.begin() + begin + count);
    const int columns = begin + count - first;
    rows_.assign(static_cast<std::size_t>(columns), Pack{});
    Pack* const x = rows_.data();  // columns from `first` on
    for (int l = 0; l < count; ++l) {
      const double* row = &factor_[start_[begin + l]];
      for (int j = first_[begin + l]; j <= begin + l; ++j) x[j - first].set(l, *row++);
    }
    for (int j = first; j < begin; ++j) {
      const int from = std::max(first, first_[j]);
      const double* other = &factor_[start_[j]] + (from - first_[j]);
      const Pack sum = combination(x + (from - first), j - from, [&](int k) { return other[k]; });
      x[j - first] -= sum;
      x[j - first] *= inverse_[j];
    }
    for (int l = 0; l < count; ++l) {
      const int j = begin + l;
      const Pack sum = combination(x, j - first, [&](int k) { return x[k][l]; });
      x[j - first] -= sum;
      const double pivot = x[j - first][l];
      if (!(pivot > 0)) return false;
      inverse_[j] = 1 / std::sqrt(pivot);
      x[j - first] *= inverse_[j];  // lanes of rows above l hold nothing that is read
    }
    for (int l = 0; l < count; ++l) {
      double* row = &factor_[start_[begin + l]];
      for (int j = first_[begin + l]; j <= begin + l; ++j) *row++ = x[j - first][l];
    }
    return true;
  }

  // Four partial sums in a fixed order: vectorises, and gives the same bits whatever the alignment.
  static double dot(const double* a, const double* b, int n) {
    double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    int k = 0;
    for (; k + 4 <= n; k += 4) {
      s0 += a[k] * b[k];
      s1 += a[k + 1] * b[k + 1];
      s2 += a[k + 2] * b[k + 2];
      s3 += a[k + 3] * b[k + 3];
    }
    for (; k < n; ++k) s0 += a[k] * b[k];
    return (s0 + s1) + (s2 + s3);
  }

  std::vector<int> order_, first_, start_, slot_;
  std::vector<double> factor_, inverse_;
  std::vector<Pack> rows_;
  std::vector<double> work_;
};

// Order and supernodes, by CHOLMOD and METIS.
class Analysis {
 public:
  explicit Analysis(SparsePattern& pattern) {
    cholmod_start(&common_);
    common_.print = 0;
    common_.error_handler = nullptr;
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_METIS;
    common_.postorder = 1;

    cholmod_sparse matrix = view(pattern);
    factor_ = cholmod_analyze(&matrix, &common_);
    if (!factor_) {
      cholmod_finish(&common_);
      throw SolverError("sparse factorisation: the pattern could not be analysed (out of memory?)");
    }
  }
  Analysis(const Analysis&) = delete;
  Analysis& operator=(const Analysis&) = delete;
  ~Analysis() {
    cholmod_free_factor(&factor_, &common_);
    cholmod_finish(&common_);
  }

  SupernodalShape shape() const {
    const auto list = [](const void* p, std::size_t n) {
      return std::vector<int>(static_cast<const int*>(p), static_cast<const int*>(p) + n);
    };
    return {list(factor_->super, factor_->nsuper + 1), list(factor_->pi, factor_->nsuper + 1),
            list(factor_->s, factor_->ssize), list(factor_->Perm, factor_->n)};
  }
  // Entries of each column of the factor.
  std::span<const int> counts() const { return {static_cast<const int*>(factor_->ColCount), factor_->n}; }

 protected:
  static cholmod_sparse view(SparsePattern& pattern) {
    cholmod_sparse matrix = {};
    matrix.nrow = matrix.ncol = static_cast<std::size_t>(pattern.size());
    matrix.nzmax = pattern.row.size();
    matrix.p = pattern.column_start.data();
    matrix.i = pattern.row.data();
    matrix.stype = -1;
    matrix.itype = CHOLMOD_INT;
    matrix.xtype = CHOLMOD_PATTERN;
    matrix.dtype = CHOLMOD_DOUBLE;
    matrix.sorted = matrix.packed = 1;
    return matrix;
  }

  cholmod_common common_ = {};
  cholmod_factor* factor_ = nullptr;
};

// Its numbers too.
class CholmodFactor : public Analysis {
 public:
  explicit CholmodFactor(SparsePattern pattern) : Analysis(pattern), pattern_(std::move(pattern)) {
    common_.quick_return_if_not_posdef = 1;
  }

  bool factorise(std::span<const double> values) {
    values_.assign(values.begin(), values.end());
    cholmod_sparse matrix = view(pattern_);
    matrix.xtype = CHOLMOD_REAL;
    matrix.x = values_.data();
    return cholmod_factorize(&matrix, factor_, &common_) != 0 && common_.status == CHOLMOD_OK &&
           factor_->minor == factor_->n;
  }

  void solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x) {
    work_ = rhs;
    cholmod_dense b = {};
    b.nrow = b.nzmax = b.d = static_cast<std::size_t>(work_.size());
    b.ncol = 1;
    b.x = work_.data();
    b.xtype = CHOLMOD_REAL;
    b.dtype = CHOLMOD_DOUBLE;
    cholmod_dense* solution = cholmod_solve(CHOLMOD_A, factor_, &b, &common_);
    if (!solution) throw SolverError("sparse factorisation: CHOLMOD could not solve (out of memory?)");
    x = Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(solution->x), x.size());
    cholmod_free_dense(&solution, &common_);
  }

 private:
  SparsePattern pattern_;
  std::vector<double> values_;
  Eigen::VectorXd work_;
};

}  // namespace

struct Cholesky::Impl {
  std::unique_ptr<Envelope> envelope;
  std::unique_ptr<SupernodalFactor> supernodal;
  std::unique_ptr<CholmodFactor> cholmod;
  Workers* workers = nullptr;
  std::size_t values = 0, nonzeros = 0;
  double operations = 0;
};

CholeskyNumbers default_numbers() {
#ifdef TOILE_CHOLMOD_SOLVES
  return CholeskyNumbers::cholmod;
#else
  return CholeskyNumbers::ours;
#endif
}

Cholesky::Cholesky(SparsePattern pattern, CholeskyNumbers numbers) : impl_(std::make_unique<Impl>()) {
  impl_->values = pattern.row.size();
  if (EnvelopeShape shape(pattern); numbers == CholeskyNumbers::ours && shape.mean_square_length() <= longest_rows) {
    impl_->envelope = std::make_unique<Envelope>(pattern, std::move(shape));
    impl_->nonzeros = impl_->envelope->nonzeros();
    impl_->operations = impl_->envelope->operations();
    return;
  }
  const auto count_up = [&](const Analysis& analysis) {
    for (const int count : analysis.counts()) {
      impl_->nonzeros += static_cast<std::size_t>(count);
      impl_->operations += static_cast<double>(count) * count;
    }
  };
  if (numbers == CholeskyNumbers::cholmod) {
    impl_->cholmod = std::make_unique<CholmodFactor>(std::move(pattern));
    count_up(*impl_->cholmod);
    return;
  }
  const Analysis analysis(pattern);
  count_up(analysis);
  impl_->supernodal = std::make_unique<SupernodalFactor>(analysis.shape(), pattern.column_start, pattern.row);
}
Cholesky::~Cholesky() = default;
Cholesky::Cholesky(Cholesky&&) noexcept = default;
Cholesky& Cholesky::operator=(Cholesky&&) noexcept = default;

bool Cholesky::factorise(std::span<const double> values) {
  assert(values.size() == impl_->values);
  if (impl_->cholmod) return impl_->cholmod->factorise(values);
  return impl_->envelope ? impl_->envelope->factorise(values) : impl_->supernodal->factorise(values, impl_->workers);
}

void Cholesky::solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x) {
  if (impl_->cholmod) return impl_->cholmod->solve(rhs, x);
  impl_->envelope ? impl_->envelope->solve(rhs, x) : impl_->supernodal->solve(rhs, x, impl_->workers);
}

void Cholesky::use_threads(Workers* workers) {
  impl_->workers = workers;
}

std::size_t Cholesky::factor_nonzeros() const {
  return impl_->nonzeros;
}

double Cholesky::factor_operations() const {
  return impl_->operations;
}

}  // namespace toile
