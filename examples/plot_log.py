"""Draws a crossing from a log: `python3 examples/plot_log.py LOG.csv [STEP] [OUT.svg]`.

LOG.csv is from `cargo rig deploy` or `cargo rig capture`; STEP counts from 1. The picture has the
axle's path and the wheel at lift-off, to scale, and preload and speed over the same distance. Rig
and crossing, with the measured gap, are those in LOG.csv-metadata.json; the rest is the controller's
own columns, so a log of a real board will do. It reads the table with pandas if that is installed,
else with Python's own csv module.
"""

import json
import math
import pathlib
import re
import sys

COLUMNS = ["t_s", "stage", "position_mm", "radius_mm", "preload_n", "preload_ref_n",
           "wheel_speed_mm_s", "speed_ref_mm_s", "retracts"]


def read(path):
    """The columns as lists; what is unknown is NaN."""
    try:
        import pandas
    except ImportError:
        import csv
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        missing = [name for name in COLUMNS if rows and name not in rows[0]]
        if missing or not rows:
            sys.exit(f"{path}: no column {', '.join(missing)}" if rows else f"{path}: no rows")
        table = {name: [row[name] for row in rows] for name in COLUMNS}
        return {name: values if name == "stage" else [float(value or "nan") for value in values]
                for name, values in table.items()}
    try:
        table = pandas.read_csv(path, usecols=COLUMNS)
    except ValueError as error:
        sys.exit(f"{path}: {error}")
    if table.empty:
        sys.exit(f"{path}: no rows")
    return {name: table[name].tolist() for name in COLUMNS}


def described(path):
    """Wheel radius, step height and wall radius, mm, and the crossings, from beside the table."""
    beside = pathlib.Path(f"{path}-metadata.json")
    if not beside.is_file():
        sys.exit(f"{beside}: is not there; it has the rig and the crossings of {path}")
    note = json.loads(beside.read_text(encoding="utf-8"))["notes"][0]
    if not note.get("parameters") or not note.get("crossings"):
        sys.exit(f"{beside}: has no parameters or no crossings of one start")
    rig = [re.search(rf"^{key} = ([-+.e0-9]+)", note["parameters"], re.MULTILINE)
           for key in ("wheel_radius_mm", "step_height_mm", "wall_radius_mm")]
    return [float(number.group(1)) for number in rig], note["crossings"]


def polyline(points, color, width=2, dash="none"):
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points if math.isfinite(x + y))
    return (f'<polyline points="{text}" fill="none" stroke="{color}" stroke-width="{width}" '
            f'stroke-dasharray="{dash}"/>')


def label(x, y, text, color="#1b1f24", size=20):
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{color}">{text}</text>'


def main():
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    path, step = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1
    out = sys.argv[3] if len(sys.argv) > 3 else "crossing.svg"
    log = read(path)
    (radius, height, wall), crossings = described(path)
    if 1.0 in log["retracts"]:
        sys.exit(f"{path}: a retraction; this picture is for deployments")
    found = [line for line in crossings if line["index"] == step]
    if not found or found[0]["gap_measured_mm"] is None:
        sys.exit(f"{path}: no crossing of step {step} whose gap was measured")
    gap = found[0]["gap_measured_mm"]
    ticks = range(len(log["t_s"]))
    lift = next(i for i in ticks if log["t_s"][i] >= found[0]["lift_s"])
    # The wheel's centre above the lower wall and before the face (negative), mm; the face is where
    # the gap has it.
    y = [wall - (step - 1) * height - value for value in log["radius_mm"]]
    before = math.sqrt(max((radius + gap) ** 2 - y[lift] ** 2, 0))
    x = [position - log["position_mm"][lift] - before for position in log["position_mm"]]
    near = [i for i in ticks if -20 <= x[i] <= 8 and log["stage"][i] != "initial"]

    scale = 20.0
    px = lambda value: 480 + value * scale
    py = lambda value: 630 - value * scale
    svg = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 1110" '
           'font-family="Helvetica, Arial, sans-serif">',
           '<rect width="960" height="1110" fill="#ffffff"/>',
           f'<circle cx="{px(x[lift]):.1f}" cy="{py(y[lift]):.1f}" r="{radius * scale:.1f}" '
           'fill="none" stroke="#59636e" stroke-width="4"/>',
           polyline([(0, py(0)), (px(0), py(0)), (px(0), py(height)), (960, py(height))],
                    "#1b1f24", 4),
           polyline([(px(x[i]), py(y[i])) for i in near], "#0550ae", 3)]
    part = gap / (radius + gap)
    svg += [polyline([(px(0), py(0)), (px(x[lift] * part), py(y[lift] * part))], "#b3202c", 5),
            label(20, 30, f"step {step}: measured gap {gap:.2f} mm, lift-off {-x[lift]:.2f} mm before the face"),
            label(px(-4), py(radius + height - 3), "path of the axle", "#0550ae")]
    panels = ((690, "preload", "N", "preload_n", "preload_ref_n"),
              (900, "speed", "mm/s", "wheel_speed_mm_s", "speed_ref_mm_s"))
    for top, name, unit, measured, wanted in panels:
        most = max(log[key][i] for key in (measured, wanted) for i in near) * 1.1
        level = lambda value: top + 180 - 180 * max(value, 0) / most
        svg += [polyline([(px(-20), top), (px(-20), top + 180), (px(8), top + 180)], "#59636e"),
                polyline([(px(0), top), (px(0), top + 180)], "#59636e", 1, "6 5"),
                polyline([(px(x[lift]), top), (px(x[lift]), top + 180)], "#b3202c", 1, "6 5"),
                polyline([(px(x[i]), level(log[wanted][i])) for i in near], "#59636e", 2, "8 4"),
                polyline([(px(x[i]), level(log[measured][i])) for i in near], "#0550ae", 3),
                label(660, top + 24, f"{name}, full scale {most:.0f} {unit}")]
    svg += [label(20, 1102, "dashed: reference, face (grey), lift-off (red); distance before the face "
                            "from -20 to 8 mm", size=18), "</svg>", ""]
    pathlib.Path(out).write_text("\n".join(svg), encoding="utf-8")
    print(f"{out}: measured gap {gap:.3f} mm; at that instant "
          f"{log['wheel_speed_mm_s'][lift]:.2f} mm/s and {log['preload_n'][lift]:.1f} N")


if __name__ == "__main__":
    main()
