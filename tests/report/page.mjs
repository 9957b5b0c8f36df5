// SPDX-License-Identifier: MIT OR Apache-2.0
// The page of `batwing report` in a browser: opens from a file, draws, moves, fits a phone, prints.
//
//     node page.mjs CHROMIUM REPORT.html PICTURES [OTHER.html ...]
//
// CHROMIUM is the path of a Chromium; screenshots and the printed page go into the directory
// PICTURES. Of OTHER pages (a study, a tolerance analysis, a search, a design without a dome, full wave) the
// layout alone is tested.
// Prints one line for each claim and ends with code 1 if one of them fails. Needs playwright-core of
// package.json.

import { mkdirSync, statSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";
import { texts } from "./texts.mjs";

const [executablePath, report, pictures, ...others] = process.argv.slice(2);
if (!pictures) {
  console.error("usage: node page.mjs CHROMIUM REPORT.html PICTURES [OTHER.html ...]");
  process.exit(2);
}
mkdirSync(pictures, { recursive: true });
const address = (file) => pathToFileURL(resolve(file)).href;
const failures = [];
function claim(holds, text) {
  console.log(`${holds ? "ok    " : "FAILED"} ${text}`);
  if (!holds) failures.push(text);
}

const DESKTOP = { width: 1280, height: 900 };
const WIDTHS = [400, 800, 1400];
const PHONE = { width: 360, height: 740 };
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
const complaints = [];
async function open(options, { before, file = report } = {}) {
  const url = address(file);
  const context = await browser.newContext(options);
  if (before) await context.addInitScript(before);
  const page = await context.newPage();
  page.on("console", (message) => {
    // What drivers of software rendering say of their speed is none of the page's.
    if (/GL Driver Message/.test(message.text())) return;
    if (["error", "warning"].includes(message.type())) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("request", (request) => {
    if (request.url() !== url) complaints.push(`asked for ${request.url()}`);
  });
  const start = performance.now();
  await page.goto(url, { waitUntil: "load" });
  // Two frames: what the scripts drew is on the screen.
  await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
  return { context, page, seconds: (performance.now() - start) / 1000 };
}

// Opens every folded part, and waits until what lies in them is drawn.
async function unfold(page) {
  await page.evaluate(() => { for (const fold of document.querySelectorAll("details")) fold.open = true; });
  await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
}

// Layout of `file` at all widths, for the first model of each of its designs.
async function layout(file) {
  for (const width of WIDTHS) {
    const { context, page } = await open({ viewport: { width, height: 900 } }, { file });
    const name = `${basename(file)} at ${width} px`;
    const choices = await page.locator("#choice option").evaluateAll((options) => options
      .filter((option, i) => i === 0 || option.dataset.design !== options[i - 1].dataset.design).map((option) => option.value));
    await page.screenshot({ path: join(pictures, `${basename(file, ".html")}-${width}.png`) });
    await unfold(page);
    // The 3-D view is drawn when it comes near the screen.
    if (await page.locator("#view-3d").count()) {
      await page.locator("#canvas-3d").scrollIntoViewIfNeeded();
      await page.locator("#angles-3d button").first().waitFor();
    }
    for (const value of choices.length ? choices : [null]) {
      if (value !== null && choices.length > 1) await page.locator("#choice select").selectOption(value);
      await page.evaluate(() => window.scrollTo({ top: 0, behavior: "instant" }));
      const { count, cut, over } = await page.evaluate(texts);
      claim(count > 20, `${name}, choice ${value}: ${count} texts are seen`);
      claim(cut.length === 0, `${name}, choice ${value}: no text is cut${cut.length ? `: ${cut.slice(0, 5).join("; ")}` : ""}`);
      claim(over.length === 0, `${name}, choice ${value}: no text stands over another${over.length ? `: ${over.slice(0, 5).join("; ")}` : ""}`);
      const empty = await page.locator("main section:visible").evaluateAll((sections) => sections.filter((s) => s.innerText.trim().split("\n").length < 2).map((s) => s.id));
      claim(empty.length === 0, `${name}, choice ${value}: no part is empty${empty.length ? `: ${empty}` : ""}`);
      const bare = await page.locator("main :is(h2, h3):visible").evaluateAll((heads) => heads.filter((head) => {
        const next = (head.closest("summary") || head).nextElementSibling;
        return !next || !(next.innerText.trim() || next.querySelector("svg, canvas, img, button"));
      }).map((head) => head.innerText));
      claim(bare.length === 0, `${name}, choice ${value}: something stands below every heading${bare.length ? `: ${bare}` : ""}`);
    }
    await context.close();
  }
}

// Nothing ticked leaves words in place of pictures.
async function emptyStates(page) {
  const boxes = page.locator("#controls-far input[name=curve]:visible");
  const count = await boxes.count();
  for (let i = 0; i < count; i += 1) await boxes.nth(i).uncheck();
  const empty = page.locator("#far-field .empty");
  claim(await empty.isVisible(), `no model ticked: ${await empty.innerText()}`);
  claim((await page.locator("#far-field figure:visible").count()) === 0, "and no empty axes");
  for (let i = 0; i < count; i += 1) await boxes.nth(i).check();
  claim(!(await empty.isVisible()) && (await page.locator("#far-field figure:visible").count()) === 2, "ticked again, the far fields are back");
}

// Pixels of the 3-D view that are not background.
const inked = (page) => page.locator("#canvas-3d").evaluate((canvas) => {
  const gl = canvas.getContext("webgl");
  const pixels = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return pixels.filter((_, k) => k % 4 === 3).filter((alpha) => alpha > 0).length;
});

// The 3-D view: filters, and from a peak to its ring in two clicks.
async function inThreeDimensions(page) {
  const readout = page.locator("#readout-3d");
  const paths = async () => Number((await readout.innerText()).match(/^(\d+) of/)?.[1] ?? 0);
  // The view is made as soon as it comes near the screen.
  await page.locator("#view-3d").scrollIntoViewIfNeeded();
  await page.locator("#angles-3d button").first().waitFor();
  const few = await paths();
  claim(few > 10 && few <= 60, `${few} paths are drawn in three dimensions at first`);
  const names = await page.locator("#labels-3d span").allInnerTexts();
  claim(names.length >= 2 && names.every((name) => /^[xyz] [\d.]+ mm$/.test(name)), `axes have names and lengths: ${names.join(", ")}`);
  const every = page.locator("#controls-3d input[name=show]").last();
  await every.check();
  const all = await paths();
  claim(all >= 100, `all ${all} paths are drawn when asked for`);
  const ink = await inked(page);
  claim(ink > 10_000, `the view has ${ink} pixels of package, rays and far field`);
  await page.locator("#view-3d").screenshot({ path: join(pictures, "view-3d.png") });
  await page.locator("#controls-3d input[name=fate]").first().uncheck();
  const others = await paths();
  claim(others < all && (await inked(page)) < ink, `without the light that escaped upwards ${others} paths are left`);
  for (const box of await page.locator("#controls-3d input[name=fate]:visible").all()) await box.uncheck();
  claim(/No fate is ticked/.test(await readout.innerText()), "no fate ticked: it says so");
  for (const box of await page.locator("#controls-3d input[name=fate]:visible").all()) await box.check();
  const bars = page.locator("#angles-3d button");
  const heights = await bars.evaluateAll((buttons) => buttons.map((b) => parseFloat(b.firstChild.style.height)));
  await bars.nth(heights.indexOf(Math.max(...heights))).click();
  const inPeak = await paths();
  claim(inPeak > 0 && inPeak < all, `one click on the brightest polar angle leaves ${inPeak} paths`);
  const first = page.locator("#ranking-rings button").first();
  claim(/: \d.* ± .* %/.test(await first.innerText()), `and ranks the rings: ${await first.innerText()}`);
  await first.click();
  const ofRing = await paths();
  claim(ofRing > 0 && ofRing <= inPeak, `a second click leaves the ${ofRing} paths of that ring`);
  claim((await page.locator("#ranking-rings button[aria-pressed=true]").count()) === 1, "which is marked for screen readers");
  await page.locator("#view-3d").screenshot({ path: join(pictures, "view-3d-ring.png") });
  await page.locator("#reset-3d").click();
  claim((await paths()) === all, "all rays are back");
  const box = await page.locator("#canvas-3d").boundingBox();
  await page.mouse.click(box.x + 0.7 * box.width, box.y + 0.35 * box.height);
  claim((await page.locator("#angles-3d button[aria-pressed=true]").count()) === 1, "a click on the far field chooses a polar angle");
  await page.locator("#reset-3d").click();
  const before = await page.locator("#canvas-3d").evaluate((canvas) => canvas.toDataURL());
  await page.locator("#canvas-3d").focus();
  await page.keyboard.press("ArrowLeft");
  claim((await page.locator("#canvas-3d").evaluate((canvas) => canvas.toDataURL())) !== before, "arrow keys turn the view");
  const named = await page.locator("#canvas-3d").getAttribute("aria-label");
  claim(/\d+ of \d+ paths/.test(named), `the view says in words what it shows: ${named.slice(0, 70)}`);
}

const megabytes = statSync(report).size / 1e6;
claim(megabytes < 6, `the page has ${megabytes.toFixed(2)} MB, under 6 MB`);

{
  const { context, page, seconds } = await open({ viewport: DESKTOP });
  // Catches a page that hangs; how fast it opens depends on what else runs.
  claim(seconds < 10, `it opens and draws in ${seconds.toFixed(2)} s, under 10 s`);
  await page.screenshot({ path: join(pictures, "desktop.png") });
  const firstScreen = await page.locator(".verdict:visible, #plot-section figure:visible").evaluateAll((nodes) => nodes.map((node) => node.getBoundingClientRect().top));
  claim(firstScreen.length === 2 && firstScreen.every((top) => top < DESKTOP.height / 2), `picture and verdict stand on the first screen (${firstScreen.map(Math.round)})`);
  const open0 = await page.locator("details.part[open]").count();
  claim((await page.locator("details.part").count()) > open0, "parts after the far field are folded");
  await page.locator("nav a[href='#ledger']").click();
  claim(await page.locator("#ledger table").first().isVisible(), "a link to a folded part opens it");
  await unfold(page);
  const html = (id) => page.locator(`#${id}`).evaluate((node) => node.innerHTML);
  const drawn = async (id, what, least) => {
    const count = await page.locator(`#${id} svg ${what}`).count();
    claim(count >= least, `${id} shows ${count} ${what}`);
  };
  if (await page.locator("#compared").count()) await drawn("plot-merit", "circle", 4);
  await drawn("plot-far", "polyline", 1);
  await drawn("plot-far-polar", "polyline", 1);
  await drawn("plot-profile", "polyline", 2);
  await drawn("plot-ledger", "polygon", 2);
  const colours = await page.locator("#plot-map figure:not([hidden]) image").first().evaluate(async (image) => {
    const picture = new Image();
    picture.src = image.getAttribute("href");
    await picture.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [picture.width, picture.height];
    const context = canvas.getContext("2d");
    context.drawImage(picture, 0, 0);
    const pixels = context.getImageData(0, 0, canvas.width, canvas.height).data;
    const seen = new Set();
    for (let k = 0; k < pixels.length; k += 4) seen.add(`${pixels[k]},${pixels[k + 1]},${pixels[k + 2]}`);
    return seen.size;
  });
  claim(colours > 50, `the map has ${colours} colours`);

  const changes = async (id, what, act) => {
    const before = await html(id);
    await act();
    claim((await html(id)) !== before, `${what} changes ${id}`);
  };
  await changes("plot-far", "switching a model off", () => page.locator("#controls-far input[type=checkbox]").first().uncheck());
  await changes("plot-far", "switching it on", () => page.locator("#controls-far input[type=checkbox]").first().check());
  await changes("plot-far", "another cut", () => page.locator("#controls-far select").selectOption({ index: 1 }));
  await changes("plot-far-polar", "another scale", () => page.locator("#controls-far input[value=relative]").check());
  const shown = (id) => page.locator(`#${id} figure:not([hidden]) svg[role=img]`);
  await shown("plot-far").scrollIntoViewIfNeeded();
  const far = await shown("plot-far").boundingBox();
  await page.mouse.move(far.x + far.width / 2, far.y + far.height / 2);
  const read = await page.locator("#plot-far .readout").first().innerText();
  claim(/θ = .*±/.test(read), `the far field is read with its error: ${read.slice(0, 60)}`);
  const scales = await page.locator("#plot-map figure:not([hidden])").evaluateAll((figures) => figures.map((f) => f.dataset.scale));
  claim(scales.join() === "linear,logarithmic", `the map stands on both scales (${scales})`);
  await changes("plot-profile", "pointing at the map", async () => {
    await shown("plot-map").first().scrollIntoViewIfNeeded();
    const map = await shown("plot-map").first().boundingBox();
    await page.mouse.move(map.x + 0.3 * map.width, map.y + 0.6 * map.height);
  });
  await changes("plot-map", "an arrow key on the map", async () => {
    await shown("plot-map").first().focus();
    await page.keyboard.press("ArrowRight");
  });
  const value = await page.locator("#plot-map .readout").innerText();
  claim(/x = .* mm, y = .* mm:.* ± /.test(value), `the map is read with its error: ${value.slice(0, 80)}`);

  if (await page.locator("#controls-bsdf input[type=range]").count()) {
    await drawn("plot-orders", "rect[data-order]", 10);
    await drawn("plot-lobe", "line", 5);
    await drawn("plot-albedo", "polyline", 3);
    const totals = async () => {
      const shares = await page.locator("#plot-orders rect[data-share]").evaluateAll((bars) => bars.map((bar) => Number(bar.dataset.share)));
      return shares.reduce((a, b) => a + b, 0);
    };
    const angle = page.locator("#controls-bsdf input[type=range]").first();
    let worst = 0;
    for (const share of [0, 0.2, 0.45, 0.7, 1]) {
      const before = await html("plot-orders");
      await angle.evaluate((input, at) => {
        input.value = Math.round(Number(input.min) + at * (Number(input.max) - Number(input.min)));
        input.dispatchEvent(new Event("input"));
      }, share);
      claim((await html("plot-orders")) !== before, `the slider of the incident angle moves the orders (at ${share})`);
      worst = Math.max(worst, Math.abs((await totals()) - 1));
    }
    claim(worst < 2e-3, `orders add up to 1 within ${worst.toExponential(1)} at every angle tried`);
    await angle.focus();
    await changes("plot-lobe", "an arrow key on the slider", () => page.keyboard.press("ArrowLeft"));
    await changes("plot-lobe", "s instead of unpolarised", () => page.locator("#controls-bsdf input[value=s]").check());
    await changes("plot-orders", "light from air", () => page.locator("#controls-bsdf input[value='1']").check());
    const ky = page.locator("#controls-bsdf select").nth(1);
    if (await ky.isVisible()) {
      await changes("plot-orders", "another ky", () => ky.selectOption({ index: 1 }));
      const total = await totals();
      claim(Math.abs(total - 1) < 2e-3, `orders add up to ${total.toFixed(5)} there too`);
    }
    const band = page.locator("#controls-bsdf select").nth(0);
    if ((await band.locator("option").count()) > 1) await changes("plot-orders", "another band", () => band.selectOption({ index: 0 }));
    await changes("plot-lobe", "more smearing", () => page.locator("#controls-bsdf input[type=range]").last().press("ArrowRight"));
    await page.locator("#bsdf").screenshot({ path: join(pictures, "scattering.png") });
  }
  await drawn("plot-section", "polyline", 50);
  for (const [id, head] of [["csv-far", "theta_deg,"], ["csv-profile", "profile,position_mm,"]]) {
    await page.evaluate(() => document.addEventListener("copy", () => { window.copied = document.activeElement.value; }, { once: true }));
    await page.locator(`#${id}`).click();
    const text = await page.evaluate(() => window.copied);
    const lines = text.trim().split("\n");
    const cells = lines.map((line) => line.replaceAll(/"[^"]*"/g, "").split(",").length);
    claim(text.startsWith(head) && lines.length > 20 && new Set(cells).size === 1, `${id}: ${lines.length} lines of ${cells[0]} columns are copied: ${lines[0].slice(0, 60)}`);
  }
  const facts = await page.locator("#simulated details dt").allInnerTexts();
  claim(["dome", "LED", "mirror", "array", "plane"].every((fact) => facts.includes(fact)), `it says what was simulated: ${facts.join(", ")}`);
  await emptyStates(page);
  await inThreeDimensions(page);
  const designs = await page.locator("#choice option").evaluateAll((options) => options.map((option) => option.dataset.design));
  if (new Set(designs).size > 1) {
    await page.locator("#choice select").selectOption(String(designs.length - 1));
    const shown = await page.locator("main [data-design]:visible").evaluateAll((nodes) => [...new Set(nodes.map((node) => node.dataset.design))]);
    claim(shown.join() === designs.at(-1), `one choice of the design holds for every part: ${shown}`);
    claim((await page.locator(".verdict:visible h3").innerText()).startsWith(designs.at(-1)), "and for the verdict");
  }
  const unnamed = await page.locator("input, select").evaluateAll((fields) => fields.filter((f) => !f.labels.length).length);
  claim(unnamed === 0, "every control has a label");
  const wordless = await page.locator("button").evaluateAll((buttons) => buttons.filter((b) => !(b.getAttribute("aria-label") || b.textContent.trim())).length);
  claim(wordless === 0, "every button has words");
  const mute = await page.locator("figure svg[role=img]").evaluateAll((plots) => plots.filter((p) => !p.getAttribute("aria-label")).length);
  claim(mute === 0, "every plot says in words what it shows");
  const pdf = await page.pdf({ path: join(pictures, "printed.pdf"), format: "A4" });
  claim(pdf.length > 50_000 && pdf.subarray(0, 5).toString() === "%PDF-", `it prints: ${(pdf.length / 1e6).toFixed(2)} MB of PDF`);
  await page.emulateMedia({ media: "print" });
  claim(!(await page.locator("#controls-far").isVisible()), "controls are not printed");
  await context.close();
}
{
  const { context, page } = await open({ viewport: PHONE, deviceScaleFactor: 2, isMobile: true, hasTouch: true });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  claim(wide <= PHONE.width, `a phone of ${PHONE.width} px scrolls no way but down (${wide} px)`);
  const sideways = await page.evaluate(() => [...document.querySelectorAll("main *")]
    .filter((node) => /auto|scroll/.test(getComputedStyle(node).overflowX) && node.scrollWidth > node.clientWidth + 1)
    .map((node) => node.id || node.className || node.tagName));
  claim(sideways.length === 0, `no part of it scrolls sideways${sideways.length ? `: ${sideways.join(", ")}` : ""}`);
  await page.screenshot({ path: join(pictures, "phone.png"), fullPage: true });
  await context.close();
}
{
  // Without WebGL the page says so and still ranks.
  const { context, page } = await open({ viewport: DESKTOP }, { before: () => { HTMLCanvasElement.prototype.getContext = ((whole) => function (kind, ...more) {
    return kind === "webgl" ? null : whole.call(this, kind, ...more);
  })(HTMLCanvasElement.prototype.getContext); } });
  await unfold(page);
  await page.locator("#view-3d").scrollIntoViewIfNeeded();
  await page.locator("#angles-3d button").first().waitFor();
  claim(await page.locator("#without-3d").isVisible(), "without WebGL it says so");
  await page.locator("#angles-3d button").first().click();
  claim((await page.locator("#ranking-rings button").count()) > 0, "and still ranks the rings");
  await context.close();
}
{
  const { context, page } = await open({ viewport: DESKTOP, colorScheme: "dark" });
  const dark = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  claim(/^rgb\((\d{1,2}), /.test(dark), `the dark scheme is followed (${dark})`);
  await page.screenshot({ path: join(pictures, "dark.png"), fullPage: true });
  await context.close();
}
for (const file of [report, ...others]) await layout(file);
claim(complaints.length === 0, `no error, no warning, no request${complaints.length ? `: ${complaints.slice(0, 3).join(" | ")}` : ""}`);
await browser.close();
console.log(failures.length ? `${failures.length} claims failed` : "all claims hold");
process.exit(failures.length ? 1 : 0);
