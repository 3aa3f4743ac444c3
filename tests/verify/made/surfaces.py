# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces as the IGES standard defines them: a formula of the file's own parameters, and the record that says it.

Every surface has at(u, v), its domain (u0, u1, v0, v1), breaks (where it is less smooth) and write(writer). Formulas
take complex numbers, so that derivatives come from a complex step and lose no digits.
"""

import cmath
import math


def combine(points, factors):
    return tuple(sum(f * p[k] for f, p in zip(factors, points)) for k in range(3))


def add(a, b, factor=1):
    return tuple(x + factor * y for x, y in zip(a, b))


# ---- curves: at(t), domain (a, b), write(writer) ----


class Line:
    def __init__(self, a, b):
        self.a, self.b, self.domain, self.breaks = a, b, (0.0, 1.0), []

    def at(self, t):
        return add(self.a, add(self.b, self.a, -1), t)

    def write(self, w):
        return w.add(110, [*map(float, self.a), *map(float, self.b)], status="00010000")


class Arc:
    """In the plane z = height, from an angle to another; its parameter is the angle."""

    def __init__(self, centre, radius, start, end, height=0.0):
        self.centre, self.radius, self.domain, self.height, self.breaks = centre, radius, (start, end), height, []

    def at(self, t):
        return (self.centre[0] + self.radius * cmath.cos(t), self.centre[1] + self.radius * cmath.sin(t), self.height)

    def write(self, w):
        a, b = (self.at(t) for t in self.domain)
        return w.add(100, [float(self.height), *map(float, self.centre), a[0].real, a[1].real, b[0].real, b[1].real],
                     status="00010000")


def basis(degree, knots, t):
    """The first function that isn't zero at t, and the degree + 1 values from there. [de Boor 1972]"""
    count = len(knots) - degree - 1
    x = t.real
    span = degree
    while span + 1 < count and knots[span + 1] <= x:
        span += 1
    values = [1.0]
    for p in range(1, degree + 1):
        raised = [0.0] * (p + 1)
        for k in range(p):
            left, right = knots[span - p + 1 + k], knots[span + 1 + k]
            share = (t - left) / (right - left)
            raised[k] += values[k] * (1 - share)
            raised[k + 1] += values[k] * share
        values = raised
    return span - degree, values


class Spline:
    def __init__(self, degree, knots, points, weights=None):
        self.degree, self.knots, self.points = degree, knots, points
        self.weights = weights or [1.0] * len(points)
        self.domain = (knots[degree], knots[len(points)])
        self.breaks = sorted(set(k for k in knots if self.domain[0] < k < self.domain[1]))

    def at(self, t):
        first, values = basis(self.degree, self.knots, t)
        values = [f * self.weights[first + k] for k, f in enumerate(values)]
        total = sum(values)
        x = combine(self.points[first:first + len(values)], values)
        return tuple(c / total for c in x)

    def write(self, w, status="00010000"):
        polynomial = int(len(set(self.weights)) == 1)
        return w.add(126, [len(self.points) - 1, self.degree, 0, 0, polynomial, 0, *map(float, self.knots),
                           *map(float, self.weights), *(float(c) for p in self.points for c in p),
                           *map(float, self.domain), 0.0, 0.0, 1.0], status=status)


# ---- surfaces ----


class SplineSurface:  # 128
    def __init__(self, degrees, knots, points, weights=None):
        """points[j][i], v by v."""
        self.degrees, self.knots, self.points = degrees, knots, points
        self.weights = weights or [[1.0] * len(row) for row in points]
        nu, nv = len(points[0]), len(points)
        self.domain = (knots[0][degrees[0]], knots[0][nu], knots[1][degrees[1]], knots[1][nv])
        self.breaks = [sorted(set(k for k in knots[d] if self.domain[2 * d] < k < self.domain[2 * d + 1]))
                       for d in range(2)]

    def at(self, u, v):
        i, fu = basis(self.degrees[0], self.knots[0], u)
        j, fv = basis(self.degrees[1], self.knots[1], v)
        x, total = (0.0, 0.0, 0.0), 0.0
        for b, g in enumerate(fv):
            for a, f in enumerate(fu):
                share = f * g * self.weights[j + b][i + a]
                total += share
                x = add(x, self.points[j + b][i + a], share)
        return tuple(c / total for c in x)

    def write(self, w, matrix=0):
        flat = [x for row in self.weights for x in row]
        return w.add(128, [len(self.points[0]) - 1, len(self.points) - 1, *self.degrees, 0, 0,
                           int(len(set(flat)) == 1), 0, 0, *(float(k) for knots in self.knots for k in knots), *flat,
                           *(float(c) for row in self.points for p in row for c in p),
                           *map(float, self.domain)], matrix=matrix, status="00010000")


class Analytic:
    """190 to 198 about an axis; counts degrees (the standard) or radians (most exporters)."""

    def __init__(self, kind, radius=0.0, second=0.0, degrees=True, origin=(3.0, -2.0, 5.0)):
        self.kind, self.radius, self.second, self.origin = kind, radius, second, origin
        self.unit = math.pi / 180 if degrees else 1.0
        self.breaks = [[], []]
        turn = 2 * math.pi / self.unit
        self.domain = {190: (0.0, 40.0, 0.0, 30.0), 192: (0.0, turn, 0.0, 50.0), 194: (0.0, turn, 0.0, 20.0),
                       196: (0.0, turn, -turn / 4, turn / 4), 198: (0.0, turn, 0.0, turn)}[kind]

    def local(self, u, v):
        if self.kind == 190:
            return (u, v, 0.0)
        a = u * self.unit
        if self.kind == 192:
            r, z = self.radius, v
        elif self.kind == 194:
            r, z = self.radius + v * math.tan(math.radians(self.second)), v
        elif self.kind == 196:
            r, z = self.radius * cmath.cos(v * self.unit), self.radius * cmath.sin(v * self.unit)
        else:
            r = self.radius + self.second * cmath.cos(v * self.unit)
            z = self.second * cmath.sin(v * self.unit)
        return (r * cmath.cos(a), r * cmath.sin(a), z)

    # The axis is y, the reference direction z: a right-handed frame that is not the world's.
    def at(self, u, v):
        x, y, z = self.local(u, v)
        return add(self.origin, (y, z, x))

    def write(self, w, matrix=0):
        place = w.add(116, [*map(float, self.origin), 0], status="00010000")
        axis = w.add(123, [0.0, 1.0, 0.0], status="00010000")
        reference = w.add(123, [0.0, 0.0, 1.0], status="00010000")
        values = {190: [place, axis, reference], 192: [place, axis, float(self.radius), reference],
                  194: [place, axis, float(self.radius), float(self.second), reference],
                  196: [place, float(self.radius), axis, reference],
                  198: [place, axis, float(self.radius), float(self.second), reference]}[self.kind]
        return w.add(self.kind, values, form=1, matrix=matrix, status="00010000")


class Revolution:  # 120
    def __init__(self, axis, generatrix, start, end):
        self.axis, self.generatrix, self.angles = axis, generatrix, (start, end)
        self.domain = (*generatrix.domain, start, end)
        self.breaks = [list(generatrix.breaks), []]

    def at(self, u, v):
        origin = self.axis[0]
        way = add(self.axis[1], origin, -1)
        length = math.sqrt(sum(c * c for c in way))
        z = tuple(c / length for c in way)
        p = add(self.generatrix.at(u), origin, -1)
        height = sum(a * b for a, b in zip(p, z))
        x = add(p, z, -height)
        y = (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0])
        out = add(origin, z, height)
        return add(add(out, x, cmath.cos(v)), y, cmath.sin(v))

    def write(self, w, matrix=0):
        axis = Line(*self.axis).write(w)
        return w.add(120, [axis, self.generatrix.write(w), *map(float, self.angles)], matrix=matrix, status="00010000")


class Tabulated:  # 122
    def __init__(self, directrix, way):
        self.directrix, self.way, self.domain = directrix, way, (0.0, 1.0, 0.0, 1.0)
        a, b = directrix.domain
        self.breaks = [[(t - a) / (b - a) for t in directrix.breaks], []]

    def at(self, u, v):
        a, b = self.directrix.domain
        return add(self.directrix.at(a + (b - a) * u), self.way, v)

    def write(self, w, matrix=0):
        end = add(self.directrix.at(self.directrix.domain[0]), self.way)
        return w.add(122, [self.directrix.write(w), *(complex(c).real for c in end)], matrix=matrix, status="00010000")


class Ruled:  # 118 form 1: equal parameters are joined
    def __init__(self, first, second, reverse=False):
        self.first, self.second, self.reverse, self.domain = first, second, reverse, (0.0, 1.0, 0.0, 1.0)
        self.breaks = [[], []]

    def at(self, u, v):
        a, b = self.first.domain
        c, d = self.second.domain
        p = self.first.at(a + (b - a) * u)
        q = self.second.at(d + (c - d) * u if self.reverse else c + (d - c) * u)
        return add(add((0, 0, 0), p, 1 - v), q, v)

    def write(self, w, matrix=0):
        return w.add(118, [self.first.write(w), self.second.write(w), int(self.reverse), 0], form=1, matrix=matrix,
                     status="00010000")


class PowerSurface:  # 114: cubic patches in powers of the distance from their breakpoints
    def __init__(self, u, v, patches):
        """patches[i][j][axis][power of t][power of s]"""
        self.u, self.v, self.patches = u, v, patches
        self.domain = (u[0], u[-1], v[0], v[-1])
        self.breaks = [list(u[1:-1]), list(v[1:-1])]

    def at(self, u, v):
        i = max(k for k in range(len(self.u) - 1) if k == 0 or self.u[k] <= u.real)
        j = max(k for k in range(len(self.v) - 1) if k == 0 or self.v[k] <= v.real)
        s, t = u - self.u[i], v - self.v[j]
        return tuple(sum(c[b][a] * s**a * t**b for b in range(4) for a in range(4)) for c in self.patches[i][j])

    def write(self, w, matrix=0):
        m, n = len(self.u) - 1, len(self.v) - 1
        nothing = [[[0.0] * 4] * 4] * 3
        flat = []
        for i in range(m + 1):
            for j in range(n + 1):
                patch = self.patches[i][j] if i < m and j < n else nothing
                flat += [float(c) for axis in patch for row in axis for c in row]
        return w.add(114, [3, 1, m, n, *map(float, self.u), *map(float, self.v), *flat], matrix=matrix,
                     status="00010000")


class Offset:  # 140 of another surface
    def __init__(self, base, distance):
        self.base, self.distance = base, distance
        self.domain, self.breaks = base.domain, base.breaks

    def normal(self, u, v):
        # Central differences of the sixth order: complex steps can't be nested.
        def slope(f, h):
            return tuple((45 * (a - b) - 9 * (c - d) + (e - g)) / (60 * h) for a, b, c, d, e, g in
                         zip(f(h), f(-h), f(2 * h), f(-2 * h), f(3 * h), f(-3 * h)))
        width = min(self.domain[1] - self.domain[0], self.domain[3] - self.domain[2])
        su = slope(lambda h: self.base.at(u + h, v), 1e-3 * width)
        sv = slope(lambda h: self.base.at(u, v + h), 1e-3 * width)
        n = (su[1] * sv[2] - su[2] * sv[1], su[2] * sv[0] - su[0] * sv[2], su[0] * sv[1] - su[1] * sv[0])
        length = cmath.sqrt(sum(c * c for c in n))
        return tuple(c / length for c in n)

    def at(self, u, v):
        return add(self.base.at(u, v), self.normal(u, v), self.distance)

    def write(self, w, matrix=0):
        u0, u1, v0, v1 = self.domain
        n = self.normal((u0 + u1) / 2, (v0 + v1) / 2)
        return w.add(140, [*(complex(c).real for c in n), float(self.distance), self.base.write(w)], matrix=matrix,
                     status="00010000")
