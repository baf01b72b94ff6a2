// The page: the timeline and its controls, what is shown, images of the cameras, the status line.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const KINDS = {estimate: "puppet", truth: "truth", other: "second run", mean: "mean postures"};

class Page {
  constructor(data) {
    this.data = data; this.times = unpack(data.times); this.own = unpack(data.frames);
    this.frame = 0; this.playing = false; this.speed = 1;
    this.images = data.cameras.map(() => Object.fromEntries(LAYERS.map(layer => [layer, {busy: false, key: "", last: null}])));
    this.asked = {};
    const acts = {look: n => this.look(n), looked: n => this.looked(n), chose: found => this.choose(found)};
    this.stage = new Stage(data, id("space"), id("labels"), acts);
    this.buildViews(); this.buildTimeline(); this.buildShow(); this.buildCurves(); this.buildAbout();
    this.inset(data.cameras.findIndex(each => each.images));
    this.frameAll();
    if (window.matchMedia("(max-width: 820px)").matches) id("panel").open = false;
    new ResizeObserver(() => this.resized()).observe(id("stage"));
    new ResizeObserver(() => this.resized()).observe(id("rows"));
    id("panel").addEventListener("toggle", () => this.resized());
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.stage.colours(); this.resized(); });
    document.addEventListener("keydown", event => this.key(event));
    this.show(0);
    if (this.times.length > 1 && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
    requestAnimationFrame(now => this.tick(now));
  }

  // Time

  buildTimeline() {
    const last = this.times.length - 1;
    id("timeline").hidden = last < 1;
    id("frame").max = last;
    id("frame").addEventListener("input", () => this.seek(+id("frame").value));
    id("play").addEventListener("click", () => this.play(!this.playing));
    for (const [name, act] of [["first", () => this.seek(0)], ["back", () => this.step(-1)], ["on", () => this.step(1)],
      ["last", () => this.seek(last)], ["next", () => this.next()]]) id(name).addEventListener("click", act);
    id("next").disabled = !this.data.moments.length;
    if (!this.data.moments.length) id("next").hidden = !this.data.strips.length;
    id("speed").append(...SPEEDS.map(value => element("option", {value, textContent: `${value} x`, selected: value == 1})));
    id("speed").addEventListener("change", () => { this.speed = +id("speed").value; this.anchor(); });
    this.strip = new Strip(this.data, this.times, id("rows"), id("key"), frame => this.seek(frame));
  }
  anchor() { this.began = performance.now(); this.from = this.times[this.frame]; }
  play(on) {
    if (this.times.length < 2) return;
    if (on && this.frame == this.times.length - 1) this.show(0);
    this.playing = on;
    id("play").textContent = on ? "Pause" : "Play";
    this.anchor();
  }
  seek(frame) { this.play(false); this.show(Math.min(Math.max(frame, 0), this.times.length - 1)); }
  step(by) { this.seek((this.frame + by + this.times.length) % this.times.length); }
  next() {
    const after = this.data.moments.find(frame => frame > this.frame);
    this.seek(after === undefined ? this.data.moments[0] : after);
  }
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(SELECT|SUMMARY)$/.test(event.target.tagName)) return;
    const button = event.target.tagName == "BUTTON" || event.target.type == "checkbox";
    const acts = {j: () => this.step(-1), l: () => this.step(1), n: () => this.data.moments.length && this.next()};
    if (event.key == " " && !button) { this.play(!this.playing); event.preventDefault(); }
    else if (event.key.toLowerCase() in acts) acts[event.key.toLowerCase()]();
  }
  tick(now) {
    if (this.playing) {
      const last = this.times.length - 1, step = (this.times[last] - this.times[0]) / last;
      let time = this.from + (now - this.began) / 1000 * this.speed;
      if (time > this.times[last] + Math.min(step, this.speed)) {
        if (id("loop").checked) { this.show(0); this.anchor(); time = this.times[0]; }
        else { this.show(last); this.play(false); }
      }
      if (this.playing) {
        let frame = nearest(this.times, time);
        if (this.times[frame] > time && frame) frame -= 1;
        if (frame != this.frame) this.show(frame);
      }
    }
    if (this.stage.stale) this.stage.draw(this.frame);
    requestAnimationFrame(next => this.tick(next));
  }
  show(frame) {
    this.frame = frame;
    const now = this.times[frame];
    id("frame").value = frame;
    id("frame").setAttribute("aria-valuetext", `${now.toFixed(2)} seconds`);
    id("clock").textContent = `${now.toFixed(2)} s, frame ${this.own[frame]}`;
    id("status").textContent = this.words(frame);
    this.strip.to(frame);
    for (const plot of this.plots) plot.to(now);
    this.fetchImages(); this.ask("hull"); this.ask("particles");
    this.stage.stale = true; this.stage.frame = frame;
  }
  words(frame) {
    const out = [];
    for (const strip of this.lines) {
      const own = strip.limbs.map((limb, k) => [limb, strip.codes[frame * strip.limbs.length + k]]).filter(([, code]) => code >= 0);
      if (!own.length) continue;
      const whole = [...new Set(own.map(([, code]) => this.data.statuses[code]))];
      const words = whole.length == 1 ? whole : own.filter(([, code]) => code > 0).map(([limb, code]) => `${limb} ${this.data.statuses[code]}`);
      for (const row of strip.rows)
        if (Number.isFinite(row.data[frame])) words.push(`${row.name} ${shown(row.data[frame], row.unit)}`);
      out.push((this.lines.length > 1 ? `${strip.name}: ` : "") + words.join(", "));
    }
    return out.join(" · ");
  }

  // Views and images

  buildViews() {
    const add = (name, act) => { const made = element("button", {textContent: name}); made.addEventListener("click", act); id("views").append(made); return made; };
    add("All", () => this.frameAll());
    add("Person", () => this.frameAll(false));
    if (!this.data.cameras.length) return;
    this.through = element("select");
    this.through.setAttribute("aria-label", "Look through a camera");
    this.through.append(element("option", {value: "", textContent: "Look through …"}),
      ...this.data.cameras.map((camera, n) => element("option", {value: n, textContent: `Through ${camera.name}`})));
    this.through.addEventListener("change", () => this.look(this.through.value === "" ? null : +this.through.value));
    id("views").append(this.through);
  }
  look(n) { if (n === null) this.frameAll(); else { this.stage.look(n); if (this.data.cameras[n].images) this.inset(n); } }
  looked(n) { if (this.through) this.through.value = n === null ? "" : n; }
  // All in view, and the film in the corner where it covers least.
  frameAll(withCameras = true) {
    this.stage.frameAll(withCameras);
    const box = id("space"), film = id("inset"), [width, height] = [film.offsetWidth + 30, film.offsetHeight + 30];
    const covered = corner => this.data.cameras.filter((_, n) => {
      const at = this.stage.onScreen(this.stage.cameras[n].centre);
      return at && (corner.includes("right") ? at[0] > box.clientWidth - width : at[0] < width)
        && (corner.includes("bottom") ? at[1] > box.clientHeight - height : at[1] < height + 40);
    }).length;
    film.className = ["bottom right", "bottom left", "top right"].reduce((best, each) => covered(each) < covered(best) ? each : best);
  }
  inset(n) {
    this.film = n;
    this.updateInset();
  }
  updateInset() {
    const on = this.film >= 0 && this.data.cameras.some(each => each.images) && (!this.showInset || this.showInset.checked);
    id("inset").hidden = !on;
    if (!on) return;
    const camera = this.data.cameras[this.film];
    id("inset").querySelector("figcaption").textContent = camera.name;
    const [film, person] = LAYERS.map(layer => this.stage.shown[layer] ? this.images[this.film][layer].last : null);
    for (const [name, image, what] of [["film", film, "Film"], ["person", person, "Silhouette"]]) {
      const shown = id(name);
      shown.style.visibility = image ? "visible" : "hidden";
      shown.alt = image ? `${what} of ${camera.name}` : "";
      if (image && shown.src != image.src) shown.src = image.src;
    }
    id("film").style.aspectRatio = id("marks").style.aspectRatio = `${camera.width} / ${camera.height}`;
    id("person").className = film ? "over" : "";
    const arm = 0.05, slim = arm * camera.height / camera.width;
    id("marks").innerHTML = this.stage.crosses(this.stage.cameras[this.film], this.frame).map(([[x, y], colour, sure]) =>
      `<path stroke="rgb(${colour})" stroke-opacity="${sure}" d="M${x - slim} ${y}h${2 * slim}M${x} ${y - arm}v${2 * arm}"/>`).join("");
  }
  // The newest image of each camera: at most one is asked for at a time, so that frames are skipped where films are read slowly.
  fetchImages() {
    for (const layer of this.layers) if (this.stage.shown[layer]) this.data.cameras.forEach((camera, n) => camera.images && this.fetchImage(n, layer));
    this.updateInset();
  }
  fetchImage(n, layer) {
    const state = this.images[n][layer], key = String(this.frame);
    if (state.busy || state.key == key) return;
    const url = this.data.served ? `image/${n}/${this.own[this.frame]}/${layer}` : this.data.images[layer][n][this.frame];
    if (!url) { state.key = key; state.last = null; this.stage.setImage(n, layer, null); return; }
    const image = new Image();
    state.busy = true;
    const done = found => {
      state.busy = false; state.key = key; state.last = found;
      this.stage.setImage(n, layer, found);
      if (n == this.film) this.updateInset();
      if (this.waiting && !this.busy()) this.hint("");
      if (String(this.frame) != key && this.stage.shown[layer]) this.fetchImage(n, layer);
    };
    image.onload = () => done(image);
    image.onerror = () => done(null);
    image.src = url;
    if (this.data.served && !this.started) { this.started = true; setTimeout(() => this.busy() && this.hint("reading the films"), 700); }
  }
  busy() { return this.images.some(each => LAYERS.some(layer => each[layer].busy)); }
  get layers() { return LAYERS.filter(layer => this.data.served || layer in this.data.images); }
  hint(text) { this.waiting = Boolean(text); id("hint").textContent = text; id("hint").hidden = !text; }
  async ask(what) {
    if (!this.data[what] || !this.stage.shown[what] || this.asked[what]) return;
    const frame = this.frame;
    this.asked[what] = true;
    try {
      const answer = await fetch(`${what}/${this.own[frame]}`);
      this.stage.extra[what] = answer.ok && answer.status == 200 ? new Float32Array(await answer.arrayBuffer()) : null;
    } catch { this.stage.extra[what] = null; }
    this.asked[what] = false;
    this.stage.stale = true;
    if (this.frame != frame) this.ask(what);
  }

  // The panel

  buildShow() {
    const {data, stage} = this;
    const add = (name, on, act) => {
      const box = element("input", {type: "checkbox", checked: on});
      box.addEventListener("change", () => { act(box.checked); stage.stale = true; });
      id("show").append(element("label", {}, box, ` ${name}`));
      return box;
    };
    for (const kind of new Set(data.figures.map(each => each.kind))) add(KINDS[kind], true, on => { stage.kinds[kind] = on; });
    if (data.cameras.length) add("cameras", true, on => { stage.shown.cameras = on; });
    if (data.cameras.some(each => each.images)) {
      add("images at the cameras", true, on => { stage.shown.images = on; });
      this.showInset = add("a camera's image in the corner", true, () => this.updateInset());
      for (const layer of this.layers) add(layer, true, on => { stage.shown[layer] = on; this.fetchImages(); });
    }
    if (data.cameras.some(each => each.keypoints)) {
      add("keypoints", true, on => { stage.shown.keypoints = on; this.updateInset(); });
      add("rays of the keypoints", false, on => { stage.shown.rays = on; });
    }
    if (stage.figures.some(each => each.sd)) add("90 % intervals of the joints", true, on => { stage.shown.intervals = on; });
    if (data.hull) add("hull points", stage.shown.hull = !data.figures.some(each => each.kind == "estimate"), on => { stage.shown.hull = on; this.ask("hull"); });
    if (data.particles) add("particles", false, on => { stage.shown.particles = on; this.ask("particles"); });
  }
  buildCurves() {
    const {data} = this, unpacked = curves => Object.fromEntries(Object.entries(curves).map(([name, values]) => [name, unpack(values)]));
    this.charts = data.charts.map(chart => ({...chart, times: unpack(chart.times), curves: unpacked(chart.curves), sd: unpacked(chart.sd)}));
    this.charts = this.charts.filter(chart => chart.times.length > 1);
    this.lines = data.strips.map(strip => ({...strip, codes: unpack(strip.status), rows: strip.rows.map(row => ({...row, data: unpack(row.values)}))}));
    this.plots = [];
    const pick = element("p", {className: "muted", textContent: "Click on the body for the curves of a joint."});
    id("curves").append(pick);
    const named = this.stage.figures.some(each => each.jointNames.length && each.kind != "truth");
    pick.hidden = !named || this.times.length < 2;
    if (!this.charts.length) { id("curves").hidden = pick.hidden; return; }
    const second = this.charts.find((chart, n) => n && /angles/.test(chart.name)) || this.charts[1];
    for (const chart of [this.charts[0], second]) if (chart) this.addPlot(chart.name);
  }
  addPlot(name) {
    const plot = new Plot(this.data, this.charts, name, time => this.seek(nearest(this.times, time)));
    this.plots.push(plot);
    id("curves").append(plot.box);
  }
  // A click on the body: curves of the joint, and of its limb's angles.
  choose(found) {
    this.stage.chosen = found; this.stage.stale = true;
    this.charts = this.charts.filter(chart => !chart.name.endsWith(PICKED));
    const own = found && this.times.length > 1 ? jointCharts(this.data, this.stage, found.figure, found.joint) : [];
    this.charts.unshift(...own);
    for (const plot of this.plots) { const name = plot.chart.name; plot.charts = this.charts; plot.fill(); plot.choose(name); }
    this.hint(found ? found.figure.jointNames[found.joint] : "");
    if (!own.length) return;
    if (!this.plots.length) this.addPlot(own[0].name);
    this.plots[0].choose(own[0].name);
    const name = found.figure.jointNames[found.joint], side = name.split(" ")[0];
    const limb = /shoulder|elbow|wrist|hand/.test(name) ? `${side} arm` : /hip|knee|ankle|heel|toe/.test(name) ? `${side} leg` : "trunk";
    const angles = this.charts.find(chart => chart.name.includes(`angles: ${limb}`));
    if (this.plots[1] && (own[1] || angles)) this.plots[1].choose((angles || own[1]).name);
  }
  buildAbout() {
    for (const [name, text] of Object.entries(this.data.facts)) id("facts").append(element("dt", {textContent: name}), element("dd", {textContent: text}));
    for (const text of [...this.data.notes, ...this.data.problems]) id("notes").append(element("p", {textContent: text}));
  }
  resized() {
    this.stage.stale = true;
    if (this.stage.through === null && !this.framed && id("space").clientWidth) { this.framed = true; this.frameAll(); }
    this.strip.resize(); this.strip.to(this.frame);
    for (const plot of this.plots) plot.to(this.times[this.frame]);
  }
}

function id(name) { return document.getElementById(name); }

try {
  window.page = new Page(JSON.parse(id("data").textContent));
} catch (error) {
  id("hint").hidden = false; id("hint").textContent = `Nothing can be drawn here: ${error.message}`;
  throw error;
}
