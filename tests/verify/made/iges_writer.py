# SPDX-License-Identifier: GPL-3.0-or-later
"""IGES files written from their standard alone: no code of the program, no numbers of its output."""


class Writer:
    """Entities one by one; habits are what exporters do differently.

    exponent: 'E', 'D' or '' (Fortran's "1.0+002"); columns: 64, or 65 with a pointer of 7; ending: line end.
    """

    def __init__(self, unit="MM", scale=1.0, resolution=1e-7, exponent="E", columns=64, ending="\n"):
        self.unit, self.scale, self.resolution = unit, scale, resolution
        self.exponent, self.columns, self.ending = exponent, columns, ending
        self.directory, self.parameters = [], []

    def real(self, x):
        text = next(t for t in ("%.*E" % (digits, x) for digits in range(1, 17)) if float(t) == x)
        mantissa, power = text.split("E")
        mantissa = mantissa.rstrip("0")
        return mantissa + self.exponent + ("%+04d" % int(power) if self.exponent == "" else "%+03d" % int(power))

    def add(self, kind, values, form=0, matrix=0, status="00000000"):
        """The directory number. Floats are written as reals, all else as it stands."""
        number = 2 * len(self.directory) + 1
        fields = [str(kind)] + [self.real(v) if isinstance(v, float) else str(v) for v in values]
        lines, line = [], ""
        for i, field in enumerate(fields):
            field += ";" if i + 1 == len(fields) else ","
            if len(line) + len(field) > self.columns:
                lines.append(line)
                line = ""
            line += field
        lines.append(line)
        first = len(self.parameters) + 1
        for text in lines:
            self.parameters.append((text, number))
        self.directory.append((kind, first, form, matrix, status, len(lines)))
        return number

    def text(self):
        out = []

        def section(letter, lines):
            for i, line in enumerate(lines):
                out.append("%-72s%s%7d" % (line, letter, i + 1))

        flag = {"INCH": 1, "MM": 2, "M": 6, "CM": 10}[self.unit]
        start = ["made to be read"]
        strings = lambda s: "%dH%s" % (len(s), s)
        globals_ = ["1H,", "1H;", strings("made"), strings("made.igs"), strings("made"), strings("made"), "32", "38",
                    "15", "308", "15", strings("made"), self.real(self.scale), str(flag), strings(self.unit), "1",
                    "1.", strings("20260101.000000"), self.real(self.resolution), "1.E4", strings("a"), strings("b"),
                    "11", "0", strings("20260101.000000")]
        lines, line = [], ""
        for i, field in enumerate(globals_):
            field += ";" if i + 1 == len(globals_) else ","
            if len(line) + len(field) > 72:
                lines.append(line)
                line = ""
            line += field
        lines.append(line)
        section("S", start)
        section("G", lines)
        cards = []
        for kind, first, form, matrix, status, count in self.directory:
            cards.append("%8d%8d%8d%8d%8d%8d%8d%8d%8s" % (kind, first, 0, 0, 0, 0, matrix, 0, status))
            cards.append("%8d%8d%8d%8d%8d%8s%8s%8s%8d" % (kind, 0, 0, count, form, "", "", "", 0))
        section("D", cards)
        width = 72 - self.columns
        # Flush right, so that the last column is used.
        section("P", [("%*s%*d" % (self.columns, text, width, number)) for text, number in self.parameters])
        out.append("%-72sT%7d" % ("S%7dG%7dD%7dP%7d" % (len(start), len(lines), len(cards), len(self.parameters)), 1))
        return self.ending.join(out) + self.ending
