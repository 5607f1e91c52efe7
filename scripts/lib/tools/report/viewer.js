// viewer.js: the robots of a report in 3D, side by side, with one clock. Metres, seconds; z is up. See replay.lua for
// the data.
"use strict";
(function () {
  const byId = (id) => document.getElementById(id);
  const TRAIL = "#c0392b";
  // rad, from straight above: the lowest place of the camera; how far it stays above ground
  const LOWEST = 3.0;
  const ABOVE = 0.03;
  const views = [];
  // draws all views in turn: a browser allows few WebGL contexts, and warns about each that has no GPU
  let renderer;
  const state = { time: 0, playing: false, last: 0, most: 0 };

  // A replay, as replay.lua packs it. Adds the positions, [sample][mass][3].
  async function unpack(text) {
    const letters = atob(text);
    const packed = new Uint8Array(letters.length);
    for (let k = 0; k < letters.length; ++k) packed[k] = letters.charCodeAt(k);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const textOf = (from, to) => new TextDecoder().decode(bytes.subarray(from, to));
    let at = 8 + Number(textOf(0, 8));
    const replay = JSON.parse(textOf(8, at));
    const [a, b, c, d] = [0, 1, 2, 3].map((plane) => bytes.subarray(at + plane * replay.steps));
    const each = replay.masses * 3;
    const places = new Int32Array(replay.steps);
    replay.positions = new Float32Array(replay.steps);
    for (let k = 0; k < replay.steps; ++k) {
      const packedStep = a[k] | b[k] << 8 | c[k] << 16 | d[k] << 24;
      places[k] = (packedStep >>> 1 ^ -(packedStep & 1)) + (k < each ? 0 : places[k - each]);
      replay.positions[k] = places[k] * replay.step;
    }
    at += 4 * replay.steps;
    replay.tints = replay.tints && bytes.subarray(at, at + replay.tints);
    return replay;
  }

  // The names of the colours.
  function showKey() {
    const names = new Map();
    for (const { replay } of views) {
      replay.materials.forEach((k) => names.set(replay.names[k], replay.colors[k]));
      if (replay.world.obstacle) names.set("obstacle", replay.world.obstacle);
      if (replay.world.target) names.set("target", replay.world.target);
    }
    for (const [name, hex] of names) {
      const word = document.createElement("span");
      const mark = document.createElement("span");
      mark.textContent = "\u25a0 ";
      mark.style.color = hex;
      word.style.whiteSpace = "nowrap";
      word.append(mark, name);
      byId("key").append(word, "  ");
    }
  }

  // ---- one view ----

  function geometry(points, colors) {
    const shape = new THREE.BufferGeometry();
    shape.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
    if (colors) shape.setAttribute("color", new THREE.BufferAttribute(new Float32Array(colors), 3));
    return shape;
  }

  // behind lines in the same plane
  const surface = (options) => Object.assign({ vertexColors: true, side: THREE.DoubleSide, polygonOffset: true,
    polygonOffsetFactor: 1, polygonOffsetUnits: 1 }, options);

  // The world's polygons as three things: solid surfaces, transparent walls, and lines.
  function worldOf({ parts = [] }) {
    const lists = { solid: [[], []], wall: [[], []], line: [[], []] };
    const add = (name, part, corners, hex) => {
      const color = new THREE.Color(hex).toArray();
      for (const k of corners) {
        lists[name][0].push(...part.points.slice(3 * k, 3 * k + 3));
        lists[name][1].push(...color);
      }
    };
    for (const part of parts) {
      const count = part.points.length / 3;
      for (let k = 2; k < count; ++k) add(part.wall ? "wall" : "solid", part, [0, k - 1, k], part.fill);
      part.edges.forEach((edge, k) => { if (edge) add("line", part, [k, (k + 1) % count], part.ink); });
    }
    const clear = { transparent: true, opacity: 0.2, depthWrite: false };
    return [new THREE.Mesh(geometry(...lists.solid), new THREE.MeshBasicMaterial(surface())),
      new THREE.Mesh(geometry(...lists.wall), new THREE.MeshBasicMaterial(surface(clear))),
      new THREE.LineSegments(geometry(...lists.line), new THREE.LineBasicMaterial({ vertexColors: true }))];
  }

  // The middle of the body at each sample.
  function pathOf({ samples, masses, body, positions }) {
    const path = new Float32Array(samples * 3);
    for (let s = 0; s < samples; ++s) {
      for (let k = 0; k < body * 3; ++k) path[s * 3 + k % 3] += positions[s * masses * 3 + k] / body;
    }
    return path;
  }

  function bodyOf(view) {
    const { materials, colors } = view.replay;
    const faces = materials.length;
    const shape = geometry(faces * 12, materials.flatMap((k) => {
      const color = new THREE.Color(colors[k]).toArray();
      return [...color, ...color, ...color, ...color];
    }));
    view.shape = shape.attributes.position.array;
    if (view.replay.tints) view.plain = shape.attributes.color.array.slice();
    const triangles = [];
    const edges = [];
    for (let a = 0; a < faces * 4; a += 4) {
      triangles.push(a, a + 1, a + 2, a, a + 2, a + 3);
      edges.push(a, a + 1, a + 1, a + 2, a + 2, a + 3, a + 3, a);
    }
    shape.setIndex(triangles);
    view.mesh = new THREE.Mesh(shape, new THREE.MeshLambertMaterial(surface()));
    const lines = new THREE.BufferGeometry();
    lines.setAttribute("position", shape.attributes.position);
    lines.setIndex(edges);
    const ink = { color: 0x202326, opacity: 0.35, transparent: true };
    return [view.mesh, new THREE.LineSegments(lines, new THREE.LineBasicMaterial(ink))];
  }

  // How far the body reaches from its middle at the start, m.
  function reachOf({ replay, path }) {
    let reach = 0.3;
    for (let k = 0; k < replay.body * 3; ++k) reach = Math.max(reach, Math.abs(replay.positions[k] - path[k % 3]));
    return reach;
  }

  function build(view) {
    const { replay } = view;
    const path = view.path = pathOf(replay);
    // drawn over the body, as in a film strip
    view.trail = new THREE.Line(geometry(path), new THREE.LineBasicMaterial({ color: TRAIL, depthTest: false }));
    view.trail.renderOrder = 1;
    view.world = new THREE.Group();
    view.world.add(...bodyOf(view), view.trail, ...worldOf(replay.world));
    view.moving = (replay.world.moving || []).map((shape) => new THREE.Group().add(...worldOf(shape)));
    view.moving.forEach((group) => view.world.add(group));
    view.world.position.set(-path[0], -path[1], 0);
    view.world.traverse((thing) => { thing.frustumCulled = false; });

    // as far away as the body is large
    const reach = reachOf(view);
    // up is against gravity, so that a slope is seen as one
    view.tilt = new THREE.Group();
    view.tilt.quaternion.setFromUnitVectors(new THREE.Vector3(...replay.world.up), new THREE.Vector3(0, 0, 1));
    view.tilt.add(view.world);
    view.scene = new THREE.Scene();
    const sun = new THREE.DirectionalLight(0xffffff, 0.5);
    sun.position.set(-0.25, -0.35, 1);
    view.scene.add(view.tilt, sun, new THREE.AmbientLight(0xffffff, 0.58));

    view.camera = new THREE.PerspectiveCamera(38, 4 / 3, 0.01, 100);
    view.camera.up.set(0, 0, 1);
    // farther where the body jumps
    let far = reach;
    for (let k = 2; k < path.length && replay.world.ground; k += 3) far = Math.max(far, reach + 0.5 * (path[k] - path[2]));
    view.camera.position.set(2.5 * far, -3.9 * far, path[2] + 1.9 * far);
    view.controls = new THREE.OrbitControls(view.camera, view.canvas);
    view.controls.enableKeys = false;
    view.controls.minPolarAngle = 0.05;
    // among fixed things the camera stays above the ground, which may be a slope
    const slope = Math.acos(Math.min(1, replay.world.up[2]));
    view.controls.maxPolarAngle = replay.world.parts ? Math.PI / 2 - slope - ABOVE : LOWEST;
    view.controls.target.copy(new THREE.Vector3(0, 0, path[2]).applyQuaternion(view.tilt.quaternion));
    view.controls.update();
    view.controls.saveState();
    view.controls.addEventListener("change", () => { view.dirty = true; });
  }

  // Muscles are lighter or darker by their activation.
  function tint({ replay: { tints, materials }, plain, mesh }, from, to, share) {
    const color = mesh.geometry.attributes.color;
    const faces = materials.length;
    for (let f = 0; f < faces; ++f) {
      const before = tints[from * faces + f];
      const factor = (before + (tints[to * faces + f] - before) * share) / 100;
      for (let k = f * 12; k < f * 12 + 12; ++k) color.array[k] = plain[k] * factor;
    }
    color.needsUpdate = true;
  }

  // The shape at the time of the clock, straight between two samples.
  function pose(view) {
    const { replay, path, shape } = view;
    const at = Math.min(state.time * replay.rate, replay.samples - 1);
    const first = Math.floor(at);
    const next = Math.min(first + 1, replay.samples - 1);
    const from = first * replay.masses * 3;
    const to = next * replay.masses * 3;
    const p = replay.positions;
    replay.corners.forEach((mass, k) => {
      for (let c = mass * 3; c < mass * 3 + 3; ++c) {
        shape[k * 3 + c % 3] = p[from + c] + (p[to + c] - p[from + c]) * (at - first);
      }
    });
    if (view.plain) tint(view, first, next, at - first);
    view.mesh.geometry.attributes.position.needsUpdate = true;
    view.mesh.geometry.computeVertexNormals();
    view.moving.forEach((group, k) => {
      const { path: moved } = replay.world.moving[k];
      const there = new THREE.Vector3(...moved.slice(next * 3, next * 3 + 3));
      group.position.set(...moved.slice(first * 3, first * 3 + 3)).lerp(there, at - first);
    });
    view.trail.geometry.setDrawRange(0, first + 1);
    // the world moves and the camera does not: the same moment is the same picture, whatever was shown before
    const [x, y, z] = path.subarray(first * 3, first * 3 + 3);
    if (byId("follow").checked) view.world.position.set(-x, -y, replay.world.ground ? 0 : path[2] - z);
    view.dirty = true;
  }

  function draw(view) {
    const { canvas } = view;
    view.width = canvas.clientWidth;
    const width = Math.round(view.width * window.devicePixelRatio);
    const height = Math.round(0.75 * width);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const own = renderer.domElement;
    if (own.width !== width || own.height !== height) renderer.setSize(width, height, false);
    renderer.setClearColor(new THREE.Color(getComputedStyle(view.canvas.parentNode).backgroundColor), 1);
    renderer.render(view.scene, view.camera);
    canvas.getContext("2d").drawImage(own, 0, 0);
    view.dirty = false;
  }

  // ---- the clock and the controls ----

  function show(time) {
    state.time = Math.min(Math.max(time, 0), state.most);
    byId("time").value = state.time;
    byId("clock").textContent = state.time.toFixed(2) + " s";
    byId("time").setAttribute("aria-valuetext", byId("clock").textContent);
    views.forEach(pose);
  }

  function play(on) {
    state.playing = on;
    byId("play").textContent = on ? "pause" : "play";
    byId("play").setAttribute("aria-pressed", String(on));
    state.last = performance.now();
  }

  function tick(now) {
    if (state.playing) {
      const time = state.time + Math.max(0, (now - state.last) / 1000) * Number(byId("speed").value);
      state.last = now;
      // repeated from the beginning
      show(time >= state.most ? 0 : time);
    }
    for (const view of views) if (view.dirty || view.canvas.clientWidth !== view.width) draw(view);
    requestAnimationFrame(tick);
  }

  async function start() {
    const panel = document.querySelector(".robots");
    try {
      renderer = new THREE.WebGLRenderer({ antialias: true });
      for (const box of panel.querySelectorAll(".view")) {
        const view = { replay: await unpack(box.querySelector("script").textContent), canvas: box.querySelector("canvas") };
        build(view);
        views.push(view);
        state.most = Math.max(state.most, (view.replay.samples - 1) / view.replay.rate);
      }
    } catch (problem) {
      panel.textContent = "The robots cannot be shown in 3D here (" + problem.message + "). See the film strips below.";
      panel.dataset.ready = "no";
      return;
    }
    byId("time").max = state.most;
    byId("play").addEventListener("click", () => play(!state.playing));
    byId("reset").addEventListener("click", () => views.forEach((view) => view.controls.reset()));
    byId("time").addEventListener("input", () => { play(false); show(Number(byId("time").value)); });
    byId("follow").addEventListener("change", () => views.forEach(pose));
    // film strips are for readers without 3D, and for paper
    const strips = byId("strips");
    strips.open = false;
    addEventListener("beforeprint", () => { strips.open = true; });
    show(0);
    showKey();
    panel.dataset.ready = "yes";
    // for a browser's console
    window.limax = { views };
    requestAnimationFrame(tick);
  }

  start();
})();
