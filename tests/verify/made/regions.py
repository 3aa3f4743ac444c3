# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a parameter plane: the curves that bound them, and their area on a surface by adaptive quadrature."""

import math

from surfaces import Arc, Line, Spline

# Gauss-Legendre nodes on [0, 1], by Newton's method on the Legendre polynomial.


def gauss(n):
    nodes = []
    for k in range(n):
        x = math.cos(math.pi * (k + 0.75) / (n + 0.5))
        for _ in range(100):
            p, q = 1.0, x
            for m in range(2, n + 1):
                p, q = q, ((2 * m - 1) * x * q - (m - 1) * p) / m
            slope = n * (x * q - p) / (x * x - 1)
            step = q / slope
            x -= step
            if abs(step) < 1e-16:
                break
        nodes.append(((1 - x) / 2, 1 / ((1 - x * x) * slope * slope)))
    return nodes


NODES = gauss(7)


def stretch(surface, u, v):
    """Area in space for each area in the parameter plane: the derivatives come from complex steps."""
    h = 1e-30
    a = [c.imag / h for c in map(complex, surface.at(u + 1j * h, v + 0j))]
    b = [c.imag / h for c in map(complex, surface.at(u + 0j, v + 1j * h))]
    return math.sqrt((a[1] * b[2] - a[2] * b[1])**2 + (a[2] * b[0] - a[0] * b[2])**2 + (a[0] * b[1] - a[1] * b[0])**2)


def integrate(f, box, depth=0, whole=None, scale=None):
    """Over a box, halved the longer way until the sum stands."""

    def rule(b):
        x0, x1, y0, y1 = b
        return (x1 - x0) * (y1 - y0) * sum(
            wx * wy * f(x0 + (x1 - x0) * x, y0 + (y1 - y0) * y) for x, wx in NODES for y, wy in NODES)

    whole = rule(box) if whole is None else whole
    scale = abs(whole) if scale is None else scale
    x0, x1, y0, y1 = box
    xm, ym = (x0 + x1) / 2, (y0 + y1) / 2
    parts = [(x0, xm, y0, ym), (xm, x1, y0, ym), (x0, xm, ym, y1), (xm, x1, ym, y1)]
    sums = [rule(p) for p in parts]
    if abs(sum(sums) - whole) <= 1e-10 * scale or depth == 7:
        return sum(sums)
    return sum(integrate(f, p, depth + 1, s, scale) for p, s in zip(parts, sums))


def strips(surface, chart, slope, cuts, crossings, low, high):
    """The area between two curves v = low(x), v = high(x) over u = chart(x): cut at the places `cuts` of x, where a
    curve meets one of the surface's lines v = break (crossings(break)), and within each strip along those lines. On
    each piece everything is smooth, whatever the surface's breaks."""
    u_breaks, v_breaks = surface.breaks
    places = sorted({*cuts, *(x for b in v_breaks for x in crossings(b))})
    places = [x for x in places if cuts[0] <= x <= cuts[-1]]
    total = 0.0
    for x0, x1 in zip(places, places[1:]):
        middle = (x0 + x1) / 2
        edges = [low, *((lambda x, b=b: b) for b in v_breaks if low(middle) < b < high(middle)), high]
        for lower, upper in zip(edges, edges[1:]):

            def f(x, t, lower=lower, upper=upper):
                a, b = lower(x), upper(x)
                return stretch(surface, chart(x), a + (b - a) * t) * (b - a) * slope(x)

            total += integrate(f, (x0, x1, 0.0, 1.0))
    return total


class Rectangle:
    def __init__(self, u0, u1, v0, v1):
        self.box = (u0, u1, v0, v1)

    def area(self, surface):
        u0, u1, v0, v1 = self.box
        us = [u0, *(b for b in surface.breaks[0] if u0 < b < u1), u1]
        vs = [v0, *(b for b in surface.breaks[1] if v0 < b < v1), v1]
        return sum(integrate(lambda u, v: stretch(surface, u, v), (a, b, c, d))
                   for a, b in zip(us, us[1:]) for c, d in zip(vs, vs[1:]))

    def curves(self):
        u0, u1, v0, v1 = self.box
        return polygon([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])


def polygon(corners):
    return [Line((*a, 0.0), (*b, 0.0)) for a, b in zip(corners, corners[1:] + corners[:1])]


class Polygon:
    """Convex, counter-clockwise."""

    def __init__(self, *corners):
        self.corners = list(corners)

    def area(self, surface):
        edges = list(zip(self.corners, self.corners[1:] + self.corners[:1]))
        u = [corner[0] for corner in self.corners]
        cuts = sorted({*u, *(b for b in surface.breaks[0] if min(u) < b < max(u))})

        def section(edges_on_side):
            def at(x):
                (a, b), = [e for e in edges_on_side if min(e[0][0], e[1][0]) <= x <= max(e[0][0], e[1][0])][:1]
                return a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0])
            return at

        def crossings(v):
            for a, b in edges:
                if min(a[1], b[1]) < v < max(a[1], b[1]):
                    yield a[0] + (b[0] - a[0]) * (v - a[1]) / (b[1] - a[1])

        # Counter-clockwise, what runs to larger u lies below.
        low, high = (section([e for e in edges if (e[1][0] - e[0][0]) * way > 0]) for way in (1, -1))
        return strips(surface, lambda x: x, lambda x: 1.0, cuts, crossings, low, high)

    def curves(self):
        return polygon(self.corners)


class Ellipse:
    """Axes along u and v; a circle is written as arcs (100), else as rational quadratics (126)."""

    def __init__(self, u, v, a, b):
        self.centre, self.axes = (u, v), (a, b)

    def area(self, surface):
        (u, v), (a, b) = self.centre, self.axes
        half = math.pi / 2
        cuts = [-half, *sorted(math.asin((x - u) / a) for x in surface.breaks[0] if abs(x - u) < a), half]

        def crossings(y):
            if abs(y - v) < b:
                x = math.acos(abs(y - v) / b)
                yield from (-x, x)

        # u = centre + a sin x: the ends of the sections are smooth in x.
        return strips(surface, lambda x: u + a * math.sin(x), lambda x: a * math.cos(x), cuts, crossings,
                      lambda x: v - b * math.cos(x), lambda x: v + b * math.cos(x))

    def curves(self):
        (u, v), (a, b) = self.centre, self.axes
        if a == b:
            return [Arc((u, v), a, 0, math.pi), Arc((u, v), a, math.pi, 2 * math.pi)]
        unit = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
        half = math.sqrt(0.5)
        out = []
        for k in range(0, 8, 2):
            points = [(u + a * x, v + b * y, 0.0) for x, y in unit[k:k + 3]]
            out.append(Spline(2, [0, 0, 0, 1, 1, 1], points, [1.0, half, 1.0]))
        return out


def image(surface, curve, pieces=48):
    """The curve that a parameter curve draws, as a cubic spline through exact places with exact tangents."""
    h = 1e-30
    a, b = curve.domain
    step = (b - a) / pieces

    def on(t):
        p = curve.at(t)
        x = surface.at(complex(p[0]), complex(p[1]))
        return tuple(complex(c) for c in x)

    points = [tuple(c.real for c in on(a + 0j))]
    for k in range(pieces):
        ends = []
        for t in (a + k * step, a + (k + 1) * step):
            x = on(t + 1j * h)
            ends.append((tuple(c.real for c in x), tuple(c.imag / h for c in x)))
        (p, dp), (q, dq) = ends
        points.append(tuple(p[i] + dp[i] * step / 3 for i in range(3)))
        points.append(tuple(q[i] - dq[i] * step / 3 for i in range(3)))
        points.append(q)
    knots = [a] * 4 + [a + k * step for k in range(1, pieces) for _ in range(3)] + [b] * 4
    return Spline(3, knots, points)
