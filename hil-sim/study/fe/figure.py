"""Gap over preload, ring and finite elements, as a small SVG."""

LINES = {5.0: "#c1440e", 8.0: "#1f5fa8", 12.0: "#3a7d34"}
LEFT, TOP, WIDE, HIGH = 60, 20, 480, 300
LOADS, GAPS = (0.0, 160.0), (0.8, 3.0)


def _x(load):
    return LEFT + WIDE * (load - LOADS[0]) / (LOADS[1] - LOADS[0])


def _y(gap):
    return TOP + HIGH * (1 - (gap - GAPS[0]) / (GAPS[1] - GAPS[0]))


def _text(x, y, words, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" {more}>{words}</text>'


def _line(points, style):
    path = " ".join(f"{_x(a):.1f},{_y(b):.1f}" for a, b in points)
    return f'<polyline points="{path}" fill="none" {style}/>'


def figure(rows, path, h=4.0):
    rows = [r for r in rows if r["h"] == h]
    out = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 560 370" font-family="sans-serif" font-size="12">',
        '<rect width="560" height="370" fill="white"/>',
        f'<rect x="{LEFT}" y="{TOP}" width="{WIDE}" height="{HIGH}" fill="none" stroke="#444"/>',
    ]
    for load in range(0, 161, 20):
        out.append(_text(_x(load), TOP + HIGH + 16, load, 'text-anchor="middle"'))
    for tenths in range(8, 31, 2):
        y = _y(tenths / 10)
        out.append(_text(LEFT - 6, y + 4, tenths / 10, 'text-anchor="end"'))
        out.append(f'<path d="M{LEFT} {y:.1f}h{WIDE}" stroke="#ddd"/>')
    out.append(_text(LEFT + WIDE / 2, TOP + HIGH + 36, "preload, N", 'text-anchor="middle"'))
    out.append(_text(16, TOP + HIGH / 2, "gap, mm", f'text-anchor="middle" transform="rotate(-90 16 {TOP + HIGH / 2})"'))
    ring = sorted({(r["preload_n"], r["ring_gap_mm"]) for r in rows})
    out.append(_line(ring, 'stroke="#000" stroke-width="2"'))
    keys = [("ring", "#000", "")]
    for thickness, colour in LINES.items():
        points = [(r["preload_n"], r["gap_base_mm"]) for r in rows if r["thickness"] == thickness and "gap_base_mm" in r]
        out.append(_line(points, f'stroke="{colour}" stroke-dasharray="6 3"'))
        out += [f'<circle cx="{_x(a):.1f}" cy="{_y(b):.1f}" r="3" fill="{colour}"/>' for a, b in points]
        keys.append((f"finite elements, tread {thickness:g} mm", colour, 'stroke-dasharray="6 3"'))
    for k, (name, colour, dash) in enumerate(keys):
        y = TOP + 20 + 18 * k
        out.append(f'<path d="M312 {y - 4}h30" stroke="{colour}" stroke-width="2" {dash}/>')
        out.append(_text(348, y, name))
    path.write_text("\n".join(out + ["</svg>"]) + "\n")
