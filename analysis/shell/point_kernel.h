// SPDX-License-Identifier: GPL-3.0-or-later
// Energy, first and second derivatives of the shell at one material point, as functions of the derivatives of the
// deformed place with respect to the fabric's rest coordinates (weft = 1, warp = 2). Local numbers in, local numbers
// out; runs on double or Lanes.
//
//   x1, x2        tangents along weft and warp                                        [eq. 7]
//   x11, x22, x12 second derivatives, contracted as the paper transforms kappa        [eq. 4 ff.]
//   a3, j         unit normal and area stretch |x1 x x2|                              [eq. 2]
//   E11, E22, g12 Green-Lagrange strain, g12 = 2 E12 = x1.x2                          [eq. 3]
//   kappa_ab      a3 . x_ab                                                           [eq. 4]
//   S, m          stress resultants S = k E and moments                               [eqs. 8, 9]
//   guard         energy of bending cloth below s = j / crush = 1: b (1 - s)^2 / (2 s). Law (8) resists less and less
//                 once cloth is shorter than 1/sqrt(3) of itself, and without area there is no normal.
//
// The gradients below are eqs. (13) and (15) summed over their moments first: with M = sum m_ab x_ab and
// t = (M - (M.a3) a3) / j, the variation of sum m_ab kappa_ab is sum m_ab a3 . dx_ab + (x2 x t) . dx1 + (t x x1) . dx2.
#pragma once

#include "analysis/fabric/bending_law.h"
#include "analysis/fabric/membrane_law.h"
#include "analysis/shell/shell_model.h"

namespace toile {

template <class Real>
struct Vec3 {
  Real x, y, z;
};
template <class Real>
inline Vec3<Real> operator+(const Vec3<Real>& a, const Vec3<Real>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Real>
inline Vec3<Real> operator-(const Vec3<Real>& a, const Vec3<Real>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Real>
inline Vec3<Real> operator*(Real s, const Vec3<Real>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class Real>
inline Real dot(const Vec3<Real>& a, const Vec3<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
inline Vec3<Real> cross(const Vec3<Real>& a, const Vec3<Real>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

constexpr double crush = 0.5773502691896258;  // 1/sqrt(3)

// A fabric's laws as the kernels read them; parts that carry nothing are skipped.
struct PointLaw {
  explicit PointLaw(const Fabric& fabric)
      : membrane(fabric.membrane),
        twist(fabric.bending.twist),
        bending_coupling(fabric.bending.coupling),
        guard(std::max(membrane.weft, membrane.warp)),
        stretches(membrane.weft > 0 || membrane.warp > 0 || membrane.shear > 0),
        weft_warp_bending(fabric.bending.b0 > 0),
        bending(fabric.bending) {}
  Fabric::Membrane membrane;
  double twist, bending_coupling;
  double guard;  // N/m, b
  bool stretches, weft_warp_bending;
  BendingLaw bending;
  bool bends() const { return weft_warp_bending || twist > 0; }
  bool twists() const { return twist > 0; }
};

// Derivatives of a field of vectors; also gradients with respect to them. The second derivatives are read and written
// only where the law bends, x12 only where it twists.
template <class Real>
struct PointJet {
  Vec3<Real> x1, x2, x11, x22, x12;
};
template <class Real>
struct Curvature {
  Real k11, k22, k12;
};

template <class Real>
struct SurfaceNormal {
  Vec3<Real> a3;
  Real j, inverse_j;
};
template <class Real>
inline SurfaceNormal<Real> surface_normal(const PointJet<Real>& x) {
  const Vec3<Real> n = cross(x.x1, x.x2);
  const Real j2 = dot(n, n), inverse_j = 1.0 / sqrt(j2);
  return {inverse_j * n, j2 * inverse_j, inverse_j};
}

// Of the guard, with respect to j.
template <class Real>
struct GuardTerms {
  Real energy, slope, curvature;
};
template <class Real>
inline GuardTerms<Real> guard(const PointLaw& law, const SurfaceNormal<Real>& n) {
  const Real zero = broadcast<Real>(0), s = (1 / crush) * n.j, inverse = crush * n.inverse_j;
  const auto squeezed = s < 1.0;
  const double b = law.guard;
  return {select(squeezed, 0.5 * b * (s - 2.0 + inverse), zero),
          select(squeezed, 0.5 * b / crush * (1.0 - inverse * inverse), zero),
          select(squeezed, b / (crush * crush) * inverse * inverse * inverse, zero)};
}

// Energies, or parts of a quadratic form, and where they are energies the least and largest of E11 and E22.
template <class Real>
struct PointEnergy {
  Real membrane, bending, least, most;
};
template <class Real>
inline Real smaller(Real a, Real b) {
  return select(b < a, b, a);
}
template <class Real>
inline Real larger(Real a, Real b) {
  return select(b > a, b, a);
}

// Energy per rest area at x and its gradient g. Needs x1 and x2 independent.
template <class Real>
inline PointEnergy<Real> energy_gradient(const PointLaw& law, const PointJet<Real>& x, const Curvature<Real>& rest,
                                         PointJet<Real>& g) {
  PointEnergy<Real> energy{};
  const Vec3<Real> zero{energy.membrane, energy.membrane, energy.membrane};
  g.x1 = g.x2 = g.x11 = g.x22 = g.x12 = zero;
  if (law.stretches) {
    const Real E11 = 0.5 * (dot(x.x1, x.x1) - 1.0), E22 = 0.5 * (dot(x.x2, x.x2) - 1.0), g12 = dot(x.x1, x.x2);
    const auto [S11, S22, S12] = membrane_stress(law.membrane, E11, E22, g12);
    energy.membrane = 0.5 * (S11 * E11 + S22 * E22 + S12 * g12);
    energy.least = smaller(E11, E22);
    energy.most = larger(E11, E22);
    g.x1 = S11 * x.x1 + S12 * x.x2;
    g.x2 = S22 * x.x2 + S12 * x.x1;
  }
  if (law.bends()) {
    const SurfaceNormal<Real> n = surface_normal(x);
    Vec3<Real> M = zero;
    if (law.weft_warp_bending) {
      const Real k11 = dot(n.a3, x.x11) - rest.k11, k22 = dot(n.a3, x.x22) - rest.k22;
      BendingTerms<Real> weft = evaluate<Real>(law.bending, k11), warp = evaluate<Real>(law.bending, k22);
      energy.bending = weft.energy + warp.energy;
      if (law.bending_coupling != 0) {
        energy.bending += law.bending_coupling * k11 * k22;
        weft.moment = weft.moment + law.bending_coupling * k22;
        warp.moment = warp.moment + law.bending_coupling * k11;
      }
      M = weft.moment * x.x11 + warp.moment * x.x22;
      g.x11 = weft.moment * n.a3;
      g.x22 = warp.moment * n.a3;
    }
    if (law.twists()) {
      const Real k12 = dot(n.a3, x.x12) - rest.k12, m12 = 2.0 * law.twist * k12;
      energy.bending += 0.5 * m12 * k12;
      M = M + m12 * x.x12;
      g.x12 = m12 * n.a3;
    }
    const GuardTerms<Real> held = guard(law, n);
    energy.membrane += held.energy;
    const Vec3<Real> t = n.inverse_j * (M - dot(M, n.a3) * n.a3) + held.slope * n.a3;
    g.x1 = g.x1 + cross(x.x2, t);
    g.x2 = g.x2 + cross(t, x.x1);
  }
  return energy;
}

// dg: second derivative of the energy per rest area applied to the variation dx; the parts of dx . dg are returned.
template <class Real>
inline PointEnergy<Real> energy_hessian(const PointLaw& law, TangentKind kind, const PointJet<Real>& x,
                                        const Curvature<Real>& rest, const PointJet<Real>& dx, PointJet<Real>& dg) {
  PointEnergy<Real> work{};
  const Vec3<Real> zero{work.membrane, work.membrane, work.membrane};
  dg.x1 = dg.x2 = dg.x11 = dg.x22 = dg.x12 = zero;
  if (law.stretches) {
    const Real E11 = 0.5 * (dot(x.x1, x.x1) - 1.0), E22 = 0.5 * (dot(x.x2, x.x2) - 1.0);
    auto [S11, S22, S12] = membrane_stress(law.membrane, E11, E22, dot(x.x1, x.x2));
    const auto [dS11, dS22, dS12] =
        membrane_stress(law.membrane, dot(x.x1, dx.x1), dot(x.x2, dx.x2), dot(x.x1, dx.x2) + dot(x.x2, dx.x1));
    if (kind == TangentKind::upper) {
      // Positive part of the symmetric 2 x 2 stress: (f(a) - f(b)) / (a - b) and its companion with f = max(., 0).
      const Real mean = 0.5 * (S11 + S22), half = 0.5 * (S11 - S22), radius = sqrt(half * half + S12 * S12);
      const Real none = broadcast<Real>(0), largest = mean + radius, smallest = mean - radius;
      const Real high = select(largest > none, largest, none), low = select(smallest > none, smallest, none);
      const Real tiny = broadcast<Real>(1e-300);
      const Real ratio = 0.5 * (high - low) / select(radius > tiny, radius, tiny), middle = 0.5 * (high + low);
      S11 = middle + ratio * half;
      S22 = middle - ratio * half;
      S12 = ratio * S12;
    }
    dg.x1 = dS11 * x.x1 + dS12 * x.x2 + S11 * dx.x1 + S12 * dx.x2;
    dg.x2 = dS22 * x.x2 + dS12 * x.x1 + S22 * dx.x2 + S12 * dx.x1;
    work.membrane = dot(dx.x1, dg.x1) + dot(dx.x2, dg.x2);
  }
  if (law.bends()) {
    const SurfaceNormal<Real> n = surface_normal(x);
    const Vec3<Real> dn = cross(dx.x1, x.x2) + cross(x.x1, dx.x2);
    const Real dj = dot(n.a3, dn);
    const Vec3<Real> da3 = n.inverse_j * (dn - dj * n.a3);
    Vec3<Real> M = zero, dM = zero;
    const auto add = [&](Real m, Real dm, const Vec3<Real>& x_ab, const Vec3<Real>& dx_ab, Vec3<Real>& dg_ab) {
      M = M + m * x_ab;
      dM = dM + dm * x_ab + m * dx_ab;
      dg_ab = dm * n.a3 + m * da3;
    };
    if (law.weft_warp_bending) {
      const Real k11 = dot(n.a3, x.x11) - rest.k11, k22 = dot(n.a3, x.x22) - rest.k22;
      const Real dk11 = dot(n.a3, dx.x11) + dot(da3, x.x11), dk22 = dot(n.a3, dx.x22) + dot(da3, x.x22);
      const BendingTerms<Real> weft = evaluate<Real>(law.bending, k11), warp = evaluate<Real>(law.bending, k22);
      const double across = law.bending_coupling;
      if (across != 0) {
        add(weft.moment + across * k22, weft.slope * dk11 + across * dk22, x.x11, dx.x11, dg.x11);
        add(warp.moment + across * k11, warp.slope * dk22 + across * dk11, x.x22, dx.x22, dg.x22);
      } else {
        add(weft.moment, weft.slope * dk11, x.x11, dx.x11, dg.x11);
        add(warp.moment, warp.slope * dk22, x.x22, dx.x22, dg.x22);
      }
    }
    if (law.twists()) {
      const Real m12 = 2.0 * law.twist * (dot(n.a3, x.x12) - rest.k12);
      add(m12, 2.0 * law.twist * (dot(n.a3, dx.x12) + dot(da3, x.x12)), x.x12, dx.x12, dg.x12);
    }
    const Real along = dot(M, n.a3);
    const Vec3<Real> bent = n.inverse_j * (M - along * n.a3);
    // The guard's slope is negative, and so is what it subtracts where the normal turns.
    const GuardTerms<Real> held = guard(law, n);
    Vec3<Real> dt = n.inverse_j * (dM - (dot(dM, n.a3) + dot(M, da3)) * n.a3 - along * da3 - dj * bent) +
                    (held.curvature * dj) * n.a3;
    if (kind == TangentKind::exact) dt = dt + held.slope * da3;
    const Vec3<Real> t = bent + held.slope * n.a3;
    const Vec3<Real> b1 = cross(dx.x2, t) + cross(x.x2, dt), b2 = cross(dt, x.x1) + cross(t, dx.x1);
    work.bending = dot(dx.x1, b1) + dot(dx.x2, b2) + dot(dx.x11, dg.x11) + dot(dx.x22, dg.x22);
    if (law.twists()) work.bending += dot(dx.x12, dg.x12);
    dg.x1 = dg.x1 + b1;
    dg.x2 = dg.x2 + b2;
  }
  return work;
}

// TangentKind::positive: the membrane's stress as far as it is positive, of bending and guard what the slopes of their
// laws give. dg . dx >= 0 for every dx.
template <class Real>
inline void positive_hessian(const PointLaw& law, const PointJet<Real>& x, const Curvature<Real>& rest,
                             const PointJet<Real>& dx, PointJet<Real>& dg) {
  PointLaw membrane = law;
  membrane.weft_warp_bending = false;
  membrane.twist = 0;
  energy_hessian(membrane, TangentKind::upper, x, rest, dx, dg);
  if (!law.bends()) return;
  const SurfaceNormal<Real> n = surface_normal(x);
  const Vec3<Real> dn = cross(dx.x1, x.x2) + cross(x.x1, dx.x2);
  const Real dj = dot(n.a3, dn);
  const Vec3<Real> da3 = n.inverse_j * (dn - dj * n.a3);
  Vec3<Real> dM{};
  const auto add = [&](Real dm, const Vec3<Real>& x_ab, Vec3<Real>& dg_ab) {
    dM = dM + dm * x_ab;
    dg_ab = dm * n.a3;
  };
  const auto change = [&](const Vec3<Real>& x_ab, const Vec3<Real>& dx_ab) {
    return dot(n.a3, dx_ab) + dot(da3, x_ab);
  };
  if (law.weft_warp_bending) {
    const Real dk11 = change(x.x11, dx.x11), dk22 = change(x.x22, dx.x22);
    Real weft = evaluate<Real>(law.bending, dot(n.a3, x.x11) - rest.k11).slope * dk11;
    Real warp = evaluate<Real>(law.bending, dot(n.a3, x.x22) - rest.k22).slope * dk22;
    if (law.bending_coupling != 0) {
      weft = weft + law.bending_coupling * dk22;
      warp = warp + law.bending_coupling * dk11;
    }
    add(weft, x.x11, dg.x11);
    add(warp, x.x22, dg.x22);
  }
  if (law.twists()) add(2.0 * law.twist * change(x.x12, dx.x12), x.x12, dg.x12);
  const Vec3<Real> dt = n.inverse_j * (dM - dot(dM, n.a3) * n.a3) + (guard(law, n).curvature * dj) * n.a3;
  dg.x1 = dg.x1 + cross(x.x2, dt);
  dg.x2 = dg.x2 + cross(dt, x.x1);
}

}  // namespace toile
