// Draws the run at an instant and moves a cursor through every plot. Lengths in mm, forces in N,
// times in s; x along the sleeve, y from the outermost wall towards the pillar.
"use strict";

// The row at time t, each column interpolated; null where one of its neighbours is unknown. Where the
// load jumps from wall to corner or back, the later row.
function rowAt(scene, t) {
  const rows = scene.rows;
  let low = 0, high = rows.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] <= t) low = middle; else high = middle;
  }
  const a = rows[low], b = rows[high], span = b[0] - a[0];
  const part = span > 0 ? Math.min(1, Math.max(0, (t - a[0]) / span)) : 0;
  const jumps = ["corner_force_n", "floor_force_n"].map((name) => scene.columns.indexOf(name))
    .every((i) => (a[i] > 0) !== (b[i] > 0));
  const row = {};
  scene.columns.forEach((name, i) => {
    const known = a[i] !== null && b[i] !== null;
    row[name] = jumps && part > 0 && i > 0 ? b[i] : known ? a[i] + part * (b[i] - a[i]) : null;
  });
  return row;
}

function wallAt(geometry, x) {
  return geometry.steps.reduce((y, [face, height]) => (face <= x ? y + height : y), 0);
}

// Everything that is drawn of a row.
function pose(scene, row) {
  const g = scene.geometry;
  const x = row.position_mm, y = g.wall_radius_mm - row.radius_mm;
  const ahead = g.steps.find(([face]) => face > x);
  // The edge that carries is at most a little behind the axle.
  const edge = g.steps.find(([face]) => face > (row.corner_force_n > 0 ? x - 0.5 : x));
  const root = ahead && ahead[0] - x < g.wheel_radius_mm ? [ahead[0], wallAt(g, x)] : null;
  const away = root && Math.hypot(root[0] - x, root[1] - y);
  const rise = g.wall_radius_mm - g.arm_pivot_radius_mm - y;
  const run = g.pivot_side * Math.sqrt(Math.max(0, g.arm_length_mm ** 2 - rise ** 2));
  return {
    x, y, floor: wallAt(g, x),
    edge: edge ? [edge[0], wallAt(g, edge[0])] : null,
    root: root && away > 0 ? root : null,
    // Point of the undeformed wheel that is next to the root.
    rim: root && away > 0 && [0, 1].map((i) => [x, y][i] + (root[i] - [x, y][i]) * g.wheel_radius_mm / away),
    pivot: [x + run, y + rise],
    // The spring acts half-way along the arm: twice the force, four times the stiffness.
    spring_mm: 45 - row.preload_n / (2 * g.spring_n_per_mm),
  };
}

// The pressure along a surface, as the outline of an area in mm² a tenth of the force in N: spread over
// the points of the surface as deep as they are within the undeformed wheel.
function pressure(centre, radius, surface, force) {
  const depths = surface.map((point) => Math.max(0, radius - Math.hypot(point[0] - centre[0], point[1] - centre[1])));
  const area = depths.slice(1).reduce((sum, depth, i) =>
    sum + depth * Math.hypot(surface[i + 1][0] - surface[i][0], surface[i + 1][1] - surface[i][1]), 0);
  if (!(force > 0.2 && area > 0)) return [];
  const tips = surface.map((point, i) => {
    const away = Math.hypot(point[0] - centre[0], point[1] - centre[1]);
    return [0, 1].map((k) => point[k] + (point[k] - centre[k]) / away * depths[i] * 0.1 * force / area);
  });
  return surface.concat(tips.reverse());
}

// The crossing that an instant belongs to: the one under way, or the next.
function current(scene, t) {
  return scene.crossings.find((c, i) => {
    const next = scene.crossings[i + 1];
    return t < Math.min(c.lift_s + 0.8, next ? (c.lift_s + next.touch_s) / 2 : Infinity);
  });
}

// What happens at a row, in words.
function phase(scene, row) {
  const n = (value, digits) => (value === null || !Number.isFinite(value) ? "unknown" : value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1"));
  const t = row.t_s;
  const next = current(scene, t);
  const said = scene.measured ? "measured " : "";
  const state = `${t.toFixed(2)} s: ${n(row.speed_mm_s, 1)} mm/s, ${said}preload ${n(row.preload_n, 1)} N of ${n(row.preload_ref_n, 1)} N wanted. `;
  if (!next) {
    const ahead = scene.geometry.steps.some(([face]) => (scene.retracts ? face < row.position_mm : face > row.position_mm));
    return state + (ahead ? "The wheel does not get over the next step in this run." : "No step is left ahead.");
  }
  const at = `Step ${next.index}: `;
  const over = Math.sign(next.face_mm - row.position_mm) * (scene.retracts ? -1 : 1);
  if (t < next.touch_s) {
    const left = Math.abs(row.position_mm - (next.face_mm - next.touch_mm));
    const why = row.preload_ref_n > scene.geometry.cruise_n + 0.5 ? ", and by then the preload has to be up" : "";
    return `${state}${at}the corner touches in ${left.toFixed(1)} mm${why}.`;
  }
  if (t < next.lift_s) {
    return state + at + (scene.retracts ? "the wheel rolls over the edge and down; the lower wall does not carry yet."
      : "the edge takes over the load from the lower wall. At lift-off the open distance is the gap.");
  }
  const gap = `${said}gap ${n(next.gap_mm, 2)} mm (reference ${n(scene.gap_ref_mm, 2)} mm)`;
  if (scene.retracts) return `${state}${at}the lower wall carries again, ${gap}.`;
  return state + at + (over > 0 ? `lifted off the lower wall, ${gap}; the wheel climbs on the edge.` : `the axle has passed the face, ${gap}.`);
}

function start(scene) {
  const $ = (id) => document.getElementById(id);
  const set = (id, attributes) => {
    for (const name in attributes) $(id).setAttribute(name, attributes[name]);
  };
  const g = scene.geometry, r = g.wheel_radius_mm, first = Math.max(0, scene.rows[0][0]);
  const last = scene.rows[scene.rows.length - 1][0];
  const near = { width: 84, height: 84 }, far = { width: 176, height: 176 };
  let from = first, to = last, now = first, frame = null;

  // The sleeve. It covers the wheel where the wheel is pressed flat: what is left is the deformed tread.
  let outline = "M-300,60 L-300,0", y = 0;
  for (const [face, height] of g.steps) {
    outline += ` L${face},${-y} L${face},${-(y += height)}`;
  }
  set("wall", { d: `${outline} L500,${-y} L500,60 Z` });
  document.querySelector("#wheel .rubber").setAttribute("r", r);
  document.querySelector("#wheel .hub").setAttribute("r", 0.7 * r);
  const spoke = 0.66 * r;
  document.querySelector("#wheel .spokes").setAttribute("d", `M${-spoke},0H${spoke}M0,${-spoke}V${spoke}`);
  set("outline", { r });

  function arrow(id, tail, tip, force, name) {
    const shown = force !== null && force > 0.2;
    $(id).style.display = $(id + "text").style.display = shown ? "" : "none";
    if (!shown) return;
    const dx = tip[0] - tail[0], dy = tip[1] - tail[1], size = Math.min(1, 2.5 / Math.hypot(dx, dy));
    const barb = (side) => `${tip[0] - size * (dx + side * dy / 2)},${-(tip[1] - size * (dy - side * dx / 2))}`;
    set(id, { d: `M${tail[0]},${-tail[1]}L${tip[0]},${-tip[1]}M${barb(1)}L${tip[0]},${-tip[1]}L${barb(-1)}` });
    $(id + "text").textContent = `${name} ${force.toFixed(1)} N`;
  }
  function label(id, x, y, anchor, size) {
    set(id, { x, y: -y, "text-anchor": anchor, "font-size": size });
  }

  function draw() {
    const row = rowAt(scene, now), p = pose(scene, row);
    const length = (force) => 20 * force / g.limit_n;
    set("near", { viewBox: `${p.x - 38} ${-(p.floor + 58)} ${near.width} ${near.height}` });
    const side = g.pivot_side;
    set("far", { viewBox: `${p.x - (side > 0 ? 40 : far.width - 40)} ${-(p.y + 133)} ${far.width} ${far.height}` });
    const text = (id, view) => 12.5 * view.width / ($(id).clientWidth || 500);
    const small = text("near", near), large = text("far", far);
    set("wheel", { transform: `translate(${p.x} ${-p.y}) rotate(${p.x / r * 180 / Math.PI})` });
    set("outline", { cx: p.x, cy: -p.y });

    arrow("preload", [p.x, p.y + length(row.preload_n)], [p.x, p.y], row.preload_n, scene.measured ? "measured preload" : "preload");
    label("preloadtext", p.x, p.y + Math.max(length(row.preload_n), r) + 1, "middle", small);
    const floor = row.floor_force_n || 0, corner = row.corner_force_n || 0;
    arrow("floor", [p.x, p.floor - length(floor)], [p.x, p.floor], row.floor_force_n, "wall");
    label("floortext", p.x - 2, p.floor - length(floor) - 1.3 * small, "end", small);
    const [ex, ey] = p.edge || [p.x, p.floor], away = Math.hypot(p.x - ex, p.y - ey) || 1;
    const tail = [ex - (p.x - ex) / away * length(corner), ey - (p.y - ey) / away * length(corner)];
    arrow("corner", tail, [ex, ey], p.edge && row.corner_force_n, "corner");
    label("cornertext", Math.min(tail[0] + 1, p.x + 44 - 9 * small), tail[1] - small, "start", small);

    const gap = p.root && row.root_clearance_mm !== null ? row.root_clearance_mm : null;
    $("gapline").style.display = $("gaptext").style.display = gap === null ? "none" : "";
    if (gap !== null) {
      set("gapline", { d: `M${p.root[0]},${-p.root[1]}L${p.rim[0]},${-p.rim[1]}` });
      $("gaptext").textContent = `clearance ${gap.toFixed(2)} mm`;
      label("gaptext", Math.min(p.root[0] + 6, p.x + 45 - 11 * small), p.edge[1] + 1.2, "start", small);
    }
    inset(row, p, gap);
    const c = scene.retracts ? null : current(scene, now);
    const touch = c && c.face_mm - c.touch_mm;
    set("touchline", { d: c ? `M${touch},${-(p.floor - 6)}V${-(p.floor + 4)}` : "" });

    const [px, py] = p.pivot, mid = [(p.x + px) / 2, (p.y + py) / 2], nut = mid[1] + p.spring_mm;
    set("pillar", { d: `M${p.x - 300},${-py}H${p.x + 500}V${-py - 300}H${p.x - 300}Z` });
    set("arm", { d: `M${p.x},${-p.y}L${px},${-py}` });
    let coil = `M${mid[0]},${-mid[1]}`;
    for (let i = 1; i < 12; i++) coil += `L${mid[0] + (i % 2 ? 5 : -5)},${-(mid[1] + p.spring_mm * i / 12)}`;
    set("spring", { d: `${coil}L${mid[0]},${-nut}` });
    set("screw", { d: `M${mid[0] - 8},${-nut}H${mid[0] + 8}M${mid[0]},${-nut}V${-py}` });
    label("pillartext", p.x - 4 * side, py - 1.2 * large, side > 0 ? "start" : "end", large);
    label("armtext", mid[0] + 16 * side, mid[1] + 4, side > 0 ? "start" : "end", large);
    label("springtext", mid[0] - 10 * side, mid[1] + p.spring_mm / 2, side > 0 ? "end" : "start", large);
    label("walltext", p.x + 50 * side, p.floor - 1.4 * large, "middle", large);

    $("phase").textContent = phase(scene, row);
    $("scrub").value = now;
    plots.show(now);
  }

  // The corner of one step: what the rubber fills, what presses, and the gap beside its reference.
  function inset(row, p, gap) {
    const next = current(scene, now) || scene.crossings[scene.crossings.length - 1];
    const at = next ? next.face_mm : p.edge ? p.edge[0] : p.x, upper = wallAt(g, at), lower = upper - (next ? next.height_mm : 0);
    const size = near.width / 5, small = 12.5 * size / ($("inset").clientWidth || 500);
    set("inset", { viewBox: `${at - 0.86 * size} ${-(lower + 0.62 * size)} ${size} ${size}` });
    const path = (points) => (points.length ? `M${points.map(([x, y]) => `${x},${-y}`).join("L")}Z` : "");
    const along = (from, to) => [...Array(41).keys()].map((i) => [0, 1].map((k) => from[k] + (to[k] - from[k]) * i / 40));
    const floor = along([Math.min(p.x - 8, at), p.floor], [p.x < at ? Math.min(p.x + 8, at) : p.x + 8, p.floor]);
    const corner = along([at, lower], [at, upper]).concat(along([at, upper], [at + 6, upper]));
    set("wallpressure", { d: path(pressure([p.x, p.y], r, floor, row.floor_force_n)) });
    set("cornerpressure", { d: p.x < at ? path(pressure([p.x, p.y], r, corner, row.corner_force_n)) : "" });
    const reference = scene.gap_ref_mm || 0;
    set("reference", { d: `M${at - reference},${-lower}A${reference},${reference} 0 0 1 ${at},${-(lower + reference)}` });
    label("referencetext", at - reference, lower - 1.4 * small, "end", small);
    $("referencetext").style.display = reference > 0 ? "" : "none";
    set("insetoutline", { r, cx: p.x, cy: -p.y });
    set("insetgap", { d: gap === null ? "" : $("gapline").getAttribute("d") });
    $("insettext").textContent = gap === null ? "" : `${gap.toFixed(2)} mm`;
    label("insettext", at + 0.13 * size, lower - 1.4 * small, "end", small);
  }

  // A pick in a plot goes to its instant.
  function pick(t) {
    if (t < from || t > to) { $("choice").value = "run"; choose(); }
    now = Math.min(to, Math.max(from, t));
    draw();
  }

  function choose() {
    const c = scene.crossings[$("choice").value];
    const [a, b] = c ? [Math.min(c.touch_s, c.lift_s), Math.max(c.touch_s, c.lift_s)] : [0, 0];
    [from, to] = c ? [Math.max(first, a - 0.5), Math.min(last, b + 0.8)] : [first, last];
    set("scrub", { min: from, max: to });
    // It opens where the corner carries.
    const corner = scene.columns.indexOf("corner_force_n");
    const carried = c && scene.rows.find((row) => row[0] >= a && row[corner] > 0);
    now = carried ? carried[0] : c ? a : from;
    draw();
  }

  function play() {
    if (frame !== null) { cancelAnimationFrame(frame); frame = null; $("play").textContent = "Play"; return; }
    if (now >= to) now = from;
    $("play").textContent = "Pause";
    let before = null;
    const tick = (time) => {
      now = Math.min(to, now + (before === null ? 0 : (time - before) / 1000 * Number($("rate").value)));
      before = time;
      draw();
      if (now < to) frame = requestAnimationFrame(tick);
      else { frame = null; $("play").textContent = "Play"; }
    };
    frame = requestAnimationFrame(tick);
  }

  // A step may be crossed more than once.
  scene.crossings.forEach((c, place) => $("choice").append(new Option(`step ${c.index}, ${c.touch_s.toFixed(1)} s`, place)));
  $("choice").append(new Option("the run", "run"));
  $("choice").addEventListener("change", choose);
  $("scrub").addEventListener("input", () => { now = Number($("scrub").value); draw(); });
  $("play").addEventListener("click", play);
  addEventListener("resize", draw);
  plots.onPick(pick);
  $("stage").hidden = false;
  choose();
}

if (typeof document === "undefined") module.exports = { rowAt, pose, current, phase };
else start(JSON.parse(document.getElementById("scene").textContent));
