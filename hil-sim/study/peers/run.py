"""One crossing by SciPy's solvers and by MuJoCo, beside the plant's ring: writes results.json, their
table in docs/PLANT.md and their figure docs/figures/peers.svg.

In a virtual environment with ../requirements.txt: `python run.py [FOLDER]`, where FOLDER takes the
compiled equations. `problem.json` has the crossing and the ring's own figures: its settings with
their errors and times, the gap and force of the converged ring, and the points that MuJoCo's
contacts are fitted at. Errors are those of gap and largest axial force against the converged
ring, the larger; times are processor time of one thread.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import matplotlib.figure

HERE = pathlib.Path(__file__).parent
DOCS = HERE.parents[2] / "docs"
# Neighbouring element counts are one setting: where the elements lie at lift-off shifts the gap by
# about a third of their pitch.
ELEMENTS = [240, 480, 960, 1920]
# Error at which times are compared.
LEVEL = 0.005


def answer(script, given):
    """What a script prints for this problem."""
    single = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, HERE / script], input=json.dumps(given), text=True,
        stdout=subprocess.PIPE, check=True, env=os.environ | single,
    )
    return json.loads(done.stdout)


def merged(points, converged):
    """Settings from neighbouring element counts: the least time and the largest error."""
    settings = {}
    optional = dict.fromkeys(("elements", "tolerance", "time_step_s", "gap_mm"))
    for point in points:
        point = optional | point
        if point["elements"]:
            point["elements"] = min(ELEMENTS, key=lambda n: abs(n - point["elements"]))
        point["error"] = point["gap_mm"] and max(
            abs(point[name] / converged[name] - 1) for name in ("gap_mm", "corner_force_n"))
        key = tuple(point[name] for name in ("name", "elements", "tolerance", "time_step_s"))
        other = settings.setdefault(key, point)
        both = (other["error"], point["error"])
        other["error"] = None if None in both else max(both)
        other["seconds"] = min(other["seconds"], point["seconds"])
    return list(settings.values())


def least(settings):
    """Least time within LEVEL by method, in the order in which they come."""
    found = {}
    for setting in settings:
        good = [setting["seconds"]] if (setting["error"] or 1) <= LEVEL else []
        found.setdefault(setting["name"], []).extend(good)
    return [[name, min(times, default=None)] for name, times in found.items()]


def table(result):
    """Least time of each method, and how many times that of the ring, the first, it is."""
    ring = result["least_seconds"][0][1]
    head = f"{'method':14}{f'ms within {100 * LEVEL} %':>18}{'over the ring':>16}"
    rows = [
        f"{name:14}{1e3 * least:18.2f}{least / ring:16.1f}" if least
        else f"{name:14}{'never':>18}{'never':>16}"
        for name, least in result["least_seconds"]
    ]
    return "\n".join([head, "-" * len(head), *rows])


def figure(result, path):
    """Error against time: settings that no other of their method beats in both."""
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "peers"})
    plot = matplotlib.figure.Figure(figsize=(6.4, 3.8), layout="constrained")
    axes = plot.subplots()
    for name, _ in result["least_seconds"]:
        points = []
        for setting in sorted(result["settings"], key=lambda setting: setting["seconds"]):
            error = setting["name"] == name and setting["error"]
            if error and (not points or error < points[-1][1]):
                points.append((1e3 * setting["seconds"], error))
        if points:
            axes.loglog(*zip(*points), "o-", label=name)
    axes.set(title="One crossing (5 mm/s, 100 N)", xlabel="time, ms")
    axes.set_ylabel("relative error of gap or force")
    axes.grid(color="#e9ebef")
    axes.minorticks_off()
    axes.legend()
    plot.savefig(path, metadata={"Date": None})


def write_docs(result):
    figure(result, DOCS / "figures/peers.svg")
    page = (DOCS / "PLANT.md").read_text()
    before, rest = page.split("<!-- peers -->\n")
    after = rest.split("<!-- end -->", 1)[1]
    block = f"<!-- peers -->\n```text\n{table(result)}\n```\n<!-- end -->"
    (DOCS / "PLANT.md").write_text(before + block + after)


def main():
    problem = json.loads((HERE / "problem.json").read_text())
    folder = sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()
    given = problem["given"] | {"folder": folder}
    answers = [answer(script, given) for script in ("solvers.py", "mujoco_crossing.py")]
    points = [point for one in answers for point in one["points"]]
    settings = problem["ring"] + merged(points, problem["converged"])
    result = {
        "versions": [one["version"] for one in answers],
        "settings": settings,
        "least_seconds": least(settings),
    }
    text = json.dumps(result, indent=1)
    # A setting a line.
    text = re.sub(r"\{\s+([^{}\[\]]*?)\s+\}", lambda m: "{" + re.sub(r"\s+", " ", m[1]) + "}", text)
    (HERE / "results.json").write_text(text + "\n")
    write_docs(result)


if __name__ == "__main__":
    main()
