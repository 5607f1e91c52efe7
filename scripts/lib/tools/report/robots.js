// robots.js: the robots of an archive or a front: a click, or the arrow keys, choose one; its numbers and its body at
// rest are shown.
"use strict";
(function () {
  const SVG = "http://www.w3.org/2000/svg";
  const element = (name, attributes) => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };

  // The corners of a voxel's faces that the viewer sees, and how much of their colour is left: above, towards +x and
  // towards -y.
  const FACES = [
    { to: [0, 0, 1], corners: [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], light: 1 },
    { to: [1, 0, 0], corners: [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]], light: 0.72 },
    { to: [0, -1, 0], corners: [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], light: 0.86 },
  ];

  const shaded = (hex, light) => "#" + [1, 3, 5].map((k) =>
    Math.round(parseInt(hex.slice(k, k + 2), 16) * light).toString(16).padStart(2, "0")).join("");

  // The body at rest, seen from above with x to the right and y to the back. Layers are separated by an empty line,
  // the lowest first; lines run along y, letters along x.
  function bodyOf(letters, colors) {
    const layers = letters.split("\n\n").map((layer) => layer.split("\n"));
    const size = [layers[0][0].length, layers[0].length, layers.length];
    const at = (x, y, z) => {
      const letter = ((layers[z] || [])[y] || "")[x];
      return letter && letter !== "." ? letter : undefined;
    };
    const flat = ([x, y, z]) => [(x + y) * 0.866, (x - y) / 2 - z];
    const [wide, high] = [(size[0] + size[1]) * 0.866, (size[0] + size[1]) / 2 + size[2]];
    const svg = element("svg", { viewBox: `-0.2 ${-0.2 - size[1] / 2 - size[2]} ${wide + 0.4} ${high + 0.4}`,
      class: "body", role: "img", "aria-label": "its body at rest", "stroke-linejoin": "round" });
    const voxels = [];
    for (let z = 0; z < size[2]; ++z) {
      for (let y = 0; y < size[1]; ++y) {
        for (let x = 0; x < size[0]; ++x) if (at(x, y, z)) voxels.push([x, y, z]);
      }
    }
    // far ones first
    voxels.sort((a, b) => (a[0] - a[1] + a[2]) - (b[0] - b[1] + b[2]));
    for (const [x, y, z] of voxels) {
      for (const { to, corners, light } of FACES) {
        if (at(x + to[0], y + to[1], z + to[2])) continue;
        const points = corners.flatMap((c) => flat([x + c[0], y + c[1], z + c[2]])).map((value) => value.toFixed(3));
        svg.append(element("polygon", { points: points.join(" "), fill: shaded(colors[at(x, y, z)], light),
          stroke: "#202326", "stroke-width": 0.03 }));
      }
    }
    return svg;
  }

  for (const figure of document.querySelectorAll("figure.chart:not(.key)")) {
    const data = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
    if (!data.robots || data.robots.list.length === 0) continue;
    const { list, colors } = data.robots;
    const svg = figure.querySelector("svg");
    const output = figure.querySelector("output");
    const ring = element("rect", { class: "chosen", visibility: "hidden" });
    svg.append(ring);
    svg.setAttribute("cursor", "pointer");
    const middles = list.map(({ box }) => [box[0] + box[2] / 2, box[1] + box[3] / 2]);
    let chosen = -1;

    const show = (k) => {
      if (k < 0) return;
      chosen = k;
      const { box, text, letters } = list[k];
      const room = box[2] > 0 ? 0 : 8;
      for (const [name, value] of [["x", box[0] - room], ["y", box[1] - room], ["width", box[2] + 2 * room],
        ["height", box[3] + 2 * room], ["rx", room], ["visibility", "visible"]]) ring.setAttribute(name, value);
      output.textContent = text;
      if (letters) output.append(bodyOf(letters, colors));
    };

    // The robot that is nearest to a place, among those for which `wanted` is true.
    const nearest = (place, wanted, cost) => {
      let best = -1;
      let least = Infinity;
      middles.forEach((middle, k) => {
        const apart = [middle[0] - place[0], middle[1] - place[1]];
        if (wanted(apart) && cost(apart) < least) [best, least] = [k, cost(apart)];
      });
      return best;
    };

    const far = (apart) => Math.hypot(...apart);
    svg.addEventListener("click", (event) => {
      const box = svg.getBoundingClientRect();
      const zoom = svg.viewBox.baseVal.width / box.width;
      const place = [(event.clientX - box.left) * zoom, (event.clientY - box.top) * zoom];
      const inside = list.findIndex((robot) => robot.box[2] > 0 && place[0] >= robot.box[0] && place[1] >= robot.box[1]
        && place[0] < robot.box[0] + robot.box[2] && place[1] < robot.box[1] + robot.box[3]);
      // an empty cell has no robot; a point has some room around it
      if (inside >= 0) show(inside);
      else if (list[0].box[2] === 0) show(nearest(place, (apart) => far(apart) < 24, far));
    });

    const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    figure.querySelector(".scroll").addEventListener("keydown", (event) => {
      const way = WAYS[event.key];
      if (!way) return;
      event.preventDefault();
      if (chosen < 0) return show(0);
      // straight ahead first
      const along = (apart) => apart[0] * way[0] + apart[1] * way[1];
      const beside = (apart) => Math.abs(apart[0] * way[1]) + Math.abs(apart[1] * way[0]);
      show(nearest(middles[chosen], (apart) => along(apart) > 0.05, (apart) => along(apart) + 4 * beside(apart)));
    });
  }
})();
