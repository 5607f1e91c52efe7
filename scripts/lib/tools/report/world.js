// world.js: the world around the robots of a report: ground, planes, boxes, spheres, terrain, wind and current, as
// described by surroundings.lua. Metres; z is up.
"use strict";
window.limax = { world: (function () {
  // darker than the ground, since it is lit
  const SOIL = 0xd2cdc2;
  const EDGE = 0x727a83;
  const FURROW = 0xc9c2b4;

  // Lines between pairs of points, in pieces of at most half a metre, so that none reaches behind the camera.
  function shortLines(points, color) {
    const short = [];
    for (let k = 0; k < points.length; k += 6) {
      const from = new THREE.Vector3(...points.slice(k, k + 3));
      const to = new THREE.Vector3(...points.slice(k + 3, k + 6));
      const count = Math.max(1, Math.ceil(from.distanceTo(to) / 0.5));
      for (let part = 0; part < count; ++part) {
        for (const share of [part / count, (part + 1) / count]) short.push(...from.clone().lerp(to, share).toArray());
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(short), 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color }));
  }

  // A mesh in one colour with lines on it; transparent if `clear`.
  function solid(name, shape, color, lines, clear) {
    const mesh = new THREE.Mesh(shape, new THREE.MeshLambertMaterial({ color, side: THREE.DoubleSide, polygonOffset: true,
      polygonOffsetFactor: 1, polygonOffsetUnits: 1, transparent: Boolean(clear), opacity: clear ? 0.2 : 1, depthWrite: !clear }));
    mesh.add(lines);
    mesh.name = name;
    return mesh;
  }

  const edgesOf = (shape) => shortLines(Array.from(new THREE.EdgesGeometry(shape, 10).attributes.position.array), EDGE);

  function triangles(points, corners) {
    const shape = new THREE.BufferGeometry();
    shape.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
    shape.setIndex(corners);
    shape.computeVertexNormals();
    return shape;
  }

  // Boxes, spheres, planes and terrain.
  function obstacles(world) {
    const list = [];
    const color = new THREE.Color(world.hex);
    for (const box of world.boxes || []) {
      const shape = new THREE.BoxGeometry(...[0, 1, 2].map((c) => box.to[c] - box.from[c]));
      shape.translate(...[0, 1, 2].map((c) => (box.to[c] + box.from[c]) / 2));
      list.push(solid("box", shape, color, edgesOf(shape)));
    }
    for (const sphere of world.spheres || []) {
      const shape = new THREE.SphereGeometry(sphere.radius, 32, 20);
      shape.translate(...sphere.center);
      list.push(solid("sphere", shape, color, new THREE.Group()));
    }
    for (const sheet of world.sheets || []) {
      const corners = [];
      for (let k = 2; k < sheet.points.length; ++k) corners.push(0, k - 1, k);
      const shape = triangles(sheet.points.flat(), corners);
      const lines = edgesOf(shape);
      lines.add(shortLines((sheet.lines || []).flat(), FURROW));
      list.push(solid("plane", shape, sheet.floor ? SOIL : color, lines, !sheet.floor));
    }
    if (world.terrain) {
      const { spacing, origin, heights } = world.terrain;
      const wide = heights[0].length;
      const points = [];
      const corners = [];
      const lines = [];
      const place = (x, y) => [origin[0] + x * spacing, origin[1] + y * spacing, origin[2] + heights[x][y]];
      heights.forEach((row, x) => row.forEach((height, y) => {
        points.push(...place(x, y));
        const at = x * wide + y;
        if (x > 0 && y > 0) corners.push(at - wide - 1, at - 1, at, at - wide - 1, at, at - wide);
        if (x > 0) lines.push(...place(x - 1, y), ...place(x, y));
        if (y > 0) lines.push(...place(x, y - 1), ...place(x, y));
      }));
      list.push(solid("terrain", triangles(points, corners), SOIL, shortLines(lines, FURROW)));
    }
    return list;
  }

  // The ground: a plane, a line every 0.1 m and a darker one every 0.5 m.
  function groundOf({ ground: height, low, high }) {
    const lines = [[], []];
    for (const [along, across] of [[0, 1], [1, 0]]) {
      const count = Math.min(Math.round((high[across] - low[across]) * 10), 400);
      for (let k = 0; k <= count; ++k) {
        for (const at of [low[along], high[along]]) {
          const point = [0, 0, height - 0.002];
          point[along] = at;
          point[across] = low[across] + k / 10;
          lines[k % 5 === 0 ? 1 : 0].push(...point);
        }
      }
    }
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(high[0] - low[0], high[1] - low[1]),
      new THREE.MeshBasicMaterial({ color: 0xefece6, side: THREE.DoubleSide }));
    plane.position.set((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, height - 0.006);
    plane.name = "ground";
    return [plane, shortLines(lines[0], 0xdcd7cc), shortLines(lines[1], 0xb0a897)];
  }

  // Arrows for wind and current, side by side above a body that reaches `reach` metres from its middle. An arrow is as
  // long as the distance that the flow moves in TIME seconds, within shares of the reach.
  const TIME = 0.1;
  const SHORTEST = 0.4;
  const LONGEST = 0.9;
  // to the right of the camera when a page is opened
  const RIGHT = new THREE.Vector3(3.4, 2.2, 0).normalize();
  function flowsOf(world, reach) {
    const flows = world.flows || [];
    const head = 0.2 * reach;
    return flows.map((flow, k) => {
      const color = new THREE.Color(flow.hex);
      const velocity = new THREE.Vector3(...flow.velocity);
      const length = Math.min(Math.max(velocity.length() * TIME, SHORTEST * reach), LONGEST * reach);
      const shaft = new THREE.CylinderGeometry(0.02 * reach, 0.02 * reach, length - head, 8);
      shaft.translate(0, -head / 2, 0);
      const tip = new THREE.ConeGeometry(0.07 * reach, head, 16);
      tip.translate(0, (length - head) / 2, 0);
      const arrow = new THREE.Group();
      for (const part of [shaft, tip]) arrow.add(new THREE.Mesh(part, new THREE.MeshLambertMaterial({ color })));
      arrow.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), velocity.normalize());
      arrow.position.set(...world.up).addScaledVector(RIGHT, k - (flows.length - 1) / 2).multiplyScalar(1.1 * reach);
      arrow.name = flow.name;
      return arrow;
    });
  }

  return { groundOf, obstacles, flowsOf };
})() };
