'use strict';
// Plots with filters, tables that sort, and the viewer of pictures. All text from the data goes into text nodes.

const data = JSON.parse(document.getElementById('data').textContent);
const color = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const element = (tag, properties, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};
const signed = v => (v < 0 ? '−' : '+') + Math.abs(v).toFixed(3);
const short = v => v === 0 ? '0' : String(+v.toPrecision(3));

// ---- Tables: a click on a head sorts, a second one turns the order around.

// The number that a cell starts with, or NaN; a dash stands for a figure that does not exist.
const leading = text => {
  const found = /^[+−-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?/i.exec(text.trim());
  return found ? Number(found[0].replace('−', '-')) : NaN;
};

function sortBy(table, column, ascending) {
  const rows = [...table.tBodies[0].rows];
  const texts = new Map(rows.map(row => [row, row.cells[column]?.textContent.trim() ?? '']));
  const present = [...texts.values()].filter(text => text !== '-' && text !== '');
  const numeric = present.every(text => !Number.isNaN(leading(text)));
  const missing = text => text === '-' || text === '';
  rows.sort((a, b) => {
    const [x, y] = [texts.get(a), texts.get(b)];
    if (missing(x) || missing(y)) return missing(x) - missing(y);
    const order = numeric ? leading(x) - leading(y) : x.localeCompare(y, 'en', { numeric: true });
    return ascending ? order : -order;
  });
  table.tBodies[0].append(...rows);
  [...table.tHead.rows[0].cells].forEach((head, i) => {
    head.setAttribute('aria-sort', i !== column ? 'none' : ascending ? 'ascending' : 'descending');
  });
}

for (const table of document.querySelectorAll('table')) {
  if (!table.tHead || !table.tBodies[0]) continue;
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = element('button', { type: 'button' }, ...head.childNodes);
    button.addEventListener('click', () => sortBy(table, column, head.getAttribute('aria-sort') !== 'ascending'));
    head.scope = 'col';
    head.setAttribute('aria-sort', 'none');
    head.append(button);
  });
}

// ---- Plots

const hue = index => `hsl(${Math.round(index * 137.508) % 360} 70% ${color('--lightness')})`;

// Ends of an axis, a little beyond the values.
function ends(low, high, log) {
  if (!(low <= high)) return log ? [0.1, 10] : [0, 1];
  if (log) return [low / 1.25, high * 1.25];
  const margin = 0.06 * (high - low || Math.abs(high) || 1);
  return [low - margin, high + margin];
}

// Ticks of a logarithmic axis: powers of two, or 1, 2 and 5 times powers of ten.
function ticks(low, high, base) {
  const steps = base === 2 ? [1] : [1, 2, 5];
  const first = Math.floor(Math.log(low) / Math.log(base));
  const last = Math.ceil(Math.log(high) / Math.log(base));
  const all = [];
  for (let power = first; power <= last; power++) all.push(...steps.map(step => step * base ** power));
  return all.filter(v => v >= low && v <= high);
}

// Draws into a figure; a later call replaces the drawing. A series has a name, a colour, points {x, y, text}, and is a
// line, dots (filled or hollow), or both. `log` has the base of each axis, or 0 for a linear one; `band` is the width
// of the noise around 0 on the x axis.
function draw(figure, { axes, series, log, band }) {
  figure.uplot?.destroy();
  const visible = p => (!log[0] || p.x > 0) && (!log[1] || p.y > 0);
  series = series.map(s => ({ ...s, points: s.points.filter(visible) }));
  const points = series.flatMap(s => s.points.map(p => ({ ...p, dots: s.dots })));
  const xs = [...new Set(points.map(p => p.x))].sort((a, b) => a - b);
  const column = s => {
    const found = new Map(s.points.map(p => [p.x, p.y]));
    return xs.map(x => found.get(x) ?? null);
  };
  const range = (values, base) => ends(Math.min(...values), Math.max(...values), base);
  const scale = (values, base) => ({
    time: false, distr: base ? 3 : 1, log: base || 10, range: () => range(values, base),
  });
  const axis = (label, size, base) => ({
    label, size, ...(base && { splits: (_u, _i, low, high) => ticks(low, high, base), filter: (_, splits) => splits }),
    labelSize: 22, labelFont: '13px system-ui', font: '12px system-ui', stroke: () => color('--text'),
    grid: { stroke: () => color('--line'), width: 1 }, ticks: { stroke: () => color('--line') },
    values: (_, splits) => splits.map(v => v == null ? '' : short(v)),
  });
  const shade = u => {
    if (!band) return;
    const { left, width, top, height } = u.bbox;
    const at = x => Math.min(Math.max(u.valToPos(x, 'x', true), left), left + width);
    const [from, to] = [log[0] ? left : at(-band), at(band)];
    u.ctx.fillStyle = color('--band');
    u.ctx.fillRect(from, top, to - from, height);
  };
  const options = {
    width: Math.max(figure.clientWidth, 240), height: 340, legend: { show: false }, cursor: { show: false },
    scales: { x: scale(points.map(p => p.x), log[0]), y: scale(points.map(p => p.y), log[1]) },
    axes: [axis(axes[0], 36, log[0]), axis(axes[1], 54, log[1])],
    hooks: { drawClear: [shade] },
    series: [{}, ...series.map(s => ({
      stroke: s.color, width: s.line ? 2 : 0, spanGaps: true, dash: s.dash, paths: s.line ? undefined : () => null,
      points: { show: s.dots, size: 9, width: 2, stroke: s.color, fill: s.hollow ? color('--back') : s.color },
    }))],
  };
  // Without points uPlot has no scale to draw axes with.
  const columns = xs.length ? [xs, ...series.map(column)] : [[1], ...series.map(() => [null])];
  figure.uplot = new uPlot(options, columns, figure.querySelector('.canvas'));
  figure.dataset.points = points.filter(p => p.dots).length;

  const over = figure.uplot.over;
  const tip = element('div', { className: 'tip', hidden: true });
  over.append(tip);
  const hover = event => {
    const place = over.getBoundingClientRect();
    const [x, y] = [event.clientX - place.left, event.clientY - place.top];
    const away = p => Math.hypot(figure.uplot.valToPos(p.x, 'x') - x, figure.uplot.valToPos(p.y, 'y') - y);
    const near = points.filter(p => p.text).map(p => [away(p), p]).sort((a, b) => a[0] - b[0])[0];
    tip.hidden = !near || near[0] > 28;
    if (tip.hidden) return;
    tip.textContent = near[1].text;
    tip.style.left = `${Math.max(0, Math.min(x + 12, place.width - tip.offsetWidth))}px`;
    tip.style.top = `${Math.max(0, Math.min(y + 12, place.height - tip.offsetHeight))}px`;
  };
  over.addEventListener('pointermove', hover);
  over.addEventListener('pointerdown', hover);
  over.addEventListener('pointerleave', event => { if (event.pointerType === 'mouse') tip.hidden = true; });
}

const figure = title => element('figure', { className: 'plot' },
  element('figcaption', {}, title), element('div', { className: 'canvas' }), element('div', { className: 'note' }));

// Drawings to repeat when the width or the colours change.
const redraws = [];
let width = innerWidth;
addEventListener('resize', () => {
  if (innerWidth === width) return;
  width = innerWidth;
  redraws.forEach(redraw => redraw());
});
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => redraws.forEach(redraw => redraw()));

const check = (text, onchange, checked = true, ...before) => {
  const box = element('input', { type: 'checkbox', checked, onchange });
  return [element('label', {}, box, ...before, text), box];
};
const group = (name, ...children) => element('fieldset', {}, element('legend', {}, name), ...children);

// Plots of time and error, a plot per class, with filters.
function addFronts(root, fronts) {
  const places = [...new Set(fronts.map(f => f.place))];
  const classes = [...new Set(fronts.map(f => f.class))];
  const techniques = new Map();
  fronts.forEach(f => f.points.forEach(p => techniques.set(p.technique, p.ours)));
  const ids = [...techniques.keys()];
  const update = () => redraw();
  const boxes = names => new Map(names.map(name => [name, check(name, update)]));
  const [classBoxes, whose, logs] = [boxes(classes), boxes(['ours', "others'"]), [
    check('time', update, false), check('error', update, false)]];
  const swatches = new Map(ids.map(id => [id, element('span', { className: 'swatch' })]));
  const idBoxes = new Map(ids.map(id => [id, check(id, update, true, swatches.get(id))]));
  const place = element('select', { onchange: update }, ...places.map(name => element('option', { value: name }, name)));
  const figures = new Map(classes.map(name => [name, figure(name)]));
  const plots = element('div', { className: 'plots' }, ...figures.values());
  const allOrNone = element('button', { type: 'button', onclick: () => {
    const on = ![...idBoxes.values()].every(b => b[1].checked);
    idBoxes.forEach(b => { b[1].checked = on; });
    redraw();
  } }, 'all or none');
  root.append(
    element('h2', {}, 'Time and error'),
    element('div', { className: 'controls' },
      element('label', {}, 'Scene', place), group('Class', ...[...classBoxes.values()].map(b => b[0])),
      group('Techniques', ...[...whose.values()].map(b => b[0])), group('Logarithmic', ...logs.map(b => b[0]))),
    element('details', { open: innerWidth > 700 }, element('summary', {}, 'Each technique'),
      element('div', { className: 'controls' }, ...[...idBoxes.values()].map(b => b[0]), allOrNone)),
    plots);

  function redraw() {
    ids.forEach((id, i) => {
      swatches.get(id).style.borderColor = hue(i);
      swatches.get(id).style.background = techniques.get(id) ? hue(i) : 'transparent';
    });
    for (const [name, shown] of figures) {
      shown.hidden = !classBoxes.get(name)[1].checked;
      const front = fronts.find(f => f.class === name && f.place === place.value);
      if (shown.hidden || !front) {
        shown.dataset.points = 0;
        continue;
      }
      const wanted = p => idBoxes.get(p.technique)[1].checked && whose.get(p.ours ? 'ours' : "others'")[1].checked;
      const points = front.points.filter(wanted).map(p => ({ ...p, text: `${p.variant}\n${p.text}` }));
      const log = logs.map(b => b[1].checked ? 10 : 0);
      const series = [
        { color: color('--quiet'), line: true, dots: false, points: points.filter(p => p.front).map(p => ({ x: p.x, y: p.y })) },
        ...points.map(p => ({ color: hue(ids.indexOf(p.technique)), dots: true, hollow: !p.ours, points: [p] })),
      ];
      draw(shown, { axes: ['ms added to sm', 'RMSE'], series, log, band: front.noise_ms });
      const lost = points.length - shown.dataset.points;
      shown.querySelector('.note').textContent = `${shown.dataset.points} of ${front.points.length} variants; `
        + 'dots ours, rings others\'; line: front'
        + (front.noise_ms ? `; band: noise, ${short(front.noise_ms)} ms` : '')
        + (lost ? `; ${lost} without a logarithm left out` : '');
    }
  }
  redraw();
  redraws.push(redraw);
}

// A chart of lines over logarithmic axes.
function addChart(root, { title, axes, lines }) {
  const shown = figure(title);
  const update = () => redraw();
  const swatches = lines.map(() => element('span', { className: 'swatch' }));
  const boxes = lines.map((line, i) => check(line.name, update, true, swatches[i]));
  root.append(element('h2', {}, 'Chart'), shown,
    element('div', { className: 'controls' }, group('Lines', ...boxes.map(b => b[0]))));
  const redraw = () => {
    swatches.forEach((s, i) => { s.style.borderColor = s.style.background = hue(i); });
    const text = (line, [x, y]) => `${line.name}\n${axes[0]}: ${short(x)}\n${axes[1]}: ${short(y)}`;
    const series = lines.map((line, i) => ({
      color: hue(i), line: true, dots: true, points: line.points.map(p => ({ x: p[0], y: p[1], text: text(line, p) })),
    })).filter((_, i) => boxes[i][1].checked);
    draw(shown, { axes, series, log: [2, 10] });
  };
  redraw();
  redraws.push(redraw);
}

// ---- The viewer of pictures

// Decodes a grey PNG: its size and the 8-bit value of each pixel.
async function decode(png) {
  const image = new Image();
  image.src = `data:image/png;base64,${png}`;
  await image.decode();
  const canvas = element('canvas', { width: image.naturalWidth, height: image.naturalHeight });
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  const rgba = context.getImageData(0, 0, canvas.width, canvas.height).data;
  return rgba.filter((_, i) => i % 4 === 0);
}

function paint(canvas, [w, h], pixel) {
  canvas.width = w;
  canvas.height = h;
  const context = canvas.getContext('2d');
  const image = context.createImageData(w, h);
  for (let i = 0; i < w * h; i++) image.data.set(pixel(i), 4 * i);
  context.putImageData(image, 0, 0);
}

const LARGEST_ZOOM = 64;

function addViewer(root, places) {
  const update = () => show();
  const option = (place, i) => element('option', { value: i }, place.name);
  const scene = element('select', { className: 'scene', onchange: update }, ...places.map(option));
  const technique = element('select', { className: 'technique', onchange: update });
  const [errorLabel, errorBox] = check('signed error', update, false);
  const button = (text, label, onclick) => element('button', { type: 'button', ariaLabel: label, title: label, onclick }, text);
  const [truth, test] = [element('canvas', {}), element('canvas', {})];
  const divider = element('div', { className: 'divider' });
  const sides = ['left', 'right'].map(side => element('div', { className: `side ${side}` }));
  const stage = element('div', { className: 'stage', tabIndex: 0 }, truth, test, divider, ...sides);
  stage.setAttribute('role', 'img');
  const wipe = element('input', { type: 'range', min: 0, max: 1000, value: 500, oninput: () => place() });
  wipe.setAttribute('aria-label', 'Divider: the technique on the left, the truth on the right');
  const readout = element('output', {}, 'Point at a pixel to read its values. Wheel, pinch or buttons zoom.');
  const legend = element('p', { hidden: true }, 'Red: too dark. Blue: too light. Dark grey: not judged.');
  root.append(element('h2', {}, 'Pictures'), element('div', { className: 'viewer' },
    element('div', { className: 'controls' },
      element('label', {}, 'Scene', scene), element('label', {}, 'Technique', technique), errorLabel,
      button('−', 'Zoom out', () => zoomAtCenter(0.5)), button('+', 'Zoom in', () => zoomAtCenter(2)),
      button('1:1', 'One pixel of the picture for a pixel of the page', () => zoomAtCenter(1 / scale)),
      button('fit', 'Show the whole picture', () => zoomAtCenter(0))),
    stage, wipe, readout, legend));

  let size = [1, 1], values = null, scale = 1, x = 0, y = 0, latest = 0;
  const fit = () => stage.clientWidth / size[0];

  // Puts the canvases and the divider where zoom, position and slider say.
  function place() {
    const [w, h] = [stage.clientWidth, stage.clientHeight];
    scale = Math.min(Math.max(scale, fit()), Math.max(LARGEST_ZOOM, fit()));
    x = Math.min(0, Math.max(x, w - size[0] * scale));
    y = Math.min(0, Math.max(y, h - size[1] * scale));
    const at = w * wipe.value / wipe.max;
    for (const canvas of [truth, test]) canvas.style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
    const cut = Math.min(Math.max((at - x) / scale, 0), size[0]);
    test.style.clipPath = `inset(0 ${size[0] - cut}px 0 0)`;
    divider.style.left = `${at}px`;
    stage.classList.toggle('zoomed', scale > 1.001 * fit());
    stage.classList.toggle('pixels', scale > 1);
  }
  // Zooms so that the point of the picture under (px, py) stays there.
  function zoom(factor, px, py) {
    const next = Math.min(Math.max(scale * factor, fit()), Math.max(LARGEST_ZOOM, fit()));
    x = px - (px - x) * next / scale;
    y = py - (py - y) * next / scale;
    scale = next;
    place();
  }
  const zoomAtCenter = factor => zoom(factor, stage.clientWidth / 2, stage.clientHeight / 2);

  // Shows the chosen scene and technique.
  async function show() {
    const turn = ++latest;
    const chosen = places[scene.value];
    if (technique.dataset.scene !== scene.value) {
      // Keeps the technique if the scene has it too.
      const name = technique.selectedOptions[0]?.textContent;
      technique.replaceChildren(...chosen.pictures.map(option));
      technique.value = Math.max(0, chosen.pictures.findIndex(p => p.name === name));
      technique.dataset.scene = scene.value;
    }
    const picture = chosen.pictures[technique.value];
    const found = await Promise.all([picture.png, chosen.truth, chosen.judged].map(decode));
    if (turn !== latest) return;
    const [mine, expected, judged] = found;
    values = { name: picture.name, mine, expected, judged };
    const resized = size[0] !== chosen.size[0] || size[1] !== chosen.size[1];
    size = chosen.size;
    const grey = v => [v, v, v, 255];
    const error = i => [...(judged[i] ? data.error_colors[mine[i] - expected[i] + 255] : data.not_judged), 255];
    paint(truth, size, i => grey(expected[i]));
    paint(test, size, i => errorBox.checked ? error(i) : grey(mine[i]));
    stage.style.aspectRatio = `${size[0]} / ${size[1]}`;
    sides[0].textContent = errorBox.checked ? `error of ${picture.name}` : picture.name;
    legend.hidden = !errorBox.checked;
    sides[1].textContent = 'truth';
    stage.setAttribute('aria-label', `${chosen.name}: ${sides[0].textContent} on the left, the truth on the right`);
    if (resized) scale = 0;
    place();
    stage.dataset.shown = `${scene.value}/${technique.value}/${errorBox.checked}`;
  }

  function read(event) {
    if (!values) return;
    const box = stage.getBoundingClientRect();
    const px = Math.floor((event.clientX - box.left - stage.clientLeft - x) / scale);
    const py = Math.floor((event.clientY - box.top - stage.clientTop - y) / scale);
    if (px < 0 || py < 0 || px >= size[0] || py >= size[1]) return;
    const i = py * size[0] + px;
    const { name, mine, expected, judged } = values;
    const value = code => `${(code / 255).toFixed(3)} (${code})`;
    readout.value = `x ${px}, y ${py}: ${name} ${value(mine[i])}, truth ${value(expected[i])}, `
      + (judged[i] ? `error ${signed((mine[i] - expected[i]) / 255)}` : 'not judged');
  }

  // Pointers that are down: one drags, two zoom.
  const down = new Map();
  stage.addEventListener('pointerdown', event => {
    down.set(event.pointerId, [event.clientX, event.clientY]);
    if (event.isTrusted) stage.setPointerCapture(event.pointerId);
    read(event);
  });
  stage.addEventListener('pointermove', event => {
    read(event);
    const before = down.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      const apart = p => Math.hypot(p[0] - other[0], p[1] - other[1]);
      const box = stage.getBoundingClientRect();
      zoom(apart(now) / Math.max(apart(before), 1), (now[0] + other[0]) / 2 - box.left, (now[1] + other[1]) / 2 - box.top);
    }
    const share = other ? 0.5 : 1;
    x += share * (now[0] - before[0]);
    y += share * (now[1] - before[1]);
    down.set(event.pointerId, now);
    place();
  });
  for (const end of ['pointerup', 'pointercancel']) stage.addEventListener(end, event => down.delete(event.pointerId));
  stage.addEventListener('wheel', event => {
    // With the whole picture in view, the wheel scrolls the page down.
    if (event.deltaY > 0 && !stage.classList.contains('zoomed')) return;
    event.preventDefault();
    const box = stage.getBoundingClientRect();
    zoom(2 ** (-event.deltaY / 300), event.clientX - box.left, event.clientY - box.top);
    read(event);
  }, { passive: false });
  stage.addEventListener('keydown', event => {
    const step = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] }[event.key];
    if (step) {
      x += step[0];
      y += step[1];
      place();
    } else if (event.key === '+' || event.key === '-') {
      zoomAtCenter(event.key === '+' ? 2 : 0.5);
    } else {
      return;
    }
    event.preventDefault();
  });
  redraws.push(place);
  show();
}

// ---- The page

const sections = [...document.querySelectorAll('section')];
sections.forEach((section, i) => {
  const { fronts, chart, places } = data.sections[i];
  const root = section.querySelector('.interactive');
  if (fronts.length) addFronts(root, fronts);
  else if (chart) addChart(root, chart);
  if (places.length) addViewer(root, places);
});
if (sections.length > 1) {
  const nav = document.querySelector('nav');
  nav.hidden = false;
  nav.append(...sections.map((s, i) => {
    s.id = `section-${i + 1}`;
    return element('a', { href: `#${s.id}` }, s.querySelector('h1').textContent);
  }));
}
