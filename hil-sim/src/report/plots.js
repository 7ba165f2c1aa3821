// One cursor in every plot with the values there, zoom and reset. A plot's lines are in the units of
// its axes, in an inner picture: to zoom is to show another part of it.
"use strict";

const plots = (() => {
  const pairs = (text) => text.trim().split(" ").map(Number);
  const page = document.getElementById("track");
  // Times and positions of the run.
  const track = page ? JSON.parse(page.textContent) : [];
  const groups = new Map();
  // Every line over time by clock, axis and name.
  const series = new Map();
  let picked = () => {};

  // The value of y at x on a line of points; null where there is none. The line may turn back.
  function along(points, x) {
    for (let i = 1; i < points.length; i++) {
      const [a, b] = [points[i - 1], points[i]];
      if (a && b && (a[0] - x) * (b[0] - x) <= 0) {
        return b[0] === a[0] ? b[1] : a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]);
      }
    }
    return null;
  }

  // The points of a path, with null where it is broken.
  function points(path) {
    return path.getAttribute("d").split("M").slice(1).flatMap((piece) => {
      const numbers = pairs(piece.replace("h0", ""));
      return [...Array(numbers.length / 2).keys()].map((i) => [numbers[2 * i], numbers[2 * i + 1]]).concat([null]);
    });
  }

  function ticks(low, high, most) {
    const decade = 10 ** Math.floor(Math.log10((high - low) / most));
    const step = decade * [1, 2, 5, 10].find((f) => f * decade >= (high - low) / most * (1 - 1e-9));
    const decimals = Math.max(0, -Math.floor(Math.log10(step * 1.000001)));
    const all = [];
    for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) all.push(n * step);
    return all.map((at) => [at, (at + 0).toFixed(decimals).replace(/^-(0\.?0*)$/, "$1")]);
  }

  function element(name, attributes, text) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  function plot(figure) {
    const svg = figure.querySelector("svg.plot"), data = svg.querySelector(".data");
    const all = (what) => [...data.querySelectorAll(what)];
    const [, , wide, high] = pairs(svg.getAttribute("viewBox"));
    const [left, top, across, down] = ["x", "y", "width", "height"].map((name) => Number(data.getAttribute(name)));
    const right = wide - left - across, bottom = top + down;
    const full = { x: pairs(figure.dataset.x), y: pairs(figure.dataset.y) };
    const lines = all(".line").map((path) => [path.dataset.name, points(path)]);
    const shown = lines.concat(all(".mark").map((path) => ["", points(path)])).flatMap((line) => line[1]);
    const bands = all(".band").map((rect) => {
      const [x, y, width] = ["x", "y", "width"].map((name) => Number(rect.getAttribute(name)));
      return { x, width, lane: Math.round(-y - 0.92), name: rect.dataset.name };
    });
    const lanes = -full.y[0] * Math.sign(bands.length);
    const spans = [...figure.querySelectorAll("figcaption span")];
    const also = figure.dataset.also && figure.dataset.also.split(" ");
    const decimals = also ? 1 : Math.min(4, Math.max(0, 3 - Math.floor(Math.log10(full.y[1] - full.y[0]))));
    const since = Number(figure.dataset.since), overPosition = figure.dataset.across === "position";
    const clock = figure.closest("[data-clock]"), clocks = [...document.querySelectorAll("[data-clock]")];
    const key = (name) => [clocks.indexOf(clock), figure.dataset.of, name].join();
    for (const [name, line] of overPosition ? [] : lines) {
      const own = { line, since, x: full.x, long: full.x[1] - full.x[0] };
      series.set(key(name), [...(series.get(key(name)) || []), own].sort((a, b) => a.long - b.long));
    }
    // The value at t from the most enlarged plot, so that every plot shows the same.
    const valueAt = (name, t) => (series.get(key(name)) || [])
      .filter((one) => t - one.since >= one.x[0] && t - one.since <= one.x[1])
      .reduce((found, one) => found ?? along(one.line, t - one.since), null);
    const cursor = element("path", { class: "cursor" }), chosen = element("rect", { class: "chosen", y: top, height: down });
    svg.append(chosen, cursor);
    let { x, y } = full, width = wide, at = null, from = null;

    const pixel = (value) => left + (value - x[0]) / (x[1] - x[0]) * (width - left - right);
    const xOf = (event) => {
      const box = svg.getBoundingClientRect();
      const part = ((event.clientX - box.left) / box.width * width - left) / (width - left - right);
      return x[0] + Math.min(1, Math.max(0, part)) * (x[1] - x[0]);
    };
    const timeOf = (value) => {
      if (!overPosition) return value + since;
      return track.reduce((a, b) => (Math.abs(b[1] - value) < Math.abs(a[1] - value) ? b : a), track[0])[0];
    };

    function zoom(range) {
      ({ x, y } = full);
      if (range) {
        x = range;
        const inside = shown.filter((p) => p && p[0] >= x[0] && p[0] <= x[1] && p[1] >= y[0] && p[1] <= y[1]).map((p) => p[1]);
        const [low, high] = [Math.min(...inside), Math.max(...inside)];
        const room = Math.max(0.08 * (high - low), (Number(figure.dataset.least) - high + low) / 2, 1e-4 * Math.abs(high), 1e-6);
        if (inside.length && !bands.length) y = [Math.max(y[0], low - room), Math.min(y[1], high + room)];
      }
      figure.classList.toggle("zoomed", Boolean(range));
      layout();
    }

    // Draws axes, names and cursor for the room that there is.
    function layout() {
      width = svg.clientWidth || width;
      const end = width - right;
      svg.setAttribute("viewBox", `0 0 ${width} ${high}`);
      svg.style.height = `${high}px`;
      data.setAttribute("width", end - left);
      data.setAttribute("viewBox", `${x[0]} ${-y[1]} ${x[1] - x[0]} ${y[1] - y[0]}`);
      svg.querySelector(".axis").setAttribute("d", `M${left} ${top}V${bottom}H${end}`);
      const name = svg.querySelector(".across");
      if (name) name.setAttribute("x", (left + end) / 2);
      const axes = ticks(...x, Math.min(10, Math.max(2, (end - left) / 45))).flatMap(([value, text]) => [
        element("path", { class: "grid", d: `M${pixel(value)} ${top}V${bottom}` }),
        element("text", { x: pixel(value), y: bottom + 16, "text-anchor": "middle" }, name ? text : ""),
      ]);
      for (const [value, text] of bands.length ? [] : ticks(...y, Math.min(7, Math.max(2, high / 27)))) {
        const place = bottom - (value - y[0]) / (y[1] - y[0]) * down;
        axes.push(element("path", { class: "grid", d: `M${left} ${place}H${end}` }));
        axes.push(element("text", { x: left - 6, y: place + 4, "text-anchor": "end" }, text));
      }
      svg.querySelector(".axes").replaceChildren(...axes);
      const labels = svg.querySelector(".labels"), taken = [];
      // A text at the first of these places where there is room; a fault's without room at the last.
      const add = (text, places, more, low, high, isFault) => {
        const label = element("text", more, text);
        labels.append(label);
        for (const [x, anchor] of places) {
          label.setAttribute("x", x);
          label.setAttribute("text-anchor", anchor);
          const from = label.getBBox().x, to = from + label.getBBox().width;
          if (from >= low && to <= high && taken.every(([a, b, y]) => y !== more.y || from >= b || to <= a)) {
            taken.push([from - 4, to + 4, more.y]);
            return true;
          }
        }
        if (!isFault) label.remove();
        return isFault;
      };
      labels.replaceChildren();
      // Faults choose first, then the shaded spans.
      for (const mark of [...all(".fault"), ...all(".shade"), ...all(".rule:not(.fault)")].filter((one) => one.dataset.name)) {
        const isSpan = mark.tagName === "rect", number = (name) => Number(mark.getAttribute(name));
        const [low, high] = isSpan ? [number("x"), number("x") + number("width")] : Array(2).fill(pairs(mark.getAttribute("d").slice(1))[0]);
        if (high < x[0] || low > x[1]) continue;
        const place = pixel((Math.max(low, x[0]) + Math.min(high, x[1])) / 2);
        const more = { y: 0.75 * top, fill: isSpan ? "#64748b" : mark.getAttribute("stroke") };
        add(mark.dataset.name, isSpan ? [[place, "middle"]] : [[place + 2, "start"], [place - 2, "end"]], more, 0, width, mark.matches(".fault"));
      }
      for (const { x: start, width: long, lane, name } of bands) {
        const [low, high] = [Math.max(left, pixel(start)), Math.min(end, pixel(start + long))];
        const middle = [[(low + high) / 2, "middle"]];
        const more = { y: top + (lane + 0.5) / -full.y[0] * down + 4, fill: "#1f2937" };
        // Where its name has no room, a stage has its number.
        if (high > low) add(name, middle, more, low, high) || add(parseInt(name) || "", middle, more, low, high);
      }
      if (at !== null) show(at);
    }

    function show(t) {
      at = t;
      const value = overPosition ? along(track, t) : t - since;
      const place = value === null ? -1 : pixel(value);
      const isInside = place >= left && place <= width - right;
      cursor.setAttribute("d", isInside ? `M${place} ${top}V${bottom}` : "");
      figure.querySelector("output").textContent = `${(t + 0).toFixed(3)} s`;
      for (const [lane, span] of spans.entries()) {
        const line = lines.find(([name]) => name === span.dataset.name);
        const number = line && isInside ? valueAt(line[0], t) : null;
        const band = isInside && bands.find((one) => one.lane === lane && value >= one.x && value <= one.x + one.width);
        const second = number !== null && also ? ` (${(number * also[0]).toFixed(3)} ${also[1]})` : "";
        if (line || lane < lanes) span.querySelector("b").textContent = band ? band.name : number === null ? "" : number.toFixed(decimals) + second;
      }
    }

    const self = { figure, clock, zoom, layout, show, range: () => x, full: full.x, middle: () => (at === null || overPosition ? null : at - since) };
    const axis = [clocks.indexOf(clock), figure.dataset.across, since].join();
    if (!groups.has(axis)) groups.set(axis, []);
    const group = groups.get(axis);
    group.push(self);

    const pick = (event) => {
      const t = timeOf(xOf(event));
      each(clock, (one) => one.show(t));
      picked(t);
    };
    svg.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "mouse" && event.button === 0) { from = xOf(event); svg.setPointerCapture(event.pointerId); event.preventDefault(); }
    });
    svg.addEventListener("pointermove", (event) => {
      pick(event);
      const [a, b] = from === null ? [0, 0] : [pixel(from), pixel(xOf(event))];
      chosen.setAttribute("x", Math.min(a, b));
      chosen.setAttribute("width", Math.abs(b - a));
    });
    svg.addEventListener("pointerup", (event) => {
      const to = xOf(event);
      if (from !== null && Math.abs(pixel(to) - pixel(from)) > 8) group.forEach((one) => one.zoom([Math.min(from, to), Math.max(from, to)]));
      from = null;
      chosen.setAttribute("width", 0);
      pick(event);
    });
    svg.addEventListener("dblclick", () => group.forEach((one) => one.zoom(null)));
    new ResizeObserver(layout).observe(figure);
    return self;
  }

  const every = [...document.querySelectorAll("figure[data-across]")].map(plot);
  const each = (clock, what) => every.filter((one) => one.clock === clock).forEach(what);

  // The buttons of the plots that zoom together, for touch and keyboard too.
  for (const group of groups.values()) {
    const bar = document.createElement("p"), first = group[0];
    bar.className = "zoom";
    const by = (factor) => () => {
      const [low, high] = first.range(), middle = first.middle();
      const centre = middle !== null && middle > low && middle < high ? middle : (low + high) / 2;
      const range = [centre - factor * (centre - low), centre + factor * (high - centre)];
      const inside = [Math.max(range[0], first.full[0]), Math.min(range[1], first.full[1])];
      const all = inside[0] === first.full[0] && inside[1] === first.full[1];
      group.forEach((one) => one.zoom(all ? null : inside));
    };
    for (const [name, act] of [["zoom in", by(0.5)], ["zoom out", by(2)], ["reset", () => group.forEach((one) => one.zoom(null))]]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = name;
      button.addEventListener("click", act);
      bar.append(button);
    }
    bar.append("Drag across a plot to zoom, double click to reset.");
    first.figure.before(bar);
  }
  // `show` moves every cursor to a time; what is picked with the pointer goes to the function given.
  return { show: (t) => every.forEach((one) => one.show(t)), onPick: (what) => { picked = what; } };
})();
