"use strict";
// The film or the stills, the slider and the play button; all move the one cursor.

(() => {
  const { flight } = garl;
  const slider = document.getElementById("time");
  const clock = document.getElementById("clock");
  const play = document.getElementById("play");
  const film = document.getElementById("film");
  const still = document.getElementById("still");
  const caption = document.getElementById("still-caption");
  const cards = [...document.querySelectorAll("[data-moment]")];
  let playing = null;

  function momentAt(time) {
    let found = cards[0];
    for (const card of cards) {
      if (Number(card.dataset.moment) <= time + 0.005) found = card;
    }
    return found;
  }

  function show(time) {
    slider.value = String(time);
    slider.setAttribute("aria-valuetext", `${time.toFixed(1)} seconds`);
    clock.textContent = `${time.toFixed(1)} s of ${flight.end_s.toFixed(1)} s`;
    const card = momentAt(time);
    for (const each of cards) each.classList.toggle("current", each === card);
    if (still && card) {
      still.src = card.querySelector("img").src;
      still.alt = card.querySelector("img").alt;
      caption.textContent = `${card.dataset.moment} s: ${card.dataset.label}`;
      still.dataset.time = card.dataset.moment;
    }
  }

  function stop() {
    if (playing !== null) cancelAnimationFrame(playing);
    playing = null;
    if (film) film.pause();
    play.textContent = "Play";
  }

  function start() {
    if (garl.time >= flight.end_s - 0.05) garl.setTime(0, "player");
    play.textContent = "Pause";
    if (film) {
      film.play();
      return;
    }
    let before = performance.now();
    const tick = (now) => {
      garl.setTime(garl.time + (now - before) / 1000, "player");
      before = now;
      if (garl.time >= flight.end_s) stop();
      else playing = requestAnimationFrame(tick);
    };
    playing = requestAnimationFrame(tick);
  }

  // While a film seeks, only the last wanted time is kept.
  let wanted = null;
  function seek(time) {
    const to = Math.max(0, time - flight.film_start_s);
    if (film.seeking) wanted = to;
    else if (Math.abs(film.currentTime - to) > 0.02) film.currentTime = to;
  }

  if (film) {
    // A film that is not loaded yet forgets where it was sent.
    film.addEventListener("loadeddata", () => seek(garl.time), { once: true });
    const follow = () => {
      if (film.paused || film.ended) return;
      garl.setTime(film.currentTime + flight.film_start_s, "film");
      requestAnimationFrame(follow);
    };
    film.addEventListener("click", () => { if (film.paused) start(); else stop(); });
    const full = document.getElementById("full");
    full.hidden = !film.requestFullscreen;
    full.addEventListener("click", () => film.requestFullscreen());
    film.addEventListener("play", () => { play.textContent = "Pause"; follow(); });
    film.addEventListener("pause", () => { play.textContent = "Play"; });
    film.addEventListener("seeked", () => {
      if (wanted !== null) {
        film.currentTime = wanted;
        wanted = null;
      } else if (film.paused && Math.abs(film.currentTime + flight.film_start_s - garl.time) > 0.15) {
        garl.setTime(film.currentTime + flight.film_start_s, "film");
      }
    });
    garl.onTime((time, source) => { if (source !== "film" && source !== "start") seek(time); });
  }

  slider.addEventListener("input", () => garl.setTime(Number(slider.value), "slider"));
  play.addEventListener("click", () => {
    if (play.textContent === "Pause") stop();
    else start();
  });
  for (const card of cards) {
    card.addEventListener("click", () => garl.setTime(Number(card.dataset.moment), "still"));
  }
  for (const button of document.querySelectorAll("[data-copy]")) {
    button.hidden = false;
    button.addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(button.parentElement.querySelector("code").textContent);
        button.textContent = "Copied";
      } catch {
        button.textContent = "Select the line and copy it";
      }
    });
  }
  document.getElementById("controls").hidden = false;
  garl.onTime(show);
  // The moment that shows the cause is what a reader looks for.
  garl.setTime(flight.opens_s, "player");
})();
