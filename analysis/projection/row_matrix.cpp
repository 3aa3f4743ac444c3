// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/row_matrix.h"

#include <algorithm>
#include <cmath>

namespace toile {
namespace {

// visit(node, node of equal or larger number), row by row.
template <class Visit>
void for_pairs(const CompressedRows& rows, Visit visit) {
  for (int r = 0; r < rows.size(); ++r)
    for (int p = rows.start[r]; p < rows.start[r + 1]; ++p)
      for (int q = p; q < rows.start[r + 1]; ++q) visit(rows.column[p], rows.column[q]);
}

SymmetricBlock inverse(const SymmetricBlock& b) {
  SymmetricBlock c{b.yy * b.zz - b.yz * b.yz, b.xx * b.zz - b.xz * b.xz, b.xx * b.yy - b.xy * b.xy,
                   b.xz * b.yz - b.xy * b.zz, b.xy * b.yz - b.xz * b.yy, b.xy * b.xz - b.xx * b.yz};
  const double per = 1 / (b.xx * c.xx + b.xy * c.xy + b.xz * c.xz);
  for (double* x : {&c.xx, &c.yy, &c.zz, &c.xy, &c.xz, &c.yz}) *x *= per;
  return c;
}

void multiply(const SymmetricBlock& b, const double* v, double* out) {
  const double x = v[0], y = v[1], z = v[2];
  out[0] = b.xx * x + b.xy * y + b.xz * z;
  out[1] = b.xy * x + b.yy * y + b.yz * z;
  out[2] = b.xz * x + b.yz * y + b.zz * z;
}

}  // namespace

RowMatrix::RowMatrix(const CompressedRows& rows, const Eigen::VectorXd& mass, const BlockPattern* added)
    : blocks(static_cast<std::size_t>(rows.size())),
      rows_(&rows),
      mass_(&mass),
      at_node_(transposed_by_mass(rows, Eigen::VectorXd::Ones(mass.size()))),
      inverse_(static_cast<std::size_t>(mass.size())),
      of_row_(3, rows.size()) {
  if (mass.size() == 0) return;
  for (int r = 0; r < rows.size(); ++r) {
    double sum = 0, size = 0;
    for (int e = rows.start[r]; e < rows.start[r + 1]; ++e) sum += rows.value[e], size += std::abs(rows.value[e]);
    free_ = free_ && std::abs(sum) <= 1e-10 * size;
  }
  make_pattern(added);
  factor_ = std::make_unique<Cholesky>(pattern_);
  for (Eigen::VectorXd* v : {&residual_, &scaled_, &direction_, &image_}) v->resize(3 * mass.size());
}

void RowMatrix::make_pattern(const BlockPattern* added) {
  const int nodes = static_cast<int>(mass_->size());
  std::vector<std::vector<int>> near(
      static_cast<std::size_t>(nodes));  // itself and larger numbers with a row in common
  for (int j = 0; j < nodes; ++j) near[j].push_back(j);
  for_pairs(*rows_, [&](int first, int second) { near[first].push_back(second); });
  for (int j = 0; added && j < nodes; ++j) near[j].insert(near[j].end(), added->rows(j).begin(), added->rows(j).end());
  pattern_.column_start.push_back(0);
  for (int j = 0; j < nodes; ++j) {
    std::sort(near[j].begin(), near[j].end());
    near[j].erase(std::unique(near[j].begin(), near[j].end()), near[j].end());
    for (int b = 0; b < 3; ++b) {
      for (const int i : near[j])
        for (int a = i == j ? b : 0; a < 3; ++a) pattern_.row.push_back(3 * i + a);
      pattern_.column_start.push_back(static_cast<int>(pattern_.row.size()));
    }
  }
  const auto below = [&](int column, int row) {
    return static_cast<int>(std::ranges::lower_bound(near[column], row) - near[column].begin());
  };
  for_pairs(*rows_, [&](int first, int second) { below_.push_back(below(first, second)); });
  for (int j = 0; added && j < nodes; ++j)
    for (const int i : added->rows(j)) added_below_.push_back(below(j, i));
  values_.resize(pattern_.row.size());
}

void RowMatrix::spread(const Eigen::Matrix3Xd& w, Eigen::Ref<Eigen::VectorXd> to) const {
  share_out(workers_, static_cast<int>(mass_->size()), [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      double s0 = 0, s1 = 0, s2 = 0;
      for (int e = at_node_.start[k]; e < at_node_.start[k + 1]; ++e) {
        const double* of_row = w.data() + 3 * static_cast<std::ptrdiff_t>(at_node_.column[e]);
        const double d = at_node_.value[e];
        s0 += d * of_row[0], s1 += d * of_row[1], s2 += d * of_row[2];
      }
      double* out = to.data() + 3 * static_cast<std::ptrdiff_t>(k);
      out[0] += s0, out[1] += s1, out[2] += s2;
    }
  });
}

void RowMatrix::gather(const Eigen::Ref<const Eigen::VectorXd>& v, Eigen::Matrix3Xd& out) const {
  share_out(workers_, rows_->size(), [&](int begin, int end) {
    for (int r = begin; r < end; ++r) {
      double s0 = 0, s1 = 0, s2 = 0;
      for (int e = rows_->start[r]; e < rows_->start[r + 1]; ++e) {
        const double* of_node = v.data() + 3 * static_cast<std::ptrdiff_t>(rows_->column[e]);
        const double d = rows_->value[e];
        s0 += d * of_node[0], s1 += d * of_node[1], s2 += d * of_node[2];
      }
      double* to = out.data() + 3 * static_cast<std::ptrdiff_t>(r);
      to[0] = s0, to[1] = s1, to[2] = s2;
    }
  });
}

void RowMatrix::fill(const BlockMatrix* added) {
  std::fill(values_.begin(), values_.end(), 0.0);
  // Column b of the block that many below a node's own, its row 0 (in the own block, rows from b on).
  const auto column = [&](int node, int lower, int b) {
    return values_.data() + pattern_.column_start[3 * node + b] + 3 * lower - b;
  };
  for (int k = 0; k < mass_->size(); ++k)
    for (int a = 0; a < 3; ++a) column(k, 0, a)[a] = scale * (*mass_)[k];
  const CompressedRows& d = *rows_;
  const int* below = below_.data();
  for (int r = 0; r < d.size(); ++r) {
    const SymmetricBlock& b = blocks[r];
    if (b.zero()) {
      const int n = d.start[r + 1] - d.start[r];
      below += n * (n + 1) / 2;
      continue;
    }
    for (int p = d.start[r]; p < d.start[r + 1]; ++p)
      for (int q = p; q < d.start[r + 1]; ++q, ++below) {
        const double w = d.value[p] * d.value[q];
        double* const x = column(d.column[p], *below, 0);
        double* const y = column(d.column[p], *below, 1);
        double* const z = column(d.column[p], *below, 2);
        x[0] += w * b.xx, x[1] += w * b.xy, x[2] += w * b.xz;
        if (p != q) y[0] += w * b.xy, z[0] += w * b.xz, z[1] += w * b.yz;
        y[1] += w * b.yy, y[2] += w * b.yz, z[2] += w * b.zz;
      }
  }
  for (int j = 0; added && j < mass_->size(); ++j)
    for (int slot = added->pattern().first_slot(j); slot < added->pattern().first_slot(j + 1); ++slot) {
      const double* const block = added->block(slot);
      for (int b = 0; b < 3; ++b) {
        double* const to = column(j, added_below_[slot], b);
        for (int a = added_below_[slot] == 0 ? b : 0; a < 3; ++a) to[a] += block[3 * a + b];
      }
    }
}

bool RowMatrix::factorise(const BlockMatrix* added) {
  fill(added);
  positive_ = true;
  return factor_->factorise(values_);
}

std::optional<int> RowMatrix::factorise_any(const BlockMatrix* added) {
  if (factorise(added)) return 0;
  if (!indefinite_) indefinite_ = std::make_unique<IndefiniteFactor>(pattern_);
  positive_ = false;
  return indefinite_->factorise(values_);
}

double own_compliance(const CompressedRows& rows, int row, const Eigen::VectorXd& stiffness,
                      const BlockMatrix& blocks) {
  double sum = 0;
  for (int e = rows.start[row]; e < rows.start[row + 1]; ++e) {
    const double* const own = blocks.block(blocks.pattern().first_slot(rows.column[e]));
    sum += rows.value[e] * rows.value[e] / (stiffness[rows.column[e]] + std::max({own[0], own[4], own[8]}));
  }
  return sum;
}

double RowMatrix::stiffening() const {
  double sum = 0;
  for (int k = 0; k < mass_->size(); ++k) {
    double own = 0;
    for (int e = at_node_.start[k]; e < at_node_.start[k + 1]; ++e)
      own += at_node_.value[e] * at_node_.value[e] * blocks[at_node_.column[e]].trace();
    sum += own / (*mass_)[k];
  }
  return mass_->size() > 0 ? sum / (scale * static_cast<double>(mass_->size())) : 0;
}

void RowMatrix::invert_nodes() {
  share_out(workers_, static_cast<int>(mass_->size()), [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const double m = scale * (*mass_)[k];
      SymmetricBlock own{m, m, m};
      for (int e = at_node_.start[k]; e < at_node_.start[k + 1]; ++e) {
        const double w = at_node_.value[e] * at_node_.value[e];
        const SymmetricBlock& b = blocks[at_node_.column[e]];
        own.xx += w * b.xx, own.yy += w * b.yy, own.zz += w * b.zz;
        own.xy += w * b.xy, own.xz += w * b.xz, own.yz += w * b.yz;
      }
      inverse_[k] = inverse(own);
    }
  });
}

void RowMatrix::apply(const Eigen::VectorXd& v, Eigen::VectorXd& out) {
  share_out(workers_, rows_->size(), [&](int begin, int end) {
    for (int r = begin; r < end; ++r) {
      double s[3] = {0, 0, 0};
      for (int e = rows_->start[r]; e < rows_->start[r + 1]; ++e) {
        const double* of_node = v.data() + 3 * static_cast<std::ptrdiff_t>(rows_->column[e]);
        const double d = rows_->value[e];
        s[0] += d * of_node[0], s[1] += d * of_node[1], s[2] += d * of_node[2];
      }
      multiply(blocks[r], s, of_row_.data() + 3 * static_cast<std::ptrdiff_t>(r));
    }
  });
  for (int k = 0; k < mass_->size(); ++k) out.segment<3>(3 * k) = (scale * (*mass_)[k]) * v.segment<3>(3 * k);
  spread(of_row_, out);
}

bool RowMatrix::conjugate_gradients(const Eigen::VectorXd& rhs, Eigen::VectorXd& x, double tolerance, int most) {
  invert_nodes();
  const auto precondition = [&] {
    for (int k = 0; k < mass_->size(); ++k) multiply(inverse_[k], residual_.data() + 3 * k, scaled_.data() + 3 * k);
  };
  residual_ = rhs;
  precondition();
  const double enough = tolerance * tolerance * residual_.dot(scaled_);
  apply(x, image_);
  residual_ -= image_;
  precondition();
  direction_ = scaled_;
  double size = residual_.dot(scaled_);
  for (int k = 0; size > enough; ++k) {
    if (k == most) return false;
    apply(direction_, image_);
    const double step = size / direction_.dot(image_);
    x += step * direction_;
    residual_ -= step * image_;
    precondition();
    const double next = residual_.dot(scaled_);
    direction_ = scaled_ + next / size * direction_;
    size = next;
  }
  if (free_) {
    const Eigen::Vector3d left = residual_.reshaped(3, mass_->size()).rowwise().sum() / (scale * mass_->sum());
    for (int k = 0; k < mass_->size(); ++k) x.segment<3>(3 * k) += left;
  }
  return std::isfinite(size);
}

void RowMatrix::use_threads(Workers* workers) {
  if (factor_) factor_->use_threads(workers);
  workers_ = workers;
}

}  // namespace toile
