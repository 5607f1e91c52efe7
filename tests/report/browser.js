// browser.js: runs first in a report that report_browser.lua opens in a headless Chromium, uses the page as a reader
// would, and logs what it saw as JSON.
"use strict";
(function () {
  const seen = { problems: [] };
  addEventListener("error", (event) => seen.problems.push(event.message));
  addEventListener("unhandledrejection", (event) => seen.problems.push(String(event.reason)));
  addEventListener("securitypolicyviolation", (event) => seen.problems.push(event.violatedDirective + " " + event.blockedURI));

  const byId = (id) => document.getElementById(id);
  const all = (selector) => [...document.querySelectorAll(selector)];
  const frame = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));

  async function until(condition) {
    for (let k = 0; k < 500; ++k) {
      if (condition()) return;
      await frame();
    }
    throw new Error("did not come: " + condition);
  }

  // Each robot's canvas after the next frame.
  async function pixels() {
    await frame();
    return all("canvas").map((canvas) => canvas.toDataURL());
  }

  async function set(id, field, value, event) {
    byId(id)[field] = value;
    byId(id).dispatchEvent(new Event(event));
    return pixels();
  }

  const press = (at, key) => at.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  const differ = (before, after) => before.every((each, k) => each !== after[k]);

  function charts() {
    seen.charts = all("figure.chart:not(.key)").map((figure) => ({
      data: JSON.parse(figure.querySelector("script").textContent),
      drawn: [...figure.querySelectorAll("polyline")].map((line) => line.points.numberOfItems) }));
    press(document.querySelector("figure.chart .scroll"), "End");
    seen.read_out = document.querySelector("figure.chart output").textContent;
  }

  // Chooses robots of the archive's map.
  function chosen() {
    const figure = document.querySelector("#archive figure.chart");
    const { robots, left, top } = JSON.parse(figure.querySelector("script").textContent);
    const svg = figure.querySelector("svg");
    const output = figure.querySelector("output");
    const click = (x, y) => {
      const box = svg.getBoundingClientRect();
      const zoom = box.width / svg.viewBox.baseVal.width;
      const at = { clientX: box.left + x * zoom, clientY: box.top + y * zoom, bubbles: true };
      svg.dispatchEvent(new MouseEvent("click", at));
      return output.textContent;
    };
    const texts = {};
    for (const { text } of robots.list) texts[text] = true;
    // the leftmost has one to its right
    const [first] = robots.list.map(({ box }) => box).sort((a, b) => a[0] - b[0]);
    seen.chosen = { list: texts, clicked: click(first[0] + first[2] / 2, first[1] + first[3] / 2) };
    press(figure.querySelector(".scroll"), "ArrowRight");
    seen.chosen.moved = output.textContent;
    seen.chosen.empty = click(left - 5, top - 5);
    seen.chosen.faces = output.querySelectorAll("polygon").length;
  }

  // Centre of the block, which has the last six faces of the robot's mesh.
  const block = () => [0, 1, 2].map((c) => limax.views[0].shape.slice(-72).filter((_, k) => k % 3 === c)
    .reduce((a, b) => a + b) / 24);

  async function robots() {
    const panel = document.querySelector(".robots");
    await until(() => panel.dataset.ready);
    if (panel.dataset.ready !== "yes") throw new Error(panel.textContent);
    const still = await pixels();
    const view = limax.views[0];
    seen.key = byId("key").textContent;
    seen.up = new THREE.Vector3(0, 0, 1).applyQuaternion(view.tilt.quaternion).toArray();
    const colors = () => String(view.mesh.geometry.attributes.color.array);
    const before = colors();
    seen.block = [block()];
    const ok = seen.ok = { still: !differ(still, await pixels()) };
    byId("play").click();
    await until(() => Number(byId("time").value) > 0.2);
    byId("play").click();
    const moved = await pixels();
    ok.moved = differ(still, moved);
    ok.paused = !differ(moved, await pixels());
    ok.scrubbed_back = String(await set("time", "value", 0, "input")) === String(still);
    const last = await set("time", "value", 1e9, "input");
    ok.scrubbed_to_end = differ(still, last);
    ok.tinted = before !== colors();
    seen.block.push(block());
    seen.clock = byId("clock").textContent;
    const turned = (radians) => {
      limax.views.forEach(({ camera, controls }) => {
        camera.position.applyAxisAngle(new THREE.Vector3(0, 0, 1), radians);
        controls.update();
      });
      return pixels();
    };
    ok.turned = differ(last, await turned(0.1));
    byId("reset").click();
    ok.reset = String(await pixels()) === String(last);
  }

  // Whatever takes the focus: its name, and whether a line around it shows the focus.
  function keyboard() {
    seen.focus = all("a[href], button, input, select, summary, [tabindex]").filter((at) => at.checkVisibility())
      .map((at) => {
        at.focus();
        const style = getComputedStyle(at);
        return { id: at.id || at.className || at.tagName.toLowerCase(),
          named: Boolean(at.getAttribute("aria-label") || (at.labels && at.labels.length) || at.textContent.trim()),
          shown: document.activeElement === at && at.getBoundingClientRect().right > 0 && style.outlineStyle !== "none"
            && parseFloat(style.outlineWidth) >= 1 };
      });
  }

  addEventListener("load", async () => {
    try {
      charts();
      chosen();
      const strips = byId("strips");
      if (document.querySelector(".robots")) {
        await robots();
        seen.ok.strips_folded = !strips.open;
      }
      keyboard();
      document.body.style.width = "320px";
      await frame();
      seen.overflow = document.body.scrollWidth - 320;
      dispatchEvent(new Event("beforeprint"));
      document.documentElement.classList.remove("scripted");
      const visible = (selector) => all(selector).filter((each) => each.getBoundingClientRect().width > 0).length;
      seen.shown = all(".figure-row").length;
      seen.plain = { robots: visible(".robots"), curves: visible("figure.chart polyline"), strips: visible(".figure-row svg") };
    } catch (problem) {
      seen.problems.push(String(problem.stack));
    }
    seen.loaded = performance.getEntriesByType("resource").length;
    console.log("SEEN " + encodeURIComponent(JSON.stringify(seen)) + " END");
    // the browser ends with its only window
    window.close();
  });
})();
