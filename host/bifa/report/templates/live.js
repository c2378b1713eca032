"use strict";
(() => {
  const token = location.hash.slice(1);
  const palettes = JSON.parse(document.getElementById("palettes").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const [state, said, stop, plot, predicted, speedBox, link, closing, preset] =
    ["state", "said", "stop", "plot", "predicted", "speed", "link", "closing", "preset"].map((id) => document.getElementById(id));
  const sliders = [...document.querySelectorAll("input[type=range]")];
  const chambers = [...document.querySelectorAll("[data-chamber]")].map((row) => row.dataset.chamber);
  const SHOWN_S = 20, LEVEL = { vacuum: 0, off: 0.5, positive: 1, both: 1 };

  // --- What is asked of the robot -----------------------------------------------------------------------------
  const say = (text, wrong = false) => { said.textContent = text; said.classList.toggle("wrong", wrong); };
  const post = async (name, body = {}) => {
    let answer, content;
    try {
      answer = await fetch(`/${name}`, { method: "POST", headers: { Authorization: `Bearer ${token}` }, body: JSON.stringify(body), keepalive: true });
      content = await answer.json();
    } catch { throw new Error("bifa monitor does not answer; it may have ended"); }
    if (!answer.ok) throw new Error(content.error);
    return content;
  };
  let period = 0; // of the gait that the robot has
  const ask = async (name, body) => {
    try {
      say((await post(name, body)).said);
      if (name === "apply" || name === "save") period = body.gait.period_s;
    } catch (error) { say(error.message, true); }
  };
  const number = (slider) => slider.parentElement.querySelector("[type=number]");
  const gait = () => Object.fromEntries(sliders.map((slider) => [slider.name, Number(number(slider).value)]));

  stop.addEventListener("click", async () => {
    say("stopping…");
    try { say((await post("stop")).said); } catch (error) { say(`NOT CONFIRMED: ${error.message}. Press the emergency stop.`, true); }
  });
  for (const button of document.querySelectorAll("[data-do]")) {
    const name = button.dataset.do;
    button.addEventListener("click", () => ask(name, name === "save" ? { gait: gait(), preset: preset.value } : { gait: gait() }));
  }
  closing.addEventListener("change", () => ask("closing", { stop: closing.checked }));
  document.querySelector("form").addEventListener("submit", (event) => event.preventDefault());

  // --- The gait and what the model makes of it: one question at a time, the newest gait last --------------------
  let asking = false, again = false;
  const predict = async () => {
    if (asking) { again = true; return; }
    asking = true;
    do {
      again = false;
      try {
        const found = await post("predict", { gait: gait() });
        predicted.textContent = `The model predicts ${found.speed_mm_s.toFixed(2)} mm/s, with ${found.slip_mm.toFixed(2)} mm of slip a cycle.`;
      } catch (error) { predicted.textContent = `No prediction: ${error.message}`; }
    } while (again);
    asking = false;
  };
  for (const slider of sliders) {
    slider.addEventListener("input", () => { number(slider).value = slider.value; predict(); });
    number(slider).addEventListener("input", () => { slider.value = number(slider).value; predict(); });
  }

  const setUp = async () => {
    const answer = await fetch("/setup");
    const found = await answer.json();
    for (const slider of sliders) {
      const box = number(slider);
      [box.min, box.max] = [slider.min, slider.max] = found.ranges[slider.name];
      // a slider to 60 s would leave no room for the gaits that there are; the number beside it goes to its end
      if (slider.name === "period_s") slider.max = 12;
      slider.disabled = box.disabled = !token;
      if (found.gait) { box.value = Math.round(1e4 * found.gait[slider.name]) / 1e4; slider.value = box.value; }
    }
    if (found.gait) period = found.gait.period_s;
    closing.checked = found.stops_when_closed;
    for (const control of [...document.querySelectorAll("[data-do]"), closing, preset, stop]) control.disabled = !token;
    if (!token) say("Only to look at: open the page by the address that bifa monitor printed, to the end.");
    else if (found.error) say(found.error, true);
    else predict();
  };

  // --- What comes from the robot -------------------------------------------------------------------------------
  const times = [], traces = Object.fromEntries(chambers.map((name) => [name, { psi: [], valves: [] }]));
  const path = { t: [], mm: [] };
  const keep = (list, count) => list.splice(0, Math.max(0, list.length - count));

  const take = (report) => {
    for (const sample of report.samples) {
      if (times.length && sample.t < times[times.length - 1]) { times.length = 0; path.t.length = path.mm.length = 0; for (const t of Object.values(traces)) t.psi.length = t.valves.length = 0; }
      times.push(sample.t);
      chambers.forEach((name, i) => {
        traces[name].psi.push(sample.psi[i]);
        traces[name].valves.push(LEVEL[sample.valves[i]] * 0.8 + 1.2 * i);
      });
    }
    if (report.position_mm) { path.t.push(report.uno_s); path.mm.push(report.position_mm.head); }
    for (const list of [times, ...Object.values(traces).flatMap((t) => [t.psi, t.valves])]) keep(list, 25 * SHOWN_S);
    for (const list of [path.t, path.mm]) keep(list, 70 * 10);
  };

  // over one whole cycle, from where it was a period ago, between two reports
  const speed = () => {
    const last = path.t.length - 1, from = path.t[last] - period;
    const after = path.t.findIndex((t) => t >= from);
    if (!period || after < 1) return "not for a cycle yet";
    const share = (from - path.t[after - 1]) / (path.t[after] - path.t[after - 1]);
    const began = path.mm[after - 1] + share * (path.mm[after] - path.mm[after - 1]);
    return `${((path.mm[last] - began) / period).toFixed(1)} mm/s over the last cycle, at ${path.mm[last].toFixed(0)} mm`;
  };

  const show = (report) => {
    if (report.gone) { state.textContent = report.gone; say(report.gone, true); return; }
    link.textContent = report.link;
    state.textContent = report.state ? `${report.state}, ${report.uno_s.toFixed(1)} s${report.warning ? `: ${report.warning}` : ""}` : "no telemetry yet";
    state.classList.toggle("wrong", Boolean(report.warning));
    for (const row of document.querySelectorAll("[data-chamber]")) {
      const now = report.chambers && report.chambers[row.dataset.chamber];
      if (!now) continue;
      row.querySelector(".psi").textContent = now.psi.toFixed(2);
      row.querySelector(".valves").textContent = now.valves;
      row.querySelector("progress").value = now.phase_rad / (2 * Math.PI);
    }
    if (report.position_mm) { speedBox.textContent = speed(); document.getElementById("path-key").hidden = false; }
  };

  // A panel for pressures, valves and, where it is seen, the head's position; made when there is something to draw.
  let panels = [];
  const panel = (height, label, y, curves, isLast) => {
    const colours = dark.matches ? palettes.dark : palettes.light;
    const canvas = plot.appendChild(document.createElement("div")).appendChild(document.createElement("canvas"));
    Object.assign(canvas.parentElement.style, { height: `${height}px`, position: "relative" });
    const axis = (text, rest) => ({ type: "linear", title: { display: Boolean(text), text, color: colours.ink }, grid: { color: colours.grid }, border: { color: colours.quiet }, ...rest });
    return new Chart(canvas, {
      type: "scatter",
      data: { datasets: curves.map(([name, points, stepped]) => ({ points, data: [], showLine: true, pointRadius: 0, borderWidth: 1.6, borderColor: colours[name] || colours.ink, stepped })) },
      options: {
        animation: false, maintainAspectRatio: false, events: [], layout: { autoPadding: false, padding: { right: 10, top: 6 } },
        plugins: { legend: { display: false }, tooltip: { enabled: false } },
        scales: {
          x: axis(isLast ? "time of the Uno, s" : "", { ticks: { display: isLast, includeBounds: false, color: colours.ink } }),
          y: axis(label, { ...y, ticks: { color: colours.ink, includeBounds: false, maxTicksLimit: 6, ...y.ticks }, afterFit: (scale) => { scale.width = 74; } }),
        },
      },
    });
  };
  const setPanels = () => {
    for (const one of panels) one.destroy();
    plot.replaceChildren();
    const withPath = path.t.length > 0, traced = (part, stepped) => chambers.map((name) => [name, () => [times, traces[name][part]], stepped]);
    const places = chambers.map((name, i) => [1.2 * i + 0.4, name]);
    panels = [
      panel(200, "psi", { min: -15, max: 15 }, traced("psi", false), false),
      panel(withPath ? 90 : 120, "valves", { min: -0.2, max: 3.4, afterBuildTicks: (scale) => { scale.ticks = places.map(([value]) => ({ value })); }, ticks: { callback: (value) => places.find(([place]) => place === value)[1] } }, traced("valves", true), !withPath),
      ...(withPath ? [panel(140, "mm", {}, [["ink", () => [path.t, path.mm], false]], true)] : []),
    ];
  };

  const draw = () => {
    if (!window.Chart) return; // it comes last: the page is connected, and Stop works, before it is there
    if (panels.length !== (path.t.length ? 3 : 2)) setPanels();
    const now = times.length ? times[times.length - 1] : 0;
    for (const one of panels) {
      for (const curve of one.data.datasets) { const [x, y] = curve.points(); curve.data = x.map((t, i) => ({ x: t, y: y[i] })); }
      Object.assign(one.options.scales.x, { min: now - SHOWN_S, max: now });
      one.update("none");
    }
    if (times.length) document.documentElement.dataset.drawn = times.length;
  };
  dark.addEventListener("change", () => { panels = []; plot.replaceChildren(); });

  let fresh = false;
  const connect = () => {
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.addEventListener("message", (event) => {
      const report = JSON.parse(event.data);
      if (report.samples) take(report);
      show(report);
      fresh = true;
    });
    socket.addEventListener("close", () => {
      if (!state.textContent.startsWith("the robot is gone")) { state.textContent = "bifa monitor does not answer; what is shown is old"; state.classList.add("wrong"); }
      setTimeout(connect, 1000);
    });
  };
  const tick = () => { if (fresh) { fresh = false; draw(); } requestAnimationFrame(tick); };
  setUp().catch(() => say("bifa monitor does not answer", true));
  connect();
  tick();
})();
