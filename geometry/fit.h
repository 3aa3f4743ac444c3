// SPDX-License-Identifier: GPL-3.0-or-later
// A control net fitted to scattered points of a surface whose parameters are known.
#pragma once

#include <Eigen/Core>
#include <span>

#include "geometry/nurbs_surface.h"

namespace toile {

struct FitSample {
  double u = 0, v = 0;
  Eigen::Vector3d x{0, 0, 0};  // where the material point (u, v) is, unit of the net
  double weight = 1;           // positive: area of cloth that the sample stands for, for instance
};

struct FitOptions {
  // Weight of the net's second differences against the samples, both scaled to unit mean diagonal. Small, so that
  // samples decide wherever there are some; the net continues smoothly where there are none.
  double smoothing = 1e-7;
  int rounds = 20;  // most repetitions, each fitting what the last left over
};

struct NetFit {
  NurbsSurface surface;              // knots and weights of the given one, net fitted
  double rms = 0, largest = 0;       // distance of samples from their places on it, unit of the net
  Eigen::Vector2d largest_at{0, 0};  // (u, v)
  int rounds = 0;                    // taken
  int without_samples = 0;           // control points whose functions vanish on all samples: smooth extension
};

// Least squares [Piegl & Tiller 1997, 9.4] in the space of the given surface's functions, rational ones included; trims
// play no part and stay valid. Its net is where the fit starts, so a net that fits already comes back. An affine image
// of the given net is reproduced everywhere, any surface of the space where samples determine it. Repeated regularised
// fits [Tikhonov, iterated] leave no bias there. Throws GeometryError for samples that aren't finite or lie outside the
// domain, weights that aren't positive, and for samples on one line of the parameter plane, which determine no net.
NetFit fit_net(const NurbsSurface& surface, std::span<const FitSample> samples, const FitOptions& options = {});

}  // namespace toile
