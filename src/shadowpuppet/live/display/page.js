const byId = (name) => document.getElementById(name);
const SPAN = 20;                          // seconds of the sparkline
const GROUPS = ["torso", "left", "right", "body"];  // the last one: angles that begin with none of the others
const bars = new Map();
let latencies = [], over = false, space = null;

function text(id, value) {
  const shown = value ?? "–";
  if (byId(id).textContent !== String(shown)) byId(id).textContent = shown;
}

function element(kind, name, parent) {
  const made = document.createElement(kind);
  made.className = name;
  parent.append(made);
  return made;
}

function makeBars(angles) {
  const groupOf = (name) => GROUPS.find((key) => name.startsWith(key + " ")) ?? "body";
  for (const key of GROUPS) {
    const own = angles.filter(([name]) => groupOf(name) === key);
    if (!own.length) continue;
    const title = key === "torso" || key === "body" ? key : key + (own.some(([name]) => /hip|knee|ankle/.test(name)) ? " side" : " arm");
    const group = element("div", key, byId("angles"));
    element("h2", "", group).textContent = title + ", degrees";
    for (const [name, , low, high] of own) {
      const row = element("div", "angle", group);
      element("span", "", row).textContent = key === "body" ? name : name.slice(key.length + 1);
      const bar = element("div", "bar", row), fill = element("i", "", bar), zero = element("u", "", bar);
      zero.style.left = 100 * -low / (high - low) + "%";
      bars.set(name, {fill, low, high, value: element("span", "value", row)});
    }
  }
}

function showAngles(angles) {
  if (!bars.size) makeBars(angles);
  for (const [name, value] of angles) {
    const bar = bars.get(name), place = (angle) => 100 * (Math.min(Math.max(angle, bar.low), bar.high) - bar.low) / (bar.high - bar.low);
    const ends = [place(0), place(value ?? 0)].sort((a, b) => a - b);
    bar.fill.style.left = ends[0] + "%";
    bar.fill.style.width = ends[1] - ends[0] + "%";
    bar.value.textContent = value === null ? "–" : (Math.round(value) || 0) + "°";
  }
}

function showLatencies(view) {
  const canvas = byId("spark"), now = performance.now() / 1000, scale = window.devicePixelRatio || 1;
  if (view.latency !== null) latencies.push([now, view.latency]);
  latencies = latencies.filter(([time]) => time > now - SPAN);
  const width = canvas.width = canvas.clientWidth * scale, height = canvas.height = canvas.clientHeight * scale;
  const pen = canvas.getContext("2d"), top = Math.max(1.15 * view.interval || 0, 20, ...latencies.map(([, late]) => 1.15 * late));
  const x = (time) => width * (1 - (now - time) / SPAN), y = (late) => height - 2 - (height - 4) * late / top;
  if (view.interval) {                     // a frame's time
    pen.strokeStyle = "#57606c";
    pen.setLineDash([4 * scale, 4 * scale]);
    pen.beginPath();
    pen.moveTo(0, y(view.interval));
    pen.lineTo(width, y(view.interval));
    pen.stroke();
    pen.setLineDash([]);
  }
  pen.strokeStyle = "#6f9fd8";
  pen.lineWidth = 1.6 * scale;
  pen.lineJoin = "round";
  pen.beginPath();
  latencies.forEach(([time, late], n) => n && time - latencies[n - 1][0] < 1 ? pen.lineTo(x(time), y(late)) : pen.moveTo(x(time), y(late)));
  pen.stroke();
  const [last] = latencies.slice(-1);
  byId("kind").textContent = view.lag ? `capture to smoothed pose, ${view.lag} ms of it lag` : "capture to pose, 20 s";
  byId("frames").textContent = last && view.interval ? (last[1] / view.interval).toFixed(2) + " frames (dashed: one)" : "";
}

function show(view) {
  byId("chip").textContent = view.chip;
  byId("chip").className = "chip " + view.chip;
  byId("call").hidden = !view.message;
  text("message", view.message);
  byId("count").textContent = view.countdown ? Math.ceil(view.countdown) : "";
  if (view.latency !== null) text("latency", view.latency.toFixed(0));
  if (view.rate !== null) text("rate", view.rate.toFixed(1));
  text("overlap", view.overlap === null ? null : view.overlap.toFixed(2));
  text("dropped", view.dropped);
  text("footer", view.footer);
  if (view.angles.length) showAngles(view.angles);
  showLatencies(view);
  if (view.space) showSpace(view);
}

// The body in space: its script is fetched when the person has been measured.
async function showSpace(view) {
  space ??= import("./space.js");
  (await space).show(view);
}

function end() {
  over = true;
  byId("chip").textContent = "over";
  byId("chip").className = "chip over";
  byId("call").hidden = false;
  text("message", "the session is over");
  byId("count").textContent = "";
}

const events = new EventSource("events");
events.onmessage = (event) => {
  const view = JSON.parse(event.data);
  if (view.over) { events.close(); end(); } else show(view);
};
events.onerror = () => { if (!over) { byId("chip").textContent = "no connection"; byId("chip").className = "chip lost"; } };

const send = (command) => fetch("command/" + command, {method: "POST", headers: {"X-Shadowpuppet": "1"}});
for (const button of document.querySelectorAll("[data-command]")) button.onclick = () => send(button.dataset.command);

const KEYS = {q: "stop", Escape: "stop", b: "learn", m: "measure"};
document.addEventListener("keydown", (event) => {
  if (KEYS[event.key] && !over && !event.repeat && !event.ctrlKey && !event.metaKey && !event.altKey) send(KEYS[event.key]);
});
