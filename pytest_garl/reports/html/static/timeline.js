"use strict";
// Margins over time, and what held when; a click or a drag moves the cursor.

(() => {
  const { flight } = garl;
  const LEFT = 52;
  const RIGHT = 14;
  const charts = [];

  // Lines of one unit: a chart, and a legend whose boxes switch them on and off.
  function addChart(id, lines, unit, range) {
    const host = document.getElementById(id);
    if (!host || !lines.length) return;
    const legend = host.parentElement.querySelector(".legend");
    const values = lines.map((line) => legendEntry(legend, line, (shown) => {
      chart.setSeries(lines.indexOf(line) + 1, { show: shown });
    }));
    const axis = (side, label) => ({
      side,
      size: side === 3 ? LEFT : 26,
      stroke: () => garl.colour("faint"),
      grid: { stroke: () => garl.colour("rule"), width: 1 },
      ticks: { show: false },
      font: "12px system-ui, sans-serif",
      values: (_, ticks) => ticks.map((tick) => (tick === null ? "" : `${tick} ${label}`)),
    });
    const options = {
      width: host.clientWidth,
      height: unit === "m" ? 240 : 130,
      padding: [8, RIGHT, 0, 0],
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, x: false, y: false, points: { show: false } },
      scales: { x: { time: false, range: () => [0, Math.max(flight.end_s, 0.1)] }, y: { range } },
      axes: [axis(2, "s"), axis(3, unit)],
      series: [{}, ...lines.map((line) => ({
        label: line.name,
        stroke: () => garl.colour(line.kind),
        width: line.kind === "marker" || line.kind === "npc" ? 2.5 : 1.75,
        dash: line.kind === "target" || line.kind === "visible" ? [6, 4] : [],
        points: { show: false },
        spanGaps: false,
      }))],
      hooks: { draw: [drawCursor] },
    };
    const chart = new uPlot(options, [flight.t, ...lines.map((line) => line.values)], host);
    charts.push({ chart, host, values, lines, unit });
    takesPointer(chart.over);
  }

  function legendEntry(legend, line, show) {
    const entry = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = true;
    box.addEventListener("change", () => show(box.checked));
    const swatch = document.createElement("span");
    swatch.className = `swatch ${line.kind}`;
    const value = document.createElement("span");
    value.className = "value";
    entry.append(box, swatch, `${line.name} `, value);
    legend.append(entry);
    return value;
  }

  function drawCursor(chart) {
    const ratio = uPlot.pxRatio;
    const x = Math.round(chart.valToPos(garl.time, "x", true));
    const { ctx, bbox } = chart;
    ctx.save();
    ctx.strokeStyle = garl.colour("cursor");
    ctx.lineWidth = 2 * ratio;
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  function takesPointer(element, inset = 0) {
    let held = false;
    const move = (event) => {
      const box = element.getBoundingClientRect();
      const share = (event.clientX - box.left - inset) / (box.width - inset - (inset ? RIGHT : 0));
      garl.setTime(share * flight.end_s, "timeline");
    };
    element.addEventListener("pointerdown", (event) => {
      held = true;
      element.setPointerCapture(event.pointerId);
      move(event);
    });
    element.addEventListener("pointermove", (event) => { if (held) move(event); });
    for (const name of ["pointerup", "pointercancel"]) {
      element.addEventListener(name, () => { held = false; });
    }
  }

  // Rows of spans: the system's phases, the marker readable, who was in view.
  function addStrips() {
    const host = document.getElementById("strips");
    if (!host) return;
    const percent = (time) => `${(100 * time) / Math.max(flight.end_s, 0.1)}%`;
    const row = (name, kind, spans) => {
      const line = document.createElement("div");
      line.className = "strip";
      const title = document.createElement("span");
      title.className = "strip-name";
      title.textContent = name;
      const track = document.createElement("div");
      track.className = "track";
      for (const [start, end, text] of spans) {
        const span = document.createElement("span");
        span.className = `span ${kind}`;
        span.style.left = percent(start);
        span.style.width = percent(Math.max(end - start, flight.end_s / 400));
        if (text) span.textContent = span.title = text;
        track.append(span);
      }
      line.append(title, track);
      host.append(line);
    };
    if (flight.phases.length) row("system's phase", "phase", flight.phases);
    for (const strip of flight.strips) row(strip.name, strip.kind, strip.spans);
    const line = document.createElement("div");
    line.className = "strip-cursor";
    host.append(line);
    takesPointer(host, LEFT);
    garl.onTime((time) => {
      line.style.left = `calc(${LEFT}px + (100% - ${LEFT + RIGHT}px) * ${time / Math.max(flight.end_s, 0.1)})`;
    });
  }

  const upTo = (_, low, high) => [Math.min(0, low ?? 0), Math.max(1, (high ?? 1) * 1.08)];
  addChart("metres", flight.metres, "m", upTo);
  addChart("percent", flight.percent, "%", () => [0, 105]);
  addStrips();

  garl.onTime((time) => {
    const index = garl.indexAt(time);
    for (const { chart, host, values, lines, unit } of charts) {
      chart.redraw(false, false);
      host.dataset.time = time.toFixed(2);
      lines.forEach((line, i) => {
        const value = line.values[index];
        values[i].textContent = value === null ? "–" : `${value.toFixed(unit === "m" ? 2 : 0)} ${unit}`;
      });
    }
  });
  const resize = new ResizeObserver(() => {
    for (const { chart, host } of charts) {
      if (host.clientWidth && host.clientWidth !== chart.width) {
        chart.setSize({ width: host.clientWidth, height: chart.height });
      }
    }
  });
  for (const { host } of charts) resize.observe(host);
  garl.onColours(() => { for (const { chart } of charts) chart.redraw(false, true); });
})();
