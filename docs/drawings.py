"""Writes the drawings of the documentation: `python3 docs/drawings.py [FOLDER]`.

The folder is by default the one of this file. The wiring is read from the table in HARDWARE.md,
lengths are those of the rig `prototype`. The same input gives the same bytes; a test compares them
with the committed files.
"""

import pathlib
import sys
from math import acos, asin, cos, degrees, hypot, pi, sin, sqrt

HERE = pathlib.Path(__file__).resolve().parent

# Rig `prototype`, mm: wheel radius, step height, wall radius, arm length, pivot radius.
R, H, WALL, ARM, PIVOT = 25.0, 4.0, 150.0, 145.0, 20.0
# Gap that a lift-off is drawn with, mm: about the prototype's reference.
GAP = 2.65
# Distance of the wheel's centre before the face, mm: touch of the corner; lift-off with that gap.
TOUCH = sqrt(R**2 - (R - H) ** 2)
LIFT_OFF = sqrt((R + GAP) ** 2 - R**2)

INK, SOFT, BLUE, RED, GREEN = "#1b1f24", "#59636e", "#0550ae", "#b3202c", "#1a6f33"
STEEL, PALE = "#d3d9e0", "#eef2f6"


def number(value):
    """A coordinate with at most one decimal."""
    text = f"{value:.1f}"
    return text[:-2] if text.endswith(".0") else text


class Drawing:
    """An SVG on a white ground, which is readable on dark pages too."""

    def __init__(self, width, height, title):
        self.size, self.title, self.items = (width, height), title, []

    def add(self, tag, **attributes):
        pairs = []
        for name, value in attributes.items():
            value = number(value) if isinstance(value, (int, float)) else value
            pairs.append(f'{name.replace("_", "-")}="{value}"')
        self.items.append(f"<{tag} {' '.join(pairs)}/>")

    def line(self, *points, color=INK, width=2.5, dash="none"):
        points = " ".join(f"{number(x)},{number(y)}" for x, y in points)
        self.add("polyline", points=points, fill="none", stroke=color, stroke_width=width,
                 stroke_dasharray=dash, stroke_linejoin="round")

    def area(self, *points, fill=STEEL, opacity=1):
        points = " ".join(f"{number(x)},{number(y)}" for x, y in points)
        self.add("polygon", points=points, fill=fill, fill_opacity=str(opacity))

    def circle(self, x, y, r, color=INK, width=2.5, fill="none", dash="none"):
        self.add("circle", cx=x, cy=y, r=r, stroke=color, stroke_width=width, fill=fill,
                 stroke_dasharray=dash)

    def box(self, x, y, width, height, fill=PALE, color=INK):
        self.add("rect", x=x, y=y, width=width, height=height, rx=6, fill=fill, stroke=color,
                 stroke_width=2)

    def head(self, x, y, dx, dy, color):
        """An arrow's head at a point, along a direction."""
        length = hypot(dx, dy)
        dx, dy = 15 * dx / length, 15 * dy / length
        self.area((x, y), (x - dx - dy * 0.4, y - dy + dx * 0.4),
                  (x - dx + dy * 0.4, y - dy - dx * 0.4), fill=color)

    def arrow(self, *points, color=INK, width=3, both=False):
        (x0, y0), (x1, y1) = points[-2:]
        length = hypot(x1 - x0, y1 - y0)
        end = (x1 - 8 * (x1 - x0) / length, y1 - 8 * (y1 - y0) / length)
        self.line(*points[:-1], end, color=color, width=width)
        self.head(x1, y1, x1 - x0, y1 - y0, color)
        if both:
            self.head(x0, y0, x0 - x1, y0 - y1, color)

    def arc(self, x, y, r, start, end, color=INK, width=2.5):
        """Angles in degrees, counterclockwise from the right; the end carries an arrow's head."""
        steps = max(2, int(abs(end - start) / 5))
        angles = [(start + (end - start) * i / steps) * pi / 180 for i in range(steps + 1)]
        points = [(x + r * cos(a), y - r * sin(a)) for a in angles]
        self.line(*points[:-1], color=color, width=width)
        (x0, y0), (x1, y1) = points[-2:]
        self.head(x1, y1, x1 - x0, y1 - y0, color)

    def text(self, x, y, *lines, size=23, color=INK, anchor="start", weight="normal"):
        for i, line in enumerate(lines):
            line = line.replace("&", "&amp;").replace("<", "&lt;")
            self.items.append(
                f'<text x="{number(x)}" y="{number(y + 1.2 * size * i)}" font-size="{size}" '
                f'fill="{color}" text-anchor="{anchor}" font-weight="{weight}">{line}</text>')

    def named_box(self, x, y, width, height, name, *lines, fill=PALE):
        """A box with its name and lines in its middle."""
        self.box(x, y, width, height, fill=fill)
        top = y + height / 2 + 7 - 12 * len(lines)
        self.text(x + width / 2, top, name, anchor="middle", weight="bold")
        self.text(x + width / 2, top + 26, *lines, size=23, anchor="middle", color=SOFT)

    def svg(self):
        width, height = self.size
        return "\n".join([
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
            f'font-family="Helvetica, Arial, sans-serif" role="img">',
            f"<title>{self.title}</title>",
            f'<rect width="{width}" height="{height}" fill="#ffffff"/>', *self.items, "</svg>", ""])


def mechanism():
    """The drive unit with its quantities and their signs, to scale."""
    d = Drawing(1000, 800, "The drive unit: quantities and signs")
    mm = 3.6
    angle = asin((WALL - R - PIVOT) / ARM)
    axis, top = 90, 190
    pivot = (axis + PIVOT * mm, top)
    wheel = (axis + (WALL - R) * mm, top + ARM * cos(angle) * mm)
    wall, face = axis + WALL * mm, wheel[1] - (TOUCH + 26) * mm
    d.area((wall, 780), (wall, face), (wall - H * mm, face), (wall - H * mm, 20), (wall + 40, 20),
           (wall + 40, 780))
    d.line((wall, 780), (wall, face), (wall - H * mm, face), (wall - H * mm, 20))
    d.text(wall + 45, face + 8, "step: face, h = 4 mm")
    d.text(wall + 45, 50, "wall of the next sleeve,", "radius 146 mm")
    # Pillar and carriage.
    d.area((axis - 36, 20), (axis + 36, 20), (axis + 36, 780), (axis - 36, 780), fill=PALE)
    d.line((axis, 20), (axis, 780), color=SOFT, dash="24 6 4 6")
    d.text(axis + 44, 45, "pillar axis", color=SOFT)
    d.box(axis + 36, top - 40, 66, 300, fill=STEEL)
    d.text(axis + 44, top - 54, "carriage")
    # Arm, pre-tightener, wheel.
    middle = ((pivot[0] + wheel[0]) / 2, (pivot[1] + wheel[1]) / 2)
    spring, end = axis + 150, middle[0] - 40
    d.box(axis + 102, middle[1] - 22, 30, 44, fill=PALE)
    d.line((axis + 132, middle[1]), (spring, middle[1]), width=5)
    turns = 9
    zigzag = [(spring + (end - spring) * (i + 0.5) / turns, middle[1] + (14 if i % 2 else -14))
              for i in range(turns)]
    d.line((spring, middle[1]), *zigzag, (end, middle[1]))
    d.box(end, middle[1] - 14, 22, 28, fill="#ffd8a8")
    d.line((end + 22, middle[1]), middle, width=5)
    d.circle(*wheel, R * mm, fill="#ffffff", width=9, color="#3d444d")
    d.line(pivot, wheel, width=11, color="#6e7781")
    d.circle(*pivot, 9, fill="#ffffff")
    d.circle(*wheel, 9, fill="#ffffff")
    d.text(middle[0] - 34, middle[1] - 62, "arm, 145 mm")
    d.text(axis + 110, middle[1] + 56, "pre-tightener:", "motor, screw,", "spring, sensor")
    # Angle.
    d.line(pivot, (pivot[0], top + 150), color=SOFT, dash="6 5")
    d.arc(*pivot, 120, -90, -90 + degrees(angle) - 4, color=GREEN)
    d.text(pivot[0] + 96, top + 28, "arm angle α, sensor code", "0 along the pillar, + outwards",
           color=GREEN)
    # Preload, load, drive force, travel, turn.
    d.arrow((wheel[0] + 14, wheel[1]), (wheel[0] + 84, wheel[1]), color=BLUE, width=4)
    d.text(wheel[0] + 28, wheel[1] - 14, "P", color=BLUE, weight="bold", size=26)
    d.text(wall - 20, middle[1] + 6, "preload P, N", "+ outwards", color=BLUE, anchor="end")
    d.line((wall - 70, middle[1] + 44), (wheel[0] + 46, wheel[1] - 38), color=BLUE, width=1.5)
    d.arrow((axis + 69, top + 262), (axis + 69, top + 372), color=RED, width=4)
    d.text(axis + 82, top + 352, "load, N: + pulls", "against deployment", color=RED)
    d.arrow((wall + 14, wheel[1] + 16), (wall + 14, wheel[1] - 80), color=RED, width=4)
    d.text(wall + 45, wheel[1] - 50, "drive force F, N", "on the wheel, + deploys", "wall force: N = P + F tan α", color=RED)
    # Clockwise: the wall on its right carries it up.
    d.arc(*wheel, 58, 330, 210, color=BLUE)
    d.text(wheel[0] - 104, wheel[1] + 50, "R = 25 mm", "encoder +", anchor="end", color=BLUE)
    d.arrow((wall + 70, 290), (wall + 70, 180), color=BLUE, width=4)
    d.text(wall + 92, 208, "travel x, mm", "speed v, mm/s", "+ deploys", color=BLUE)
    d.line((wall - 2, wheel[1] + 14), (wall + 48, wheel[1] + 84), color=SOFT, width=1.5)
    d.text(wall + 53, wheel[1] + 92, "compression c, mm", "+ as the tread yields")
    d.arrow((axis, 745), (wall, 745), both=True, color=SOFT)
    d.text((axis + wall) / 2 + 30, 735, "wall radius 150 mm", anchor="middle", color=SOFT)
    return d


def crossing():
    """One crossing in side view, to scale."""
    d = Drawing(1000, 720, "One crossing to scale: touch, lift-off and gap")
    mm, root = 20.0, (690, 560)

    def at(x, y):
        return (root[0] + x * mm, root[1] - y * mm)

    d.circle(*at(-TOUCH, R), R * mm, color=SOFT, width=2, dash="10 6")
    d.circle(*at(-LIFT_OFF, R), R * mm, color="#3d444d", width=5)
    d.area((0, 0), (1000, 0), (1000, 14), (0, 14), fill="#ffffff")
    d.area(at(-35, 0), root, at(0, H), at(16, H), at(16, -8), at(-35, -8), opacity=0.75)
    d.line(at(-35, 0), root, at(0, H), at(16, H), width=4)
    d.text(20, 544, "lower wall", size=24)
    d.text(985, 466, "upper wall", size=24, anchor="end")
    # Centres.
    for x, color in ((-TOUCH, SOFT), (-LIFT_OFF, INK)):
        d.circle(*at(x, R), 6, fill=color, color=color)
        d.line(at(x, R), at(x, -2.9 if x == -TOUCH else -1.2), color=color, width=1.5, dash="7 5")
    d.text(at(-TOUCH, 0)[0] - 12, 56, "centre at the touch", color=SOFT, anchor="end", size=24)
    d.text(at(-LIFT_OFF, 0)[0] + 14, 56, "centre at lift-off", size=24)
    # Radius.
    spoke = (-LIFT_OFF - R * cos(0.55), R - R * sin(0.55))
    d.arrow(at(-LIFT_OFF, R), at(*spoke), color=INK, width=2)
    d.text(270, 136, "R = 25 mm", size=24, anchor="end")
    # The gap, from the root towards the centre.
    part = GAP / (R + GAP)
    end = (-LIFT_OFF * part, R * part)
    d.line(root, at(*end), color=RED, width=6)
    d.line(at(-1.0, 1.9), at(-3.4, 6.8), color=RED, width=1.5)
    d.text(*at(-10.7, 8.6), "gap 2.65 mm", size=26, color=RED, weight="bold")
    d.text(*at(-10.7, 7.4), "root to circle", color=RED)
    # Names of the step's parts.
    for point, label, x, y in (((0.25, H), "corner", 165, 398), ((0.15, 2.0), "face", 60, 526),
                               ((0, 0), "root", 60, 604)):
        x += root[0]
        d.line(at(*point), (x - 6, y - 8), color=SOFT, width=1.5)
        d.text(x, y, label, size=24)
    d.circle(*at(0, H), 7, fill=BLUE, color=BLUE)
    d.circle(*root, 7, fill=RED, color=RED)
    d.arrow((955, root[1]), at(13.25, H), both=True, color=SOFT)
    d.text(945, 530, "h = 4 mm", anchor="end", color=SOFT)
    # Distances before the face.
    d.line(root, at(0, -6.9), color=SOFT, width=1.5, dash="7 5")
    d.arrow(at(-LIFT_OFF, -1.3), at(0, -1.3), both=True)
    d.text(at(-LIFT_OFF / 2, 0)[0], 622, "11.8 mm at lift-off", anchor="middle")
    d.arrow(at(-TOUCH, -4.2), at(0, -4.2), both=True, color=SOFT)
    d.line(at(-TOUCH, -2.9), at(-TOUCH, -4.6), color=SOFT, width=1.5, dash="7 5")
    d.text(at(-TOUCH / 2, 0)[0], 680, "13.6 mm at the touch", anchor="middle", color=SOFT)
    d.arrow((40, 640), (220, 640), color=BLUE, width=4)
    d.text(40, 676, "travel, + deploys", color=BLUE)
    assert (number(TOUCH), number(LIFT_OFF)) == ("13.6", "11.8")
    return d


def stages():
    """The six contact stages in two rows."""
    d = Drawing(600, 760, "The six contact stages")
    names = [("initial", "no preload"), ("preloaded", "P rises at rest"),
             ("static friction", "both walls carry"), ("sliding", "corner carries"),
             ("rolling", "onto next wall"), ("continuous", "rolls on a wall")]
    mm = 3.3
    for i, (name, what) in enumerate(names):
        left, top = 200 * (i % 3), 360 * (i // 3)
        low = top + 245
        if i % 2:
            d.area((left, top), (left + 200, top), (left + 200, top + 360), (left, top + 360),
                   fill="#f6f8fa")
        face = left + {2: 138, 3: 132, 4: 104}[i] if 2 <= i <= 4 else None
        back = [(left + 8, low), (left + 192, low)]
        if face:
            back = [(left + 8, low), (face, low), (face, low - H * mm), (left + 192, low - H * mm)]
        centre = {2: (-TOUCH + 0.7, R - 0.5), 3: (-9.0, 26.3), 4: (-1.5, R + H - 0.5)}
        x, y = centre.get(i, (0, R - (0 if i == 0 else 0.6)))
        x = (face or left + 100) + x * mm
        y = low - y * mm
        d.circle(x, y, R * mm, width=5, color="#3d444d")
        d.area(*back, (left + 192, low + 24), (left + 8, low + 24))
        d.line(*back)
        if i:
            d.arrow((x, y - 30), (x, y + 36), color=BLUE, width=4)
            d.text(x + 9, y + 6, "P", color=BLUE, size=24)
        if i > 1:
            d.arc(x, y, 60, 140, 55, color=SOFT, width=3)
        for carries, point in ((i in (1, 2, 5), (x, low + 1)), (i in (2, 3, 4), (face, low - H * mm))):
            if carries:
                d.circle(*point, 8, fill=RED, color=RED)
        d.text(left + 100, top + 46, str(i + 1), size=36, weight="bold", anchor="middle")
        d.text(left + 100, top + 314, name, size=25, anchor="middle", weight="bold")
        d.text(left + 100, top + 346, what, size=23, anchor="middle", color=SOFT)
    d.text(300, 746, "● where the wall carries the wheel", size=22, anchor="middle", color=RED)
    return d


def wires():
    """Rows of the wiring table: pin and connector by signal."""
    page = (HERE / "HARDWARE.md").read_text(encoding="utf-8")
    table = page.split("| signal | MCU pin | connector |")[1].split("\n\n")[0]
    rows = [[cell.strip() for cell in row.split("|")[1:4]] for row in table.splitlines()[2:]]
    return {signal: (pin, connector) for signal, pin, connector in rows if connector[:2] == "CN"}


def wiring():
    """Board, connectors, sensors, bridges and emergency stop."""
    d = Drawing(1080, 910, "Wiring of the NUCLEO-G474RE")
    left = [("wheel encoder", "", ["wheel encoder A", "wheel encoder B"], "in"),
            ("preload sensor", "0 to 3.3 V", ["preload sensor"], "in"),
            ("compression sensor", "0 to 3.3 V", ["compression sensor"], "in"),
            ("angle encoder", "SPI, 3.3 V",
             ["angle encoder clock", "angle encoder data to the board",
              "angle encoder data from the board", "angle encoder select"], "out"),
            ("emergency stop", "opening contact", ["emergency stop, first pin",
                                                   "emergency stop, second pin"], "in")]
    right = [("drive bridge", ["drive PWM", "drive direction", "drive enable",
                               "output of the drive's bridge"]),
             ("pre-tightener bridge", ["pre-tightener PWM", "pre-tightener direction",
                                       "pre-tightener enable", "output of the pre-tightener's bridge"])]
    pins = wires()
    short = {"angle encoder clock": "clock", "angle encoder data to the board": "data in",
             "angle encoder data from the board": "data out", "angle encoder select": "select",
             "wheel encoder A": "A", "wheel encoder B": "B"}
    d.box(380, 30, 320, 740, fill="#e6f0e9")
    d.text(540, 66, "NUCLEO-G474RE", anchor="middle", weight="bold", size=24)
    d.text(540, 94, "pin · connector", anchor="middle", color=SOFT)
    used, y = [], 116
    for name, what, signals, sense in left:
        height = 54 * len(signals) + 6
        d.box(20, y, 260, height)
        middle = y + height / 2
        d.text(34, middle + (-4 if what else 7), name, weight="bold", size=20)
        d.text(34, middle + 20, what, size=19, color=SOFT)
        if name == "emergency stop":
            d.line((280, middle), (330, middle), color=BLUE, width=3)
            d.line((330, y + 30), (330, y + 84), color=BLUE, width=3)
            d.text(305, middle - 8, "1 kΩ", size=18, anchor="middle", color=SOFT)
        for i, signal in enumerate(signals):
            row = y + 30 + 54 * i
            ends = [(330 if name == "emergency stop" else 280, row), (380, row)]
            outwards = sense == "out" and signal != "angle encoder data to the board"
            d.arrow(*(ends[::-1] if outwards else ends), color=GREEN if outwards else BLUE)
            d.text(330, row - 8, short.get(signal, ""), size=18, anchor="middle", color=SOFT)
            d.text(392, row + 7, "{} · {}".format(*pins[signal]), size=20)
            used.append(signal)
        y += height + 12
    y = 136
    for name, signals in right:
        d.box(800, y, 260, 270)
        d.text(930, y + 40, name, anchor="middle", weight="bold", size=20)
        d.text(930, y + 70, "to its motor; supply", "through the stop's", "other contact", size=19,
               anchor="middle", color=SOFT)
        d.text(930, y + 180, "output by difference", "amplifier and 1 ms", "low-pass", size=19,
               anchor="middle", color=SOFT)
        for i, (signal, what) in enumerate(zip(signals, ("PWM", "direction", "enable", "output"))):
            row = y + 36 + 66 * i
            ends = [(700, row), (800, row)]
            inwards = what == "output"
            d.arrow(*(ends[::-1] if inwards else ends), color=BLUE if inwards else GREEN)
            d.text(750, row - 8, what, size=18, anchor="middle", color=SOFT)
            d.text(688, row + 7, "{1} · {0}".format(*pins[signal]), size=20, anchor="end")
            used.append(signal)
        y += 310
    assert set(used) == set(pins), set(used) ^ set(pins)
    notes = ["Stop: both pins on one wire, 1 kΩ at the board, contact to ground; open = PWM off.",
             "3.3 kΩ to ground at each PWM and enable line. 2.2 kΩ to 3V3 at PA0 and PA1.",
             "100 kΩ and 10 nF to ground at PC2 and PC3.",
             "220 to 470 µF from 3V3 (CN7-16) to GND (CN7-20). Grounds joined at the bridges."]
    d.text(20, 812, *notes, size=21)
    return d


def data():
    """The way of a reading from the sensor to the report."""
    d = Drawing(1000, 800, "From the sensor to the report")
    d.area((10, 10), (990, 10), (990, 352), (10, 352), fill="#e6f0e9")
    d.text(26, 42, "board, every millisecond", color=SOFT)
    d.named_box(30, 64, 260, 110, "sensor tasks", "raw code", "and its age")
    d.named_box(370, 64, 260, 110, "control tick", "estimate, schedule,", "loops")
    d.named_box(710, 64, 260, 110, "bridges", "two duties")
    d.named_box(370, 226, 260, 110, "record task", "copies input", "and output")
    d.named_box(710, 226, 260, 110, "journal", "frames: differences,", "number, CRC-32")
    d.arrow((290, 119), (370, 119))
    d.arrow((630, 119), (710, 119))
    d.arrow((500, 174), (500, 226))
    d.arrow((630, 281), (710, 281))
    d.text(824, 388, "RTT up 1: 46 kB/s, 4 KiB; never waits for a reader", color=BLUE, anchor="end")
    d.area((10, 408), (990, 408), (990, 790), (10, 790), fill="#f2eefa")
    d.text(26, 440, "host", color=SOFT)
    d.arrow((840, 336), (840, 452), color=BLUE, width=4)
    d.named_box(710, 452, 260, 110, "rig capture", "or rig live,", "by the probe")
    d.named_box(370, 452, 260, 110, "log files", "log.mcap (/frames),", "log.csv")
    d.named_box(30, 452, 260, 110, "rig deploy", "controller and plant;", "adds the truth")
    d.arrow((710, 507), (630, 507))
    d.arrow((290, 507), (370, 507))
    for x, name, lines in ((30, "rig report", ("page: plots and", "ledger")),
                           (370, "rig identify", ("parameters with", "intervals")),
                           (710, "rig replay", ("the same bits, or the", "first difference"))):
        d.named_box(x, 660, 260, 110, name, *lines)
        d.arrow((500, 562), (500, 612), (x + 130, 612), (x + 130, 660))
    return d


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    for drawing in (mechanism, crossing, stages, wiring, data):
        text = drawing().svg()
        (folder / f"{drawing.__name__}.svg").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
