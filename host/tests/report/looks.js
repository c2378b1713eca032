// What a reader would stumble over, as a list of sentences: read by test_in_the_browser.py.
() => {
  const found = [];
  const box = (node) => node.getBoundingClientRect();
  const shown = (node) => { const b = box(node); return b.width > 0 && b.height > 0 && getComputedStyle(node).visibility !== "hidden"; };
  const name = (node) => `${node.tagName.toLowerCase()} "${(node.textContent || "").trim().replace(/\s+/g, " ").slice(0, 50)}"`;

  // Nothing is wider than the page, and no table is cut off.
  if (document.documentElement.scrollWidth > innerWidth) found.push(`the page is ${document.documentElement.scrollWidth} px wide on ${innerWidth}`);
  for (const node of document.querySelectorAll(".scroll")) if (node.scrollWidth > node.clientWidth + 1) found.push(`clipped by ${node.scrollWidth - node.clientWidth} px: ${name(node)}`);

  // No text lies over another, nor is cut off at a plot's edge.
  const texts = [...document.querySelectorAll("h1, h2, p, th, td, caption, figcaption, button, dt, dd, li a, output, svg text")].filter((n) => shown(n) && n.textContent.trim());
  const boxes = texts.map((node) => { const range = document.createRange(); range.selectNodeContents(node); return node instanceof SVGElement ? box(node) : range.getBoundingClientRect(); });
  for (let i = 0; i < texts.length; i++) {
    for (let j = i + 1; j < texts.length; j++) {
      if (texts[i].contains(texts[j]) || texts[j].contains(texts[i])) continue;
      const across = Math.min(boxes[i].right, boxes[j].right) - Math.max(boxes[i].left, boxes[j].left);
      const down = Math.min(boxes[i].bottom, boxes[j].bottom) - Math.max(boxes[i].top, boxes[j].top);
      if (across > 2 && down > 3) found.push(`${name(texts[i])} lies over ${name(texts[j])} by ${across.toFixed(0)} x ${down.toFixed(0)} px`);
    }
    const plot = texts[i].closest("svg");
    if (plot && (boxes[i].left < box(plot).left - 1 || boxes[i].right > box(plot).right + 1)) found.push(`cut off: ${name(texts[i])}`);
    const size = texts[i] instanceof SVGElement ? boxes[i].height : parseFloat(getComputedStyle(texts[i]).fontSize);
    if (size < 10.5) found.push(`only ${size.toFixed(1)} px: ${name(texts[i])}`);
  }

  // Contrast, WCAG AA: 4.5 to 1 for text, 3 to 1 for what is drawn.
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => { canvas.clearRect(0, 0, 1, 1); canvas.fillStyle = colour; canvas.fillRect(0, 0, 1, 1); return [...canvas.getImageData(0, 0, 1, 1).data]; };
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)).reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const contrast = (a, b) => { const [x, y] = [light(a), light(b)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
  const behind = (node) => { for (let n = node; n; n = n.parentElement) { const c = rgba(getComputedStyle(n).backgroundColor); if (c[3] === 255) return c; } return [255, 255, 255]; };
  for (const node of texts) {
    const style = getComputedStyle(node);
    const c = contrast(rgba(node instanceof SVGElement ? style.fill : style.color), behind(node));
    if (c < 4.5) found.push(`contrast ${c.toFixed(2)}: ${name(node)}`);
  }
  for (const path of document.querySelectorAll(".keys i, .motion rect[class]")) {
    const style = getComputedStyle(path);
    const colour = path.matches(".keys i") ? style.color : style.fill;
    if (rgba(colour)[3] < 255) continue;
    const c = contrast(rgba(colour), behind(path.parentElement));
    if (c < 3) found.push(`contrast ${c.toFixed(2)}: ${colour} ${path.className.baseVal || path.className}`);
  }

  // The same of what the plots letter and draw.
  for (const plot of document.querySelectorAll(".plot")) for (const chart of plot.charts) {
    const { ctx, width, height } = chart, ground = behind(chart.canvas), words = [];
    for (const scale of Object.values(chart.scales).filter((one) => one.options.ticks.display)) for (const { label, font, textOffset, options } of scale.getLabelItems(chart.chartArea)) {
      if (!label) continue;
      ctx.font = font.string;
      const wide = ctx.measureText(label).width, [x, y] = options.translation;
      const from = options.textAlign === "right" ? x - wide : options.textAlign === "left" ? x : x - wide / 2;
      words.push({ label, from, to: from + wide, top: y + textOffset - font.size / 2, size: font.size });
      if (from < -1 || from + wide > width + 1 || y > height) found.push(`cut off in a plot: ${label}`);
      if (font.size < 10.5) found.push(`only ${font.size} px in a plot: ${label}`);
      const c = contrast(rgba(options.color), ground);
      if (c < 4.5) found.push(`contrast ${c.toFixed(2)} in a plot: ${label}`);
    }
    words.forEach((a, i) => words.slice(i + 1).forEach((b) => {
      if (Math.min(a.to, b.to) - Math.max(a.from, b.from) > 1 && Math.abs(a.top - b.top) < a.size - 3) found.push(`${a.label} lies over ${b.label} in a plot`);
    }));
    for (const { borderColor, label } of chart.data.datasets) {
      const c = contrast(rgba(borderColor), ground);
      if (c < 3) found.push(`contrast ${c.toFixed(2)}: ${borderColor} of ${label}`);
    }
  }

  // What stands at one place in the panels of a column has one x.
  for (const plot of document.querySelectorAll(".plot")) {
    const spans = new Set(plot.charts.map(({ scales: { x } }) => `${x.min} to ${x.max}`));
    if (spans.size > 1) found.push(`panels of one column reach from ${[...spans].join(", ")}`);
  }
  return found;
}
