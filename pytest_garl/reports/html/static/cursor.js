"use strict";
// One time of the flight for film, path and timeline: whoever moves the cursor tells all others.

const garl = {
  flight: JSON.parse(document.getElementById("flight").textContent),
  time: 0,
  listeners: [],

  // Call listener(time, source) now and whenever the cursor moves.
  onTime(listener) {
    this.listeners.push(listener);
    listener(this.time, "start");
  },

  // Move the cursor; source names the view that moves it, so that it need not follow itself.
  setTime(time, source) {
    this.time = Math.min(this.flight.end_s, Math.max(0, time));
    for (const listener of this.listeners) listener(this.time, source);
  },

  // The index of the last sample up to a time.
  indexAt(time) {
    const times = this.flight.t;
    let low = 0;
    let high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  },

  // The position of a track at a time, between two samples.
  positionAt(track, time) {
    const i = this.indexAt(time);
    const j = Math.min(i + 1, this.flight.t.length - 1);
    const span = this.flight.t[j] - this.flight.t[i];
    const share = span > 0 ? Math.min(1, Math.max(0, (time - this.flight.t[i]) / span)) : 0;
    const between = (values) => values[i] + share * (values[j] - values[i]);
    return [between(track.x), between(track.y), between(track.z)];
  },

  // The last of [time, ...] pairs up to a time.
  lastUntil(pairs, time) {
    let found = null;
    for (const pair of pairs) {
      if (pair[0] > time + 1e-6) break;
      found = pair;
    }
    return found;
  },

  colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  },

  // Call draw() now, and when the page turns light or dark.
  onColours(draw) {
    for (const query of ["(prefers-color-scheme: dark)", "print"]) {
      matchMedia(query).addEventListener("change", draw);
    }
  },
};
