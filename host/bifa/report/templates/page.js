"use strict";
(() => {
  // --- Plots: drawn at the available width, in the reader's colour scheme; on paper in the light one.
  const holder = document.getElementById("plots");
  const content = holder ? JSON.parse(holder.textContent) : { plots: [] };
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const touch = matchMedia("(pointer: coarse)").matches;
  const left = 64, right = 12;
  let onPaper = false;

  const dashes = { dashed: [4, 3], dotted: [1, 3] };

  const curve = ({ keys, points, colour, style, base }, palette) => ({
    keys, label: keys.join(", "), data: points.map(([x, y]) => ({ x, y })),
    showLine: style !== "dots", pointRadius: style === "dots" ? 5.5 : 0, pointHitRadius: 6, stepped: style === "steps" || style === "area",
    borderColor: palette[colour], backgroundColor: palette[colour], borderWidth: style === "area" ? 0 : 1.6, borderDash: dashes[style] || [],
    fill: style === "area" ? { value: base } : false, spanGaps: false, animation: false,
  });

  const axis = ({ label, range, log, ticks, words }, palette, options) => ({
    type: log ? "logarithmic" : "linear",
    title: { display: Boolean(label), text: label, color: palette.ink },
    min: range ? range[0] : undefined, max: range ? range[1] : undefined,
    grid: { display: !words, color: palette.grid, tickColor: palette.quiet }, border: { color: palette.quiet },
    ticks: { color: palette.ink, maxTicksLimit: 6, includeBounds: false, maxRotation: 0, autoSkip: !words, callback: ticks.length ? (value) => ticks.find((tick) => tick.value === value)?.label : log ? (value) => (Number.isInteger(Math.log10(value)) ? String(value) : "") : (value) => String(Number(value.toPrecision(6))) },
    afterBuildTicks: ticks.length ? (scale) => { scale.ticks = ticks.filter(({ value }) => value >= scale.min && value <= scale.max).map(({ value }) => ({ value })); } : undefined,
    ...options,
  });

  const rule = ({ along, place, label }, palette) => ({
    type: "line", [`${along}Min`]: place, [`${along}Max`]: place, borderColor: palette.ink, borderWidth: 1, borderDash: [1, 3],
    label: { display: Boolean(label), content: label, color: palette.ink, backgroundColor: palette.paper, font: { size: 11 }, padding: 2, position: along === "x" ? "end" : "center" },
  });

  // A column's panels share their x axis: if one is zoomed, the others follow.
  const zoomed = ({ chart }) => {
    const { min, max } = chart.scales.x;
    for (const other of chart.column) if (other !== chart) other.zoomScale("x", { min, max }, "none");
  };

  const panelOf = (box, panel, isLast, isAlone, palette, off) => {
    const canvas = box.appendChild(document.createElement("div")).appendChild(document.createElement("canvas"));
    canvas.parentElement.style.height = `${panel.height + (isLast ? 42 : 14)}px`;
    canvas.parentElement.style.position = "relative";
    return new Chart(canvas, {
      type: "scatter",
      data: { datasets: panel.curves.map((one) => ({ ...curve(one, palette), hidden: one.keys.some((key) => off.has(key)) })) },
      options: {
        animation: false, maintainAspectRatio: false, responsive: true, devicePixelRatio: onPaper ? 3 : undefined,
        layout: { autoPadding: false, padding: { right, top: 8 } },
        scales: {
          x: axis(panel.x, palette, isLast ? {} : { ticks: { display: false } }),
          y: axis(panel.y, palette, { afterFit: (scale) => { scale.width = isAlone ? Math.max(left, scale.width) : left; } }),
        },
        interaction: { mode: "nearest", intersect: false },
        plugins: {
          legend: { display: false },
          annotation: { annotations: panel.rules.map((one) => rule(one, palette)) },
          tooltip: { animation: false, callbacks: { label: ({ dataset, parsed }) => `${dataset.label}: ${[parsed.x, parsed.y].map((v) => Number(v.toPrecision(4))).join(", ")}` } },
          zoom: { zoom: { drag: { enabled: !touch, backgroundColor: `${palette.quiet}33` }, mode: "x", onZoomComplete: zoomed } },
        },
      },
    });
  };

  const hidden = (box) => new Set([...box.closest(".chart").querySelectorAll('.keys [aria-pressed="false"]')].map((b) => b.dataset.key));

  const draw = (box) => {
    (box.charts || []).forEach((chart) => chart.destroy());
    box.replaceChildren();
    const palette = onPaper || !dark.matches ? content.light : content.dark;
    const panels = content.plots[box.dataset.plot], off = hidden(box);
    box.charts = panels.map((panel, k) => panelOf(box, panel, k === panels.length - 1, panels.length === 1, palette, off));
    for (const chart of box.charts) chart.column = box.charts;
  };

  const boxes = [...document.querySelectorAll(".plot")];
  const drawAll = () => boxes.forEach(draw);
  if (boxes.length) Chart.defaults.font = { ...Chart.defaults.font, size: 12, family: "system-ui, sans-serif" };
  document.addEventListener("click", (event) => {
    const button = event.target.closest(".keys button");
    if (!button) return;
    button.setAttribute("aria-pressed", button.getAttribute("aria-pressed") !== "true");
    for (const box of button.closest(".chart").querySelectorAll(".plot")) {
      const off = hidden(box);
      for (const chart of box.charts) {
        chart.data.datasets.forEach((one, k) => chart.setDatasetVisibility(k, !one.keys.some((key) => off.has(key))));
        chart.update("none");
      }
    }
  });
  for (const box of boxes) box.addEventListener("dblclick", () => box.charts.forEach((chart) => chart.resetZoom("none")));
  dark.addEventListener("change", drawAll);
  addEventListener("beforeprint", () => { onPaper = true; document.body.classList.add("paper"); drawAll(); });
  addEventListener("afterprint", () => { onPaper = false; document.body.classList.remove("paper"); drawAll(); });
  drawAll();
  document.documentElement.dataset.drawn = boxes.length;

  // --- Animations: they run by themselves, unless the reader prefers reduced motion; with pause, clock and slider.
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
      const share = Math.min(slider.value / shown, 1 - 1e-6); // the very end would wrap to the beginning
      moves.forEach((move) => { move.currentTime = 1000 * seconds * share; });
      say();
    });
    figure.querySelector(".controls").hidden = false;
    go(running);
    say();
    tick();
  }
})();
