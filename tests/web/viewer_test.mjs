// The viewer in a real browser, by mouse and key, on a server with the bridge that two robots mapped.
//
//   node tests/web/viewer_test.mjs --build build/release [--pictures DIR] [--as-built 1] [--quick 1]
//
// Exits 77, which ctest counts as skipped, where Chromium or the viewer's packages are not there.
import { execFileSync, spawn } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { gunzipSync } from "node:zlib";

const options = Object.fromEntries(process.argv.slice(2).map((word, i, all) => [word, all[i + 1]]));
const build = path.resolve(options["--build"] ?? "build/release");
const viewer = path.join(build, "client/web/viewer");
const packages = path.join(build, "client/web/npm/node_modules");
const chromium = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((file) => fs.existsSync(file));

function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);
}
if (!chromium) skip("no Chromium (apt install chromium)");
try {
  if (!options["--as-built"]) execFileSync("cmake", ["--build", build, "--target", "viewer"], { stdio: "pipe" });
} catch {
  // Without npm or the network; what was built before will do.
}
if (!fs.existsSync(path.join(viewer, "viewer.js"))) skip("no viewer (cmake --build --preset release --target viewer; needs npm)");
const { default: puppeteer } = await import(pathToFileURL(path.join(packages, "puppeteer-core/lib/puppeteer/puppeteer-core.js")));

const work = fs.mkdtempSync(path.join(os.tmpdir(), "strata-viewer-"));
const pictures = options["--pictures"];
const ended = [];
let failures = 0;

function expect(holds, what) {
  console.log(`${holds ? "ok  " : "FAIL"} ${what}`);
  if (!holds) ++failures;
}
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
// `ms` is what a quiet machine takes at most, and is said where it took longer; it fails after ten times that.
async function within(ms, what, holds) {
  const begun = Date.now();
  for (;;) {
    const took = Date.now() - begun;
    if (await holds()) return expect(true, `${what} (${took} ms${took > ms ? `, more than ${ms}` : ""})`);
    if (took > 10 * ms) return expect(false, `${what}: not within ${10 * ms} ms`);
    await pause(50);
  }
}

// A server on free ports: its addresses, and its log so far.
async function serve(name, ...more) {
  const at = more.includes("--listen") ? [] : ["--listen", "127.0.0.1:0", "--web", "127.0.0.1:0"];
  const args = ["--data", path.join(work, name), "--web-viewer", viewer, ...at, ...more];
  const child = spawn(path.join(build, "server/stratad"), args);
  const server = { log: "", out: "", child };
  child.stdout.on("data", (text) => (server.out += text));
  child.stderr.on("data", (text) => (server.log += text));
  ended.push(() => child.kill());
  for (let i = 0; i < 200 && !server.out.includes("\nweb "); ++i) await pause(50);
  [, server.address] = server.out.match(/listening (\S+)/);
  [, server.url] = server.out.match(/web (\S+)/);
  server.strata = (...words) => execFileSync(path.join(build, "client/cli/strata"), ["--server", server.address, ...words], { encoding: "utf8", maxBuffer: 1 << 28, env: { ...process.env, STRATA_TOKEN: server.token ?? "" } });
  return server;
}

// Poses of a simulation begin at 0 s; these in 2026, as a robot's whose clock is right.
function dateThePoses(file) {
  const lines = fs.readFileSync(file, "utf8").split("\n").map((line) => (/^\d/.test(line) ? line.replace(/ \S+/, (time) => ` ${(Number(time) + 1767225600).toFixed(6)}`) : line));
  fs.writeFileSync(file, lines.join("\n"));
}

async function mapTheBridge() {
  const simulate = path.join(build, "tests/support/strata-simulate");
  execFileSync(simulate, ["bridge", path.join(work, "world"), "--seed", "1", "--step", "2", "--noise-m", "0.02", "--noise-rad", "0.003"]);
  for (const robot of ["over", "under"]) dateThePoses(path.join(work, "world", robot, "poses_initial.txt"));
  const server = await serve("maps");
  server.strata("map", "create", "bridge", "--cell-size", "0.1");
  server.import = (robot, as) => server.strata("scan", "import", "bridge", path.join(work, "world", robot, "scans"), "--poses", path.join(work, "world", robot, "poses_initial.txt"), "--pose-format", "index-tum", "--trajectory", as, "--align", "on", "--wait");
  for (const robot of ["over", "under"]) server.import(robot, robot);
  return server;
}

async function open(browser, url) {
  const page = await browser.newPage();
  await page.setViewport({ width: 1280, height: 800 });
  page.on("pageerror", (error) => expect(false, `no error in the page: ${error.message}`));
  page.on("console", (line) => line.type() === "error" && !/401|503|ERR_/.test(line.text()) && expect(false, `no error on the console: ${line.text()}`));
  await page.goto(url);
  await page.waitForFunction("window.strata?.begun", { timeout: 120000 });
  return page;
}
const drawn = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
const picture = (page, name) => pictures && page.screenshot({ path: path.join(pictures, `${name}.png`) });
async function click(page, place) {
  const [x, y] = await page.evaluate((p) => strata.stage.pixelOf(p), place);
  await page.mouse.click(x, y);
}
const message = (page) => page.$eval("#message", (node) => node.textContent);

// Two clicks, and what the CLI says between the same places.
async function planBothWays(server, page, camera, from, to, name) {
  await page.evaluate((c) => strata.stage.look(c), camera);
  await drawn(page);
  await page.keyboard.press("Escape");
  await click(page, from);
  await page.waitForFunction("strata.levels !== null", { timeout: 120000 });
  const levels = await page.evaluate("strata.levels");
  const said = await page.$$eval("#levels li", (items) => items.map((item) => item.textContent));
  await click(page, to);
  await page.waitForFunction("strata.plan !== null", { timeout: 120000 });
  await drawn(page);
  const plan = await page.evaluate("strata.plan");
  await picture(page, name);
  const at = ({ x, y, z }) => `${x},${y},${z}`;
  const told = JSON.parse(server.strata("--output", "json", "plan", "bridge", "--from", at(plan.from), "--to", at(plan.to)));
  expect(plan.found, `${name}: a path of ${plan.length.toFixed(2)} m (${await message(page)})`);
  expect(Math.abs(plan.length - told.length_m) < 0.1, `${name}: that of the CLI, ${told.length_m.toFixed(2)} m`);
  expect(Math.hypot(plan.from.x - from.x, plan.from.y - from.y) < 0.5, `${name}: it begins where the click was`);
  return { plan, levels, said };
}

async function testDecoder(server) {
  const tile = path.join(work, "tile.bin");
  server.strata("tile", "get", "bridge", "0/0/0", "--out", tile);
  const told = JSON.parse(server.strata("--output", "json", "tile", "get", "bridge", "0/0/0", "--surfaces")).surfaces;
  const { decodeTile } = await import(pathToFileURL(path.join(build, "client/web/npm/src/tile.js")));
  const bytes = new Uint8Array(fs.readFileSync(tile));
  const begun = performance.now();
  const ours = decodeTile(bytes);
  const ms = performance.now() - begun;
  let off = 0;
  for (let i = 0; i < told.length; ++i) {
    if (Math.abs(ours.height[i] / 512 - told[i].z) > 1e-3 || Math.abs(ours.depth[i] / 512 - (told[i].depth_m ?? 0)) > 1e-3) ++off;
  }
  expect(ours.size === told.length && ours.size > 10000 && off === 0, `${ours.size} surfaces decoded as the CLI does, ${off} differ (${ms.toFixed(0)} ms)`);
  for (const cut of [3, 20, 200, bytes.length - 40]) {
    let refused = false;
    try {
      decodeTile(bytes.subarray(0, cut));
    } catch {
      refused = true;
    }
    expect(refused, `a tile of ${cut} bytes is refused`);
  }
}

async function testMap(server, page) {
  expect((await page.$eval("#maps", (node) => node.textContent)).includes("bridge"), "the list has the map");
  await page.waitForFunction("strata.view.settled", { timeout: 120000 });
  const state = await page.$eval("#state", (node) => node.textContent);
  expect(/\d+ tiles, 1\d\d,\d{3} surfaces, epoch 1/.test(state), state);
  await within(5000, "two trajectories are drawn", () => page.evaluate("strata.runs === 2"));
  await drawn(page);
  await picture(page, "bridge");
  const frames = await page.evaluate("strata.stage.frameMs");
  console.log(`     frames of [ms] ${frames.map((ms) => ms.toFixed(0)).join(" ")}`);
  const pixels = () => page.evaluate(() => (strata.stage.draw(), strata.stage.canvas.toDataURL().length));
  const before = await pixels();
  await page.keyboard.press("2");
  await drawn(page);
  expect((await pixels()) !== before && (await page.$eval("body", (node) => node.dataset.layer)) === "height", "the key 2 colours by height");
  const scale = await page.$$eval("#scale-low, #scale-high", (ends) => ends.map((end) => end.textContent));
  expect(scale.every((end) => /^(?!-0\.00)-?\d+\.\d\d m$/.test(end)) && parseFloat(scale[1]) > 3, `and says of which: ${scale.join(" to ")}`);
  await picture(page, "height");
  await page.keyboard.press("7");
  await within(3000, "the key 7 colours by time, and says of when", () => page.$eval("#time-first", (node) => /^2026-01-01 /.test(node.textContent)));
  const codes = await page.evaluate(() => {
    const seen = new Set();
    for (const { group } of strata.view.shown()) for (const { userData: { rows, count } } of group.children) for (let i = 0; i < count; ++i) seen.add(rows[4 * i + 3] >>> 24);
    return [...seen];
  });
  expect(codes.length > 20 && Math.min(...codes) === 1 && Math.max(...codes) === 255, `${codes.length} times of surfaces, from the first to the last`);
  await drawn(page);
  await picture(page, "time");
  await page.keyboard.press("d");
  await drawn(page);
  await picture(page, "dark");
  await page.keyboard.press("1");
  await page.keyboard.press("d");
}

// By mouse: turned, brought nearer, moved; and the picture that the key p saves.
async function testMouse(page) {
  const view = () => page.evaluate(() => strata.stage.view());
  const before = await view();
  const drag = async (button) => {
    await page.mouse.move(700, 400);
    await page.mouse.down({ button });
    await page.mouse.move(800, 440, { steps: 4 });
    await page.mouse.up({ button });
    await drawn(page);
  };
  await drag("right");
  const turned = await view();
  expect(Math.hypot(turned[0] - before[0], turned[1] - before[1]) > 1 && Math.hypot(turned[3] - before[3], turned[4] - before[4]) < 0.01, "the right button turns about what is looked at");
  await page.mouse.wheel({ deltaY: -400 });
  await drawn(page);
  const far = ([x, y, z, u, v, w]) => Math.hypot(x - u, y - v, z - w);
  expect(far(await view()) < 0.95 * far(turned), "the wheel brings it nearer");
  await drag("left");
  const moved = await view();
  expect(Math.hypot(moved[3] - turned[3], moved[4] - turned[4]) > 1, "the left button moves it");
  for (const [key, layer, legend] of [["3", "class", "no class"], ["4", "confidence", "0 % 100 %"], ["5", "sigma", "1 mm 1 m"]]) {
    await page.keyboard.press(key);
    const told = await page.$$eval(".legend", (all) => all.filter((one) => one.checkVisibility()).map((one) => one.textContent.trim().replace(/\s+/g, " ")).join());
    expect((await page.$eval("body", (body) => body.dataset.layer)) === layer && told === legend, `the key ${key} colours by ${layer}: ${told}`);
  }
  await page.keyboard.press("1");
  const client = await page.createCDPSession();
  await client.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: work });
  await page.keyboard.press("p");
  const file = path.join(work, "bridge.png");
  await within(3000, "the key p saves a picture", () => fs.existsSync(file) && fs.statSync(file).size > 0);
  const bytes = fs.readFileSync(file);
  expect(bytes.subarray(1, 4).toString() === "PNG" && bytes.readUInt32BE(16) === 1280 && bytes.readUInt32BE(20) === 800 && bytes.length > 20000, `a PNG of 1280 × 800 in ${bytes.length} bytes`);
  await page.keyboard.press("f");
  await page.keyboard.press("Escape");
}

async function testPlans(server, page) {
  const above = [0, -30, 30, 0, 0, 0];
  const { levels, said } = await planBothWays(server, page, above, { x: 0, y: 0, z: 3.4 }, { x: 24, y: 0, z: 0 }, "over");
  expect(/: drivable, 0\.\d\d m deep$/.test(said[0]) && /: drivable/.test(said.at(-1)), `both are drivable: ${said.join("; ")}`);
  const heights = levels.map((surface) => surface.z_m ?? 0); // JSON leaves out what is 0
  expect(heights[0] > 3 && heights.at(-1) < 0.5, `on the deck there are levels at ${heights.map((z) => z.toFixed(2)).join(" and ")} m`);
  await planBothWays(server, page, above, { x: 0, y: -14, z: 0 }, { x: 0, y: 14, z: 0 }, "under");
  // Under the deck, seen with the deck cut off.
  await page.$eval("#cut", (slider) => {
    slider.value = 1.5;
    slider.dispatchEvent(new Event("input"));
  });
  await page.evaluate((c) => strata.stage.look(c), above);
  await drawn(page);
  const place = await page.evaluate(() => strata.stage.pick(...strata.stage.pixelOf({ x: 0, y: 0, z: 0 })));
  expect(place && Math.abs(place.z) < 0.2, "with the deck cut off the road under it is picked");
  await picture(page, "cut");
  await page.keyboard.press("Escape");
  await page.evaluate((c) => strata.stage.look(c), [0, -30, 60, 0, 0, 0]);
  await drawn(page);
  await click(page, { x: 0, y: -14, z: 0 });
  await page.waitForFunction("strata.levels !== null");
  // Out there are single rings of the scanner only.
  const far = await page.evaluate(() => {
    for (let x = 330; x < innerWidth; x += 23) for (let y = 10; y < innerHeight; y += 61) {
      const at = strata.stage.pick(x, y);
      if (at && Math.hypot(at.x, at.y) > 45) return [x, y];
    }
    return null;
  });
  await page.mouse.click(...far);
  await page.waitForFunction("strata.plan !== null", { timeout: 120000 });
  const why = await message(page);
  expect(why.startsWith("no path: ") && why.length > 20, why);
  await picture(page, "no_path");
}

async function testLink(server, browser, page) {
  await page.keyboard.press("3");
  await page.keyboard.press("l");
  const url = await page.evaluate("location.href");
  const other = await open(browser, url);
  expect(url.includes("cut="), "it has the height that is cut off");
  const [a, b] = await Promise.all([page, other].map((p) => p.evaluate("[...strata.stage.view(), document.body.dataset.layer, document.getElementById('cut-value').textContent].join()")));
  expect(a.split(",").slice(6).join() === b.split(",").slice(6).join() && url.includes("map=bridge"), `a link shows the same view: ${url.slice(0, 110)}`);
  await other.close();
  await page.keyboard.press("6");
  await within(20000, "floors are found", () => page.evaluate("strata.floors > 1"));
  await page.select("#floor", "1");
  for (const name of ["trajectories", "scans"]) await press(page, `#switches input[data-layer="${name}"]`);
  await page.keyboard.press("l");
  const third = await open(browser, await page.evaluate("location.href"));
  const seen = (on) => on.evaluate(() => [document.getElementById("floor").value, document.getElementById("cut-value").textContent, ...[...document.querySelectorAll("#switches input:checked")].map((box) => box.dataset.layer)].join());
  const here = await seen(page);
  expect(/^1,\d.*of the floor,scans$/.test(here), `one floor alone and other switches: ${here}`);
  await within(20000, "a link has those, too", async () => (await seen(third)) === here);
  await third.close();
  for (const name of ["trajectories", "scans"]) await press(page, `#switches input[data-layer="${name}"]`);
  await page.select("#floor", "");
  await page.keyboard.press("1");
}

// Of a pyramid of 64 × 64 tiles, without a browser: what is chosen covers every place once.
async function testTree() {
  const { TileTree, choose, cover } = await import(pathToFileURL(path.join(build, "client/web/npm/src/tile_tree.js")));
  const tree = new TileTree(0.1);
  for (let level = 0; level < 13; ++level) {
    const tiles = [];
    const side = Math.max(1, 32 >> level);
    for (let x = -side; x < side; ++x) for (let y = -side; y < side; ++y) tiles.push({ key: { level, x, y }, version: "1", patches: "60000" });
    tree.set(level, tiles);
  }
  tree.setTop();
  const eye = { x: 3, y: 4, z: 20, low: 0, high: 5, pixels: 800, sees: () => true };
  const cut = choose(tree, eye, 2_000_000);
  const once = (nodes) => {
    const seen = new Uint8Array(64 * 64);
    for (const { level, x, y } of nodes) {
      const wide = 2 ** level;
      for (let i = Math.max(-32, x * wide); i < Math.min(32, (x + 1) * wide); ++i) for (let j = Math.max(-32, y * wide); j < Math.min(32, (y + 1) * wide); ++j) ++seen[(i + 32) * 64 + j + 32];
    }
    return seen.every((times) => times === 1);
  };
  const leaves = [...cut.leaves.values()];
  const levels = new Set(leaves.map(({ level }) => level));
  expect(cut.patches <= 2_000_000 && cut.patches > 500_000 && levels.size > 2 && cut.leaves.has(`${Math.min(...levels)}/0/0`), `${leaves.length} of 4096 tiles, ${cut.patches} surfaces, of levels ${[...levels].sort().join(" ")}`);
  expect(once(leaves), "they cover every place once");
  let all = true;
  let state = 7;
  for (let share = 0; share < 20; ++share) {
    const roots = new Set(tree.roots().map(({ id }) => id));
    const has = new Set([...cut.inner.keys(), ...cut.leaves.keys()].filter((id) => roots.has(id) || (state = (state * 48271) % 2147483647) % 20 < share));
    all &&= once(cover(tree, cut, (id) => has.has(id)));
  }
  expect(all, "so does what is drawn while they come, in any order");
}

// What the machine itself takes, in a context of its own: a clear and 200,000 plain triangles of a
// few pixels. Runs in the page.
function makeBaseline() {
  const gl = Object.assign(document.createElement("canvas"), { width: 1280, height: 800 }).getContext("webgl2", { antialias: false });
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, `#version 300 es
    precision highp float; flat out vec3 c;
    void main() { int i = gl_VertexID / 3, v = gl_VertexID - 3 * i; c = vec3(float(i & 255) / 255.);
      gl_Position = vec4((vec2(i % 500, i / 500) + vec2(v == 1, v == 2)) * vec2(.004, .005) - 1., 0., 1.); }`], [gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float; flat in vec3 c; out vec4 o; void main() { o = vec4(c, 1.); }`]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  gl.enable(gl.DEPTH_TEST);
  window.baseline = () => {
    const begun = performance.now();
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawArrays(gl.TRIANGLES, 0, 600_000);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return performance.now() - begun;
  };
}

// A frame, beside what the machine takes in the same second.
async function testFrames(page) {
  await page.evaluate(makeBaseline);
  const pairs = await page.evaluate(async () => {
    const found = [];
    for (let i = 0; i < 8; ++i) {
      strata.stage.draw();
      found.push([strata.stage.frameMs.at(-1), baseline()]);
      await new Promise(requestAnimationFrame);
    }
    return found.slice(1);
  });
  const median = (all) => all.sort((a, b) => a - b)[all.length >> 1];
  const [ms, plain, ratio] = [pairs.map(([a]) => a), pairs.map(([, b]) => b), pairs.map(([a, b]) => a / b)].map(median);
  const seen = await page.evaluate("strata.view.cut.patches");
  expect(ratio < 3.5, `${seen} surfaces in sight: a frame of ${ms.toFixed(0)} ms (250 on a quiet machine), 200,000 plain triangles ${plain.toFixed(0)} ms, ratio ${ratio.toFixed(2)}`);
}

// What a browser has to load before it shows anything.
function testBundle() {
  const files = ["index.html", "viewer.js", "worker.js", "viewer.css"];
  const packed = files.map((file) => fs.readFileSync(path.join(viewer, `${file}.gz`)));
  expect(files.every((file, i) => gunzipSync(packed[i]).equals(fs.readFileSync(path.join(viewer, file)))), "each file is there packed, too");
  const bytes = packed.reduce((sum, { length }) => sum + length, 0);
  expect(bytes <= 250_000, `the viewer has ${(bytes / 1000).toFixed(0)} kB, packed by gzip`);
}

// Near the ground far tiles are coarse, and no place is drawn twice.
async function testLevels(page) {
  await page.evaluate(() => strata.stage.look([-22, -22, 3, 10, 10, 0]));
  await pause(300);
  await page.waitForFunction("strata.view.settled && !strata.view.due", { timeout: 120000 });
  await drawn(page);
  const tiles = await page.evaluate(() => strata.view.shown().map(({ decoded: { level, x, y, size } }) => ({ level, x, y, size })));
  const levels = new Set(tiles.map(({ level }) => level));
  const covered = tiles.some((a) => tiles.some((b) => a.level > b.level && b.x >> (a.level - b.level) === a.x && b.y >> (a.level - b.level) === a.y));
  const seen = await page.evaluate("strata.view.cut.patches");
  expect(levels.size > 1 && levels.has(0) && !covered && seen <= 200000, `from near the ground: levels ${[...levels].join(" ")}, ${seen} surfaces in sight, none over another`);
  await testFrames(page);
  await picture(page, "levels");
}

const press = (page, selector) => page.$eval(selector, (node) => node.click());
const job = (page, kind, state) => page.$$eval("#job-list li", (items, k, s) => items.some((item) => item.dataset.state === s && item.querySelector("b").textContent.endsWith(k)), kind, state);
const jobButton = (page, verb) => page.$$eval("#job-list button", (all, v) => all.find((one) => one.textContent === v).click(), verb);
const layerSwitch = (page, name) => page.$(`#switches input[data-layer="${name}"]`);

async function testPanels(server, page) {
  await page.evaluate(() => strata.stage.look([0, -40, 40, 0, 0, 0]));
  await press(page, "#jobs > summary");
  await page.select("#job-kind", "optimize");
  await press(page, "#job-dry");
  await press(page, "#job-form button");
  await within(40000, "a dry run of optimize proposes", () => job(page, "optimize", "proposed"));
  await picture(page, "job");
  const proposed = await page.$eval("#job-list li[data-state=proposed] b", (name) => name.textContent); // another may have run by itself
  await jobButton(page, "accept");
  await within(40000, `accepted, ${proposed} succeeds`, () => job(page, proposed, "succeeded"));
  await press(page, "#epochs > summary");
  await within(10000, "the new epoch is listed", () => page.$eval("#epoch-list", (list) => list.children.length > 1));
  page.once("dialog", (dialog) => dialog.accept());
  await press(page, "#epoch-list button[aria-label^='bring back']");
  await within(40000, "asked and agreed to, an earlier epoch comes back", () => job(page, "revert", "succeeded"));
  await page.select("#job-kind", "planes");
  await press(page, "#job-form button");
  await within(40000, "planes are found", () => job(page, "planes", "succeeded"));
  await within(10000, "and have a switch", () => layerSwitch(page, "planes"));
  expect(!(await layerSwitch(page, "objects")), "objects, of which there are none, have none");
  for (const name of ["planes", "scans", "registrations"]) {
    const lines = () => page.evaluate((prefix) => strata.stage.overlay.children.filter(({ name }) => name.startsWith(prefix)).length, name);
    await press(page, `#switches input[data-layer="${name}"]`);
    expect((await lines()) > 0, `${name} are drawn when switched on`);
    await drawn(page);
    await picture(page, name);
    await press(page, `#switches input[data-layer="${name}"]`);
    expect((await lines()) === 0, `${name} go when switched off`);
  }
  const [x, y] = await page.evaluate(() => strata.hover.layers.get("scans").map((scan) => strata.stage.pixelOf(scan)).find(([x, y]) => x > 400 && x < 1200 && y > 100 && y < 700));
  await page.mouse.move(x, y);
  await within(3000, "the scan under the pointer is named, with its time", () => page.$eval("#hover", (label) => !label.hidden && /^scan \w+\/\d+, 2026-01-01 /.test(label.textContent)));
  await page.keyboard.press("6");
  await within(20000, "floors are found", () => page.evaluate("strata.floors > 1"));
  await drawn(page);
  await picture(page, "floors");
  await page.select("#floor", "0");
  await drawn(page);
  await picture(page, "floor");
  await page.select("#floor", "");
  await page.keyboard.press("1");
}

// A map whose points have classes: boxes around its things, and what is inferred of them.
async function testObjects(server, browser) {
  const labelled = path.join(work, "labelled");
  execFileSync(path.join(build, "tests/support/strata-simulate"), ["bridge", labelled, "--seed", "1", "--labels", "--scans", "8"]);
  server.strata("map", "create", "things");
  server.strata("scan", "import", "things", path.join(labelled, "over/scans"), "--poses", path.join(labelled, "over/poses_truth.txt"), "--trajectory", "over", "--align", "off", "--wait");
  for (const kind of ["objects", "complete"]) server.strata("job", "start", "things", kind, "--wait");
  const page = await open(browser, `${server.url}#map=things`);
  const told = server.strata("--output", "json", "objects", "list", "things");
  await within(20000, "objects have a switch", () => layerSwitch(page, "objects"));
  await press(page, '#switches input[data-layer="objects"]');
  const boxes = () => page.evaluate(() => (strata.stage.overlay.children.find(({ name }) => name === "objects")?.geometry.attributes.position.count ?? 0) / 24);
  const listed = JSON.parse(told).entities.length;
  await within(5000, `${listed} boxes, as many as the CLI lists`, async () => listed > 0 && (await boxes()) === listed);
  await drawn(page);
  await picture(page, "objects");
  await testClasses(server, page);
  await testNoDates(page);
  await page.close();
}

// What somebody called class 2, and in which colour.
async function testClasses(server, page) {
  const legend = () => page.$$eval("#class-legend span", (all) => all.map((one) => [one.textContent.trim(), one.firstChild.style.background]));
  const painted = (colour) => page.evaluate((wanted) => {
    let count = 0;
    for (const { group } of strata.view.shown()) for (const { userData: { rows, texture, count: size } } of group.children) for (let i = 0; i < size; ++i) count += ((rows[4 * i] >> 20) & 255) === 2 && (texture.image.data[4 * i + 3] & 0xffffff) === wanted;
    return count;
  }, colour);
  await page.keyboard.press("3");
  await within(5000, "the classes that are seen are in the legend, by number where they have no name", async () => (await legend()).some(([name]) => name === "2"));
  server.strata("map", "classes", "things", "--set", "2=facade:#c08040");
  await page.keyboard.press("3");
  await within(5000, "by name where they have one, and in its colour", async () => (await legend()).some(([name, colour]) => name === "facade" && colour === "rgb(192, 128, 64)"));
  expect((await painted(0x4080c0)) > 100, `as ${await painted(0x4080c0)} surfaces are`);
  await drawn(page);
  await picture(page, "classes");
  await page.reload(); // things are described when they are read
  await page.waitForFunction("window.strata?.begun", { timeout: 120000 });
  await within(20000, "objects have a switch", () => layerSwitch(page, "objects"));
  await press(page, '#switches input[data-layer="objects"]');
  const objects = await page.evaluate(() => strata.hover.layers.get("objects").map(({ text }) => text));
  expect(objects.some((text) => /, class facade/.test(text)) && !objects.some((text) => /, class 2\b/.test(text)), `and things: ${objects[0]}`);
  await page.evaluate(async () => { // the middle of a wall's surface
    for (const { group } of strata.view.shown()) for (const { userData: { rows, count } } of group.children) for (let i = 0; i < count; i += 7) {
      if (((rows[4 * i] >> 20) & 255) !== 2) continue;
      const { origin, size } = group.userData;
      strata.wall = { x: origin.x + ((rows[4 * i] & 255) + 0.5) * size, y: origin.y + (((rows[4 * i] >> 8) & 255) + 0.5) * size, z: rows[4 * i + 1] / 512 };
      return;
    }
  });
  await page.evaluate(() => strata.stage.look([strata.wall.x, strata.wall.y - 1, strata.wall.z + 20, strata.wall.x, strata.wall.y, strata.wall.z]));
  await drawn(page);
  await click(page, await page.evaluate("strata.wall"));
  await within(5000, "a click names it, too", () => page.$$eval("#levels li", (items) => items.some((item) => /, class facade \(\d+ %\)/.test(item.textContent))));
}

// The times of this map's scans are those since a robot's start.
async function testNoDates(page) {
  await page.keyboard.press("7");
  await within(5000, "of times that are none of a calendar no date is said", () => page.$eval("#time-first", (node) => node.textContent === "no scan has a date"));
  const scans = await page.evaluate(() => strata.hover.layers.get("scans").map(({ text }) => text));
  expect(scans.length > 0 && scans.every((text) => /^scan over\/\d+(, [a-z]+)?$/.test(text)), `nor of scans: ${scans[0]}`);
}

// The list has all maps at once, and of each what the server says of it.
async function testMapList(server, browser) {
  const rows = (page) => page.$$eval("#maps tbody tr", (all) => all.map((row) => [...row.cells].map((cell) => cell.textContent)));
  const page = await browser.newPage();
  await page.setRequestInterception(true);
  const held = [];
  const calls = [];
  page.on("request", (request) => {
    calls.push(request.url().replace(/.*\./, ""));
    const name = /Maps\/Stats$/.test(request.url()) ? JSON.parse(request.postData()).name : "";
    if (name === "bridge") held.push(request);
    else if (name === "halves") request.respond({ status: 429, contentType: "application/json", body: JSON.stringify({ code: "resource_exhausted", message: "1 map is open" }) });
    else request.continue();
  });
  await page.goto(server.url);
  await page.waitForFunction("window.strata?.begun", { timeout: 120000 });
  await within(5000, "maps are listed while one is being counted, and one cannot be", async () => held.length === 1 && (await rows(page)).some(([name, scans]) => name === "things" && scans === "8"));
  const listed = await rows(page);
  expect(listed.length === 3 && listed.every(([name, scans, size, age]) => age && (name === "things" || (scans === "–" && size === "–"))), listed.map((row) => row.join(" ")).join("; "));
  held[0].continue();
  const told = server.strata("map", "list").split("\n").map((line) => line.split(/ {2,}/));
  await within(5000, "sizes are those of the CLI", async () => (await rows(page)).filter(([name]) => name !== "halves").every(([name, scans, size]) => told.some(([its, count, , bytes]) => its === name && count === scans && bytes === size)));
  console.log(`     ${(await rows(page)).map((row) => row.join(" ")).join("; ")}`);
  await page.$eval('#maps button[aria-label="open map things"]', (button) => button.click());
  await within(20000, "a map that is chosen is in the address", () => page.evaluate("strata.ready && location.hash === '#map=things'"));
  calls.length = 0;
  await page.reload();
  await within(20000, "and opened again by it", () => page.evaluate("window.strata?.begun && strata.view.name === 'things'"));
  await within(5000, "before any is counted", () => calls.includes("Maps/Stats"));
  expect(calls.indexOf("Maps/Watch") >= 0 && calls.indexOf("Maps/Watch") < calls.indexOf("Maps/Stats"), calls.filter((name) => /^Maps/.test(name)).join(" "));
  await page.close();
}

// Of very many maps the first are counted, few at once.
async function testManyMaps(server, browser) {
  const page = await browser.newPage();
  await page.setRequestInterception(true);
  let [asked, open, most] = [0, 0, 0];
  page.on("request", async (request) => {
    const json = (body) => request.respond({ contentType: "application/json", body: JSON.stringify(body) });
    if (/Maps\/List$/.test(request.url())) return json({ maps: Array.from({ length: 250 }, (_, i) => ({ name: `map${i}`, created: "2026-01-01T00:00:00Z" })) });
    if (!/Maps\/Stats$/.test(request.url())) return request.continue();
    ++asked;
    most = Math.max(most, ++open);
    await pause(5);
    --open;
    json({ stats: { scans: "7" } });
  });
  await page.goto(server.url);
  await within(10000, "of 250 maps 200 are counted", () => page.$$eval("#maps tbody tr", (all) => all.length === 250 && all[199].cells[1].textContent === "7" && all[200].cells[1].textContent === "–"));
  await pause(200);
  expect(asked === 200 && most <= 3, `${asked} calls, ${most} at once`);
  await page.close();
}

// The sides and the top of a block, of which no point is beyond `most` along x; labelled, as PLY.
function writeBlock(file, low, most) {
  const lines = [];
  for (let x = 0; x <= 16; ++x) for (let y = 0; y <= 12; ++y) for (let z = 0; z <= 18; ++z) {
    if (!(x % 16 && y % 12 && z < 18) && x <= most) lines.push(`${low[0] + x / 20} ${low[1] + y / 20} ${0.1 + z / 20} 2`);
  }
  fs.writeFileSync(file, ["ply", "format ascii 1.0", `element vertex ${lines.length}`, ...["x", "y", "z"].map((axis) => `property float ${axis}`), "property ushort label", "end_header", ...lines, ""].join("\n"));
}

// Two blocks, of one of which nobody saw a part: it is drawn when one says so, hatched, and goes with the scan that it is from.
async function testInferred(server, browser) {
  const files = ["whole", "part"].map((name) => path.join(work, `${name}.ply`));
  writeBlock(files[0], [2, 2], 16);
  writeBlock(files[1], [2, -3], 10);
  server.strata("map", "create", "halves");
  for (const file of files) server.strata("scan", "import", "halves", file, "--trajectory", path.basename(file, ".ply"), "--align", "off", "--wait");
  const page = await open(browser, `${server.url}#map=halves`);
  expect(!(await layerSwitch(page, "inferred")), "what was inferred, of which there is nothing, has no switch");
  for (const kind of ["objects", "complete"]) server.strata("job", "start", "halves", kind, "--wait");
  await within(20000, "it has one once there is something", () => layerSwitch(page, "inferred"));
  const places = () => page.evaluate(() => strata.stage.overlay.children.find(({ name }) => name === "inferred")?.geometry.attributes.position.count ?? 0);
  expect((await places()) === 0, "which is off");
  const told = JSON.parse(server.strata("--output", "json", "objects", "export", "halves", path.join(work, "inferred.ply"), "--inferred"));
  await press(page, '#switches input[data-layer="inferred"]');
  await within(5000, `${told.points} places, as many as the CLI exports`, async () => told.points > 100 && (await places()) === told.points);
  await drawn(page);
  await page.evaluate(() => { // what is on the screen, as numbers
    strata.look = () => {
      const { canvas } = strata.stage;
      strata.stage.draw();
      const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
      copy.drawImage(canvas, 0, 0);
      return copy.getImageData(0, 0, canvas.width, canvas.height);
    };
    strata.seen = strata.look();
  });
  await picture(page, "inferred");
  await press(page, '#switches input[data-layer="inferred"]');
  await drawn(page);
  const { changed, onLines } = await page.evaluate(() => {
    const { data, width, height } = strata.look();
    const all = Array.from({ length: width * height }, (_, i) => i);
    const others = all.filter((i) => [0, 1, 2].some((c) => data[4 * i + c] !== strata.seen.data[4 * i + c]));
    const lines = others.filter((i) => ((i % width) - Math.floor(i / width) + height + 8 * height) % 8 >= 4);
    return { changed: others.length, onLines: lines.length };
  });
  expect(changed > 100 && onLines > 0.95 * changed, `it is drawn, hatched: ${changed} pixels, ${onLines} on every other stripe`);
  await press(page, '#switches input[data-layer="inferred"]');
  server.strata("scan", "delete", "halves", "whole/0", "--yes");
  await within(20000, "it goes with the scan that it is from, on the open page", async () => !(await layerSwitch(page, "inferred")) && (await places()) === 0);
  await page.close();
}

async function testMeasure(page) {
  await page.$eval("#cut", (slider) => { // the plan under the bridge has cut the deck off
    slider.value = slider.max;
    slider.dispatchEvent(new Event("input"));
  });
  await page.evaluate(() => strata.stage.look([0, -30, 30, 0, 0, 0]));
  await pause(300);
  await page.waitForFunction("strata.view.settled && !strata.view.due", { timeout: 120000 }); // finer tiles
  await drawn(page);
  await page.focus("canvas");
  await page.keyboard.press("m");
  await click(page, { x: 0, y: 0, z: 3.4 });
  await click(page, { x: 0, y: -14, z: 0 });
  const measure = await page.evaluate("strata.measure");
  const told = Math.hypot(measure.to.x - measure.from.x, measure.to.y - measure.from.y, measure.to.z - measure.from.z);
  expect(Math.abs(measure.rise + 3.4) < 0.5 && Math.abs(measure.length - told) < 1e-6 && Math.abs(measure.length - 14.4) < 1, `measured: ${await message(page)}; from ${JSON.stringify(measure.from)}`);
  await drawn(page);
  await picture(page, "measure");
  await page.keyboard.press("Escape");
}

async function testTouchAndKeys(page) {
  const view = () => page.evaluate(() => strata.stage.view());
  const far = (a) => Math.hypot(a[0] - a[3], a[1] - a[4], a[2] - a[5]);
  const client = await page.createCDPSession();
  const touch = (type, points) => client.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const before = await view();
  await touch("touchStart", [[700, 400]]);
  for (let i = 1; i < 6; ++i) await touch("touchMove", [[700 + 20 * i, 400]]);
  await touch("touchEnd", []);
  const moved = await view();
  expect(Math.hypot(moved[3] - before[3], moved[4] - before[4]) > 1, "a finger moves the map");
  await touch("touchStart", [[650, 400], [750, 400]]);
  for (let i = 1; i < 6; ++i) await touch("touchMove", [[650 - 20 * i, 400], [750 + 20 * i, 400]]);
  await touch("touchEnd", []);
  const pinched = await view();
  expect(far(pinched) < 0.9 * far(moved), "two fingers bring it nearer");
  expect(await page.evaluate("strata.levels === null"), "and neither is a click");
  await page.focus("canvas");
  await page.keyboard.press("ArrowRight");
  expect((await view())[3] !== pinched[3], "an arrow moves it");
  await page.keyboard.press("-");
  expect(far(await view()) > 1.1 * far(pinched), "the key - goes away");
  await page.evaluate(() => strata.stage.look([0, -30, 30, 0, 0, 0]));
  await drawn(page);
  await page.keyboard.press("Enter");
  await within(5000, "Enter clicks in the middle", () => page.evaluate("strata.levels?.length > 0"));
  await picture(page, "keyboard");
  await page.keyboard.press("Escape");
  await page.$eval("#jobs", (jobs) => (jobs.open = true));
  const reached = new Set();
  for (let i = 0; i < 60; ++i) {
    await page.keyboard.press("Tab");
    reached.add(await page.evaluate(() => document.activeElement.id || document.activeElement.textContent.slice(0, 20)));
  }
  const missing = ["cut", "layer", "measure", "floors", "link", "picture", "dark", "job-kind"].filter((id) => !reached.has(id));
  expect(!missing.length, `Tab reaches ${reached.size} controls, misses ${missing.join(" ") || "none"}`);
  const unnamed = await page.$$eval("button, input, select", (all) => all.filter((one) => !one.textContent.trim() && !one.ariaLabel && !one.labels?.length).map((one) => one.id));
  expect(!unnamed.length, `controls without a name: ${unnamed.join(" ") || "none"}`);
  await page.setViewport({ width: 360, height: 560 });
  await pause(300);
  await drawn(page);
  const panel = await page.$eval("#panel", (node) => node.getBoundingClientRect().toJSON());
  expect(panel.bottom <= 560 && panel.right <= 360, "the panel fits into a small window");
  await picture(page, "small");
  await page.setViewport({ width: 1280, height: 800 });
}

// From the server's word that the scan is safe (its log of the call) to the frame that shows the last tile of it.
async function testLatency(server, page) {
  await page.evaluate(() => strata.stage.look([0, -30, 30, 0, 0, 0]));
  await pause(300);
  await page.waitForFunction("strata.view.settled && !strata.view.due", { timeout: 120000 });
  const one = path.join(work, "one");
  fs.mkdirSync(one);
  const scans = path.join(work, "world/over/scans");
  const file = fs.readdirSync(scans).sort()[30];
  fs.copyFileSync(path.join(scans, file), path.join(one, file));
  const uploads = () => (server.log.match(/method=Scans.Upload code=OK/g) ?? []).length;
  const before = uploads();
  let acknowledged = 0;
  const note = () => (acknowledged ||= uploads() > before ? Date.now() : 0);
  server.child.stderr.on("data", note);
  const asked = Date.now();
  const upload = spawn(path.join(build, "client/cli/strata"), ["--server", server.address, "scan", "import", "bridge", one, "--poses", path.join(work, "world/over/poses_initial.txt"), "--pose-format", "index-tum", "--trajectory", "single", "--align", "off"]);
  await new Promise((end) => upload.on("exit", end));
  await within(5000, "the upload is acknowledged", () => acknowledged > 0);
  const fresh = () => page.evaluate((since) => strata.view.shown().filter(({ at }) => at >= since).map(({ seenAt }) => seenAt ?? Infinity), asked);
  await within(30000, "tiles of the scan come", async () => (await fresh()).length > 0);
  await pause(2000); // for the last of them
  const times = await fresh();
  const seen = Math.max(...times);
  const [told, listed, held] = await page.evaluate((since) => [strata.view.newsAt, strata.view.listedAt, strata.view.shown().reduce((last, { at }) => (at >= since ? Math.max(last, at) : last), 0)], asked);
  expect(times.length > 0 && seen < Infinity, `seen ${seen - acknowledged} ms after its acknowledgement (the server told after ${told - acknowledged}, tiles were listed ${listed - told} later, all there ${held - listed}, seen ${seen - held}), ${times.length} tiles`);
}

async function testLive(server, page) {
  const before = await page.evaluate("strata.view.updates");
  const upload = spawn(path.join(build, "client/cli/strata"), ["--server", server.address, "scan", "import", "bridge", path.join(work, "world/over/scans"), "--poses", path.join(work, "world/over/poses_initial.txt"), "--pose-format", "index-tum", "--trajectory", "third"]);
  const done = new Promise((end) => upload.on("exit", end));
  await within(20000, "tiles change while a robot uploads", async () => (await page.evaluate("strata.view.updates")) > before);
  await done;
}

async function testRestart(server, page) {
  server.child.kill();
  await new Promise((end) => server.child.on("exit", end));
  await within(5000, "that the server has gone is said", async () => /trying again/.test(await message(page)));
  const again = await serve("maps", "--listen", server.address, "--web", server.url.replace("http://", ""));
  await within(8000, "after its restart the page follows again", () => page.evaluate("strata.view.watching === true"));
  return again;
}

async function testClosedTab(server, page) {
  const watches = () => (server.log.match(/method=Maps.Watch code=CANCELLED/g) ?? []).length;
  const before = watches();
  await page.close();
  await within(5000, "a closed tab frees its watch", () => watches() > before);
}

async function testToken(browser) {
  const tokens = path.join(work, "tokens");
  const token = execFileSync(path.join(build, "server/stratad"), ["token", "add", "--tokens", tokens, "viewer", "--right", "read", "--all-maps"], { encoding: "utf8" }).trim();
  const server = await serve("guarded", "--tokens", tokens);
  const page = await open(browser, server.url);
  expect(await page.$eval("#token-form", (form) => !form.hidden), "a server with tokens asks for one");
  await page.type("#token", token);
  await page.keyboard.press("Enter");
  await within(5000, "a token opens it", () => page.$eval("#token-form", (form) => form.hidden));
  const stratad = (...words) => execFileSync(path.join(build, "server/stratad"), ["token", ...words, "--tokens", tokens], { encoding: "utf8" }).trim();
  const admin = stratad("add", "maker", "--right", "admin", "--all-maps");
  server.token = admin;
  await pause(1500);
  server.strata("map", "create", "yard");
  await page.reload();
  await page.waitForFunction("window.strata?.ready", { timeout: 120000 });
  await press(page, "#jobs > summary");
  stratad("revoke", "viewer");
  await within(15000, "a token that holds no longer is asked for again, the page staying open", () => page.$eval("#token-form", (form) => !form.hidden));
  await page.type("#token", admin);
  await page.keyboard.press("Enter");
  await within(15000, "with another the page goes on", () => page.evaluate("document.getElementById('token-form').hidden && strata.ready && strata.view.watching === true"));
  await page.close();
}

try {
  const server = await mapTheBridge();
  await testDecoder(server);
  const browser = await puppeteer.launch({ executablePath: chromium, headless: true, userDataDir: path.join(work, "profile"), args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"] });
  ended.push(() => browser.close());
  testBundle();
  await testTree();
  const begun = Date.now();
  const page = await open(browser, server.url);
  expect(await page.evaluate("strata.view.surfaces() > 0"), `the map is seen after ${Date.now() - begun} ms`);
  if (!options["--quick"]) {
    await testMap(server, page);
    await testMouse(page);
    await testPlans(server, page);
    await testLink(server, browser, page);
    await testLevels(page);
    await testPanels(server, page);
  }
  await testObjects(server, browser);
  await testInferred(server, browser);
  await testMapList(server, browser);
  await testManyMaps(server, browser);
  await page.bringToFront();
  await testMeasure(page);
  await testTouchAndKeys(page);
  await testLatency(server, page);
  await testLive(server, page);
  await testClosedTab(await testRestart(server, page), page);
  await testToken(browser);
} catch (error) {
  expect(false, error.stack);
} finally {
  for (const end of ended.reverse()) await end();
  fs.rmSync(work, { recursive: true, force: true });
}
process.exit(failures ? 1 : 0);
