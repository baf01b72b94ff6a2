// The body of a live session in space, moved by the session's events; a new stage whenever the person is measured again.

const IMAGE_EVERY = 100;                  // ms between the camera's images
const find = name => document.getElementById(name);
let stage = null, scene = null, building = false, asked = 0;

export async function show(view) {
  if (!scene || scene.number !== view.space) await build(view.space);
  if (!stage) return;
  if (view.puppet) stage.move(stage.figures[0], view.puppet);
  else { stage.figures[0].frames = [-1]; stage.stale = true; }
  if (scene.film && !find("scene").hidden && performance.now() - asked > IMAGE_EVERY) fetchImage();
}

async function build() {
  if (building) return;
  building = true;
  try {
    const answer = await fetch("space.json");
    if (!answer.ok) return;
    scene = await answer.json();
    const canvas = element("canvas", {id: "space", tabIndex: 0, ariaLabel: "The body in space. Drag or arrow keys turn the view, wheel or plus and minus zoom."});
    const labels = element("div", {id: "labels"});
    canvas.setAttribute("role", "img");
    stage?.gl.getExtension("WEBGL_lose_context")?.loseContext();
    stage = null;
    find("scene").replaceChildren(canvas, labels);
    if (find("views").hidden) toggle(true);
    find("views").hidden = false;
    const acts = {look: n => stage.look(n), looked: () => {}, chose: () => {}};
    stage = new Stage(scene, canvas, labels, acts);
    new ResizeObserver(() => { stage.stale = true; }).observe(canvas);
    stage.frameAll();
    window.stage = stage;
  } catch (error) {
    find("scene").textContent = `The body in space cannot be drawn here: ${error.message}`;
  } finally { building = false; }
}

function fetchImage() {
  const image = new Image();
  asked = Infinity;
  image.onload = () => { asked = performance.now(); stage.setImage(0, "pictures", image); };
  image.onerror = () => { asked = performance.now(); };
  image.src = `space.jpg?${performance.now()}`;
}

// The space in which the person is now.
function framePerson() {
  const figure = stage.figures[0], at = figure.frames[0] < 0 ? [] : figure.jointNames.map((_, j) => stage.joint(figure, 0, j)).filter(Boolean);
  if (at.length) scene.box = [Math.min, Math.max].map(most => [0, 1, 2].map(axis => most(...at.map(point => point[axis]))));
  stage.frameAll(false);
}

// Whether the space is shown beside the picture.
function toggle(on) {
  find("scene").hidden = !on;
  document.querySelector("main").classList.toggle("in-space", on);
  document.querySelector("[data-view=toggle]").setAttribute("aria-pressed", !on);
}

find("views").addEventListener("click", event => {
  const wish = event.target.dataset.view;
  if (stage && wish) ({all: () => stage.frameAll(), person: framePerson, camera: () => stage.look(0), toggle: () => toggle(find("scene").hidden)})[wish]();
});
function tick() {
  if (stage?.stale && !find("scene").hidden) stage.draw(0);
  requestAnimationFrame(tick);
}
tick();
