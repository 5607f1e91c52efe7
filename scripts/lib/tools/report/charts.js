// charts.js: shows a chart's numbers at the pointer, or at the place chosen with the arrow keys. The curves are SVG and
// need no script.
"use strict";
(function () {
  document.documentElement.classList.add("scripted");
  const shown = (value) => Number(value.toPrecision(4)).toString();

  for (const figure of document.querySelectorAll("figure.chart:not(.key)")) {
    const svg = figure.querySelector("svg");
    const frame = figure.querySelector(".scroll");
    const output = figure.querySelector("output");
    const data = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
    const named = data.curves.filter((curve) => curve.points.length > 0);
    const places = [...new Set(named.flatMap((curve) => curve.points.map((point) => point[0])))].sort((a, b) => a - b);
    if (places.length === 0) continue;
    const cursor = document.createElementNS("http://www.w3.org/2000/svg", "line");
    cursor.setAttribute("class", "cursor");
    cursor.setAttribute("visibility", "hidden");
    svg.appendChild(cursor);
    let at = -1;

    const show = (k) => {
      at = Math.min(Math.max(k, 0), places.length - 1);
      const x = places[at];
      const across = data.left + ((x - data.low) / (data.high - data.low)) * (data.right - data.left);
      for (const [name, value] of [["x1", across], ["x2", across], ["y1", data.top], ["y2", data.bottom]]) {
        cursor.setAttribute(name, value);
      }
      cursor.setAttribute("visibility", "visible");
      const parts = [];
      for (const curve of named) {
        const point = curve.points.find((each) => each[0] === x);
        if (point && parts.length < 8) parts.push(curve.name + " " + shown(point[1]));
      }
      output.textContent = data.x + " " + shown(x) + ": " + parts.join(", ");
    };

    svg.addEventListener("pointermove", (event) => {
      const box = svg.getBoundingClientRect();
      const across = ((event.clientX - box.left) / box.width) * svg.viewBox.baseVal.width;
      const x = data.low + ((across - data.left) / (data.right - data.left)) * (data.high - data.low);
      let nearest = 0;
      places.forEach((place, k) => {
        if (Math.abs(place - x) < Math.abs(places[nearest] - x)) nearest = k;
      });
      show(nearest);
    });
    svg.addEventListener("pointerleave", () => {
      cursor.setAttribute("visibility", "hidden");
      output.textContent = "";
    });
    frame.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -Infinity, End: Infinity };
      if (!(event.key in steps)) return;
      event.preventDefault();
      const step = steps[event.key];
      show(step === -Infinity ? 0 : step === Infinity ? places.length - 1 : at + step);
    });
  }
})();
