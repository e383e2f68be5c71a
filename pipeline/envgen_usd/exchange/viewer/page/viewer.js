// The page of `envgen-usd view`: camera, layers, label colours, and what is clicked.
import {
  ACESFilmicToneMapping, BackSide, Box3, Box3Helper, Color, DirectionalLight, Fog, HemisphereLight,
  MapControls, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PMREMGenerator, PerspectiveCamera, Raycaster, Scene,
  ShaderMaterial, SphereGeometry, Vector2, Vector3, WebGLRenderer,
} from "./three.js";
import { Tiles } from "./streaming.js";
import { factsAt, shown } from "./facts.js";
import { showLabels } from "./flat_meshes.js";

const TICK = 250; // Time in ms between two looks at what is near; less loads sooner.
const SLOW = 70; // Time in ms between two frames above which moving pictures get coarser.
const LEAN = 0.5; // Factor of the distances of detail without a graphics card.
const STILL = 700; // Time in ms that the first picture of a resting camera may take.
const LONG = 1500; // Time in ms after which a resting picture has all pixels, however long that takes.
const HASTE = [0.25, 0.5]; // Range of the factor of the distances at which small objects end in motion, without a graphics card.
const GRAIN = 0.7; // Pixels below whose width a triangle is left out in motion; more leaves gaps.
const COARSEST = 0.3; // Smallest share of the window's pixels along each side.
const SKY = { high: new Color(0x84acd8), low: new Color(0xdde4e8), ground: new Color(0xb9bfb8) };
const SUN = new Vector3(0.45, 0.75, 0.5);
const $ = (id) => document.getElementById(id);

const options = new URLSearchParams(location.search);
const software = isSoftware();
const renderer = new WebGLRenderer({ antialias: !software });
renderer.toneMapping = ACESFilmicToneMapping;
renderer.toneMappingExposure = 1.25;
document.body.prepend(renderer.domElement);
const scene = new Scene();
const camera = new PerspectiveCamera(60, 1, 0.3, 4000);
const controls = new MapControls(camera, renderer.domElement);
controls.maxPolarAngle = Math.PI * 0.497;
controls.addEventListener("change", draw);
const classes = {};
const hidden = new Set();
const walked = new Set();
const times = [];
let tiles = null, mark = null, wanted = true, labelled = options.get("colours") === "classes";

start().catch((error) => {
  $("state").textContent = error.message;
  $("state").className = "error";
});

async function start() {
  const answer = await fetch("gltf/tiles.json");
  if (!answer.ok) throw new Error("tiles.json cannot be read; run envgen-usd export OUT --gltf");
  const index = await answer.json();
  for (const [name, rgb] of Object.entries(index.classes)) {
    const colour = new Color().setRGB(...rgb.map((value) => value / 255), "srgb");
    classes[name] = new MeshBasicMaterial({ color: colour, toneMapped: false, side: 2, fog: false });
  }
  tiles = new Tiles(index, "gltf", arrived, software ? plain : (material) => material,
    software ? LEAN : 1, software);
  if (options.has("range")) tiles.range = Number(options.get("range"));
  scene.add(tiles.group);
  light();
  place(tiles.bounds);
  fillPanel(index);
  addEventListener("resize", resize);
  resize();
  window.envgen = { camera, controls, tiles, scene, renderer, render, pick, setLabels, setLayer, report };
  setInterval(tick, TICK);
  tick();
  requestAnimationFrame(loop);
}

/** True where no graphics card draws. */
function isSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const name = gl?.getExtension("WEBGL_debug_renderer_info");
  return !gl || !name || /swiftshader|llvmpipe|software/i.test(gl.getParameter(name.UNMASKED_RENDERER_WEBGL));
}

/** A sky that lights, and a sun. */
function light() {
  const sky = new ShaderMaterial({
    side: BackSide, depthWrite: false,
    uniforms: Object.fromEntries(Object.entries(SKY).map(([key, value]) => [key, { value }])),
    vertexShader: "varying vec3 d; void main() { d = position; gl_Position = " +
      "projectionMatrix * vec4((modelViewMatrix * vec4(position, 0.0)).xyz, 1.0); }",
    fragmentShader: "uniform vec3 high, low, ground; varying vec3 d; void main() { float y = " +
      "normalize(d).y; vec3 c = y > 0.0 ? mix(low, high, pow(y, 0.5)) : mix(low, ground, " +
      "smoothstep(0.0, 0.1, -y)); gl_FragColor = vec4(c, 1.0); }",
  });
  const dome = new Mesh(new SphereGeometry(100, 32, 16), sky);
  dome.frustumCulled = false;
  dome.renderOrder = -1;
  if (software) scene.add(new HemisphereLight(0xcfdff4, 0x9ba0a6, 3.4));
  else {
    const surroundings = new Scene();
    surroundings.add(dome.clone());
    scene.environment = new PMREMGenerator(renderer).fromScene(surroundings, 0, 1, 300).texture;
    scene.environmentIntensity = 1.1;
  }
  scene.background = SKY.low;
  scene.fog = new Fog(SKY.low, 500, 2500);
  const sun = new DirectionalLight(0xffeed6, 3.2);
  sun.position.copy(SUN);
  scene.add(sun, dome);
}

const plains = new Map();

/** A material without reflections, which a computer without a graphics card draws faster. */
function plain(material) {
  if (!plains.has(material.uuid)) {
    const { name, color, map, alphaTest, transparent, opacity, side, vertexColors, emissive, emissiveIntensity } = material;
    plains.set(material.uuid, new MeshLambertMaterial({ name, color, map, alphaTest, transparent, opacity,
      side, vertexColors, emissive, emissiveIntensity }));
  }
  return plains.get(material.uuid);
}

/** The camera of the address, or a view of the whole town. */
function place(bounds) {
  const given = (options.get("camera") || "").split(",").map(Number);
  if (given.length === 6 && given.every(Number.isFinite)) {
    camera.position.set(...given.slice(0, 3));
    controls.target.set(...given.slice(3));
  } else {
    const middle = bounds.getCenter(new Vector3());
    const size = bounds.getSize(new Vector3());
    const far = 0.62 * Math.max(size.x, size.z, 60);
    controls.target.set(middle.x, 0, middle.z);
    camera.position.set(middle.x + 0.2 * far, 0.75 * far, middle.z + far);
  }
  controls.update();
}

function fillPanel(index) {
  const names = ["Terrain", "Roads", "Buildings", "Props", "Actors"];
  if (index.chunks.some((each) => each.chunk === "Traffic")) names.push("Traffic");
  for (const name of names) {
    const box = toggle($("layers"), name, !(options.get("hide") || "").split(",").includes(name));
    box.addEventListener("change", () => setLayer(name, box.checked));
    if (!box.checked) hidden.add(name);
  }
  $("labels").checked = labelled;
  $("classes").hidden = !labelled;
  $("labels").addEventListener("change", () => setLabels($("labels").checked));
  for (const [name, rgb] of Object.entries(index.classes)) {
    const row = document.createElement("div");
    const colour = document.createElement("i");
    colour.style.background = `rgb(${rgb.join()})`;
    row.append(colour, name.replace("_", " "));
    $("classes").append(row);
  }
}

function toggle(parent, name, checked) {
  const label = document.createElement("label");
  const box = Object.assign(document.createElement("input"), { type: "checkbox", checked });
  label.append(box, ` ${name}`);
  parent.append(label);
  return box;
}

/** Shows a new chunk as the others are shown. */
function arrived(tile) {
  if (tile?.scene) {
    colour(tile.scene);
    for (const name of hidden) show(tile.scene, name, false);
  }
  draw();
  tick();
}

function setLabels(on) {
  labelled = on;
  $("labels").checked = on;
  $("classes").hidden = !on;
  colour(tiles.group);
  scene.fog.near = on ? 1e6 : 500;
  scene.fog.far = on ? 2e6 : 2500;
  draw();
}

function colour(root) {
  root.traverse((object) => {
    if (!object.isMesh) return;
    const { label, ownMaterial, looks } = object.userData;
    if (looks) showLabels(object, labelled, (name) => (classes[name] || classes.void).color);
    else object.material = labelled ? labelMaterial(label, ownMaterial) : ownMaterial;
  });
}

/** The colour of a class; leaves keep the shape that their texture cuts. */
function labelMaterial(label, own) {
  const plain = classes[label] || classes.void;
  if (!own.alphaTest) return plain;
  const key = `${label} ${own.map.uuid}`;
  if (!classes[key]) {
    const cut = plain.clone();
    Object.assign(cut, { map: own.map, alphaTest: own.alphaTest });
    cut.onBeforeCompile = (shader) => {
      const alone = "diffuseColor.a *= texture2D(map, vMapUv).a;";
      shader.fragmentShader = shader.fragmentShader.replace("#include <map_fragment>", alone);
    };
    classes[key] = cut;
  }
  return classes[key];
}

function setLayer(name, on) {
  on ? hidden.delete(name) : hidden.add(name);
  show(tiles.group, name, on);
  draw();
}

function show(root, name, on) {
  root.traverse((object) => {
    if (object.userData.layer === name) object.visible = on;
  });
}

/** Facts of what is drawn at a place of the window (pixels), or null. */
function pick(x, y) {
  const size = renderer.domElement.getBoundingClientRect();
  const at = new Vector2((2 * (x - size.left)) / size.width - 1, 1 - (2 * (y - size.top)) / size.height);
  const ray = new Raycaster();
  camera.updateMatrixWorld();
  tiles.see(camera);
  ray.setFromCamera(at, camera);
  const hit = ray.intersectObject(tiles.group).find((each) => isSeen(each.object));
  if (mark) scene.remove(mark);
  mark = null;
  const facts = hit ? factsAt(hit) : null;
  if (hit) scene.add((mark = new Box3Helper(boxOf(hit), 0xffcc33)));
  $("facts").replaceChildren(...(facts ? [shown(facts)] : []));
  draw();
  return facts;
}

function isSeen(object) {
  for (let each = object; each; each = each.parent) if (!each.visible) return false;
  return true;
}

/** Box around the object that a ray hits, in the world. */
function boxOf({ object, instanceId, faceIndex }) {
  const { parts } = object.userData;
  if (!parts) {
    const box = object.geometry.boundingBox || (object.geometry.computeBoundingBox(), object.geometry.boundingBox);
    const place = new Matrix4();
    if (object.isInstancedMesh) object.getMatrixAt(instanceId, place);
    return box.clone().applyMatrix4(place.premultiply(object.matrixWorld));
  }
  const { facts } = object.partAt(faceIndex);
  const box = new Box3(), corner = new Vector3();
  for (const mesh of object.parent.children) mesh.expand?.(box, facts, corner);
  return box.applyMatrix4(object.matrixWorld);
}

let pressed = null;
renderer.domElement.addEventListener("pointerdown", (event) => {
  pressed = [event.clientX, event.clientY];
});
renderer.domElement.addEventListener("pointerup", (event) => {
  const [x, y] = pressed || [0, 0];
  const moved = Math.hypot(event.clientX - x, event.clientY - y);
  if (event.button === 0 && moved < 4) pick(event.clientX, event.clientY);
});
addEventListener("keydown", (event) => walked.add(event.key.toLowerCase()));
addEventListener("keyup", (event) => walked.delete(event.key.toLowerCase()));
addEventListener("blur", () => walked.clear());

/** Moves camera and target together. */
function walk(seconds) {
  const along = new Vector3();
  camera.getWorldDirection(along).setY(0).normalize();
  const aside = new Vector3(-along.z, 0, along.x);
  const step = new Vector3();
  const directions = { w: along, s: along.clone().negate(), d: aside, a: aside.clone().negate(),
    e: new Vector3(0, 1, 0), q: new Vector3(0, -1, 0) };
  for (const [key, direction] of Object.entries(directions)) if (walked.has(key)) step.add(direction);
  if (!step.lengthSq()) return;
  const reach = camera.position.distanceTo(controls.target);
  step.multiplyScalar(Math.min(Math.max(reach, 10), 150) * seconds);
  camera.position.add(step);
  controls.target.add(step);
  wanted = true;
}

let before = 0, drawn = 0, rest = 0, cost = 0;
let complete = false; // True if the picture shows all that it can.
let share = 1; // Of the window's pixels along each side.
let moving = software ? 0.5 : 1; // The share while the camera moves.
let haste = HASTE[1]; // The reach while the camera moves.
function loop(now) {
  walk(Math.min((now - before) / 1000, 0.1));
  before = now;
  controls.update();
  if (drawn) measure(now - drawn);
  drawn = 0;
  if (wanted) {
    wanted = false;
    sharpen(moving);
    drawn = now;
    rest = now + 400;
    if (software) render(haste, grain());
    else render();
    complete = !software;
  } else if (now > rest && (share < sharpest() || !complete)) {
    sharpen(sharpest()); // Standing still, the picture is sharper and shows more.
    render();
    complete = true;
  } else if (now > rest + LONG && share < 1) {
    sharpen(1);
    render();
  }
  requestAnimationFrame(loop);
}

/** Angle of `GRAIN` drawn pixels, in steps of 2, so that it seldom changes. */
function grain() {
  const pixel = (camera.fov * Math.PI) / 180 / (innerHeight * renderer.getPixelRatio());
  return 2 ** Math.round(Math.log2(GRAIN * pixel));
}

/** Draws what the camera sees; `see` of the tiles says what reach and grain leave out. */
function render(reach = 1, grain = 0) {
  camera.updateMatrixWorld();
  tiles?.see(camera, reach, grain);
  renderer.render(scene, camera);
}

/** Adapts the pixels, and then the reach, of moving pictures to the time of a frame, ms. */
function measure(ms) {
  times.push(ms);
  if (times.length > 60) times.shift();
  cost = ms / share ** 2;
  const fit = Math.min(Math.max(Math.sqrt(SLOW / ms), 0.5), 1.2);
  if (ms > SLOW || ms < SLOW / 2) moving = Math.min(Math.max(moving * fit, COARSEST), 1);
  if (ms > SLOW && moving === COARSEST) haste = Math.max(0.8 * haste, HASTE[0]);
  if (ms < SLOW / 2) haste = Math.min(1.1 * haste, HASTE[1]);
}

/** The share of the first picture that rests: all pixels, if they take no longer than `STILL`. */
function sharpest() {
  return cost > STILL ? Math.max(Math.sqrt(STILL / cost), moving) : 1;
}

/** Draws with a share of the window's pixels along each side. */
function sharpen(value) {
  if (Math.abs(value - share) < 0.02 && value !== 1) return;
  if (value === share) return;
  share = value;
  renderer.setPixelRatio(share * Math.min(devicePixelRatio, 2));
}

function draw() {
  wanted = true;
}

function tick() {
  tiles.update(camera.position);
  const { calls, triangles } = report();
  const errors = tiles.failed.length ? `\n${tiles.failed.join("\n")}` : "";
  $("state").textContent = `${tiles.loaded.length} of ${tiles.tiles.length} chunks\n` +
    `${(triangles / 1e6).toFixed(2)} M triangles, ${calls} draws${errors}`;
}

function report() {
  const { calls, triangles } = renderer.info.render;
  const sorted = [...times].sort((a, b) => a - b);
  return { calls, triangles, loaded: tiles.loaded.length, all: tiles.tiles.length,
    ready: tiles.isReady, failed: tiles.failed, software, ms: sorted[Math.floor(sorted.length / 2)] || 0 };
}

function resize() {
  renderer.setPixelRatio(share * Math.min(devicePixelRatio, 2));
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  draw();
}
