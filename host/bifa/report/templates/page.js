"use strict";
(() => {
  // --- Plots: drawn in the reader's colours, at the width there is; on paper in light ones.
  const holder = document.getElementById("plots");
  const content = holder ? JSON.parse(holder.textContent) : { plots: [] };
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const touch = matchMedia("(pointer: coarse)").matches;
  let onPaper = false;

  const coloured = (value, palette) => {
    if (typeof value === "string") return value[0] === "@" ? palette[value.slice(1)] : value;
    if (value === null || typeof value !== "object") return value;
    if (Array.isArray(value)) return typeof value[0] === "object" || typeof value[0] === "string" ? value.map((v) => coloured(v, palette)) : value;
    return Object.fromEntries(Object.entries(value).map(([key, v]) => [key, coloured(v, palette)]));
  };

  const hidden = (box) => new Set([...box.closest(".chart").querySelectorAll('.keys [aria-pressed="false"]')].map((b) => b.dataset.key));

  const draw = (box) => {
    const { data, layout } = coloured(content.plots[box.dataset.plot], onPaper || !dark.matches ? content.light : content.dark);
    const off = hidden(box);
    for (const trace of data) trace.visible = !trace.keys.some((key) => off.has(key));
    layout.width = Math.floor(box.parentElement.getBoundingClientRect().width);
    layout.dragmode = touch ? false : "zoom";
    layout.uirevision = "kept";
    box.drawnAt = layout.width;
    return Plotly.react(box, data, layout, { displayModeBar: false });
  };

  const boxes = [...document.querySelectorAll(".plot")];
  const drawAll = () => Promise.all(boxes.map(draw));
  document.addEventListener("click", (event) => {
    const button = event.target.closest(".keys button");
    if (!button) return;
    button.setAttribute("aria-pressed", button.getAttribute("aria-pressed") !== "true");
    button.closest(".chart").querySelectorAll(".plot").forEach(draw);
  });
  dark.addEventListener("change", drawAll);
  addEventListener("resize", () => boxes.forEach((box) => {
    if (Math.floor(box.parentElement.getBoundingClientRect().width) !== box.drawnAt) draw(box);
  }));
  addEventListener("beforeprint", () => { onPaper = true; document.body.classList.add("paper"); drawAll(); });
  addEventListener("afterprint", () => { onPaper = false; document.body.classList.remove("paper"); drawAll(); });
  drawAll().then(() => { document.documentElement.dataset.drawn = boxes.length; });

  // --- Animations: they run by themselves, and stand still for who prefers that; here are pause, clock and slider.
  for (const figure of document.querySelectorAll(".motion")) {
    const moves = figure.querySelector("svg").getAnimations({ subtree: true });
    const [seconds, shown] = [figure.dataset.seconds, figure.dataset.shown].map(Number);
    const [button, slider, clock] = ["button", "input", "output"].map((tag) => figure.querySelector(tag));
    const time = () => ((Number(moves[0].currentTime) / 1000) % seconds) * (shown / seconds);
    const say = () => { slider.value = time(); clock.textContent = `${time().toFixed(1)} s`; };
    let running = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    const go = (on) => {
      running = on;
      moves.forEach((move) => (on ? move.play() : move.pause()));
      button.textContent = on ? "Pause" : "Play";
    };
    const tick = () => { if (running) say(); requestAnimationFrame(tick); };
    button.addEventListener("click", () => go(!running));
    slider.addEventListener("input", () => {
      go(false);
      const share = Math.min(slider.value / shown, 1 - 1e-6); // the very end is the beginning again
      moves.forEach((move) => { move.currentTime = 1000 * seconds * share; });
      say();
    });
    figure.querySelector(".controls").hidden = false;
    go(running);
    say();
    tick();
  }
})();
