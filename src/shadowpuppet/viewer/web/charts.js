// The strip under the timeline, over the whole run, and plots of curves around the current time.

const PAINTS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a7a7a", "#a6761d"];
const AROUND = 4;  // seconds before and after the current time
const PICKED = " (picked)";

function context(canvas) {
  const scale = Math.min(window.devicePixelRatio || 1, 2), [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.round(width * scale); canvas.height = Math.round(height * scale);
  const drawn = canvas.getContext("2d");
  drawn.scale(scale, scale);
  return [drawn, width, height, 1 / scale];
}
function colourOf(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
function shown(value, unit) {
  if (!Number.isFinite(value)) return "–";
  const digits = unit == "m" ? 3 : unit == "of 1" ? 2 : Math.abs(value) < 10 ? 1 : 0;
  return `${value.toFixed(digits)}${unit == "of 1" ? "" : unit == "°" ? "°" : ` ${unit}`}`;
}
function extent(values, none = [0, 1]) {
  const known = values.filter(Number.isFinite);
  return known.length ? [known.reduce((a, b) => Math.min(a, b)), known.reduce((a, b) => Math.max(a, b))] : none;
}
function nearest(times, now) {
  let low = 0, high = times.length - 1;
  while (low < high) { const middle = (low + high) >> 1; if (times[middle] < now) low = middle + 1; else high = middle; }
  return low > 0 && now - times[low - 1] < times[low] - now ? low - 1 : low;
}

class Strip {
  constructor(data, times, rows, key, seek) {
    this.data = data; this.times = times; this.parts = [];
    for (const strip of data.strips) {
      if (data.strips.length > 1) rows.append(element("div", {className: "row group", textContent: strip.name}));
      const status = unpack(strip.status);
      strip.limbs.forEach((limb, k) => this.add(rows, limb, `Status of ${limb} over the run`, 9, seek,
        canvas => this.drawStatus(canvas, status, strip.limbs.length, k)));
      for (const row of strip.rows) {
        const values = unpack(row.values);
        const top = row.unit == "of 1" ? 1 : extent([...values])[1];
        this.add(rows, `${row.short}, 0–${shown(top, row.unit)}`, `${row.name} over the run, 0 to ${shown(top, row.unit)}`, 22, seek,
          canvas => this.drawValues(canvas, values, top));
      }
    }
    this.now = element("div", {id: "now"});
    if (this.parts.length) rows.append(this.now);
    this.rows = rows;
    if (data.strips.length) for (const name of data.statuses)
      key.append(element("span", {}, this.swatch(name), name == "tracked" ? "tracked: vouched for" : name));
    key.hidden = !data.strips.length;
  }
  add(rows, name, label, height, seek, draw) {
    const canvas = element("canvas");
    canvas.setAttribute("role", "img"); canvas.setAttribute("aria-label", label);
    canvas.style.height = `${height}px`;
    rows.append(element("div", {className: "row", title: label}, element("span", {className: "name", textContent: name}), canvas));
    const go = event => seek(Math.round(event.offsetX / canvas.clientWidth * (this.times.length - 1)));
    canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); go(event); });
    canvas.addEventListener("pointermove", event => { if (event.buttons) go(event); });
    this.parts.push({canvas, draw});
  }
  swatch(name) {
    const made = element("span", {className: "swatch"});
    made.style.background = name == "absent" ? "transparent" : `var(--${name})`;
    return made;
  }
  resize() { for (const {canvas, draw} of this.parts) draw(canvas); }
  drawStatus(canvas, status, limbs, k) {
    const [drawn, width, height, pixel] = context(canvas), T = this.times.length;
    const paints = this.data.statuses.map(name => name == "absent" ? null : colourOf(`--${name}`));
    for (let x = 0; x < width; x += pixel) {  // the worst of the frames at a pixel
      let worst = -1;
      const first = Math.floor(x / width * T), last = Math.max(Math.ceil((x + pixel) / width * T), first + 1);
      for (let n = first; n < last && n < T; n++) worst = Math.max(worst, status[n * limbs + k]);
      if (worst < 0 || !paints[worst]) continue;
      drawn.fillStyle = paints[worst];
      drawn.fillRect(x, 1, pixel, height - 2);
    }
  }
  drawValues(canvas, values, top) {
    const [drawn, width, height, pixel] = context(canvas), T = values.length;
    drawn.fillStyle = colourOf("--line"); drawn.fillRect(0, height - 1, width, 1);
    drawn.fillStyle = colourOf("--soft");
    for (let x = 0; x < width; x += pixel) {
      let most = NaN;
      const first = Math.floor(x / width * T), last = Math.max(Math.ceil((x + pixel) / width * T), first + 1);
      for (let n = first; n < last && n < T; n++) if (!(most >= values[n]) && Number.isFinite(values[n])) most = values[n];
      if (Number.isFinite(most)) { const high = most / (top || 1) * (height - 3); drawn.fillRect(x, height - 1 - high, pixel, high); }
    }
  }
  to(frame) {
    const canvas = this.parts.length && this.parts[0].canvas;
    if (canvas) this.now.style.left = `${canvas.offsetLeft + frame / Math.max(this.times.length - 1, 1) * canvas.clientWidth - 1}px`;
  }
}

class Plot {
  // `charts`: [{name, unit, times, curves: {name: values}, sd: {name: values}}].
  constructor(data, charts, first, seek) {
    this.data = data; this.charts = charts; this.seek = seek; this.now = 0; this.hover = null;
    this.choice = element("select");
    this.choice.setAttribute("aria-label", "Curves of");
    this.canvas = element("canvas");
    this.canvas.setAttribute("role", "img");
    this.legend = element("ul", {className: "legend"});
    this.box = element("div", {className: "plot"}, this.choice, this.canvas, this.legend);
    this.fill(); this.choose(first);
    this.choice.addEventListener("change", () => this.choose(this.choice.value));
    const timeAt = event => this.low + (event.offsetX - this.left) / (this.canvas.clientWidth - this.left) * (this.high - this.low);
    this.canvas.addEventListener("pointermove", event => { this.hover = timeAt(event); this.to(this.now); });
    this.canvas.addEventListener("pointerleave", () => { this.hover = null; this.to(this.now); });
    this.canvas.addEventListener("pointerdown", event => this.seek(timeAt(event)));
  }
  fill() { this.choice.replaceChildren(...this.charts.map(chart => element("option", {value: chart.name, textContent: `${chart.name}, ${chart.unit}`}))); }
  choose(name) {
    this.chart = this.charts.find(chart => chart.name == name) || this.charts[0];
    this.choice.value = this.chart.name;
    this.names = Object.keys(this.chart.curves);
    let [least, most] = extent(this.names.flatMap(curve => [...this.chart.curves[curve]]));
    const [low, high] = extent(Object.entries(this.chart.sd).flatMap(([curve, sd]) =>
      [...sd].flatMap((each, n) => [-1, 1].map(side => this.chart.curves[curve][n] + side * this.data.interval * each))), [Infinity, -Infinity]);
    const room = Math.max(most - least, 1e-3);  // wide intervals are cut, so that curves stay curves
    [least, most] = [Math.min(least, Math.max(low, least - room)), Math.max(most, Math.min(high, most + room))];
    if (["mm", "of 1"].includes(this.chart.unit)) least = Math.min(least, 0);
    const margin = 0.05 * Math.max(most - least, 1e-3);
    this.range = [least - (least < 0 || !["mm", "of 1"].includes(this.chart.unit) ? margin : 0), most + margin];
    this.canvas.setAttribute("aria-label", `Curves over time: ${this.chart.name}, ${this.chart.unit}`);
    this.values = this.names.map(() => element("span", {className: "value"}));
    this.legend.replaceChildren(...this.names.map((curve, n) => {
      const dash = element("span", {className: n >= PAINTS.length || curve.endsWith(", beside") ? "dash broken" : "dash"});
      dash.style.borderTopColor = this.paint(n);
      return element("li", {}, dash, element("span", {textContent: curve}), this.values[n]);
    }));
    this.to(this.now);
  }
  paint(n) {
    const name = this.names[n], own = this.names.indexOf(name.replace(/, beside$/, ""));
    return PAINTS[(own >= 0 ? own : n) % PAINTS.length];
  }
  to(now) {
    this.now = now;
    const [drawn, width, height] = context(this.canvas), {times, curves, sd} = this.chart;
    if (!width || !times.length) return;
    const [first, last] = [times[0], times[times.length - 1]], span = Math.min(2 * AROUND, Math.max(last - first, 1e-6));
    this.low = Math.min(Math.max(now - span / 2, first), last - span); this.high = this.low + span;
    this.left = 42;
    const foot = 18, x = time => this.left + (time - this.low) / span * (width - this.left);
    const [least, most] = this.range, y = value => (height - foot) * (1 - (value - least) / (most - least));
    const from = Math.max(nearest(times, this.low) - 1, 0), to = Math.min(nearest(times, this.high) + 2, times.length);
    drawn.font = "11px system-ui, sans-serif"; drawn.lineWidth = 1;
    this.ticks(least, most, 4).forEach(value => {
      drawn.fillStyle = colourOf("--line"); drawn.fillRect(this.left, y(value), width, 1);
      drawn.fillStyle = colourOf("--soft"); drawn.textAlign = "right"; drawn.textBaseline = "middle";
      drawn.fillText(+value.toPrecision(4), this.left - 5, Math.min(Math.max(y(value), 6), height - foot - 4));
    });
    this.ticks(this.low, this.high, 5).forEach(value => {
      drawn.fillStyle = colourOf("--soft"); drawn.textAlign = "center"; drawn.textBaseline = "bottom";
      drawn.fillText(`${+value.toPrecision(4)} s`, Math.min(Math.max(x(value), this.left + 8), width - 16), height);
    });
    drawn.save(); drawn.beginPath(); drawn.rect(this.left, 0, width - this.left, height - foot); drawn.clip();
    this.names.forEach((name, n) => {
      const values = curves[name], deviations = sd[name];
      drawn.strokeStyle = drawn.fillStyle = this.paint(n);
      if (deviations) {
        drawn.globalAlpha = 0.2;
        for (let k = from; k + 1 < to; k++) {
          const [a, b] = [deviations[k], deviations[k + 1]].map(value => this.data.interval * value);
          if (!Number.isFinite(values[k] + values[k + 1] + a + b)) continue;
          drawn.beginPath();
          drawn.moveTo(x(times[k]), y(values[k] - a)); drawn.lineTo(x(times[k + 1]), y(values[k + 1] - b));
          drawn.lineTo(x(times[k + 1]), y(values[k + 1] + b)); drawn.lineTo(x(times[k]), y(values[k] + a));
          drawn.fill();
        }
        drawn.globalAlpha = 1;
      }
      drawn.lineWidth = 1.7;
      drawn.setLineDash(n >= PAINTS.length || name.endsWith(", beside") ? [5, 4] : []);
      drawn.beginPath();
      let down = false;
      for (let k = from; k < to; k++) {
        if (!Number.isFinite(values[k])) { down = false; continue; }
        if (down) drawn.lineTo(x(times[k]), y(values[k])); else drawn.moveTo(x(times[k]), y(values[k]));
        down = true;
      }
      drawn.stroke();
    });
    drawn.setLineDash([]);
    const at = this.hover === null ? now : this.hover, k = nearest(times, at);
    drawn.fillStyle = colourOf("--ink"); drawn.fillRect(x(now) - 0.75, 0, 1.5, height);
    if (this.hover !== null) { drawn.fillStyle = colourOf("--soft"); drawn.fillRect(x(at), 0, 1, height); }
    drawn.restore();
    this.names.forEach((name, n) => {
      const reach = sd[name] && Number.isFinite(sd[name][k]) ? ` ± ${shown(this.data.interval * sd[name][k], this.chart.unit)}` : "";
      this.values[n].textContent = shown(curves[name][k], this.chart.unit) + reach;
    });
  }
  ticks(low, high, count) {
    const rough = (high - low) / count, ten = 10 ** Math.floor(Math.log10(rough || 1));
    const step = [1, 2, 5, 10].map(value => value * ten).find(value => value >= rough) || 1, out = [];
    for (let value = Math.ceil(low / step) * step; value <= high && out.length < 20; value += step) out.push(value);
    return out;
  }
}

// Charts of a joint of a figure: where it is with its 90 % interval, and how far off where a truth has the joint, too.
function jointCharts(data, stage, figure, j) {
  const times = unpack(data.times), names = ["x", "y", "z"], T = times.length, count = figure.jointNames.length;
  const curves = names.map(() => new Float32Array(T).fill(NaN)), sd = names.map(() => new Float32Array(T).fill(NaN));
  const truth = stage.figures.find(each => each.kind == "truth" && each.jointNames.includes(figure.jointNames[j]));
  const error = new Float32Array(T).fill(NaN), k = truth ? truth.jointNames.indexOf(figure.jointNames[j]) : -1;
  for (let frame = 0; frame < T; frame++) {
    const n = figure.frames[frame];
    if (n < 0) continue;
    for (let axis = 0; axis < 3; axis++) {
      curves[axis][frame] = figure.named[3 * (n * count + j) + axis];
      if (figure.sd) sd[axis][frame] = figure.sd[3 * (n * count + j) + axis];
    }
    const m = truth ? truth.frames[frame] : -1;
    if (m >= 0) error[frame] = 1000 * Math.hypot(...[0, 1, 2].map(axis =>
      truth.named[3 * (m * truth.jointNames.length + k) + axis] - curves[axis][frame]));
  }
  const who = stage.figures.filter(each => each.kind != "truth").length > 1 ? `${figure.name}, ` : "";
  const of = (values) => Object.fromEntries(names.map((name, axis) => [name, values[axis]]));
  const stated = figure.sd && sd.some(values => values.some(Number.isFinite));
  const out = [{name: `${who}${figure.jointNames[j]}${PICKED}`, unit: "m", times, curves: of(curves), sd: stated ? of(sd) : {}}];
  if (truth) out.push({name: `${who}error of ${figure.jointNames[j]}${PICKED}`, unit: "mm", times, curves: {error}, sd: {}});
  return out;
}
