// viewer.js: the robots of a report in 3D, side by side, with one clock. Metres, seconds; z is up.
"use strict";
(function () {
  const byId = (id) => document.getElementById(id);
  const views = [];
  const state = { time: 0, playing: false, last: 0, most: 0 };

  // ---- a replay: base64, zlib, differences modulo 2^16 ----

  async function unpack(replay) {
    const packed = Uint8Array.from(atob(replay.data), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const each = replay.masses * 3;
    const count = each * replay.samples;
    const positions = new Float32Array(count);
    const steps = new Int32Array(each);
    for (let k = 0; k < count; ++k) {
      const c = k % each;
      steps[c] = (steps[c] + bytes[k] + 256 * bytes[count + k]) & 0xffff;
      positions[k] = replay.low[c % 3] + steps[c] * replay.step;
    }
    return positions;
  }

  // ---- colours ----

  const mix = (from, to, share) => new THREE.Color(from).lerp(new THREE.Color(to), share);

  // Legends of the colours.
  const KEYS = {
    strain: "strain of a face's edges: blue 20 % shorter than at rest, grey at rest, orange 20 % longer",
    phase: "phase of the muscles: one turn of hues is one turn of the phase; grey is not a muscle",
  };

  function faceColor(view, face, mode) {
    const replay = view.replay;
    if (mode === "phase") {
      const phase = replay.phases[face];
      return phase < 0 ? new THREE.Color("#b9bdc2") : new THREE.Color().setHSL((phase / (2 * Math.PI)) % 1, 0.65, 0.55);
    }
    if (mode === "material") return new THREE.Color(replay.colors[replay.materials[face]]);
    // the block is rigid
    if (replay.corners[face * 4] >= replay.body) return new THREE.Color("#b9bdc2");
    const p = view.shape;
    let sum = 0;
    for (let k = 0; k < 4; ++k) {
      const a = (face * 4 + k) * 3;
      const b = (face * 4 + ((k + 1) % 4)) * 3;
      sum += Math.hypot(p[a] - p[b], p[a + 1] - p[b + 1], p[a + 2] - p[b + 2]) / replay.edge - 1;
    }
    const strain = Math.max(-1, Math.min(1, sum / 4 / 0.2));
    return strain < 0 ? mix("#c9cdd2", "#0072b2", -strain) : mix("#c9cdd2", "#d55e00", strain);
  }

  function paint(view, mode) {
    const colors = view.mesh.geometry.attributes.color;
    for (let face = 0; face < view.replay.materials.length; ++face) {
      const color = faceColor(view, face, mode);
      for (let k = 0; k < 4; ++k) colors.setXYZ(face * 4 + k, color.r, color.g, color.b);
    }
    colors.needsUpdate = true;
    view.mode = mode;
  }

  // ---- one view ----

  const HELD = "#26282b";

  // How far the eye rises with the body, sample by sample: not where there is ground, else with the mean of the body
  // over half a second.
  function risesOf(replay, path) {
    const around = Math.round(replay.rate / 4);
    return Array.from({ length: replay.samples }, (_, s) => {
      if (replay.world.ground !== undefined) return 0;
      let sum = 0;
      let count = 0;
      for (let k = Math.max(0, s - around); k <= Math.min(replay.samples - 1, s + around); ++k, ++count) sum += path[k * 3 + 2];
      return sum / count - path[2];
    });
  }

  function build(view) {
    const faces = view.replay.materials.length;
    view.shape = new Float32Array(faces * 12);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(view.shape, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(faces * 12), 3));
    const triangles = [];
    const edges = [];
    for (let face = 0; face < faces; ++face) {
      const a = face * 4;
      triangles.push(a, a + 1, a + 2, a, a + 2, a + 3);
      edges.push(a, a + 1, a + 1, a + 2, a + 2, a + 3, a + 3, a);
    }
    geometry.setIndex(triangles);
    view.mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({
      vertexColors: THREE.VertexColors === undefined ? true : THREE.VertexColors, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    const outline = new THREE.BufferGeometry();
    outline.setAttribute("position", geometry.attributes.position);
    outline.setIndex(edges);
    view.outline = new THREE.LineSegments(outline, new THREE.LineBasicMaterial({ color: 0x202326, opacity: 0.35, transparent: true }));
    view.mesh.frustumCulled = view.outline.frustumCulled = false;

    const replay = view.replay;
    const path = new Float32Array(replay.samples * 3);
    for (let s = 0; s < replay.samples; ++s) {
      for (let m = 0; m < replay.body; ++m) {
        for (let c = 0; c < 3; ++c) path[s * 3 + c] += view.positions[(s * replay.masses + m) * 3 + c] / replay.body;
      }
    }
    view.path = path;
    view.rise = risesOf(replay, path);
    const trail = new THREE.BufferGeometry();
    trail.setAttribute("position", new THREE.BufferAttribute(path, 3));
    // drawn over the body, as in a film strip
    view.trail = new THREE.Line(trail, new THREE.LineBasicMaterial({ color: 0xc0392b, depthTest: false }));
    view.trail.renderOrder = 1;
    view.trail.frustumCulled = false;

    view.scene = new THREE.Scene();
    view.world = new THREE.Group();
    view.mesh.name = "robot";
    view.world.add(view.mesh, view.outline, view.trail);
    view.world.position.set(-path[0], -path[1], 0);
    // up is against gravity, so that a slope is seen as one
    view.tilt = new THREE.Group();
    view.tilt.quaternion.setFromUnitVectors(new THREE.Vector3(...replay.world.up), new THREE.Vector3(0, 0, 1));
    view.tilt.add(view.world);
    view.scene.add(view.tilt, new THREE.AmbientLight(0xffffff, 0.62));
    const sun = new THREE.DirectionalLight(0xffffff, 0.55);
    sun.position.set(-2, -3, 5);
    view.scene.add(sun);
    view.ground = new THREE.Group();
    if (replay.world.ground !== undefined) view.ground.add(...limax.world.groundOf(replay.world));
    view.ground.add(...limax.world.obstacles(replay.world));
    view.world.add(view.ground);
    if (replay.held) {
      const held = new THREE.BufferGeometry();
      const places = replay.held.flatMap((mass) => Array.from(view.positions.slice(mass * 3, mass * 3 + 3)));
      held.setAttribute("position", new THREE.BufferAttribute(new Float32Array(places), 3));
      const points = new THREE.Points(held, new THREE.PointsMaterial({ color: HELD, size: 7, sizeAttenuation: false }));
      points.name = "held";
      view.world.add(points);
    }

    // as far away as the body is large
    let reach = 0.3;
    for (let k = 0; k < replay.body * 3; ++k) reach = Math.max(reach, Math.abs(view.positions[k] - path[k % 3]));
    // the flows follow the camera's target
    view.flows = new THREE.Group();
    view.flows.position.set(0, 0, path[2]);
    const arrows = limax.world.flowsOf(replay.world, reach);
    if (arrows.length > 0) view.flows.add(...arrows);
    view.tilt.add(view.flows);
    view.camera = new THREE.PerspectiveCamera(38, 4 / 3, 0.01, 100);
    view.camera.up.set(0, 0, 1);
    view.camera.position.set(2.2 * reach, -3.4 * reach, path[2] + 1.7 * reach);
    view.renderer = new THREE.WebGLRenderer({ canvas: view.canvas, antialias: true, preserveDrawingBuffer: true });
    view.controls = new THREE.OrbitControls(view.camera, view.canvas);
    view.controls.enableKeys = false;
    view.controls.target.copy(new THREE.Vector3(0, 0, path[2]).applyQuaternion(view.tilt.quaternion));
    view.controls.update();
    view.controls.addEventListener("change", () => { view.dirty = true; });
    view.canvas.addEventListener("keydown", (event) => turn(view, event));
  }

  // Turns the camera around its target, or zooms.
  function turn(view, event) {
    const around = { ArrowLeft: -0.1, ArrowRight: 0.1 }[event.key] || 0;
    const over = { ArrowUp: -0.1, ArrowDown: 0.1 }[event.key] || 0;
    const zoom = { "+": 1 / 1.1, "=": 1 / 1.1, "-": 1.1 }[event.key] || 1;
    if (around === 0 && over === 0 && zoom === 1) return;
    event.preventDefault();
    const away = view.camera.position.clone().sub(view.controls.target);
    const length = away.length() * zoom;
    const turned = Math.atan2(away.y, away.x) + around;
    const down = Math.min(Math.max(Math.acos(away.z / away.length()) + over, 0.05), 3.0);
    away.set(Math.sin(down) * Math.cos(turned), Math.sin(down) * Math.sin(turned), Math.cos(down)).multiplyScalar(length);
    view.camera.position.copy(view.controls.target).add(away);
    view.controls.update();
    view.dirty = true;
  }

  // The shape at a time, straight between two samples.
  function pose(view, time) {
    const replay = view.replay;
    const at = Math.min(time * replay.rate, replay.samples - 1);
    const first = Math.min(Math.floor(at), replay.samples - 1);
    const second = Math.min(first + 1, replay.samples - 1);
    const share = at - first;
    const from = first * replay.masses * 3;
    const to = second * replay.masses * 3;
    const p = view.positions;
    replay.corners.forEach((mass, k) => {
      for (let c = 0; c < 3; ++c) {
        const a = p[from + mass * 3 + c];
        view.shape[k * 3 + c] = a + (p[to + mass * 3 + c] - a) * share;
      }
    });
    view.mesh.geometry.attributes.position.needsUpdate = true;
    view.mesh.geometry.computeVertexNormals();
    view.trail.geometry.setDrawRange(0, first + 1);
    // the world moves and the camera does not: the same moment is the same picture, whatever was shown before
    if (byId("follow").checked) view.world.position.set(-view.path[first * 3], -view.path[first * 3 + 1], -view.rise[first]);
    if (view.mode === "strain") paint(view, "strain");
    view.dirty = true;
  }

  function draw(view) {
    const width = view.canvas.clientWidth;
    const height = Math.round(width * 0.75);
    const ratio = window.devicePixelRatio || 1;
    if (width !== view.width || ratio !== view.ratio) {
      view.width = width;
      view.ratio = ratio;
      view.renderer.setPixelRatio(ratio);
      view.renderer.setSize(width, height, false);
    }
    const background = getComputedStyle(view.canvas.parentNode).backgroundColor;
    view.renderer.setClearColor(new THREE.Color(background), 1);
    view.renderer.render(view.scene, view.camera);
    view.dirty = false;
  }

  // ---- the clock and the controls ----

  function show(time) {
    state.time = Math.min(Math.max(time, 0), state.most);
    byId("time").value = state.time;
    byId("clock").textContent = state.time.toFixed(2) + " s";
    byId("time").setAttribute("aria-valuetext", byId("clock").textContent);
    for (const view of views) pose(view, state.time);
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

  function showLegend(mode) {
    let text = KEYS[mode];
    if (mode === "material") {
      const names = new Set();
      for (const view of views) {
        const world = view.replay.world;
        view.replay.materials.forEach((k) => names.add(view.replay.names[k] + " " + view.replay.colors[k]));
        if (view.replay.held) names.add("held " + HELD);
        if (world.boxes || world.spheres || (world.sheets || []).some((sheet) => !sheet.floor)) names.add("obstacle " + world.hex);
        for (const flow of world.flows || []) names.add(flow.label + " " + flow.hex);
      }
      text = "";
      byId("key").textContent = "";
      for (const entry of names) {
        const word = document.createElement("span");
        const mark = document.createElement("span");
        mark.textContent = "\u25a0 ";
        mark.style.color = entry.slice(-7);
        word.style.whiteSpace = "nowrap";
        word.append(mark, entry.slice(0, -8));
        byId("key").append(word, "  ");
      }
      return;
    }
    byId("key").textContent = text;
  }

  async function start() {
    const panel = document.querySelector(".robots");
    try {
      for (const box of panel.querySelectorAll(".view")) {
        const replay = JSON.parse(box.querySelector("script").textContent);
        const view = { replay, canvas: box.querySelector("canvas"), positions: await unpack(replay) };
        build(view);
        views.push(view);
        state.most = Math.max(state.most, (replay.samples - 1) / replay.rate);
      }
    } catch (problem) {
      panel.textContent = "The robots cannot be shown in 3D here (" + problem.message + "). See the film strips below.";
      panel.dataset.ready = "no";
      return;
    }
    byId("time").max = state.most;
    byId("play").addEventListener("click", () => play(!state.playing));
    byId("time").addEventListener("input", () => { play(false); show(Number(byId("time").value)); });
    byId("colours").addEventListener("change", () => {
      for (const view of views) { paint(view, byId("colours").value); view.dirty = true; }
      showLegend(byId("colours").value);
    });
    byId("ground").addEventListener("change", () => {
      for (const view of views) {
        view.ground.visible = view.flows.visible = byId("ground").checked;
        view.dirty = true;
      }
    });
    byId("trail").addEventListener("change", () => {
      for (const view of views) { view.trail.visible = byId("trail").checked; view.dirty = true; }
    });
    byId("follow").addEventListener("change", () => show(state.time));
    // the background follows the page
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      for (const view of views) view.dirty = true;
    });
    show(0);
    for (const view of views) paint(view, "material");
    showLegend("material");
    panel.dataset.ready = "yes";
    // for a browser's console
    limax.views = views;
    requestAnimationFrame(tick);
  }

  start();
})();
