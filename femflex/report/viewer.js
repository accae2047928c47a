// Draws the moving bodies of a report: positions are linear between instants, rotations turn at a uniform rate.
import * as THREE from "three";

const PLAY = 12; // s, in which a clip that does not repeat is shown
const CYCLE = 2; // s, of a vibration
const $ = (id) => document.getElementById(id);
const TYPES = {f4: Float32Array, u4: Uint32Array, i2: Int16Array};

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const array = ([type, offset, count]) => new TYPES[type](buffer, 4 + length + offset, count);
  return {header, array};
}

const {header, array} = await unpacked($("payload").textContent.trim());
const canvas = $("scene");
const renderer = new THREE.WebGLRenderer({canvas, antialias: true});
const scene = new THREE.Scene();
scene.background = new THREE.Color("#ffffff");
const root = new THREE.Group();
if (header.up === 2) root.rotation.x = -Math.PI / 2;
if (header.up === 0) root.rotation.z = Math.PI / 2;
scene.add(root, new THREE.HemisphereLight("#ffffff", "#8c97a3", 2.2));
const camera = new THREE.PerspectiveCamera(32, 1, 0.01, 1e4);
const lamp = new THREE.DirectionalLight("#ffffff", 1.4);
camera.add(lamp);
lamp.position.set(-0.4, 0.8, 1);
scene.add(camera);

const clips = header.clips.map((clip) => ({...clip, times: array(clip.times)}));
const bodies = header.bodies.map((entry) => {
  const rest = array(entry.points);
  const geometry = new THREE.BufferGeometry();
  const position = new THREE.BufferAttribute(new Float32Array(rest), 3);
  const colour = new THREE.BufferAttribute(new Float32Array(rest.length), 3);
  geometry.setAttribute("position", position);
  geometry.setAttribute("color", colour);
  const group = new THREE.Group();
  const part = (cells, Kind, material) => {
    if (!cells.length) return null;
    const shared = new THREE.BufferGeometry();
    shared.setAttribute("position", position);
    shared.setAttribute("color", colour);
    shared.setIndex(new THREE.BufferAttribute(cells, 1));
    const node = new Kind(shared, material);
    node.frustumCulled = false;
    group.add(node);
    return node;
  };
  const faces = part(array(entry.faces), THREE.Mesh, new THREE.MeshStandardMaterial({
    vertexColors: true, side: THREE.DoubleSide, roughness: 0.75, metalness: 0,
    polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
  }));
  part(array(entry.edges), THREE.LineSegments, new THREE.LineBasicMaterial({color: "#26313d"}));
  part(array(entry.lines), THREE.LineSegments, new THREE.LineBasicMaterial({vertexColors: true}));
  part(array(entry.dots), THREE.Points, new THREE.PointsMaterial({vertexColors: true, size: 6, sizeAttenuation: false}));
  root.add(group);
  const k = entry.steps.length;
  return {
    rest, position, colour, group, faces, k, steps: entry.steps, shapes: array(entry.shapes), grows: entry.grows,
    paint: new THREE.Color(entry.colour), poses: entry.poses.map(array), weights: entry.weights.map(array),
    turn: [new THREE.Quaternion(), new THREE.Quaternion()],
  };
});

let clip = 0;
let time = 0; // s, from the first instant
let playing = true;
let stale = true;
const rgb = new THREE.Color();

function paint(share) {
  const x = Math.min(Math.max(share, 0), 1) * (header.map.length - 1);
  const i = Math.min(Math.floor(x), header.map.length - 2);
  const [a, b] = [header.map[i], header.map[i + 1]];
  return rgb.setRGB(...a.map((value, c) => value + (x - i) * (b[c] - value)), THREE.SRGBColorSpace);
}

function interval(times, t) {
  let low = 0;
  let high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle; else high = middle;
  }
  const span = times[high] - times[low];
  return [low, high, span > 0 ? Math.min(Math.max((t - times[low]) / span, 0), 1) : 0];
}

function place(body, a, b, s) {
  const p = body.poses[clip];
  const mix = (c) => p[7 * a + c] + s * (p[7 * b + c] - p[7 * a + c]);
  body.group.position.set(mix(0), mix(1), mix(2));
  const [first, second] = body.turn;
  first.set(p[7 * a + 4], p[7 * a + 5], p[7 * a + 6], p[7 * a + 3]);
  second.set(p[7 * b + 4], p[7 * b + 5], p[7 * b + 6], p[7 * b + 3]);
  body.group.quaternion.slerpQuaternions(first, second, s);
}

function bend(body, a, b, s) {
  const {rest, k, shapes, steps} = body;
  const w = body.weights[clip];
  const out = body.position.array;
  const count = rest.length;
  const scale = Number($("scale").value) || 0;
  const elastic = body.grows ? k - 1 : k;
  const amplitudes = Array.from({length: k}, (_, i) => (w[k * a + i] + s * (w[k * b + i] - w[k * a + i])) * steps[i]);
  const moved = new Float32Array(count);
  for (let i = 0; i < elastic; i++) {
    if (amplitudes[i] === 0) continue;
    for (let j = 0, at = i * count; j < count; j++, at++) moved[j] += amplitudes[i] * shapes[at];
  }
  const coloured = $("colour").value === "displacement" && elastic > 0 && clips[clip].largest > 0;
  const colour = body.colour.array;
  for (let j = 0; j < count; j += 3) {
    const size = Math.hypot(moved[j], moved[j + 1], moved[j + 2]);
    const c = coloured ? paint(size / clips[clip].largest) : body.paint;
    colour[j] = c.r; colour[j + 1] = c.g; colour[j + 2] = c.b;
  }
  for (let j = 0; j < count; j++) {
    out[j] = rest[j] + scale * moved[j];
    if (body.grows) out[j] += amplitudes[k - 1] * shapes[elastic * count + j];
  }
  body.position.needsUpdate = body.colour.needsUpdate = true;
  if (body.faces) body.faces.geometry.computeVertexNormals();
}

function show() {
  const [a, b, s] = interval(clips[clip].times, time);
  for (const body of bodies) { place(body, a, b, s); bend(body, a, b, s); }
  const {start, repeats, times} = clips[clip];
  $("time").value = time / (times[times.length - 1] || 1);
  $("clock").textContent = repeats ? "" : `t = ${Number((start + time).toPrecision(5))} s`;
}

// the camera turns about a target: angles, distance and target
const home = {azimuth: 0.7, height: 0.45, distance: 1, target: new THREE.Vector3()};
let view = null;

function extent() {
  const box = new THREE.Box3();
  const v = new THREE.Vector3();
  const times = clips[clip].times;
  const kept = time;
  for (let i = 0; i <= 24; i++) {
    time = times[Math.round((i / 24) * (times.length - 1))];
    show();
    root.updateMatrixWorld(true);
    for (const body of bodies) {
      const stride = 3 * Math.max(1, Math.floor(body.rest.length / 600));
      for (let j = 0; j < body.rest.length; j += stride) {
        box.expandByPoint(body.group.localToWorld(v.fromArray(body.position.array, j)));
      }
    }
  }
  time = kept;
  return box;
}

function reset() {
  const box = extent();
  const radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1e-6);
  box.getCenter(home.target);
  home.distance = radius / Math.sin((camera.fov * Math.PI) / 360) / Math.min(1, camera.aspect);
  view = {...home, target: home.target.clone()};
  stale = true;
}

function look() {
  const {azimuth, height, distance, target} = view;
  const level = Math.cos(height);
  camera.position.set(Math.sin(azimuth) * level, Math.sin(height), Math.cos(azimuth) * level)
    .multiplyScalar(distance).add(target);
  camera.near = distance / 100;
  camera.far = distance * 100;
  camera.updateProjectionMatrix();
  camera.lookAt(target);
}

const touches = new Map();
canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  touches.set(event.pointerId, event);
});
for (const end of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(end, (event) => touches.delete(event.pointerId));
}
canvas.addEventListener("pointermove", (event) => {
  const before = touches.get(event.pointerId);
  if (!before) return;
  const other = [...touches.values()].find((touch) => touch.pointerId !== event.pointerId);
  const dx = event.clientX - before.clientX;
  const dy = event.clientY - before.clientY;
  if (other) {
    const gap = (touch) => Math.hypot(touch.clientX - other.clientX, touch.clientY - other.clientY) || 1;
    view.distance *= gap(before) / gap(event);
    shift(dx / 2, dy / 2);
  } else if (event.buttons & 2 || event.shiftKey) {
    shift(dx, dy);
  } else {
    view.azimuth -= dx * 0.008;
    view.height = Math.min(Math.max(view.height + dy * 0.008, -1.55), 1.55);
  }
  touches.set(event.pointerId, event);
  stale = true;
});
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  view.distance *= Math.exp(event.deltaY * 0.001);
  stale = true;
}, {passive: false});

function shift(dx, dy) {
  const metre = (2 * view.distance * Math.tan((camera.fov * Math.PI) / 360)) / canvas.clientHeight;
  const right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
  const up = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
  view.target.addScaledVector(right, -dx * metre).addScaledVector(up, dy * metre);
}

function choose(k) {
  clip = k;
  time = 0;
  $("scale").value = Number(clips[k].scale.toPrecision(4));
  const [size, unit] = clips[k].unit;
  const shown = clips[k].largest > 0;
  $("bar").hidden = !shown || clips[k].repeats || $("colour").value !== "displacement";
  $("top").textContent = shown ? `${Number((clips[k].largest * size).toPrecision(3))} ${unit}` : "";
  reset();
}

const strip = $("bar").querySelector("canvas").getContext("2d");
for (let x = 0; x < 112; x++) {
  strip.fillStyle = `#${paint(x / 111).getHexString()}`;
  strip.fillRect(x, 0, 1, 1);
}
clips.forEach((each, k) => $("clip").add(new Option(each.name, k)));
$("choice").hidden = clips.length < 2;
$("clip").addEventListener("change", (event) => choose(Number(event.target.value)));
$("play").addEventListener("click", () => { run(!playing); });
$("time").addEventListener("input", (event) => {
  run(false);
  time = Number(event.target.value) * clips[clip].times[clips[clip].times.length - 1];
  stale = true;
});
$("scale").addEventListener("input", () => { stale = true; });
$("colour").addEventListener("change", () => {
  $("bar").hidden = !(clips[clip].largest > 0) || clips[clip].repeats || $("colour").value !== "displacement";
  stale = true;
});
$("home").addEventListener("click", reset);

function run(on) {
  playing = on;
  $("play").textContent = on ? "Pause" : "Play";
}

function resize() {
  const {clientWidth, clientHeight} = canvas;
  renderer.setPixelRatio(window.devicePixelRatio);
  renderer.setSize(clientWidth, clientHeight, false);
  camera.aspect = clientWidth / clientHeight;
  stale = true;
}
new ResizeObserver(resize).observe(canvas);

resize();
const asked = /(?:#|&)t=([-\d.e]+)/i.exec(location.hash); // #t=12.5 shows that time
const asked_clip = /(?:#|&)motion=(\d+)/.exec(location.hash);
choose(asked_clip ? Math.min(Number(asked_clip[1]), clips.length - 1) : 0);
if (asked) {
  run(false);
  time = Number(asked[1]) - clips[clip].start;
}
if (clips[clip].times.length < 2) run(false);

let last = null;
renderer.setAnimationLoop((now) => {
  const end = clips[clip].times[clips[clip].times.length - 1];
  if (playing && last !== null && end > 0) {
    time += ((now - last) / 1000) * (end / (clips[clip].repeats ? CYCLE : PLAY));
    if (time > end) time %= end;
    stale = true;
  }
  last = now;
  if (!stale) return;
  stale = false;
  show();
  look();
  renderer.render(scene, camera);
});
