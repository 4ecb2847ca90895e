"use strict";
// The paths of a flight in space, seen from far away: drag, keys or buttons turn the view.

(() => {
  const canvas = document.getElementById("path");
  if (!canvas) return;
  const { flight } = garl;
  const scene = flight.scene;
  const context = canvas.getContext("2d");
  const START = { yaw: -0.6, pitch: 0.55 };
  const view = { ...START, zoom: 1 };
  const ground = new Image();
  const reach = reachOf();
  const labels = [];
  let size = { width: 0, height: 0 };

  // The middle of the UAV's path and the marker, and how far they reach from it.
  function reachOf() {
    const xs = [...flight.uav.x, flight.marker[0]];
    const ys = [...flight.uav.y, flight.marker[1]];
    const top = Math.max(2, ...flight.uav.z);
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const across = Math.max(8, Math.hypot(x1 - x0, y1 - y0));
    return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, z: top / 2, across, top };
  }

  function scale() {
    const tall = reach.top * Math.cos(view.pitch) + reach.across * Math.sin(view.pitch);
    return view.zoom * Math.min(size.width / (reach.across * 1.25), size.height / (tall * 1.25));
  }

  // The pixel of a place, and how far away it is.
  function project([x, y, z]) {
    const s = scale();
    const [dx, dy, dz] = [x - reach.x, y - reach.y, z - reach.z];
    const across = dx * Math.cos(view.yaw) + dy * Math.sin(view.yaw);
    const away = -dx * Math.sin(view.yaw) + dy * Math.cos(view.yaw);
    const up = away * Math.sin(view.pitch) + dz * Math.cos(view.pitch);
    return { x: size.width / 2 + across * s, y: size.height / 2 - up * s, away };
  }

  function trace(points, close = false) {
    context.beginPath();
    points.forEach((point, index) => {
      const { x, y } = project(point);
      if (index) context.lineTo(x, y);
      else context.moveTo(x, y);
    });
    if (close) context.closePath();
  }

  function stroke(points, colour, width, { close = false, dash = [] } = {}) {
    trace(points, close);
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }

  function fill(points, colour) {
    trace(points, true);
    context.fillStyle = colour;
    context.fill();
  }

  function drawGround(ratio) {
    if (!scene) return drawGrid();
    if (!ground.complete || !ground.naturalWidth) return;
    const s = scale() * scene.m_per_px;
    const origin = project([scene.x_m, scene.y_m, 0]);
    const [cos, sin, tilt] = [Math.cos(view.yaw), Math.sin(view.yaw), Math.sin(view.pitch)];
    context.save();
    context.setTransform(
      ratio * s * cos, ratio * s * sin * tilt, -ratio * s * sin, ratio * s * cos * tilt,
      ratio * origin.x, ratio * origin.y,
    );
    context.globalAlpha = 0.85;
    context.drawImage(ground, 0, 0);
    context.restore();
  }

  // Lines 5 m apart, for a flight in another simulator, whose ground nobody can paint.
  function drawGrid() {
    const [mx, my] = flight.marker;
    for (let at = -20; at <= 20; at += 5) {
      stroke([[mx + at, my - 20, 0], [mx + at, my + 20, 0]], garl.colour("rule"), 1);
      stroke([[mx - 20, my + at, 0], [mx + 20, my + at, 0]], garl.colour("rule"), 1);
    }
  }

  function shade([r, g, b], share) {
    return `rgb(${Math.round(r * share)} ${Math.round(g * share)} ${Math.round(b * share)} / 0.82)`;
  }

  function drawBodies() {
    const parts = (scene ? scene.bodies : []).flatMap((body) => body.parts);
    const away = (part) => project([...part.outline[0], part.low]).away;
    for (const part of [...parts].sort((a, b) => away(b) - away(a))) {
      const top = part.outline.map(([x, y]) => [x, y, part.high]);
      part.outline.forEach(([x, y], i) => {
        const [nx, ny] = part.outline[(i + 1) % part.outline.length];
        const side = [[x, y, part.low], [nx, ny, part.low], [nx, ny, part.high], [x, y, part.high]];
        fill(side, shade(part.colour, 0.82));
      });
      fill(top, shade(part.colour, 1.1));
    }
  }

  // Names wait until all bodies are drawn; one that would cover another goes above it.
  function label(text, place, colour) {
    labels.push({ text, colour, ...project(place) });
  }

  function writeLabels() {
    context.font = "12px system-ui, sans-serif";
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.strokeStyle = garl.colour("halo");
    const written = [];
    for (const { text, colour, x, y } of labels.splice(0).reverse()) {
      const wide = context.measureText(text).width;
      const left = Math.min(Math.max(4, x - wide / 2), size.width - wide - 4);
      let base = y - 11;
      const covers = (each) => Math.abs(each.base - base) < 14
        && left < each.left + each.wide + 4 && each.left < left + wide + 4;
      while (written.some(covers)) base -= 14;
      written.push({ left, wide, base });
      context.strokeText(text, left, base);
      context.fillStyle = colour;
      context.fillText(text, left, base);
    }
  }

  function drawMarker() {
    const [x, y] = flight.marker;
    const half = 0.75;
    const square = scene
      ? scene.outline.map(([a, b]) => [a, b, 0])
      : [[x - half, y - half, 0], [x + half, y - half, 0], [x + half, y + half, 0], [x - half, y + half, 0]];
    stroke(square, garl.colour("marker"), 3, { close: true });
    for (const [name, dx, dy] of flight.decoys) label(name, [dx, dy, 0], garl.colour("ink"));
  }

  const points = (track, until) => {
    const found = [];
    for (let i = 0; i < until; i += 1) found.push([track.x[i], track.y[i], track.z[i]]);
    return found;
  };

  function drawObject(item, time, until) {
    const colour = garl.colour(["person", "dog", "bird"].includes(item.type) ? item.type : "npc");
    const flat = points(item, until).map(([x, y, z]) => [x, y, item.low_m < 0 ? z : 0]);
    const [x, y, z] = garl.positionAt(item, time);
    stroke([...flat, [x, y, item.low_m < 0 ? z : 0]], colour, 1.5);
    const bottom = z + item.low_m;
    const ring = (height) => Array.from({ length: 16 }, (_, i) => {
      const angle = (i / 16) * 2 * Math.PI;
      return [x + item.radius_m * Math.cos(angle), y + item.radius_m * Math.sin(angle), height];
    });
    context.globalAlpha = 0.55;
    fill(ring(bottom), colour);
    context.globalAlpha = 1;
    for (const height of [bottom, bottom + item.height_m]) stroke(ring(height), colour, 1.5, { close: true });
    for (const i of [0, 4, 8, 12]) stroke([ring(bottom)[i], ring(bottom + item.height_m)[i]], colour, 1);
    label(item.name, [x, y, bottom + item.height_m], colour);
  }

  function drawUav(time, until) {
    const blue = garl.colour("uav");
    const place = garl.positionAt(flight.uav, time);
    const [x, y, z] = place;
    const all = points(flight.uav, flight.t.length);
    context.globalAlpha = 0.35;
    stroke(all, blue, 1.5);
    stroke(all.map(([a, b]) => [a, b, 0]), garl.colour("ink"), 1, { dash: [2, 4] });
    context.globalAlpha = 1;
    stroke([...points(flight.uav, until), place], blue, 3);
    stroke([place, [x, y, 0]], blue, 1, { dash: [4, 3] });
    for (const [a, b] of [[1, 1], [1, -1]]) {
      stroke([[x - a * 0.35, y - b * 0.35, z], [x + a * 0.35, y + b * 0.35, z]], blue, 3);
    }
    const middle = project(place);
    context.beginPath();
    context.arc(middle.x, middle.y, 5, 0, 2 * Math.PI);
    context.fillStyle = blue;
    context.fill();
    label(`UAV, ${Math.max(0, z).toFixed(1)} m up`, place, blue);
  }

  function drawBelief(time) {
    const orange = garl.colour("system");
    const plan = garl.lastUntil(flight.plans, time);
    if (plan && time - plan[0] < 1.5) stroke(plan[1], orange, 2, { dash: [6, 3] });
    const target = garl.lastUntil(flight.targets, time);
    if (!target) return;
    const [, x, y] = target;
    for (const way of [1, -1]) stroke([[x - 0.4, y - 0.4 * way, 0], [x + 0.4, y + 0.4 * way, 0]], orange, 3);
  }

  function drawCompass() {
    const [cx, cy, length] = [26, 30, 14];
    const east = [Math.cos(view.yaw), Math.sin(view.yaw) * Math.sin(view.pitch)];
    const north = [-Math.sin(view.yaw), Math.cos(view.yaw) * Math.sin(view.pitch)];
    context.lineWidth = 2;
    for (const [name, [dx, dy]] of [["N", north], ["E", east]]) {
      context.strokeStyle = context.fillStyle = garl.colour(name === "N" ? "ink" : "faint");
      context.beginPath();
      context.moveTo(cx, cy);
      context.lineTo(cx + dx * length, cy - dy * length);
      context.stroke();
      context.font = "11px system-ui, sans-serif";
      context.fillText(name, cx + dx * (length + 8) - 4, cy - dy * (length + 8) + 4);
    }
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    size = { width: canvas.clientWidth, height: canvas.clientHeight };
    canvas.width = Math.round(size.width * ratio);
    canvas.height = Math.round(size.height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const until = garl.indexAt(garl.time) + 1;
    drawGround(ratio);
    drawMarker();
    drawBodies();
    drawBelief(garl.time);
    for (const item of flight.objects) drawObject(item, garl.time, until);
    drawUav(garl.time, until);
    writeLabels();
    drawCompass();
    canvas.dataset.time = garl.time.toFixed(2);
  }

  let asked = 0;
  function redraw() {
    cancelAnimationFrame(asked);
    asked = requestAnimationFrame(draw);
  }

  function turn(yaw, pitch) {
    view.yaw += yaw;
    view.pitch = Math.min(Math.PI / 2, Math.max(0.05, view.pitch + pitch));
    redraw();
  }

  const zoom = (factor) => { view.zoom = Math.min(12, Math.max(0.3, view.zoom * factor)); };

  const views = {
    start: () => Object.assign(view, START, { zoom: 1 }),
    above: () => Object.assign(view, { yaw: 0, pitch: Math.PI / 2 }),
    side: () => Object.assign(view, { yaw: 0, pitch: 0.05 }),
    nearer: () => zoom(1.3),
    farther: () => zoom(1 / 1.3),
  };
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => {
      views[button.dataset.view]();
      redraw();
    });
  }

  let dragged = null;
  canvas.addEventListener("pointerdown", (event) => {
    dragged = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!dragged) return;
    turn((dragged[0] - event.clientX) / 150, (event.clientY - dragged[1]) / 150);
    dragged = [event.clientX, event.clientY];
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, () => { dragged = null; });
  }
  canvas.addEventListener("wheel", (event) => {
    // Without a key the wheel scrolls the page.
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    zoom(event.deltaY < 0 ? 1.15 : 1 / 1.15);
    redraw();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const keys = {
      ArrowLeft: () => turn(0.1, 0), ArrowRight: () => turn(-0.1, 0),
      ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
      "+": views.nearer, "-": views.farther, Home: views.start,
    };
    if (!(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
    redraw();
  });

  if (scene) {
    ground.addEventListener("load", redraw);
    ground.src = scene.ground;
  }
  new ResizeObserver(redraw).observe(canvas);
  garl.onTime(redraw);
  garl.onColours(redraw);
})();
