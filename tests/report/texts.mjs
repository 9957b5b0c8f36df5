// SPDX-License-Identifier: MIT OR Apache-2.0
// Texts of a page, for tests in a browser: a function that runs within the page.

// Every text that is seen: what lies outside the page, what a part or a picture cuts off, and what stands over another text.
export const texts = () => {
  const seen = (node) => {
    const style = getComputedStyle(node);
    return node.checkVisibility() && style.visibility !== "hidden" && style.display !== "none" && Number(style.opacity) > 0;
  };
  const found = [];
  const add = (words, owner, box, image) => {
    if (box.width < 1 || box.height < 1 || !words.trim()) return;
    // Letters take the middle of their line.
    const inset = image ? 0.2 * Math.min(box.width, box.height) : 0.12 * box.height;
    found.push({ words: words.trim().slice(0, 40), owner, left: box.left, right: box.right, top: box.top, bottom: box.bottom, inset, image });
  };
  // What parts that scroll down leave of a box.
  const scrolled = (owner, { left, right, width, top, bottom }) => {
    for (let node = owner; node && node !== document.body; node = node.parentElement) {
      if (getComputedStyle(node).overflowY === "visible") continue;
      const frame = node.getBoundingClientRect();
      [top, bottom] = [Math.max(top, frame.top), Math.min(bottom, frame.bottom)];
    }
    return { left, right, width, top, bottom, height: bottom - top };
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const owner = node.parentElement;
    if (!owner || owner.closest("script, style, noscript, option, title, .skip") || !node.data.trim() || !seen(owner)) continue;
    if (owner.closest("svg")) {
      const text = owner.closest("text");
      if (text && text.firstChild === node) add(text.textContent, text, text.getBoundingClientRect(), text.closest("svg"));
      continue;
    }
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const box of range.getClientRects()) add(node.data, owner, scrolled(owner, box), null);
  }
  const cut = [];
  const wide = document.documentElement.clientWidth;
  for (const text of found) {
    const { words, owner, left, right, top, bottom, image } = text;
    if (left < -1 || right > wide + 1) cut.push(`${words} (outside the page)`);
    if (image) {
      const box = image.getBoundingClientRect();
      if (left < box.left - 1 || right > box.right + 1 || top < box.top - 1 || bottom > box.bottom + 1) cut.push(`${words} (outside its picture)`);
    }
    for (let node = owner; node && node !== document.body; node = node.parentElement) {
      if (getComputedStyle(node).overflowX === "visible" || node.tagName === "svg" || node instanceof SVGElement) continue;
      const box = node.getBoundingClientRect();
      if (left < box.left - 1 || right > box.right + 1) cut.push(`${words} (cut off)`);
    }
  }
  const over = [];
  found.sort((a, b) => a.top - b.top);
  found.forEach((a, i) => {
    for (let j = i + 1; j < found.length && found[j].top < a.bottom; j += 1) {
      const b = found[j];
      if (a.owner === b.owner && !a.image) continue;
      const inset = Math.max(a.inset, b.inset, 1);
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (across > Math.min(inset, 3) && down > inset) over.push(`${a.words} | ${b.words}`);
    }
  });
  return { count: found.length, cut, over };
};
