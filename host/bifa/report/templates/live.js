"use strict";
(() => {
  const token = /^#?([\w-]*)/.exec(location.hash)[1]; // without what was copied from the terminal after the address
  addEventListener("hashchange", () => location.reload()); // another address of the same page is not loaded by itself
  const palettes = JSON.parse(document.getElementById("palettes").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const names = ["state", "clock", "alarm", "said", "stop", "plot", "unsent", "predicted", "speed", "link", "closing", "preset", "presets", "revert"];
  const [state, clock, alarm, said, stop, plot, unsent, predicted, speedBox, link, closing, preset, presets, revert] =
    names.map((id) => document.getElementById(id));
  const sliders = [...document.querySelectorAll("input[type=range]")];
  const chambers = [...document.querySelectorAll("[data-chamber]")].map((row) => row.dataset.chamber);
  const SHOWN_S = 20, LEVEL = { vacuum: 0, off: 0.5, positive: 1, both: 1 };
  const SILENT = "bifa monitor does not answer; it may have ended";
  const OLD = "bifa monitor does not answer; the data shown are old.";
  const STALE = "This page belongs to an earlier bifa monitor: open the address that the terminal shows now. Stop still works here.";
  // write only changes: screen readers would announce unchanged text ten times a second
  const tell = (element, text) => { if (element.textContent !== text) element.textContent = text; };

  // --- Requests to the robot: over one websocket, so that a stop never waits behind other requests ---------------
  let socket = null, you = null, live = null, number = 0;
  const waiting = new Map();
  const say = (text, wrong = false) => { tell(said, text); said.classList.toggle("wrong", wrong); };
  const isOpen = () => socket && socket.readyState === WebSocket.OPEN;
  const request = (name, body = {}) => new Promise((resolve, reject) => {
    if (!isOpen()) { reject(new Error(SILENT)); return; }
    number += 1;
    waiting.set(number, { resolve, reject });
    socket.send(JSON.stringify({ id: number, do: name, ...body }));
  });
  const ask = async (name, body) => {
    try { say(await request(name, body)); } catch (error) { say(error.message, true); }
  };
  const answered = (message) => {
    const waits = waiting.get(message.id);
    waiting.delete(message.id);
    if (!waits) return;
    if (message.error) waits.reject(new Error(message.error)); else waits.resolve(message.said);
  };
  const stopByRequest = async () => {
    let answer;
    try { answer = await (await fetch("/stop", { method: "POST", keepalive: true })).json(); }
    catch { throw new Error(SILENT); }
    if (answer.error) throw new Error(answer.error);
    return answer.said;
  };
  const halt = async () => {
    say("stopping…");
    try { say(await (isOpen() ? request("stop").catch(stopByRequest) : stopByRequest())); }
    catch (error) { say(`NOT CONFIRMED: ${error.message}. Press the emergency stop.`, true); }
  };

  const box = (slider) => slider.parentElement.querySelector("[type=number]");
  const gait = () => Object.fromEntries(sliders.map((slider) => [slider.name, Number(box(slider).value)]));
  const isFilled = () => sliders.every((slider) => box(slider).value !== ""); // empty, or no number yet, would be 0
  const set = (wanted) => sliders.forEach((slider) => { slider.value = box(slider).value = wanted[slider.name]; });
  const rounded = (value) => Math.round(1e4 * value) / 1e4;

  stop.addEventListener("click", halt);
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" || event.key === "!") { event.preventDefault(); halt(); }
  });
  for (const button of document.querySelectorAll("[data-do]")) {
    const name = button.dataset.do;
    button.addEventListener("click", () => ask(name, { gait: gait(), preset: name === "load" ? presets.value : preset.value }));
  }
  closing.addEventListener("change", () => ask("closing", { stop: closing.checked }));
  document.querySelector("form").addEventListener("submit", (event) => event.preventDefault());
  let sending = 0, shownDraft = ""; // a draft that arrives before the answer is older than what the sliders show
  const draft = async () => {
    sending += 1;
    try { await request("draft", { gait: gait() }); } catch (error) { say(error.message, true); }
    sending -= 1;
  };
  const showDraft = () => {
    const now = JSON.stringify(live.draft);
    if (now === shownDraft || sending) return;
    shownDraft = now;
    if (live.draft && live.draft.by !== you.number) set(live.draft.gait);
  };
  for (const slider of sliders) {
    slider.addEventListener("input", () => { box(slider).value = slider.value; if (isFilled()) draft(); });
    box(slider).addEventListener("input", () => {
      if (box(slider).value === "") return;
      slider.value = box(slider).value;
      if (isFilled()) draft();
    });
  }
  revert.addEventListener("click", () => {
    set(Object.fromEntries(sliders.map(({ name }) => [name, rounded(live.parameters[name])])));
    draft();
  });

  // --- The state, the same on every page -------------------------------------------------------------------------
  const times = [], traces = Object.fromEntries(chambers.map((name) => [name, { psi: [], valves: [] }]));
  const path = { t: [], mm: [] };
  const lists = [times, path.t, path.mm, ...Object.values(traces).flatMap((trace) => [trace.psi, trace.valves])];

  const take = (samples) => {
    for (const sample of samples) {
      if (times.length && sample.t < times[times.length - 1]) for (const list of lists) list.length = 0;
      times.push(sample.t);
      chambers.forEach((name, i) => {
        traces[name].psi.push(sample.psi[i]);
        traces[name].valves.push(LEVEL[sample.valves[i]] * 0.8 + 1.2 * i);
      });
      if ("mm" in sample) { path.t.push(sample.t); path.mm.push(sample.mm); }
    }
    const until = times[times.length - 1] - SHOWN_S;
    while (times[0] < until) { times.shift(); for (const trace of Object.values(traces)) { trace.psi.shift(); trace.valves.shift(); } }
    while (path.t[0] < until) { path.t.shift(); path.mm.shift(); }
  };

  const stopWords = (stopped) => {
    if (!stopped) return "";
    if (stopped.why) return `Stopped at ${stopped.at}: ${stopped.why}.`;
    const by = stopped.by === `page ${you.number}` ? "this page" : stopped.by;
    if (stopped.is_confirmed) return `Stopped by ${by} at ${stopped.at}; all valves are off.`;
    return stopped.is_confirmed === false ? `THE ROBOT MAY STILL BE MOVING: the stop by ${by} at ${stopped.at} is not confirmed. Press the emergency stop.` : `The robot is being stopped by ${by}.`;
  };

  const showGait = () => {
    const robot = live.parameters;
    for (const output of document.querySelectorAll("[data-robot]")) if (robot) tell(output, String(rounded(robot[output.dataset.robot])));
    showDraft();
    const differs = robot && live.draft && sliders.some(({ name }) => Math.abs(live.draft.gait[name] - robot[name]) > 6e-4);
    tell(unsent, live.is_pending ? "The robot adopts its new gait at its next cycle." : differs ? "Not sent yet: the robot still has a different gait." : robot ? "The sliders show the robot's gait." : "");
    const found = live.prediction;
    const isAsked = live.draft && (!found || sliders.some(({ name }) => found.gait[name] !== live.draft.gait[name]));
    if (isAsked) tell(predicted, "Predicting the speed of this gait…");
    else if (found) tell(predicted, found.error ? `No prediction: ${found.error}` : `The model predicts ${found.predicted || `${found.speed_mm_s.toFixed(2)} mm/s`}; ${found.slip_mm.toFixed(2)} mm of slip per cycle.`);
    const there = Object.keys(live.presets || {});
    if (there.join() !== [...presets.options].map((option) => option.value).join()) presets.replaceChildren(...there.map((name) => new Option(name)));
    return differs;
  };

  const showControls = (differs) => {
    const may = you.is_owner && !live.gone && Boolean(live.parameters);
    const can = { run: ["idle", "holding"].includes(live.robot), clear: ["stopped", "fault"].includes(live.robot), apply: differs && isFilled(), save: isFilled(), load: presets.options.length > 0 };
    for (const button of document.querySelectorAll("[data-do]")) button.disabled = !may || !can[button.dataset.do];
    for (const control of [...sliders, ...sliders.map(box), closing, preset, presets]) control.disabled = !may;
    revert.disabled = !may || !differs;
    if (closing.checked !== live.stops_when_closed) closing.checked = live.stops_when_closed;
  };

  const show = () => {
    tell(state, live.gone ? "the link to the robot is lost" : (live.robot === "connecting" ? "waiting for the robot" : [live.robot, live.fault, live.warning].filter(Boolean).join(": ")));
    tell(clock, live.gone || live.uno_s === undefined ? "" : `, ${live.uno_s.toFixed(1)} s`);
    state.classList.toggle("wrong", Boolean(live.gone || live.warning));
    document.body.classList.toggle("old", Boolean(live.gone));
    tell(alarm, you.is_stale ? STALE : live.gone || stopWords(live.stopped));
    alarm.classList.toggle("loud", Boolean(you.is_stale || live.gone || (live.stopped && live.stopped.is_confirmed === false)));
    tell(link, live.link || "–");
    for (const row of document.querySelectorAll("[data-chamber]")) {
      const now = live.chambers && live.chambers[row.dataset.chamber];
      if (!now) continue;
      tell(row.querySelector(".psi"), now.psi.toFixed(2));
      tell(row.querySelector(".valves"), now.valves);
      const phase = row.querySelector("progress"), share = now.phase_rad / (2 * Math.PI);
      phase.value = share;
      phase.setAttribute("aria-valuetext", `${Math.round(360 * share)}°`);
    }
    if (live.position_mm) {
      const fast = live.robot !== "running" ? "not walking" : live.speed_mm_s === null ? "less than one cycle walked" : live.settled || `${live.speed_mm_s.toFixed(1)} mm/s over the last cycle`;
      tell(speedBox, `${fast}, at ${live.position_mm.head.toFixed(0)} mm`);
      document.getElementById("path-key").hidden = false;
    } else if (live.position_mm === null) tell(speedBox, "the head is not visible");
    showControls(showGait());
  };

  const setUp = () => {
    for (const slider of sliders) {
      [box(slider).min, box(slider).max] = [slider.min, slider.max] = live.ranges[slider.name];
      // a slider up to 60 s would be too coarse for usual gaits; the number beside it covers the whole range
      if (slider.name === "period_s") slider.max = 12;
    }
    if (!token) say("View and stop only. For control, open the page by the full address that bifa monitor printed.");
  };

  // Panels for pressures, valves and, if it is measured, the head's position; made when there is something to draw.
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
    if (!window.Chart) return; // the library loads last: the page is connected, and Stop works, before it is there
    if (panels.length !== (path.t.length ? 3 : 2)) setPanels();
    const now = times.length ? times[times.length - 1] : 0;
    for (const one of panels) {
      for (const curve of one.data.datasets) { const [x, y] = curve.points(); curve.data = x.map((t, i) => ({ x: t, y: y[i] })); }
      Object.assign(one.options.scales.x, { min: Math.max(now - SHOWN_S, 0), max: Math.max(now, SHOWN_S) });
      one.update("none");
    }
    if (times.length) document.documentElement.dataset.drawn = times.length;
  };
  dark.addEventListener("change", () => { panels = []; plot.replaceChildren(); });

  let fresh = false;
  const hear = (message) => {
    if ("id" in message) { answered(message); return; }
    if (message.you) you = message.you;
    live = message.state;
    if (message.you) { shownDraft = ""; setUp(); }
    if (message.whole) for (const list of lists) list.length = 0;
    take(message.samples);
    show();
    fresh = true;
  };
  const lost = () => {
    for (const waits of waiting.values()) waits.reject(new Error(SILENT));
    waiting.clear();
    tell(state, "not connected");
    tell(clock, "");
    tell(alarm, live && live.gone ? `${live.gone}.\n${OLD}` : OLD);
    state.classList.add("wrong");
    alarm.classList.add("loud");
    document.body.classList.add("old");
    for (const control of document.querySelectorAll("[data-do], form input, form select, #revert")) control.disabled = true;
    setTimeout(connect, 1000);
  };
  const connect = () => {
    socket = new WebSocket(`ws://${location.host}/live`, token ? ["bifa", token] : ["bifa"]);
    socket.addEventListener("message", (event) => hear(JSON.parse(event.data)));
    socket.addEventListener("close", lost);
  };
  const tick = () => { if (fresh) { fresh = false; draw(); } requestAnimationFrame(tick); };
  connect();
  tick();
})();
