"""Finite-element reference of one crossing: python3 run.py --out results.json"""

import argparse
import json
import os
import re
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.interpolate import PchipInterpolator

import checks
import ring
from crossing import NU, RADIUS, WIDTH, first_touch, static_curve
from element import StressMaxwell
from figure import figure
from mesh import Grading
from rolling import crossing
from wheel import NotConverged

LOADS = [20.0, 33.3, 50.0, 80.0, 100.0, 120.0, 150.0]
HEIGHTS = [4.0, 3.0, 2.0, 5.0, 6.0]
THICKNESSES = [8.0, 5.0, 12.0]
CALIBRATION_N, STEP = 100.0, 4.0
MESHES = {"coarse": 0.5, "base": 1.0, "fine": 2.0}
SPEEDS, MOVING_LOADS = [3.0, 5.0, 8.0], [33.3, 50.0, 100.0]
# Most load per width and modulus, mm, that the rows above need, by thickness.
ENOUGH = {5.0: 19.5, 8.0: 11.2, 12.0: 7.5}


def grading(mesh):
    return Grading().refined(MESHES[mesh])


def rounded(value, digits=6):
    if isinstance(value, dict):
        return {k: rounded(v, digits) for k, v in value.items()}
    if isinstance(value, list):
        return [rounded(v, digits) for v in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def free_gap(h):
    return float(np.hypot(*first_touch(h)) - RADIUS)


def record(curve, seconds):
    keys = ("thickness", "h", "elements", "load", "gap", "height", "thrust", "iterations", "stopped")
    return {k: getattr(curve, k) for k in keys} | {"energy": checks.energy(curve), "seconds": seconds}


class Tables:
    """Gap and height over the load of a stored curve."""

    def __init__(self, curve):
        load = [0.0] + curve["load"]
        self.most = load[-1]
        gap = [free_gap(curve["h"])] + curve["gap"]
        self.gap = PchipInterpolator(load, gap)
        self.height = PchipInterpolator(load, [RADIUS] + curve["height"])
        self.load = PchipInterpolator(-np.array(gap), load)


def modulus(curve):
    """Relaxed shear modulus, N/mm^2, that gives the ring's gap at the calibration point."""
    return float(CALIBRATION_N / WIDTH / Tables(curve).load(-ring.static_gap(CALIBRATION_N, STEP)))


class Run:
    def __init__(self, out):
        self.out = out
        self.data = json.loads(out.read_text()) if out.exists() else {}

    def save(self):
        text = json.dumps(rounded(self.data), indent=1)
        lists = re.compile(r"\[[^\[\]{}]*\]")
        self.out.write_text(lists.sub(lambda m: " ".join(m[0].split()), text) + "\n")

    def curve(self, thickness, h, mesh):
        curves = self.data.setdefault("curves", {})
        key = f"{thickness:g}/{h:g}/{mesh}"
        if key not in curves:
            begun = time.time()
            done = static_curve(thickness, h, grading(mesh), ENOUGH[thickness])
            curves[key] = record(done, time.time() - begun)
            print(key, f"{curves[key]['seconds']:.0f} s", done.stopped, flush=True)
            self.save()
        return curves[key]

    def static(self):
        for thickness in THICKNESSES:
            for h in HEIGHTS:
                self.curve(thickness, h, "base")
                self.curve(thickness, h, "coarse")

    def fine(self):
        for thickness in THICKNESSES:
            self.curve(thickness, STEP, "fine")

    def moving(self):
        for thickness in THICKNESSES:
            for load in MOVING_LOADS:
                for speed in SPEEDS:
                    self.move(thickness, speed, load, "coarse")
        self.move(8.0, 5.0, 100.0, "coarse, half stride", stride=0.05)
        self.move(8.0, 0.001, 50.0, "coarse, slow limit", stride=0.2)
        for speed, load in ((5.0, 100.0), (8.0, 33.3), (8.0, 100.0)):
            self.move(8.0, speed, load, "coarse, other law", law=StressMaxwell)
        self.move(8.0, 5.0, 100.0, "base")

    def driven(self):
        for speed in (0.001, 5.0):
            for load in MOVING_LOADS:
                self.move(8.0, speed, load, "coarse, driven", driven=True)
        for thickness in (5.0, 12.0):
            self.move(thickness, 5.0, 100.0, "coarse, driven", driven=True)
        self.move(8.0, 0.001, 33.3, "coarse, slow limit", stride=0.2)
        self.move(8.0, 0.001, 100.0, "coarse, slow limit", stride=0.2)
        self.move(8.0, 5.0, 100.0, "base, driven", driven=True)

    def move(self, thickness, speed, load, name, stride=0.1, **options):
        rows = self.data.setdefault("moving", {})
        key = f"{thickness:g}/{speed:g}/{load:g}/{name}"
        if key in rows:
            return
        begun = time.time()
        mesh = name.split(",")[0]
        mu = modulus(self.curve(thickness, STEP, mesh))
        driven = options.get("driven", False)
        if speed < 0.01:
            gap, height = ring.static_gap(load, STEP, driven), RADIUS
        else:
            gap, height = ring.moving_gap(load, STEP, speed, driven)
        row = {"thickness": thickness, "speed_mm_s": speed, "preload_n": load, "name": name}
        row |= {"stride_mm": stride, "ring_gap_mm": gap, "ring_height_mm": height}
        try:
            done = crossing(
                thickness, STEP, load / WIDTH / mu, speed, ring.STIFFENING, ring.TAU, grading(mesh), stride, **options
            )
            row |= {k: getattr(done, k) for k in ("steps", "iterations", "elements")}
            row |= {"gap_mm": done.gap, "height_mm": done.height}
            row["largest_thrust_before_release_n"] = done.largest_thrust * WIDTH * mu
            row["against_ring"] = done.gap / gap - 1
        except NotConverged as why:
            row["missing"] = str(why)
        row["seconds"] = time.time() - begun
        rows[key] = row
        print(key, row.get("gap_mm"), row.get("against_ring"), f"{row['seconds']:.0f} s", flush=True)
        self.save()

    def checks(self):
        self.data["checks"] = {
            "patch": checks.patch(),
            "tangent": checks.tangent(),
            "hertz": checks.hertz(),
            "pinned_node_coarse": checks.pinned_node(8.0, STEP, 5.0, grading("coarse")),
            "pinned_node_base": checks.pinned_node(8.0, STEP, 5.0, grading("base")),
        }
        print(json.dumps(self.data["checks"]), flush=True)
        self.save()

    def tables(self):
        """Rows of gap over preload, from the curves."""
        curves, rows = self.data["curves"], []
        self.data["modulus_n_mm2"] = {
            f"{t:g}/{m}": modulus(curves[f"{t:g}/{STEP:g}/{m}"])
            for t in THICKNESSES
            for m in MESHES
            if f"{t:g}/{STEP:g}/{m}" in curves
        }
        for thickness in THICKNESSES:
            for h in sorted(HEIGHTS):
                rows += self.rows(thickness, h)
        self.data["static"] = rows
        self.data["model"] = {"radius_mm": RADIUS, "width_mm": WIDTH, "nu": NU, "ring_k_inf_n_mm3": ring.K_INF}
        self.save()
        figure(rows, self.out.with_name("gap.svg"))

    def rows(self, thickness, h):
        curves, moduli = self.data["curves"], self.data["modulus_n_mm2"]
        rows = []
        for load in LOADS:
            reference = ring.static_gap(load, h)
            row = {"thickness": thickness, "h": h, "preload_n": load, "ring_gap_mm": reference}
            for mesh in MESHES:
                curve = curves.get(f"{thickness:g}/{h:g}/{mesh}")
                if curve is None:
                    continue
                table = Tables(curve)
                at = load / WIDTH / moduli[f"{thickness:g}/{mesh}"]
                if at > table.most:
                    row[f"missing_{mesh}"] = curve["stopped"] or "beyond the curve"
                    continue
                row[f"gap_{mesh}_mm"] = float(table.gap(at))
                row[f"height_{mesh}_mm"] = float(table.height(at))
            if "gap_base_mm" in row:
                row["against_ring"] = row["gap_base_mm"] / reference - 1
                others = [row[k] for k in ("gap_fine_mm", "gap_coarse_mm") if k in row][:1]
                spread = self.data["checks"]["pinned_node_base"]["spread_mm"]
                row["estimated_error_mm"] = max(abs(row["gap_base_mm"] - others[0]), spread) if others else None
            rows.append(row)
        return rows


def main():
    parts = ["checks", "static", "fine", "moving", "driven", "tables"]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("results.json"))
    parser.add_argument("--parts", nargs="*", choices=parts, default=parts)
    options = parser.parse_args()
    run = Run(options.out)
    for part in options.parts:
        getattr(run, part)()


if __name__ == "__main__":
    main()
